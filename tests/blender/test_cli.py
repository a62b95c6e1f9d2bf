"""The command reads scenes and bakes them as the operator does."""

import json
import os
import subprocess
import sys
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon import cli, demo
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.properties import CharacterSettings
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import CLEAN_UP, Settings
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.demo_room import build_room
from bl_ext.user_default.dafnet.dafnet_addon.core.cleanup import CleanUp

from kit.places import ROOT
from kit.stage import Stage, keys_of


@pytest.fixture
def scene_file(blender: ModuleType, tmp_path: Path) -> Path:
    """A character whose root walks a metre in 20 frames, beside a box to sit on, saved to a
    file.
    """
    stage = Stage(frames=(1, 20))
    stage.walk((1, 0.0), (20, 1.0))
    stage.box("Box", (0.3, 0.8, 0.0), (0.7, 1.2, 0.45))
    file = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    return file


def played() -> dict[tuple[str, int], np.ndarray]:
    """The keys of what the only armature plays."""
    return keys_of(next(ob for ob in bpy.context.scene.objects if ob.type == "ARMATURE"))


def test_bake_saves_the_keys_that_the_operator_makes(
    blender: ModuleType,
    scene_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    by_operator = played()

    out = tmp_path / "made" / "out.blend"
    capsys.readouterr()
    assert cli.main(["bake", str(scene_file), "-o", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert {"reading", "conditions", "sampling", "baking"} <= set(report["seconds"])
    assert report["takes"][0]["frames"] == 20

    bpy.ops.wm.open_mainfile(filepath=str(out))
    by_command = played()
    assert by_command.keys() == by_operator.keys() and len(by_command) > 90
    for key, values in by_operator.items():
        np.testing.assert_array_equal(by_command[key], values, err_msg=str(key))


def test_a_device_runs_the_network_on_torch_or_says_why_not(
    blender: ModuleType,
    scene_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    played_by = []
    for device in ([], ["--device", "cpu"]) if find_spec("torch") else ():
        out = tmp_path / f"{len(played_by)}.blend"
        assert cli.main(["bake", str(scene_file), "-o", str(out), *device]) == 0
        bpy.ops.wm.open_mainfile(filepath=str(out))
        played_by.append(played())
    for key, values in played_by[0].items() if played_by else ():
        np.testing.assert_allclose(played_by[1][key], values, atol=1e-3, err_msg=str(key))

    capsys.readouterr()
    out = tmp_path / "none.blend"
    assert cli.main(["bake", str(scene_file), "-o", str(out), "--device", "abacus"]) == 1
    said = capsys.readouterr().err
    assert said.count("dafnet: ") == 1 and ("torch" in said or "'abacus' cannot be used" in said)
    assert not out.exists()


def test_several_takes_are_kept_and_the_first_one_plays(
    blender: ModuleType,
    scene_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "takes.blend"
    capsys.readouterr()
    arguments = [
        "bake",
        str(scene_file),
        "-o",
        str(out),
        "--takes",
        "3",
        "--seed",
        "5",
        "--frames",
        "3:9",
        "--json",
    ]
    assert cli.main(arguments) == 0
    takes = json.loads(capsys.readouterr().out)["takes"]
    made = [(take["seed"], take["temperature"], take["frames"]) for take in takes]
    assert made == [(5, 0.0, 7), (6, 1.0, 7), (7, 1.0, 7)]
    blender.ops.wm.open_mainfile(filepath=str(out))
    armature = next(ob for ob in blender.context.scene.objects if ob.type == "ARMATURE")
    assert armature.animation_data.action.name == takes[0]["action"]
    assert {take["action"] for take in takes} <= {action.name for action in blender.data.actions}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.blend", "-o", "out.blend"], "no file"),
        (["{scene}", "-o", "out.txt"], ".blend"),
        (
            ["{scene}", "-o", "{out}", "--takes", "100000"],
            "number of takes is 100000; give a whole number from 1 to 64",
        ),
        (
            ["{scene}", "-o", "{out}", "--seed", "2147483647", "--takes", "2"],
            "last take's seed is 2147483648",
        ),
        (
            ["{scene}", "-o", "{out}", "--frames", "1:99999999999"],
            "frame of the range is 99999999999",
        ),
        (
            ["{scene}", "-o", "{out}", "--frames", "99999999999:99999999999"],
            "frame of the range is 99999999999",
        ),
        (
            ["{scene}", "-o", "{out}", "--frames", "1:1000000"],
            "length of the frame range is 1000000",
        ),
        (["{scene}", "-o", "{out}", "--temperature", "11"], "temperature is 11"),
        (["{scene}", "-o", "{scene}"], "is the scene's own file"),
        (["{scene}", "-o", "{out}", "--character", "Nobody"], "no armature 'Nobody'"),
        (["{scene}", "-o", "{out}", "--root", "Nothing"], "root 'Nothing'"),
        (["{scene}", "-o", "{out}", "--frames", "9:3"], "before its start"),
        (["{scene}", "-o", "{out}", "--weights", "none.safetensors"], "weights file"),
    ],
)
def test_bake_says_what_is_wrong(
    scene_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    said: str,
) -> None:
    out = tmp_path / "out.blend"
    capsys.readouterr()
    filled = [argument.format(scene=scene_file, out=out) for argument in arguments]
    assert cli.main(["bake", *filled]) == 1
    assert said in capsys.readouterr().err
    assert not out.exists()


def test_the_demo_room_has_its_seats_at_their_heights(blender: ModuleType) -> None:
    room = build_room(blender.context)
    blender.context.view_layer.update()
    depsgraph = blender.context.evaluated_depsgraph_get()
    furniture = {ob.name: ob for ob in blender.data.collections["Furniture"].objects}
    assert set(furniture) == set(demo.PLACES)
    for seat in demo.SEATS:
        hit, where, _, _, ob, _ = room.scene.ray_cast(
            depsgraph, (*seat.center[:2], 0.9), (0, 0, -1)
        )
        assert hit and ob.name == seat.name
        assert where.z == pytest.approx(seat.center[2], abs=0.002)

    root = room.armature.dafnet.root
    modes = set()
    for rest in room.route.rests:
        room.scene.frame_set(1 + (rest.start + rest.stop - 1) // 2)
        np.testing.assert_allclose(
            root.matrix_world.translation[:2], rest.place.position, atol=1e-4
        )
        modes.add((rest.place.name, room.armature.dafnet.mode))
    assert modes == {("", "FREE"), ("Chair", "FREE"), ("Whiteboard", "EE"), ("Stool", "FREE")}


def test_the_demo_runs_in_a_process_of_its_own(tmp_path: Path) -> None:
    bpy = pytest.importorskip("bpy")
    if bpy.app.binary_path:
        pytest.skip("runs the Python module in a process of its own")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "dafnet_addon",
            "demo",
            "-o",
            str(tmp_path),
            "--no-preview",
            "--json",
        ],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")},
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (tmp_path / "demo.blend").is_file() and report == json.loads(
        (tmp_path / "report.json").read_text(encoding="utf-8")
    )
    heights = {seat["name"]: seat["seat_height"] for seat in report["seats"]}
    assert len(set(heights.values())) == 2 and all(
        abs(seat["error"]) <= 0.05 for seat in report["seats"]
    )
    assert (
        0.88 < report["standing_pelvis_height"] < 1.0
        and report["metrics"]["ground_truth"]["clips"] > 0
    )


def test_every_clean_up_can_be_set_everywhere(
    blender: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    """By a property, by a field of the settings, by an option of the command, in every preset."""
    assert cli.main(["bake", "--help"]) == 0
    said = capsys.readouterr().out
    presets = list((ROOT / "dafnet_addon/blender/presets/dafnet").glob("*.py"))
    assert {*CLEAN_UP.values()} == {strength.name for strength in fields(CleanUp)}
    for name in CLEAN_UP:
        assert name in {setting.name for setting in fields(Settings)}
        assert name in CharacterSettings.__annotations__
        assert f"--{name.replace('_', '-')} SHARE" in said
        assert presets and all(f"own.{name} = " in p.read_text(encoding="utf-8") for p in presets)
