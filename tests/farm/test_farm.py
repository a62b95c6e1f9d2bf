"""The farm's files: the OpenJD template is checked and run by ``openjd``; the Flamenco job type is
run under Node against a small stand-in, and the commands that it makes are run.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dafnet_addon.core.manifest import MANIFEST
from kit.batches import HEAD, contents, shot
from kit.places import ROOT
from kit.populating import PROGRAM

TEMPLATE = ROOT / "farm" / "openjd" / "dafnet.yaml"
OPENJD = Path(sys.executable).with_name("openjd")

needs_openjd = pytest.mark.skipif(
    not OPENJD.exists(), reason="needs openjd (pip install openjd-cli)"
)
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
posix = pytest.mark.skipif(os.name == "nt", reason="the command is a shell script here")


@pytest.fixture
def dafnet(tmp_path: Path) -> Path:
    """The command ``dafnet``, whose shots are made by the stand-in of ``populate``."""
    script, command = tmp_path / "dafnet.py", tmp_path / "dafnet"
    script.write_text(
        "from dafnet_addon.batch import making\n"
        "from dafnet_addon.cli import run\n"
        f"making.program = lambda: {PROGRAM!r}\n"
        "run()\n",
        encoding="utf-8",
    )
    command.write_text(
        f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" "{script}" "$@"\n',
        encoding="utf-8",
    )
    command.chmod(0o755)
    return command


def jobs(tmp_path: Path) -> Path:
    file = tmp_path / "jobs.toml"
    file.write_text(HEAD + shot("a", count=2) + shot("bad", "broken"), encoding="utf-8")
    return file


def ran(*command: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        list(map(str, command)), capture_output=True, text=True, encoding="utf-8", check=False
    )


def of_report(output: Path) -> dict[str, str]:
    told = json.loads((output / "report.json").read_text(encoding="utf-8"))
    return {row["name"]: row["state"] for row in told["shots"]}


@needs_openjd
def test_the_template_is_one() -> None:
    done = ran(OPENJD, "check", TEMPLATE)
    assert done.returncode == 0, done.stdout + done.stderr


@needs_openjd
@posix
@pytest.mark.slow
def test_the_template_makes_shots_and_a_report(tmp_path: Path, dafnet: Path) -> None:
    output = tmp_path / "out"
    given = [f"List={jobs(tmp_path)}", f"Output={output}", "Shots=2", f"Dafnet={dafnet}"]
    options = [each for value in given for each in ("-p", value)]
    done = ran(OPENJD, "run", TEMPLATE, "--step", "Report", "--run-dependencies", *options)
    assert done.returncode == 0, done.stdout + done.stderr
    assert contents(output).keys() == {"a_001", "a_002"}
    assert of_report(output) == {"a_001": "unchanged", "a_002": "unchanged", "bad": "missing"}
    failed = ran(OPENJD, "run", TEMPLATE, "--step", "Shots", *options, "-tp", "Shot=3")
    assert failed.returncode != 0
    options[options.index("Shots=2")] = "Shots=3"
    failed = ran(OPENJD, "run", TEMPLATE, "--step", "Shots", *options, "-tp", "Shot=3")
    assert failed.returncode != 0 and "The room is broken; mend it." in failed.stdout


def compiled(**settings: object) -> dict[str, Any]:
    """The job type, and the tasks that it makes."""
    done = ran(
        "node", ROOT / "tests/farm/flamenco.js", ROOT / "farm/flamenco/dafnet.js",
        json.dumps(settings),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@needs_node
def test_the_job_type_makes_tasks_and_then_a_report() -> None:
    found = compiled(list="/l.toml", output="/o", shots=10, chunk_size=4)
    *shots, report = found["tasks"]
    assert [each["name"] for each in shots] == ["shots-1-4", "shots-5-8", "shots-9-10"]
    assert report["dependsOn"] == [each["name"] for each in shots]
    only = [each["commands"][0]["parameters"]["args"][-1] for each in shots]
    assert only == ["1:4", "5:8", "9:10"]
    assert {each["type"] for each in found["tasks"]} == {"misc"}
    known = {"key", "type", "subtype", "required", "default", "visible", "description"}
    for setting in found["type"]["settings"]:
        assert setting.keys() <= known and setting["type"] in ("string", "int32")
    page = (ROOT / "farm/flamenco/README.md").read_text(encoding="utf-8")
    given = json.loads(page.split("-d '")[1].split("'}")[0].split("'\n")[0])
    assert given["type"] == "dafnet", "the name of the file"
    assert given["settings"].keys() == {each["key"] for each in found["type"]["settings"]}


@needs_node
@posix
@pytest.mark.slow
def test_what_the_job_type_makes_can_be_run(tmp_path: Path, dafnet: Path) -> None:
    output = tmp_path / "out"
    found = compiled(
        list=str(jobs(tmp_path)), output=str(output), shots=3, chunk_size=2, dafnet=str(dafnet)
    )
    codes = []
    for task in found["tasks"]:
        (command,) = task["commands"]
        assert command["name"] == "exec"
        codes.append(ran(command["parameters"]["exe"], *command["parameters"]["args"]).returncode)
    assert codes == [0, 1, 0]
    assert of_report(output) == {"a_001": "unchanged", "a_002": "unchanged", "bad": "failed"}
    assert (output / "a_001" / MANIFEST).exists() and (output / "report.html").exists()
