"""The scripts of ``examples`` do what their docstrings say."""

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np

from dafnet_addon.director.task_lists import tasks_from
from dafnet_addon.director.tasks import VERBS, options
from kit.places import ROOT


def test_a_take_without_blender(tmp_path: Path) -> None:
    script, file = ROOT / "examples" / "without_blender.py", tmp_path / "take.npz"
    done = subprocess.run(
        [sys.executable, str(script), str(file)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    with np.load(file) as take:
        joints = take["joints"]
    assert joints.shape[1:] == (22, 3) and f"{len(joints)} frames" in done.stdout
    pelvis = joints[:, 0, 2]
    assert 0.5 < pelvis.min() < 0.68 and pelvis[0] > 0.8 and pelvis[-1] > 0.8, "sits, and gets up"


def test_tasks_without_blender(tmp_path: Path) -> None:
    script, file = ROOT / "examples" / "tasks_without_blender.py", tmp_path / "take.npz"
    done = subprocess.run(
        [sys.executable, str(script), str(file)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    words = [line.split("s  ")[1] for line in done.stdout.splitlines()]
    assert words[:3] == ["work at Desk", "look at Door", "stand up"] and len(words) == 6
    with np.load(file) as take:
        pelvis = take["joints"][:, 0, 2]
    assert 0.45 < pelvis.min() < 0.68 and pelvis[-1] > 0.8, "sits, and gets up"


def test_the_page_on_tasks_says_what_is_true() -> None:
    """Its Python runs, and its words are the vocabulary's."""
    page = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    said: dict[str, object] = {}
    exec(code, said)
    assert len(said["take"].joints) == len(said["plan"])
    assert tasks_from(tomllib.loads(page.split("```toml\n")[1].split("```")[0])["tasks"])
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows] == list(VERBS)
    for row, kind in zip(rows, VERBS.values(), strict=True):
        assert row.split("`")[3] == kind.__name__
        for option in options(kind)[1:]:
            assert f"`{option.name}`" in row, f"{kind.__name__}: {option.name}"
