"""The scripts of ``examples`` that need Blender do what their docstrings say."""

import runpy
import shutil
from pathlib import Path
from types import ModuleType

import bpy
import pytest

from kit.places import ROOT
from kit.stage import bone_heads, keys_of

EXAMPLES = ROOT / "examples"


@pytest.fixture
def sitting(blender: ModuleType, tmp_path: Path) -> Path:
    """The file that the first script writes."""
    file = tmp_path / "sitting.blend"
    runpy.run_path(str(EXAMPLES / "sit_on_a_chair.py"))["main"](file)
    return file


def test_a_character_sits_on_a_chair(sitting: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(sitting))
    ann = bpy.data.objects["Ann"]
    assert len(keys_of(ann)) > 90
    # The last second of three on the chair, whose seat is 0.46 m high.
    (pelvis,) = bone_heads(ann, bpy.context.scene.frame_end - 24, names=["pelvis"])
    assert 0.5 < pelvis[2] < 0.64 and abs(pelvis[0]) < 0.2 and abs(pelvis[1]) < 0.25


def test_a_folder_is_baked_and_gone_on_with(sitting: Path, capsys: pytest.CaptureFixture) -> None:
    shots, baked = sitting.parent / "shots", sitting.parent / "baked"
    shots.mkdir()
    shutil.copy(sitting, shots / "good.blend")
    (shots / "bad.blend").write_bytes(b"not a scene")
    main = runpy.run_path(str(EXAMPLES / "bake_a_folder.py"))["main"]
    capsys.readouterr()
    assert main(shots, baked) == 1
    said = capsys.readouterr().out
    assert "good.blend: 3 takes of" in said and "bad.blend: dafnet: " in said
    before = (baked / "good.blend").read_bytes()
    assert main(shots, baked) == 1 and "good" not in capsys.readouterr().out
    assert (baked / "good.blend").read_bytes() == before
