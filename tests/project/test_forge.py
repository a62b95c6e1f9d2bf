"""What a public forge runs and asks for: workflows, forms, and who is to be cited."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from kit.places import ROOT

FORGE = ROOT / ".github"
WORKFLOWS = sorted((FORGE / "workflows").glob("*.yml"))
FORMS = sorted(file for file in (FORGE / "ISSUE_TEMPLATE").glob("*.yml") if file.stem != "config")


def read(file: Path) -> Any:
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load(file.read_text(encoding="utf-8"))


def steps(workflow: dict[str, Any]) -> list[dict[str, Any]]:
    return [step for job in workflow["jobs"].values() for step in job["steps"]]


def test_linters_find_nothing() -> None:
    """``actionlint`` and ``zizmor``, where they are on the path."""
    linters = {"actionlint": [], "zizmor": ["--offline", "--config", FORGE / "zizmor.yml"]}
    there = {name: options for name, options in linters.items() if shutil.which(name)}
    if not there:
        pytest.skip("needs actionlint or zizmor")
    for name, options in there.items():
        done = subprocess.run(
            [name, *options, *WORKFLOWS], capture_output=True, text=True, cwd=ROOT, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("file", WORKFLOWS, ids=lambda file: file.stem)
def test_what_a_workflow_runs_is_there(file: Path) -> None:
    """Scripts, targets of make, folders of tests; and it may write nothing unless a job says so."""
    workflow = read(file)
    assert workflow["permissions"] == {"contents": "read"}
    said = "\n".join(step.get("run", "") for step in steps(workflow))
    targets = re.findall(r"(?m)^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"))
    assert set(re.findall(r"(?m)^make (\w+)", said)) <= set(targets)
    named = re.findall(r"(?<![\w/.])((?:scripts|tests|\.ci)/[\w./]+)", said)
    assert not [name for name in named if not (ROOT / name).exists()]


def test_tests_run_by_the_script_that_runs_them_anywhere() -> None:
    workflow = read(FORGE / "workflows" / "tests.yml")
    assert steps(workflow)[-1]["run"] == ".ci/run"
    assert {"push", "pull_request"} <= workflow[True].keys()  # YAML takes "on" for a truth value


def test_a_tag_only_drafts_a_release() -> None:
    workflow = read(FORGE / "workflows" / "release.yml")
    (command,) = [step["run"] for step in steps(workflow) if "gh release" in step.get("run", "")]
    assert "--draft" in command
    writing = [name for name, job in workflow["jobs"].items() if "permissions" in job]
    assert writing == ["draft"]


@pytest.mark.parametrize("file", FORMS, ids=lambda file: file.stem)
def test_forms_ask_for_the_report_by_the_name_that_it_has(file: Path) -> None:
    form = read(file)
    assert form["body"][0]["id"] == "report" and form["body"][0]["validations"]["required"]
    source = (ROOT / "operators" / "copy_report.py").read_text(encoding="utf-8")
    label = re.search(r'bl_label = "(.*)"', source)
    assert label and label[1] in form["body"][0]["attributes"]["description"]


def test_who_is_to_be_cited() -> None:
    cited = read(ROOT / "CITATION.cff")
    assert cited["cff-version"] == "1.2.0" and cited["license"] == "GPL-3.0-or-later"
    assert re.sub(r"\s+", " ", cited["references"][0]["title"]) in re.sub(
        r"\s+", " ", (ROOT / "README.md").read_text(encoding="utf-8").replace("*", "")
    )
    if shutil.which("cffconvert"):
        subprocess.run(["cffconvert", "--validate"], cwd=ROOT, check=True, capture_output=True)
