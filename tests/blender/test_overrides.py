"""Characters and rigs of a library: overrides get takes, walks and settings of their own, which the
file keeps.
"""

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.walk_rows import asked_in
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig.properties import presets
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS
from bpy.types import Object

from kit import humanoids
from kit.places import EXTENSION
from kit.stage import Stage, bone_heads


def overridden(name: str, library: Path) -> Any:
    """The armature of a collection of the scene, as an editable override in an empty scene that
    links the collection from the file ``library``.
    """
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.collections = [name]
    scene, layer = bpy.context.scene, bpy.context.view_layer
    wanted.collections[0].override_hierarchy_create(scene, layer, do_fully_editable=True)
    armature = the_armature()
    assert armature.override_library
    return armature


def opened_again(file: Path) -> Any:
    """The scene's armature, once the scene was saved and opened."""
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.wm.open_mainfile(filepath=str(file))
    return the_armature()


def the_armature() -> Any:
    (armature,) = (each for each in bpy.context.scene.objects if each.type == "ARMATURE")
    return armature


def kept_of(owner: Any) -> Iterator[tuple[Any, Any]]:
    """The properties that we have given to a kind of data, and those of their groups, rows within
    rows included; each with its owner.
    """
    for each in owner.bl_rna.properties:
        group = type(getattr(each, "fixed_type", None))
        ours = group.__module__.startswith(EXTENSION)
        named = each.identifier not in ("rna_type", "name")
        if named and (ours or owner.__module__.startswith(EXTENSION)):
            yield owner, each
        if ours:
            yield from kept_of(group)


def test_whatever_is_set_on_an_object_is_kept_by_an_override(blender: ModuleType) -> None:
    found = {f"{owner.__name__}.{each.identifier}": each for owner, each in kept_of(Object)}
    for name in ("Object.dafnet", "Object.dafnet_rig", "WalkPoint.point", "RigRow.bone"):
        assert name in found, name
    assert [name for name, each in found.items() if not each.is_overridable] == []

    rows = {
        f"{owner.__name__}.{each.identifier}": owner.__annotations__[each.identifier].keywords
        for owner, each in kept_of(Object)
        if each.type == "COLLECTION"
    }
    assert {"CharacterSettings.walks", "WalkRow.points", "RigSettings.rows"} <= rows.keys()
    assert [name for name, said in rows.items() if "USE_INSERTION" not in said["override"]] == []


@pytest.mark.parametrize("known", [False, True])
def test_the_map_of_an_overridden_rig_is_kept_by_the_file(
    blender: ModuleType, tmp_path: Path, known: bool
) -> None:
    """``known``: whether the rig of the library has a map already."""
    stage = Stage(furnished=False)
    rig = humanoids.BUILDERS["mixamo"](bpy)
    stage.collection("Rigs", stage.scene.collection).objects.link(rig)
    if known:
        stage.select(rig)
        assert bpy.ops.dafnet.detect_rig() == {"FINISHED"}
        rig.dafnet_rig.rows["right_wrist"].bone = ""
    rig = overridden("Rigs", tmp_path / "library.blend")

    bpy.context.view_layer.objects.active = rig
    assert bpy.ops.dafnet.detect_rig() == {"FINISHED"}
    preset = next(key for key, name, _ in presets(None, bpy.context) if name == "Mixamo")
    assert bpy.ops.dafnet.load_rig_map(preset=preset) == {"FINISHED"}
    own = rig.dafnet_rig
    own.rows["left_wrist"].bone = "mixamorig:LeftForeArm"
    own.limbs, own.root_motion = "IK", "HIPS"

    opened_again(tmp_path / "shot.blend")
    own = opened_again(tmp_path / "later.blend").dafnet_rig
    assert [row.name for row in own.rows] == list(JOINTS)
    bones = {row.name: row.bone for row in own.rows}
    assert bones["left_wrist"] == "mixamorig:LeftForeArm"
    assert bones["right_wrist"] == "mixamorig:RightHand"
    assert (own.convention, own.limbs, own.root_motion) == ("Mixamo", "IK", "HIPS")


def test_a_library_override_gets_takes_of_its_own_that_the_file_keeps(
    blender: ModuleType, tmp_path: Path
) -> None:
    stage = Stage(frames=(1, 12), furnished=False)
    stage.walk((1, 0.0), (12, 0.4))
    ann = overridden("Ann", tmp_path / "library.blend")
    scene = bpy.context.scene
    scene.frame_end = 12
    assert ann.dafnet.root.override_library
    result = job.run(bpy.context, settings_of(ann, scene))

    ann = opened_again(tmp_path / "shot.blend")
    action = ann.animation_data.action
    assert action.library is None and [row.action for row in ann.dafnet.takes] == [action]
    heads = bone_heads(ann, 12)
    np.testing.assert_allclose(heads, result.take.joints[-1], atol=1e-4)


def test_takes_of_the_library_stay_and_those_of_the_file_come_and_go(
    blender: ModuleType, tmp_path: Path
) -> None:
    stage = Stage(frames=(1, 6), furnished=False)
    stage.walk((1, 0.0), (6, 0.2))
    job.run(bpy.context, stage.settings())
    ann = overridden("Ann", tmp_path / "library.blend")
    scene = bpy.context.scene
    scene.frame_end = 6
    job.run(bpy.context, settings_of(ann, scene, take_count=3))
    assert len(ann.dafnet.takes) == 4

    ann = opened_again(tmp_path / "shot.blend")
    takes = [row.action.name_full for row in ann.dafnet.takes]
    assert len(set(takes)) == 4 and ann.dafnet.takes[0].action.library
    ann.dafnet.active_take = 0
    with pytest.raises(RuntimeError, match="of the library that 'Ann' comes from"):
        bpy.ops.dafnet.reject_take()
    ann.dafnet.active_take = 2
    assert bpy.ops.dafnet.reject_take() == {"FINISHED"}
    assert [row.action.name_full for row in ann.dafnet.takes] == [*takes[:2], takes[3]]
    ann.dafnet.takes[2].action.dafnet.accepted = True
    assert bpy.ops.dafnet.keep_accepted() == {"FINISHED"}
    assert [row.action.name_full for row in ann.dafnet.takes] == [takes[0], takes[3]]


def through(*points: Any) -> None:
    """Send the only character through these."""
    for each in bpy.context.scene.objects:
        each.select_set(each in points)
    assert bpy.ops.dafnet.walk_through_points(seconds=0.5) == {"FINISHED"}


def point(name: str, x: float, y: float) -> Any:
    made = bpy.data.objects.new(name, None)
    bpy.context.scene.collection.objects.link(made)
    made.location = (x, y, 0.0)
    bpy.context.view_layer.update()
    return made


def test_walks_of_an_overridden_character_are_kept_by_the_file(
    blender: ModuleType, tmp_path: Path
) -> None:
    Stage(furnished=False)
    overridden("Ann", tmp_path / "library.blend")
    first, second, third = point("A", 0.0, 2.0), point("B", 2.0, 2.0), point("C", 2.0, 4.0)
    through(first, second)
    through(third)
    through(second, first)
    own = the_armature().dafnet
    asked = [(asked_in(row), row.first, row.last, row.digest) for row in own.walks]
    assert [each[0].points for each in asked] == [("A", "B"), ("C",), ("A", "B")]

    own = opened_again(tmp_path / "shot.blend").dafnet
    assert [(asked_in(row), row.first, row.last, row.digest) for row in own.walks] == asked
    assert bpy.context.scene.frame_end == own.walks[-1].last
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}


def test_walks_of_the_library_stay_when_they_cannot_be_replaced(
    blender: ModuleType, tmp_path: Path
) -> None:
    stage, first = Stage(furnished=False), point("A", 0.0, 2.0)
    stage.ann.users_collection[0].objects.link(first)
    through(first)
    ann = overridden("Ann", tmp_path / "library.blend")
    root, own = ann.dafnet.root, ann.dafnet
    root.animation_data.action = root.animation_data.action.copy()
    through(point("B", 2.0, 2.0))
    through(point("C", 2.0, 4.0))
    walks = [(asked_in(row), row.first, row.last) for row in own.walks]
    keys = [[tuple(p.co) for p in curve.keyframe_points] for curve in action_curves(root)]
    own.active_walk = 0
    with pytest.raises(RuntimeError, match=r"has from its library .* make the character local"):
        bpy.ops.dafnet.redo_walk(replace_edited=True)
    assert [(asked_in(row), row.first, row.last) for row in own.walks] == walks
    assert keys == [[tuple(p.co) for p in c.keyframe_points] for c in action_curves(root)]
    assert len(walks) == 3

    own.active_walk = 1
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert [(asked_in(row), row.first, row.last) for row in own.walks] == walks


def test_tasks_of_an_overridden_character_are_kept_by_the_file(
    blender: ModuleType, tmp_path: Path
) -> None:
    stage = Stage(furnished=False)
    assert bpy.ops.dafnet.add_task(verb="STAND_UP") == {"FINISHED"}
    stage.own.tasks[0].seconds = 1.0
    own = overridden("Ann", tmp_path / "library.blend").dafnet
    for seconds in (2.0, 3.0, 4.0):
        assert bpy.ops.dafnet.add_task(verb="WAIT") == {"FINISHED"}
        own.tasks[own.active_task].seconds = seconds
    own.tasks[0].verb = "WALK_TO"

    own = opened_again(tmp_path / "shot.blend").dafnet
    rows = [(row.verb, row.seconds) for row in own.tasks]
    assert rows == [("WALK_TO", 1.0), ("WAIT", 2.0), ("WAIT", 3.0), ("WAIT", 4.0)]

    # Those of the library are neither removed nor changed places with; one's own are.
    own.active_task = 0
    for refused in (bpy.ops.dafnet.remove_task, lambda: bpy.ops.dafnet.move_task(direction="DOWN")):
        with pytest.raises(RuntimeError, match=r"of the library that 'Ann' comes from"):
            refused()
    own.active_task = 1
    with pytest.raises(RuntimeError, match="make the character local"):
        bpy.ops.dafnet.move_task(direction="UP")
    assert [(row.verb, row.seconds) for row in own.tasks] == rows
    assert bpy.ops.dafnet.remove_task() == {"FINISHED"}
    assert [row.seconds for row in own.tasks] == [1.0, 3.0, 4.0]
