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

    own = opened_again(tmp_path / "shot.blend").dafnet_rig
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
