"""Whose the tab is: a character's, until another one is chosen."""

from types import ModuleType
from typing import Any

import bpy
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import (
    character_of,
    choose,
    selected_characters,
)
from bl_ext.user_default.dafnet.panels import CLASSES

from kit.stage import Stage


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    """Ann and Bob, Bob added last, and a chair."""
    made = Stage(fps=30, furnished=False)
    made.seat("Chair", location=(0.0, 3.0, 0.0))
    bpy.ops.dafnet.add_character(name="Bob")
    return made


def active(stage: Stage) -> Any:
    return character_of(bpy.context)


def test_it_stays_whose_it_was_while_furniture_is_selected(stage: Stage) -> None:
    chair, bob = bpy.data.objects["Chair"], bpy.data.objects["Bob"]
    stage.select(chair)
    assert active(stage) == bob, "who was added last"
    stage.select(chair, stage.ann)
    assert active(stage) == stage.ann, "who is selected beside it"
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    stage.select(chair)
    assert active(stage) == stage.ann and bpy.ops.dafnet.generate.poll()
    stage.select()
    assert active(stage) == stage.ann, "with nothing active"
    assert selected_characters(bpy.context) == [stage.ann]


@pytest.mark.parametrize("part", ["body", "root", "head", "rig"])
def test_any_part_of_a_character_chooses_it(stage: Stage, part: str) -> None:
    if part == "rig":
        chosen = stage.put(bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig")))
        chosen.dafnet_rig.character = stage.ann
    else:
        chosen = getattr(stage, part)
    stage.select(chosen)
    assert active(stage) == stage.ann


def test_it_outlasts_names_files_and_goes_with_the_character(stage: Stage, tmp_path: Any) -> None:
    choose(stage.scene, stage.ann)
    stage.ann.name = "Anna"
    stage.select(bpy.data.objects["Chair"])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    assert character_of(bpy.context).name == "Anna"
    bpy.data.objects.remove(bpy.data.objects["Anna"])
    assert character_of(bpy.context).name == "Bob", "the only one that is left"
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    assert character_of(bpy.context) is None


def test_set_up_stands_above_what_generates(stage: Stage) -> None:
    children = [cls.bl_idname for cls in CLASSES if getattr(cls, "bl_parent_id", "")]
    assert children.index("DAFNET_PT_setup") < children.index("DAFNET_PT_shot")
