"""``dafnet bake`` can do what the panel can: by a file of tasks, furniture found, onto a rig; and
it delivers what is wished for, whole or not at all.
"""

import json
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon import cli

from kit import humanoids
from kit.delivered import Shot
from kit.stage import Stage, keys_of

TASKS = """
tasks = [{ sit_on = "Stool", seconds = 1 }, { stand_up = 0.5 }]
"""


def saved(folder: Path) -> Path:
    file = folder / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    return file


def bake(capsys: pytest.CaptureFixture[str], *words: Any, status: int = 0) -> Any:
    capsys.readouterr()
    assert cli.main(["bake", *map(str, words), "--json"]) == status
    said = capsys.readouterr()
    return said.err if status else json.loads(said.out)


def test_tasks_and_furniture(
    blender: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage = Stage(furnished=False)
    stage.seat("Stool", stage.scene.collection, location=(0.6, 1.4, 0.0))
    file, tasks, out = saved(tmp_path), tmp_path / "tasks.toml", tmp_path / "out.blend"
    tasks.write_text(TASKS, encoding="utf-8")
    report = bake(capsys, file, "-o", out, "--tasks", tasks, "--find")
    sits, gets_up = report["tasks"]
    assert sits["task"] == "sit on Stool" and sits["seat"] == "Stool" and sits["start"] <= 2
    assert report["takes"][0]["frames"] == gets_up["stop"] - 1 and report["delivered"] is None

    bpy.ops.wm.open_mainfile(filepath=str(out))
    ann = bpy.data.objects["Ann"]
    assert [each.name for each in ann.dafnet.furniture.objects] == ["Stool"]
    assert keys_of(ann.dafnet.root) and bpy.context.scene.frame_end == gets_up["stop"] - 1
    bpy.context.scene.frame_set(sits["there"] + 12)
    pelvis = ann.matrix_world @ ann.pose.bones["pelvis"].head
    assert np.hypot(pelvis.x - 0.6, pelvis.y - 1.4) < 0.25 and pelvis.z < 0.7

    (tmp_path / "wrong.toml").write_text('tasks = [{ sit_on = "Stol" }]', encoding="utf-8")
    said = bake(capsys, file, "-o", out, "--tasks", tmp_path / "wrong.toml", status=1)
    assert "'Ann': Task 1, 'sit on Stol': 'Stol' is not the name of any furniture there" in said
    said = bake(capsys, file, "-o", out, "--already-there", status=1)
    assert "--already-there is about tasks" in said


def test_all_is_delivered_beside_the_scene(
    blender: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Shot()
    humanoids.mixamo(bpy).name = "Mix"
    file, out = saved(tmp_path), tmp_path / "made" / "out.blend"
    words = ("--truth", "--render", "masks", "--every", 6, "--export", "FBX", "--takes", 2)
    report = bake(capsys, file, "-o", out, *words, "--rig", "Mix")
    folder = tmp_path / "made" / "out"
    assert report["delivered"] == str(folder)
    files = json.loads((folder / "delivered.json").read_text(encoding="utf-8"))["files"]
    assert files == sorted(
        each.relative_to(folder).as_posix()
        for each in folder.rglob("*")
        if each.is_file() and each.name != "delivered.json"
    )
    for take in ("take_1", "take_2"):
        assert {f"export/{take}/Mix.fbx", f"truth/{take}/Mix.npz"} <= {*files}
        assert f"frames/{take}/Side/0011_mask.png" in files
    with np.load(folder / "truth" / "take_1" / "Mix.npz") as known:
        assert known["frames"].tolist() == list(range(5, 18))
        assert 0.7 < known["joints"][0, 0, 2] < 1.2 and (known["joints_seen"][0] == 2).any()

    bpy.ops.wm.open_mainfile(filepath=str(out))
    assert len([a for a in bpy.data.actions if " on Mix" in a.name]) == 2
    assert keys_of(bpy.data.objects["Mix"]) and len(bpy.data.scenes) == 1

    # Once more takes the place of the earlier one; what is not ours is never touched.
    bake(capsys, file, "-o", out, "--truth")
    assert not (folder / "export").exists() and (folder / "truth").is_dir()
    (folder / "delivered.json").unlink()
    said = bake(capsys, file, "-o", out, "--truth", status=1)
    assert "holds something else than an earlier run's output" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--export", "obj"), "'export' does not know 'obj'"),
        (("--render", "mask"), "did you mean 'masks'?"),
        (("--rig", "Mixx"), "has no armature 'Mixx'; give --rig one that it has: 'Ann'."),
    ],
)
def test_what_cannot_be_done_is_said_and_nothing_is_written(
    blender: ModuleType,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    said: str,
) -> None:
    Stage()
    file = saved(tmp_path)
    assert said in bake(capsys, file, "-o", tmp_path / "out.blend", *words, status=1)
    assert [each.name for each in tmp_path.iterdir()] == ["scene.blend"]
