"""Pages: their links lead somewhere, their code runs, and the site is built of them without
anything from elsewhere.
"""

import ast
import importlib.util
import os
import re
import runpy
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest

from kit.places import ROOT

SITE = runpy.run_path(str(ROOT / "scripts" / "site_pages.py"))
PAGES = sorted(
    file
    for pattern in ("*.md", "docs/**/*.md", "weights_stub/*.md", "farm/**/*.md")
    for file in ROOT.glob(pattern)
)
"""All pages of the repository."""


def names(pages: list[Path]) -> list[str]:
    return [page.relative_to(ROOT).as_posix() for page in pages]


def anchors(page: Path) -> set[str]:
    """What a page's headings are called in a link."""
    found = set()
    for line in page.read_text(encoding="utf-8").splitlines():
        if heading := re.match(r"#+ (.*)", line):
            plain = unicodedata.normalize("NFKC", re.sub(r"[`*]", "", heading[1])).lower()
            found.add(re.sub(r"[^\w\- ]", "", plain).strip().replace(" ", "-"))
    return found


@pytest.mark.parametrize("page", PAGES, ids=names(PAGES))
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"(?s)```.*?```", "", page.read_text(encoding="utf-8"))
    for target in re.findall(r"\]\(([^()\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = Path(os.path.normpath(page.parent / path)) if path else page
        if file.parent == ROOT / "docs" / "reference":
            assert file.stem in SITE["REFERENCE"]
            continue
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


CODE = [
    (page, code)
    for page in PAGES
    for code in re.findall(r"(?s)```python\n(.*?)```", page.read_text(encoding="utf-8"))
]


@pytest.mark.slow
@pytest.mark.parametrize(("page", "code"), CODE, ids=names([page for page, _ in CODE]))
def test_code_on_pages_runs(page: Path, code: str, tmp_path: Path) -> None:
    """Where it needs Blender, it is only compiled."""
    if "import bpy" in code or "bl_ext." in code:
        compile(code, str(page), "exec")
        return
    script = tmp_path / "block.py"
    # Blender's module of 4.2 may crash while Python ends (see cli.run).
    leave = "import os, sys\nsys.stdout.flush(), sys.stderr.flush(), os._exit(0)\n"
    script.write_text(f"{code}\n{leave}", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr


def test_the_command_is_called_on_pages_as_it_can_be() -> None:
    """Every ``dafnet`` word and option in the pages' shell blocks is one that there is."""
    help_page = SITE["REFERENCE"]["command"]()
    sections = dict(re.findall(r"(?s)## (\S+)\n\n```text\n(.*?)```", help_page))
    for page in PAGES:
        for block in re.findall(r"(?s)```sh\n(.*?)```", page.read_text(encoding="utf-8")):
            for line in block.replace("\\\n", " ").splitlines():
                called = re.search(r"(?:-m dafnet_addon|--command dafnet) (\w+)(.*)", line)
                if not called or called[1] == "bench":  # whose measurements have their own options
                    continue
                help_text = sections[called[1]]
                options = re.findall(r"(?<!\S)(--?[a-z][\w-]*)", called[2].split("#")[0])
                assert not [each for each in options if each not in help_text], line


def test_what_the_site_lacks_becomes_a_name() -> None:
    for_the_site, docs = SITE["for_the_site"], ROOT / "docs"
    there = {"guide.md", "weights.md", "figures/README.md"}
    text = (
        "[a](guide.md#takes) [`b`](../examples/tasks.toml) [c](../weights_stub/README.md) [d](#e)"
    )
    led = for_the_site(text, docs / "tasks.md", "tasks.md", there)
    assert led == "[a](guide.md#takes) `b` [c](weights.md) [d](#e)"
    up = for_the_site(
        "[a](../guide.md)", docs / "figures" / "README.md", "figures/README.md", there
    )
    assert up == "[a](../guide.md)"


def test_operators_are_all_there_and_say_what_they_do() -> None:
    page = SITE["REFERENCE"]["operators"]()
    said = set(re.findall(r"`bpy\.ops\.(dafnet\.\w+)\(\)`\n\n\w.{15,}\.", page))
    labels = [
        ast.literal_eval(name)
        for file in (ROOT / "operators").glob("*.py")
        for name in re.findall(r"bl_idname = (\"dafnet\..*\")", file.read_text(encoding="utf-8"))
    ]
    assert said == set(labels) and len(labels) > 15


def test_the_python_page_has_what_the_package_offers() -> None:
    import dafnet_addon

    page = SITE["REFERENCE"]["python"]()
    headings = set(re.findall(r"(?m)^### (\w+)$", page))
    assert set(dafnet_addon.__all__) <= headings
    for block in re.findall(r"(?s)```python\n(.*?)```", page):
        lines = [f"{line}: ..." if "def " in line else line for line in block.splitlines()]
        ast.parse(
            "\n".join(lines).replace("@property def", "def").replace("@classmethod def", "def")
        )


@pytest.mark.slow
def test_the_site_is_built_of_what_is_here(tmp_path: Path) -> None:
    """Strictly, without a dead link, and no page fetches anything from elsewhere."""
    if importlib.util.find_spec("material") is None:
        pytest.skip("needs mkdocs-material (make docs)")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", tmp_path / "site"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 12
    for page in pages:
        loads = re.findall(
            r"<(?:link|script|img|source|iframe)[^>]*(?:href|src)=\"?((?:https?:)?//[^\s\">]*)",
            page.read_text(encoding="utf-8"),
        )
        assert not loads, page
