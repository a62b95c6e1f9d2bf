"""Where hands, feet, head and pelvis of the animator's own rig land: where the character's do, on
every convention.
"""

from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.baker import bake
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import baker, detection
from bl_ext.user_default.dafnet.dafnet_addon.core import (
    body,
    kinematics,
    retargeting,
    rotations,
    skeleton,
    t_pose,
)
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Take

from kit import humanoids
from kit.rig_stage import MEASURED, RigStage

CENTIMETRE = 0.01


def test_a_body_of_its_own_keeps_the_motion(takes: dict[str, Take]) -> None:
    """Onto itself nothing changes; the same body at rest in an A-pose, with fewer joints, reaches
    the same places.
    """
    take = takes["write"]
    frames = kinematics.global_from_local(rotations.matrix_from_quaternion(take.rotations))
    motion, own_body, root = (
        retargeting.Motion(take.joints, frames),
        body.canonical_body(1.0),
        take.root[:, :3, 3],
    )
    same = retargeting.retarget(motion, own_body, own_body, root)
    assert (
        np.abs(same.motion.joints - take.joints).max() < 2e-3
        and np.abs(same.motion.frames - frames).max() < 0.02
    )
    down = np.array(skeleton.REST)
    for shoulder, elbow, wrist, sign in ((16, 18, 20, 1.0), (17, 19, 21, -1.0)):
        turn = rotations.matrix_from_vector(np.array([0.0, -0.8 * sign, 0.0]))
        down[[elbow, wrist]] = down[shoulder] + (down[[elbow, wrist]] - down[shoulder]) @ turn.T
    down[[3, 13, 14]] = np.nan
    lesser = t_pose.lay_in_t_pose(down)
    assert np.abs(lesser.rest - skeleton.REST).max() < 0.05
    retargeted = retargeting.retarget(motion, own_body, lesser, root).motion
    off = np.linalg.norm(retargeted.joints - take.joints, axis=-1).mean(axis=0)
    assert off[[1, 2, 7, 8, 10, 11]].max() < 1e-6 and off[[15, 20, 21]].max() < CENTIMETRE
    assert np.abs(retargeted.frames[:, [20, 21]] - frames[:, [20, 21]]).max() < 1e-9


GOLDEN = [(kind, "FK") for kind in MEASURED] + [("rigify", "IK")]


@pytest.mark.parametrize(("kind", "limbs"), GOLDEN)
def test_hands_feet_head_and_pelvis_land(stage: RigStage, kind: str, limbs: str) -> None:
    rig = stage.build(kind)
    for take in stage.takes:
        stage.play(take)
        baked = stage.bake(kind, rig, limbs=limbs)
        assert baked.ratio == 1.0
        for part, distances in stage.errors(kind, rig).items():
            assert distances.mean() < CENTIMETRE, (
                f"{take}: {part} off by {100 * distances.mean():.2f} cm"
            )
            assert baked.errors[part][0] == pytest.approx(distances.mean(), abs=0.004), (
                "the report is honest"
            )


@pytest.mark.parametrize(
    ("kind", "arms", "legs"),
    [
        ("mixamo", 1.1, 1.0),
        ("mixamo", 0.9, 1.0),
        ("mixamo", 1.0, 1.1),
        ("mixamo", 1.0, 0.9),
        ("rigify", 0.9, 1.0),
        ("rigify", 1.1, 0.9),
    ],
)
def test_limbs_of_other_lengths_still_reach(
    stage: RigStage, kind: str, arms: float, legs: float
) -> None:
    """Other legs make another size: the source is scaled about its root, but steps keep their
    length, and the head lies over the hips by the trunk's size. Short arms with long legs are left
    out: they would have to reach a fifth further than they do.
    """
    rig = stage.build(kind, arms=arms, legs=legs)
    for take in ("walk", "write"):
        stage.play(take)
        baked = stage.bake(kind, rig)
        assert baked.ratio == pytest.approx(legs, abs=0.01)
        root = stage.take.root[:, None, :3, 3]
        source = root + baked.ratio * (stage.take.joints - root)
        source[:, [7, 8], :2] = stage.take.joints[:, [7, 8], :2]
        if baked.ratio != 1.0:
            hips, upright = (
                source[:, [1, 2]].mean(axis=1),
                stage.take.joints[:, 15] - stage.take.joints[:, [1, 2]].mean(axis=1),
            )
            source[:, 15] = hips + upright
        errors = stage.errors(kind, rig, source)
        assert errors["ankles"].mean() < CENTIMETRE
        assert errors["head"].mean() < CENTIMETRE, "these trunks are of the character's size"
        assert ("wrists" in errors) == (take == "write")
        if take == "write":
            # At first they come from where they hung, farther than these arms reach.
            assert errors["wrists"].mean() < 1.5 * CENTIMETRE


def test_a_small_rig_plays_the_motion_at_its_size(stage: RigStage) -> None:
    """Hips, head and hands at its height, feet on the floor below, the root's way unchanged."""
    stage.play("sit")
    rig = stage.build("mixamo")
    rig.scale = rig.scale * 0.8
    baked = stage.bake("mixamo", rig)
    assert baked.ratio == pytest.approx(0.8, abs=0.01)
    root = stage.take.root[:, None, :3, 3]
    source = root + baked.ratio * (stage.take.joints - root)
    source[:, [7, 8], :2] = stage.take.joints[:, [7, 8], :2]
    errors = stage.errors("mixamo", rig, source)
    judged = errors.keys() & {"wrists", "head", "pelvis"}
    assert judged >= {"head", "pelvis"}, "hands only where they hold on to something"
    assert max(errors[part].mean() for part in judged) < 1.2 * CENTIMETRE
    assert np.allclose(
        stage.heads(rig, ["mixamorig:Hips"], 1)[0, :2], stage.take.root[0, :2, 3], atol=0.06
    )


TURNED = {  # hand and middle finger, foot and toe by side, head
    "unreal": (
        ("hand_l", "middle_01_l", "foot_l", "ball_l"),
        ("hand_r", "middle_01_r", "foot_r", "ball_r"),
        "head",
    ),
    "mixamo": (
        *(
            tuple(f"mixamorig:{word}{name}" for name in ("Hand", "HandMiddle1", "Foot", "ToeBase"))
            for word in ("Left", "Right")
        ),
        "mixamorig:Head",
    ),
    "rigify": (
        *(
            tuple(f"DEF-{name}.{side}" for name in ("hand", "f_middle.01", "foot", "toe"))
            for side in "LR"
        ),
        "DEF-spine.006",
    ),
}


@pytest.mark.parametrize(
    ("kind", "limbs"), [("unreal", "FK"), ("mixamo", "FK"), ("rigify", "FK"), ("rigify", "IK")]
)
def test_hands_and_feet_turn_as_the_characters(stage: RigStage, kind: str, limbs: str) -> None:
    """From A-pose as from T-pose: fingers point, soles tilt and faces look where the source's
    do.
    """
    stage.play("write")
    frames = kinematics.global_from_local(rotations.matrix_from_quaternion(stage.take.rotations))[
        60
    ]
    rig = stage.build(kind)
    # The room's axes of a rig that looks along -y, turned to look along +y.
    upright = np.diag([-1.0, -1.0, 1.0]) @ np.array(rig.matrix_world.to_3x3().normalized())
    stage.bake(kind, rig, limbs=limbs)
    *sides, head = TURNED[kind]
    for names, word, out in zip(sides, ("left", "right"), (-1.0, 1.0), strict=True):
        wrist, tip, ankle, toe = stage.heads(rig, list(names), 61)
        finger = frames[skeleton.joint(f"{word}_wrist")] @ [out, 0, 0]
        assert np.dot(rotations.normalised(tip - wrist), finger) > np.cos(np.radians(10))
        foot = frames[skeleton.joint(f"{word}_ankle")] @ rotations.normalised(
            skeleton.OFFSETS[skeleton.joint(f"{word}_foot")]
        )
        assert np.dot(rotations.normalised(toe - ankle), foot) > np.cos(np.radians(3))
    evaluated = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
    turned = (evaluated.matrix_world @ evaluated.pose.bones[head].matrix).to_3x3().normalized()
    rest = upright @ np.array(rig.data.bones[head].matrix_local)[:3, :3]
    assert np.abs(np.array(turned) - frames[skeleton.joint("head")] @ rest).max() < 1e-3


@pytest.mark.parametrize("kind", ["unreal", "rigify", "odd"])
def test_every_root_motion_gives_the_same_places(stage: RigStage, kind: str) -> None:
    stage.play("walk")
    rig = stage.build(kind)
    rig.location, rig.rotation_euler = (0.3, -0.2, 0.0), (0.0, 0.0, 0.7)
    names = [name for part in MEASURED[kind].values() for name in part]
    places = {}
    for motion in ("OBJECT", "BONE", "HIPS"):
        stage.bake(kind, rig, root_motion=motion)
        places[motion] = stage.bones(rig, names)
        root = {"unreal": "root", "rigify": "root", "odd": "Wurzel"}[kind]
        ways = [stage.heads(rig, [root], frame)[0] for frame in (1, len(stage.take))]
        assert (np.linalg.norm(ways[1] - ways[0]) > 1.0) == (motion != "HIPS")
        here = rig.matrix_world.translation.copy()
        stage.scene.frame_set(1)
        assert ((here - rig.matrix_world.translation).length > 1.0) == (motion == "OBJECT")
        stage.scene.frame_set(len(stage.take))
        if motion == "OBJECT":
            rig.animation_data_clear()
            rig.location, rig.rotation_euler = (0.3, -0.2, 0.0), (0.0, 0.0, 0.7)
    assert np.abs(places["BONE"] - places["OBJECT"]).max() < 2e-3
    assert np.abs(places["HIPS"] - places["OBJECT"]).max() < 2e-3


def test_units_of_the_scene(blender: ModuleType, takes: dict[str, Take]) -> None:
    """In a scene of centimetres a Mixamo rig has the scale 1; errors are told in metres."""
    stage = RigStage(takes, unit=0.01)
    stage.take = takes["sit"]
    bake(stage.take, stage.ann, 1, "sit", 0.01)
    rig = stage.build("mixamo")
    rig.scale = (1.0, 1.0, 1.0)
    baked = stage.bake("mixamo", rig)
    errors = stage.errors("mixamo", rig, 100.0 * stage.take.joints)
    assert max(distances.mean() for distances in errors.values()) < 100.0 * CENTIMETRE
    assert max(mean for mean, _ in baked.errors.values()) < CENTIMETRE


def test_a_parent_that_moves_is_undone(stage: RigStage) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")
    cart = bpy.data.objects.new("Cart", None)
    stage.scene.collection.objects.link(cart)
    for frame, x in ((1, 0.0), (60, 3.0)):
        cart.location.x, cart.rotation_euler.z = x, x
        cart.keyframe_insert("location", frame=frame)
        cart.keyframe_insert("rotation_euler", frame=frame)
    rig.parent = cart
    for motion in ("OBJECT", "HIPS"):
        stage.bake("mixamo", rig, root_motion=motion)
        assert (
            max(distances.mean() for distances in stage.errors("mixamo", rig).values()) < CENTIMETRE
        )


def test_rotation_modes_give_the_same_pose(stage: RigStage) -> None:
    stage.play("sit")
    rig = stage.build("vrm")
    names = [bone.name for bone in rig.pose.bones]
    stage.bake("vrm", rig)
    meant = stage.bones(rig, names)
    modes = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "AXIS_ANGLE")
    for shift in range(len(modes)):
        for k, bone in enumerate(rig.pose.bones):
            bone.rotation_mode = modes[(k + shift) % len(modes)]
        rig.rotation_mode = modes[shift]
        stage.bake("vrm", rig)
        assert np.abs(stage.bones(rig, names, 18) - meant[::2]).max() < 1e-3
    assert {bone.rotation_mode for bone in rig.pose.bones} == set(modes), (
        "the modes are the animator's"
    )


def test_hips_beside_the_trunk_do_not_tear_it(stage: RigStage) -> None:
    """A bone "pelvis" for the hips' own turns, and the trunk, both on "hip": the guess takes that;
    the other is refused.

    What was played before is played again then, in its own slot.
    """
    stage.play("walk")
    rig = humanoids.mixamo(bpy, prefix="")
    bpy.ops.object.mode_set(mode="EDIT")
    bones = rig.data.edit_bones
    for old, new in (
        ("Hips", "pelvis"),
        ("Spine", "abdomenLower"),
        ("Spine1", "abdomenUpper"),
        ("Spine2", "chest"),
    ):
        bones[old].name = new
    hip = bones.new("hip")
    hip.head, hip.tail = bones["pelvis"].head, bones["pelvis"].tail
    bones["pelvis"].parent = bones["abdomenLower"].parent = hip
    bpy.ops.object.mode_set(mode="OBJECT")
    found = detection.detect_map(rig)
    assert (found.name, found.joints["pelvis"], found.joints["spine1"]) == (
        "Guessed",
        "hip",
        "abdomenLower",
    )

    rig.pose.bones["Head"].keyframe_insert("location", frame=1)
    data = rig.animation_data
    mine, slot = data.action, getattr(data, "action_slot", None)
    if slot is not None:
        mine.slots.new(id_type="OBJECT", name="Another")
    torn = type(found)("Mine", joints=found.joints | {"pelvis": "pelvis"})
    with pytest.raises(InputError, match="'pelvis' does not carry 'abdomenLower'"):
        baker.bake_onto_rig(bpy.context, stage.ann, rig, torn)
    assert data.action == mine and getattr(data, "action_slot", None) == slot
    assert all(bone.matrix_basis == bone.matrix_basis.Identity(4) for bone in rig.pose.bones)

    baker.bake_onto_rig(bpy.context, stage.ann, rig, found)
    assert (
        np.abs(stage.heads(rig, ["Head", "LeftHand"], 30) - stage.take.joints[29, [15, 20]]).max()
        < 3 * CENTIMETRE
    )
