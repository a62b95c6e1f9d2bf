"""The motion keeps its shape from any rest pose, on real characters, and back again: elbows, knees
and limbs point as they did.
"""

from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import create_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.rig_trial import real_rig
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import detection, properties, reading
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.core import (
    kinematics,
    rotations,
    skeleton,
    touching,
)
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS

from kit import humanoids
from kit.places import SHARED
from kit.rig_stage import RigStage

CENTIMETRE = 0.01


@pytest.mark.parametrize("kind", ["mixamo", "rigify", "odd"])
def test_full_mode_copies_from_any_rig(stage: RigStage, kind: str) -> None:
    """The rig plays what Bob plays; Ann's upper body copied from either is the same within about a
    centimetre.
    """
    stage.play("write")
    stage.ann.dafnet.root = None  # the source's root is found from its joints, as a rig's is
    bob, stage.ann = (
        stage.ann,
        create_character(bpy.context, "Ann"),
    )
    stage.ann, source = bob, stage.ann
    rig = stage.build(kind)
    stage.bake(kind, rig)
    properties.show_map(rig, stage.map(kind, rig))
    source.dafnet.mode = "FULL"
    stage.scene.frame_start, stage.scene.frame_end = 1, len(stage.take)
    read = {}
    for each in (bob, rig):
        source.dafnet.upper_body_source = each
        settings = settings_of(source, stage.scene)
        read[each.name] = read_scene(bpy.context, settings).controls.upper_body
    off = np.linalg.norm(read[rig.name] - read[bob.name], axis=-1)
    # Without collars the chest turns with the reaching arm, and with it the heading that the root
    # is found from.
    assert off.mean() < (2.0 if kind == "odd" else 1.2) * CENTIMETRE
    assert off[:, [7, 12, 13]].mean() < (2.5 if kind == "odd" else 1.0) * CENTIMETRE, (
        "head and wrists"
    )


def test_full_mode_refuses_what_it_does_not_know(stage: RigStage) -> None:
    rig = humanoids.odd(bpy)
    stage.ann.dafnet.upper_body_source = rig
    stage.ann.dafnet.mode = "FULL"
    settings = settings_of(stage.ann, stage.scene)
    with pytest.raises(InputError, match="'Odd' has no bone for the"):
        read_scene(bpy.context, settings)


def test_a_source_plays_later_and_over_and_over(stage: RigStage) -> None:
    """What is copied at a frame is what is copied without them at the frame that they lead to; the
    frames of the scene are read again for it, and the current one comes back.
    """
    stage.play("write")
    bob, ann = stage.ann, create_character(bpy.context, "Ann")
    ann.dafnet.upper_body_source, ann.dafnet.mode = bob, "FULL"
    stage.scene.frame_start, stage.scene.frame_end = 1, 30
    stage.scene.frame_set(7)

    def read(frames: tuple[int, int] = (1, 30), **asked: Any) -> np.ndarray:
        first, last = frames
        settings = settings_of(ann, stage.scene, frame_start=first, frame_end=last, **asked)
        return read_scene(bpy.context, settings).controls.upper_body

    plain = read()
    later = read((11, 30), source_offset=10)
    assert np.abs(later - plain[:20]).max() < 0.01
    length = len(stage.take) - 1
    over = read((1, length + 20), source_offset=-5, source_loops=True)
    assert np.abs(over[length : length + 15] - over[:15]).max() < 1e-6
    assert np.abs(over[:25] - plain[5:]).max() < 0.01
    assert stage.scene.frame_current == 7

    bob.animation_data_clear()
    with pytest.raises(InputError, match="plays no action that could loop"):
        read(source_loops=True)


def test_a_copied_body_sways_the_same_at_any_rate(stage: RigStage) -> None:
    """The root of a source is found from its joints as smoothly at 120 frames a second as at 30:
    what sways in it would else be lost from what is copied.
    """
    stage.play("walk")
    bob, ann = stage.ann, create_character(bpy.context, "Ann")
    bob.dafnet.root = None
    for frame in range(1, len(stage.take) + 1):
        bob.delta_location.x = 0.03 * np.sin(2.0 * np.pi * frame / 15)
        bob.keyframe_insert("delta_location", frame=frame)
    ann.dafnet.upper_body_source, ann.dafnet.mode = bob, "FULL"

    def read(last: int) -> np.ndarray:
        settings = settings_of(ann, stage.scene, frame_start=1, frame_end=last)
        return read_scene(bpy.context, settings).controls.upper_body

    at_30 = read(len(stage.take))
    stage.scene.render.fps = 120
    for curve in action_curves(bob):
        for point in curve.keyframe_points:
            point.co.x = 1 + 4 * (point.co.x - 1)
        curve.update()
    at_120 = read(4 * len(stage.take) - 3)[::4]
    assert np.abs(at_120 - at_30).max() < 0.2 * CENTIMETRE


ENDS = {
    "upper arms": ((16, 18), (17, 19)),
    "forearms": ((18, 20), (19, 21)),
    "thighs": ((1, 4), (2, 5)),
    "shins": ((4, 7), (5, 8)),
    "shoulders": ((16, 17),),
}

BENT = {"elbows": ((16, 18, 20), (17, 19, 21)), "knees": ((1, 4, 7), (2, 5, 8))}


def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between vectors (…, 3)."""
    a, b = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (a, b))
    return np.degrees(np.arccos(np.clip((a * b).sum(-1), -1.0, 1.0)))


def seen_off(joints: np.ndarray, source: np.ndarray) -> dict[str, np.ndarray]:
    """What an eye sees of two motions (T, 22, 3): by how many degrees limbs, trunk and head lie
    otherwise, and bend.
    """
    off = {
        name: np.concatenate(
            [between(joints[:, b] - joints[:, a], source[:, b] - source[:, a]) for a, b in pairs]
        )
        for name, pairs in ENDS.items()
    }
    for name, triples in BENT.items():
        off[name] = np.concatenate(
            [
                np.abs(
                    between(ours[:, 0] - ours[:, 1], ours[:, 2] - ours[:, 1])
                    - between(theirs[:, 0] - theirs[:, 1], theirs[:, 2] - theirs[:, 1])
                )
                for ours, theirs in (
                    (joints[:, limb], source[:, limb]) for limb in map(list, triples)
                )
            ]
        )
    hips, theirs = joints[:, [1, 2]].mean(axis=1), source[:, [1, 2]].mean(axis=1)
    off["trunk"] = between(
        joints[:, [16, 17]].mean(axis=1) - hips, source[:, [16, 17]].mean(axis=1) - theirs
    )
    off["head"] = between(joints[:, 15] - hips, source[:, 15] - theirs)
    return off


class World:
    """Where a rig's joints are in the room, and what FULL reads from it."""

    def __init__(self, stage: RigStage, rig: Any) -> None:
        self.stage, self.rig, self.map = stage, rig, detection.detect_map(rig)

    def played(self, frames: range) -> np.ndarray:
        known = [j for j, name in enumerate(JOINTS) if self.map.place(name)]
        joints = np.full((len(frames), 22, 3), np.nan)
        joints[:, known] = [
            self.stage.heads(self.rig, [self.map.place(JOINTS[j]) for j in known], f)
            for f in frames
        ]
        return joints

    def read(self, frames: range) -> np.ndarray:
        """Joints (T, 22, 3) of the canonical body that moves as the rig does."""
        bodies, poses = [], []
        for frame in frames:
            self.stage.scene.frame_set(frame)
            evaluated = self.rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
            bodies.append(np.array(evaluated.matrix_world))
            poses.append(
                reading.pose_matrices(evaluated, [self.map.place(name) for name in JOINTS])
            )
        return reading.joints_of(self.rig, self.map, np.array(bodies), np.array(poses), 1.0)[0]


@pytest.mark.parametrize("rest", humanoids.RESTS)
@pytest.mark.parametrize("kind", ["mixamo", "unreal", "vrm"])
def test_the_rest_pose_does_not_matter(stage: RigStage, kind: str, rest: str) -> None:
    """Arms hanging or ahead, sitting, twisted, bent, leaning: limbs, trunk and head lie in the room
    as the character's.

    And FULL reads them back so.
    """
    stage.play("write")
    rig = stage.build(kind)
    humanoids.rested(bpy, rig, *humanoids.rest_pose(rest, detection.detect_map(rig).joints))
    baked = stage.bake(kind, rig)
    for part, distances in stage.errors(kind, rig).items():
        assert distances.mean() < CENTIMETRE, part
    world, frames = World(stage, rig), range(1, len(stage.take) + 1, 9)
    played = world.played(frames)
    for part, off in seen_off(played, stage.take.joints[::9]).items():
        assert off.mean() < 4.0 and off.max() < 6.0, f"{part} {off.mean():.1f} ({off.max():.1f})"
    assert max(mean for mean, _ in baked.angles.values()) < 5.0
    for part, off in seen_off(world.read(frames), played).items():
        assert off.max() < 5.0, f"{part} read {off.mean():.1f} ({off.max():.1f})"


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_bones_may_point_anywhere_and_objects_stand_anyhow(stage: RigStage, size: float) -> None:
    """Random tails and rolls, an object of any scale that is turned: nothing of it is seen."""
    stage.play("write")
    rig = stage.build("vrm")
    rng = np.random.default_rng(5)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in rig.data.edit_bones:
        bone.use_connect = False
    turn = rotations.matrix_from_vector(np.array([0.4, -1.1, 0.6]))
    for bone in rig.data.edit_bones:
        head = turn @ np.array(bone.head) / size
        bone.head, bone.tail = head, head + 0.1 * rng.normal(size=3) / size
        bone.roll = rng.uniform(-3.0, 3.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.scale = (size,) * 3
    rig.rotation_euler = (0.7, 0.2, -2.0)
    stage.bake("vrm", rig)
    assert max(distances.mean() for distances in stage.errors("vrm", rig).values()) < CENTIMETRE
    played = World(stage, rig).played(range(1, len(stage.take) + 1, 9))
    for part, off in seen_off(played, stage.take.joints[::9]).items():
        assert off.max() < 6.0, f"{part} {off.mean():.1f} ({off.max():.1f})"


BVH = [
    "accad_male1_B3_walk",
    "accad_male1_A9_lie_down",
    "cmu69_69_02_1",
    "cmu_daz_14_12_wash_windows",
    "cmu_daz_14_30_sit_stepstool",
    "snu_ys2010_walk_turn_180",
]


def imported(stage: RigStage, name: str) -> Any:
    """A real BVH as Blender's own importer brings it in, in metres."""
    file = SHARED / "mocap" / "raw_samples" / f"{name}.bvh"
    if not file.is_file():
        pytest.skip(f"needs the motion file {file}")
    if not hasattr(bpy.ops.import_anim, "bvh"):
        pytest.skip("this Blender has no importer of BVH")
    bpy.ops.import_anim.bvh(filepath=str(file), global_scale=0.01)
    return bpy.context.object


@pytest.mark.parametrize("name", BVH)
def test_full_mode_reads_real_imports_as_they_are_seen(stage: RigStage, name: str) -> None:
    """Whatever pose they rest in: trunks bent by a right angle, arms ahead, legs astride, collars
    on one side only.
    """
    rig = imported(stage, name)
    end = int(rig.animation_data.action.frame_range[1])
    world, frames = World(stage, rig), range(2, end, max(1, end // 40))
    source, read = world.played(frames), world.read(frames)
    # Hands that lie on thighs lie on the character's own, at the price of some degrees.
    legs = [np.linalg.norm(each[0, 4] - each[0, 1]) for each in (source, read)]
    lie = (
        np.max(
            [touching.in_lap(each, 30.0) for each in (read, source * legs[1] / legs[0])],
            axis=(0, 2, 3),
        )
        > 0.0
    )
    for frames, arms in ((lie, 40.0), (~lie, 0.1)):
        for part, off in seen_off(read[frames], source[frames]).items():
            on_arms, on_legs = (
                part in ("upper arms", "forearms", "elbows"),
                part in ("thighs", "shins", "knees"),
            )
            most = arms if on_arms else 0.1 if on_legs else 6.0
            assert off.max(initial=0.0) < most, f"{part} {off.mean():.1f} ({off.max():.1f})"
            assert not len(off) or off.mean() < 10.0
    way = [joints[:, 15] - joints[:, [1, 2]].mean(axis=1) for joints in (read, source)]
    size = np.linalg.norm(way[0], axis=1).max() / np.linalg.norm(way[1], axis=1).max()
    assert np.linalg.norm(way[0] - size * way[1], axis=1).max() < 4.0 * CENTIMETRE, (
        "the head over the hips"
    )


# Mean degrees that legs may be off, whose feet stand where the character's do; what is left comes
# from thighs and shins of other proportions, most of all where they sit.
LEGS = {
    "mixamo_gltf_woman": 3.0,
    "mixamo_gltf_soldier": 7.0,
    "vrm_b": 13.0,
    "robot_gltf": 26.0,
    "chibi_gltf": 13.0,
}


@pytest.mark.parametrize("name", LEGS)
@pytest.mark.parametrize("what", ["walk", "sit", "write"])
def test_real_characters_keep_the_motions_shape(stage: RigStage, name: str, what: str) -> None:
    """The character is made as large as the rig first: then free arms lie as its own do, hands that
    hold on to something are there, as far as arms reach, and feet stand on the floor.
    """
    file = SHARED / "rigs" / f"{name}.json"
    if not file.is_file():
        pytest.skip(f"needs the rest pose {file}")
    rig = real_rig(file)
    stage.size_as(rig)
    stage.play(what)
    baked = stage.bake(name, rig)
    assert baked.ratio == 1.0
    assert baked.errors["ankles"][0] < CENTIMETRE, (
        "feet are on the floor, also those that hang on no leg"
    )

    step = 3
    played = World(stage, rig).played(range(1, len(stage.take) + 1, step))
    source, held = stage.take.joints[::step], stage.take.touches[::step]
    for side, arm in enumerate(((16, 18, 20), (17, 19, 21))):
        off = limb_off(played, source, arm)
        if (free := held[:, side] == 0.0).any():
            assert off[free].max() < 6.0, "a free arm"
        if (holds := held[:, side] > 0.99).any() and name in ("mixamo_gltf_woman", "vrm_b"):
            assert (
                np.linalg.norm(played[holds, arm[2]] - source[holds, arm[2]], axis=-1).mean()
                < 2.5 * CENTIMETRE
            ), "a hand that holds on to something, or lies in its own lap"

    for leg in ((1, 4, 7), (2, 5, 8)):
        assert limb_off(played, source, leg).mean() < LEGS[name]
    seen = seen_off(played, source)
    assert max(seen["trunk"].mean(), seen["head"].mean()) < 6.0
    for limb, joints in (("left arm", (16, 18, 20)), ("left leg", (1, 4, 7))):
        assert baked.angles[limb][0] > limb_off(played, source, joints).mean() - 2.5, (
            "the report is no better than what is seen"
        )


def limb_off(joints: np.ndarray, source: np.ndarray, limb: tuple[int, int, int]) -> np.ndarray:
    """By how many degrees (T,) a limb's bones lie otherwise, or it is bent otherwise, the most."""
    first, middle, end = limb
    ours, theirs = (
        (each[:, middle] - each[:, first], each[:, end] - each[:, middle])
        for each in (joints, source)
    )
    bends = between(-ours[0], ours[1]) - between(-theirs[0], theirs[1])
    return np.max([between(ours[0], theirs[0]), between(ours[1], theirs[1]), np.abs(bends)], axis=0)


@pytest.mark.parametrize("rest", humanoids.RESTS)
def test_hands_feet_and_face_turn_the_same_from_any_rest_pose(stage: RigStage, rest: str) -> None:
    """Fingers, palms, soles and face as the character's in the room, by where bones are that nobody
    keyed.
    """
    stage.play("write")
    frames = kinematics.global_from_local(rotations.matrix_from_quaternion(stage.take.rotations))[
        60
    ]
    rig = stage.build("mixamo")
    humanoids.rested(bpy, rig, *humanoids.rest_pose(rest, detection.detect_map(rig).joints))
    stage.bake("mixamo", rig)

    def way(start: str, end: str) -> np.ndarray:
        return np.subtract(*stage.heads(rig, [f"mixamorig:{end}", f"mixamorig:{start}"], 61))

    for word, side, out in (("Left", "left", -1.0), ("Right", "right", 1.0)):
        hand, ankle = (frames[skeleton.joint(f"{side}_{joint}")] for joint in ("wrist", "ankle"))
        fingers = way(f"{word}Hand", f"{word}HandMiddle1") + way(f"{word}Hand", f"{word}HandRing1")
        assert between(fingers, hand @ [out, 0.0, 0.0]) < 1.0
        assert between(way(f"{word}HandPinky1", f"{word}HandIndex1"), hand @ [0.0, 1.0, 0.0]) < 5.0
        assert (
            between(
                way(f"{word}Foot", f"{word}ToeBase"),
                ankle @ skeleton.OFFSETS[skeleton.joint(f"{side}_foot")],
            )
            < 1.0
        )
    assert (
        between(way("Head", "HeadTop_End"), frames[skeleton.joint("head")] @ [0.0, 0.0, 1.0]) < 2.0
    )


def test_full_mode_tells_what_it_cannot_follow(stage: RigStage) -> None:
    """A trunk folded by bones that the map does not know: in words, per limb, in degrees; nothing
    where all is followed.
    """
    stage.play("walk")
    rig = stage.build("mixamo")
    stage.ann.dafnet.upper_body_source = rig
    stage.ann.dafnet.mode = "FULL"
    stage.scene.frame_start, stage.scene.frame_end = 1, 20

    def warnings() -> str:
        return " ".join(stage.read().warnings)

    rig.pose.bones["mixamorig:Spine1"].rotation_quaternion = (0.966, 0.259, 0.0, 0.0)
    assert "is copied" not in warnings()
    known = detection.detect_map(rig)
    joints = {
        joint: bone
        for joint, bone in known.joints.items()
        if "spine" not in joint and "collar" not in joint
    }
    properties.show_map(rig, type(known)("Mine", joints=joints))
    rig.pose.bones["mixamorig:Spine1"].rotation_quaternion = (0.383, 0.0, 0.924, 0.0)
    assert "'Mixamo' is copied, but the trunk by" in warnings() and "degrees off" in warnings()
