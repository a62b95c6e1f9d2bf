"""The scripts of ``examples`` do what their docstrings say."""

import subprocess
import sys
from pathlib import Path

import numpy as np

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
