"""Files for other programs hold what Blender plays: read back, joint by joint; one clean action, at
the scene's rate, in metres; and nothing of the user's is changed.
"""

import math
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.people import Played
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import baker, detection
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS

from kit import humanoids
from kit.delivered import Shot, glb
from kit.stage import bone_heads

KINDS = {"fbx": "fbx", "gltf": "glb", "usd": "usdc", "bvh": "bvh"}
TENTH_OF_A_MILLIMETRE = 1e-4


def read_back(kind: str, file: Path, fps: tuple[int, float]) -> Any:
    """The armature that a file holds, in an empty scene of this rate."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = fps
    if kind == "fbx":
        bpy.ops.import_scene.fbx(filepath=str(file), anim_offset=0.0)
    elif kind == "gltf":
        bpy.ops.import_scene.gltf(filepath=str(file))
    elif kind == "usd":
        bpy.ops.wm.usd_import(filepath=str(file))
    else:
        bpy.ops.import_anim.bvh(filepath=str(file), frame_start=5, axis_forward="Y", axis_up="Z")
    (armature,) = (each for each in scene.objects if each.type == "ARMATURE")
    assert len(bpy.data.actions) == 1 or kind == "gltf"
    return armature


@pytest.mark.parametrize("root_motion", ["bone", "hips"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_read_back_moves_as_blender_plays(
    blender: ModuleType, tmp_path: Path, kind: str, root_motion: str
) -> None:
    shot = Shot()
    take = shot.ann.takes[0]
    shot.deliver(tmp_path, export=kind, root_motion=root_motion)
    (file,) = (tmp_path / "export" / "take_1").iterdir()
    assert file.name == f"Ann.{KINDS[kind]}"

    armature = read_back(kind, file, (24, 1.0))
    bones = {bone.name for bone in armature.data.bones}
    assert bones == {*JOINTS} | ({"root"} if root_motion == "bone" else set())
    for k in range(len(take)):
        found = bone_heads(armature, 5 + k)
        assert np.abs(np.array(armature.matrix_world.translation)).max() < 1e-6, "it stays"
        assert np.abs(found - take.joints[k]).max() < TENTH_OF_A_MILLIMETRE, k
        if root_motion == "bone":
            (root,) = bone_heads(armature, 5 + k, ["root"])
            assert np.abs(root - take.root[k, :3, 3]).max() < TENTH_OF_A_MILLIMETRE
    if kind in ("fbx", "gltf"):
        (body,) = (each for each in armature.children if each.type == "MESH")
        shown = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
        corners = np.array([shown.matrix_world @ vertex.co for vertex in shown.data.vertices])
        pelvis = take.joints[-1, 0]
        assert np.abs(0.5 * (corners.min(0) + corners.max(0)) - pelvis)[:2].max() < 0.3
        assert 1.6 < np.ptp(corners[:, 2]) < 1.8, "the body is worn, and as tall as it is"


@pytest.mark.parametrize("kind", KINDS)
def test_files_are_in_metres_at_the_scene_s_rate(
    blender: ModuleType, tmp_path: Path, kind: str
) -> None:
    shot = Shot(unit=0.01, fps=30)
    shot.scene.render.fps_base = 1.001
    take = shot.ann.takes[0]
    shot.deliver(tmp_path, export=kind, root_motion="hips")
    file = tmp_path / "export" / "take_1" / f"Ann.{KINDS[kind]}"
    # Blender's reader of glTF multiplies with what it should divide by.
    armature = read_back(kind, file, (30, 1.0 / 1.001 if kind == "gltf" else 1.001))
    # Blender's reader of FBX counts whole frames a second, 30 here instead of 29.97.
    slower = 1.001 if kind == "fbx" else 1.0
    for k in (0, 6, 12):
        subframe, frame = math.modf(slower * (5 + k))
        found = bone_heads(armature, int(frame), subframe=subframe)
        assert np.abs(found - take.joints[k]).max() < TENTH_OF_A_MILLIMETRE, k
    if kind == "gltf":
        told = glb(file)
        times = [told["accessors"][each["input"]] for each in told["animations"][0]["samplers"]]
        assert {round(each["max"][0] * 30 / 1.001, 4) for each in times} == {17.0}
    if kind == "bvh":
        assert "Frame Time: 0.033367" in file.read_text(encoding="utf-8")


def test_one_clean_action_a_character_whatever_else_there_is(
    blender: ModuleType, tmp_path: Path
) -> None:
    """The root's action, other takes, strips and constraints flood no file, and stay."""
    shot = Shot(takes=2)
    ann = shot.stage.ann
    track = ann.animation_data.nla_tracks.new()
    track.strips.new("Waves", 1, shot.ann.actions[1])
    track.mute = True
    ann.pose.bones["head"].constraints.new("LIMIT_ROTATION")
    before = shot.stage.state()
    shot.deliver(tmp_path, export=("fbx", "gltf", "usd", "bvh"))
    assert shot.stage.state() == before and len(bpy.data.scenes) == 1
    assert [strip.name for strip in track.strips] == ["Waves"] and track.mute
    assert not bpy.data.libraries and len(bpy.data.armatures) == 1

    for take in ("take_1", "take_2"):
        folder = tmp_path / "export" / take
        assert sorted(file.suffix for file in folder.iterdir()) == [".bvh", ".fbx", ".glb", ".usdc"]
        told = glb(folder / "Ann.glb")
        assert [each["name"] for each in told["animations"]] == [f"Ann take {take[-1]}"]
        assert [each["name"] for each in told["nodes"] if "skin" in each] == ["Ann Body"]
    armature = read_back("fbx", tmp_path / "export" / "take_2" / "Ann.fbx", (24, 1.0))
    found = bone_heads(armature, 12)
    np.testing.assert_allclose(found, shot.ann.takes[1].joints[7], atol=TENTH_OF_A_MILLIMETRE)


@pytest.mark.parametrize("build", [humanoids.mixamo, humanoids.rigify], ids=lambda f: f.__name__)
def test_rigs_are_written_as_they_play(blender: ModuleType, tmp_path: Path, build: Any) -> None:
    shot = Shot()
    rig = build(bpy)
    rig_map = detection.detect_map(rig)
    baked = baker.bake_onto_rig(bpy.context, shot.stage.ann, rig, rig_map)
    measured = [
        bone.name
        for bone in rig.data.bones
        if bone.use_deform
        and bone.name
        in (
            *("mixamorig:LeftHand", "mixamorig:RightFoot", "mixamorig:Head", "mixamorig:Hips"),
            *("DEF-hand.L", "DEF-foot.R", "DEF-spine.006", "DEF-thigh.L"),
        )
    ]
    assert len(measured) == 4
    played = {frame: bone_heads(rig, frame, measured) for frame in (5, 11, 17)}
    count = len(rig.data.bones)
    shot.deliver(tmp_path, Played(rig, shot.ann.takes, [baked.action]), export="fbx")

    (file,) = (tmp_path / "export" / "take_1").iterdir()
    armature = read_back("fbx", file, (24, 1.0))
    assert len(armature.data.bones) <= count + 1
    for frame, heads in played.items():
        found = bone_heads(armature, frame, measured)
        assert np.abs(found - heads).max() < 10 * TENTH_OF_A_MILLIMETRE, frame
