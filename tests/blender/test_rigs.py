"""The animator's own rig: hands, feet, head and pelvis land where the character's do, on every
convention; and back again.
"""

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import addon_utils
import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender import (
    compat,
    onto_rig,
    rig_properties,
    rig_reading,
    rigs,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.armature import create_character, is_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.baker import bake
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.blender.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.core import (
    kinematics,
    retargeting,
    rotations,
    skeleton,
)
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Take
from bl_ext.user_default.dafnet.operators.bake_to_rig import DAFNET_OT_bake_to_rig
from bl_ext.user_default.dafnet.panels.rig import DAFNET_PT_rig, DAFNET_UL_rig

from kit import humanoids
from kit.panels import Layout, drawn_by
from kit.places import SHARED
from kit.rig_stage import MEASURED, RigStage, made_takes

CENTIMETRE = 0.01


@pytest.fixture(scope="module")
def takes() -> dict[str, Take]:
    return made_takes()


@pytest.fixture(scope="module", autouse=True)
def without_rigify_afterwards() -> Iterator[None]:
    yield
    if addon_utils.check("rigify")[1]:
        addon_utils.disable("rigify")


@pytest.fixture
def stage(blender: ModuleType, takes: dict[str, Take]) -> RigStage:
    return RigStage(takes)


def test_a_body_of_its_own_keeps_the_motion(takes: dict[str, Take]) -> None:
    """Onto itself nothing changes; the same body at rest in an A-pose, with fewer joints, reaches
    the same places.
    """
    take = takes["write"]
    frames = kinematics.global_from_local(rotations.matrix_from_quaternion(take.rotations))
    motion, body, root = (
        retargeting.Motion(take.joints, frames),
        retargeting.canonical_body(1.0),
        take.root[:, :3, 3],
    )
    same = retargeting.retarget(motion, body, body, root)
    assert (
        np.abs(same.motion.joints - take.joints).max() < 2e-3
        and np.abs(same.motion.frames - frames).max() < 0.02
    )
    down = np.array(skeleton.REST)
    for shoulder, elbow, wrist, sign in ((16, 18, 20, 1.0), (17, 19, 21, -1.0)):
        turn = rotations.matrix_from_vector(np.array([0.0, -0.8 * sign, 0.0]))
        down[[elbow, wrist]] = down[shoulder] + (down[[elbow, wrist]] - down[shoulder]) @ turn.T
    down[[3, 13, 14]] = np.nan
    lesser = retargeting.lay_in_t_pose(down)
    assert np.abs(lesser.rest - skeleton.REST).max() < 0.05
    retargeted = retargeting.retarget(motion, body, lesser, root).motion
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
        assert errors["wrists"].mean() < CENTIMETRE


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
    assert max(errors[part].mean() for part in ("wrists", "head", "pelvis")) < CENTIMETRE
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


def test_hand_edits_are_baked(stage: RigStage) -> None:
    stage.play("walk")
    arm = 'pose.bones["right_shoulder"].rotation_quaternion'
    for curve in compat.action_curves(stage.ann):
        if curve.data_path == arm:
            curve.keyframe_points.foreach_set(
                "co",
                np.array(
                    [
                        (point.co.x, (0.8, 0.6, 0.0, 0.0)[curve.array_index])
                        for point in curve.keyframe_points
                    ],
                    np.float32,
                ).ravel(),
            )
            curve.update()
    rig = stage.build("mixamo")
    stage.bake("mixamo", rig)
    wrist = stage.heads(stage.ann, ["right_wrist"], 20)
    assert np.linalg.norm(wrist - stage.take.joints[19, 21]) > 0.2
    assert np.abs(stage.heads(rig, ["mixamorig:RightHand"], 20) - wrist).max() < CENTIMETRE


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


def test_controls_that_are_turned_by_several_are_found_frame_by_frame(stage: RigStage) -> None:
    """Rigify's neck that follows the torso by half is rigid on nothing; the head lands and looks
    ahead all the same.
    """
    stage.play("write")
    rig = stage.build("rigify")
    stage.bake("rigify", rig)
    names = ["DEF-spine.004", "DEF-spine.006", "DEF-hand.L"]
    meant = stage.bones(rig, names)
    rig.animation_data_clear()
    rig.pose.bones["torso"]["neck_follow"] = rig.pose.bones["torso"]["head_follow"] = 0.5
    detected = rigs.detected(rig)
    follows = {kind: rows for kind, rows in detected.settings.items() if kind != "BOTH"}
    rig_map = type(detected)(**{**vars(detected), "settings": follows})
    onto_rig.bake_onto_rig(bpy.context, stage.ann, rig, rig_map)
    assert np.abs(stage.bones(rig, names) - meant).max() < CENTIMETRE


def test_rigify_is_switched_and_old_poses_do_not_leak(stage: RigStage) -> None:
    """An older action has keyed IK, the chest and a limb's parent; the new one plays right after
    it, whatever was shown.
    """
    stage.play("walk")
    rig = stage.build("rigify")
    arm = rig.pose.bones["upper_arm_parent.L"]
    arm["IK_FK"] = 0.0
    arm.keyframe_insert('["IK_FK"]', frame=1)
    for name in ("chest", "hips", "root"):
        rig.pose.bones[name].location = (0.1, 0.2, 0.0)
        rig.pose.bones[name].keyframe_insert("location", frame=1)
    mine = rig.animation_data.action
    baked = stage.bake("rigify", rig)
    compat.assign_action(rig, mine)
    stage.scene.frame_set(3)
    assert arm["IK_FK"] == 0.0 and rig.pose.bones["chest"].location.y == pytest.approx(0.2)
    compat.assign_action(rig, baked.action)
    assert max(distances.mean() for distances in stage.errors("rigify", rig).values()) < CENTIMETRE
    assert arm["IK_FK"] == 1.0
    stage.bake("rigify", rig, limbs="IK")
    assert arm["IK_FK"] == 0.0 and arm["pole_vector"]


def test_earlier_actions_stay_as_they_are(stage: RigStage) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")
    bone = rig.pose.bones["mixamorig:LeftArm"]
    for frame, angle in ((1, 0.0), (30, 0.7)):
        bone.rotation_quaternion = (np.cos(angle), np.sin(angle), 0.0, 0.0)
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    mine = rig.animation_data.action
    before = [
        [tuple(point.co) for point in curve.keyframe_points] for curve in compat.action_curves(rig)
    ]
    theirs = stage.ann.animation_data.action
    stage.scene.frame_set(17)
    first = stage.bake("mixamo", rig).action
    second = stage.bake("mixamo", rig, root_motion="HIPS").action
    assert len({mine, first, second}) == 3 and rig.animation_data.action == second
    assert all(action.use_fake_user for action in (mine, first, second))
    assert stage.scene.frame_current == 17 and stage.ann.animation_data.action == theirs
    assert {
        point.interpolation
        for curve in compat.action_curves(rig)
        for point in curve.keyframe_points
    } == {"LINEAR"}
    compat.assign_action(rig, mine)
    assert [
        [tuple(point.co) for point in curve.keyframe_points] for curve in compat.action_curves(rig)
    ] == before


def test_what_cannot_be_baked_is_refused_and_left_alone(stage: RigStage) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")
    rig.pose.bones["mixamorig:Spine"].location = (1.0, 2.0, 3.0)

    def refused(match: str, rig: Any = rig, rig_map: Any = None, **options: Any) -> None:
        actions, pose = (
            set(bpy.data.actions),
            [bone.matrix_basis.copy() for bone in rig.pose.bones],
        )
        with pytest.raises(InputError, match=match) as caught:
            onto_rig.bake_onto_rig(
                bpy.context, stage.ann, rig, rig_map or rigs.detected(rig), **options
            )
        assert str(caught.value).count(". ") == 0
        assert set(bpy.data.actions) == actions and rig.animation_data is None
        assert [bone.matrix_basis for bone in rig.pose.bones] == pose

    detected = rigs.detected(rig)
    joints = {joint: bone for joint, bone in detected.joints.items() if joint != "left_knee"}
    refused("no bone for the left knee", rig_map=type(detected)("Mine", joints=joints))
    refused(
        "both left_elbow and left_knee",
        rig_map=type(detected)(
            "Mine", joints=detected.joints | {"left_knee": detected.joints["left_elbow"]}
        ),
    )
    refused("no known IK controls", limbs="IK")
    refused("no root bone", root_motion="BONE")
    rig.scale.x *= 2.0
    refused("unevenly")
    rig.scale.x *= 0.5
    rig.data.pose_position = "REST"
    refused("rest position")
    rig.data.pose_position = "POSE"
    rig.constraints.new("COPY_LOCATION")
    refused("Hips", root_motion="OBJECT")
    stage.ann.data.pose_position = "REST"
    refused("'Ann' shows its rest position", root_motion="HIPS")
    stage.ann.data.pose_position = "POSE"


def test_an_object_that_drivers_move_is_refused(stage: RigStage) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")
    rig.driver_add("location", 0).driver.expression = "0.5"
    with pytest.raises(InputError, match="drivers"):
        stage.bake("mixamo", rig)


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
    found = rigs.detected(rig)
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
        onto_rig.bake_onto_rig(bpy.context, stage.ann, rig, torn)
    assert data.action == mine and getattr(data, "action_slot", None) == slot
    assert all(bone.matrix_basis == bone.matrix_basis.Identity(4) for bone in rig.pose.bones)

    onto_rig.bake_onto_rig(bpy.context, stage.ann, rig, found)
    assert (
        np.abs(stage.heads(rig, ["Head", "LeftHand"], 30) - stage.take.joints[29, [15, 20]]).max()
        < CENTIMETRE
    )


def test_constraints_that_move_keyed_bones_are_named(stage: RigStage) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")
    assert stage.bake("mixamo", rig).overruled == ()
    constraint = rig.pose.bones["mixamorig:LeftLeg"].constraints.new("IK")
    constraint.target, constraint.chain_count = stage.ann.dafnet.hand_left, 2
    rig.pose.bones["mixamorig:RightArm"].driver_add("rotation_quaternion", 1)
    baked = stage.bake("mixamo", rig)
    assert set(baked.overruled) == {"mixamorig:LeftLeg", "mixamorig:RightArm"}
    assert baked.errors["ankles"][0] > 0.05, "and the report is honest"
    constraint.mute = rig.animation_data.drivers[0].mute = True
    assert stage.bake("mixamo", rig).errors["ankles"][0] < CENTIMETRE


DETECTED = {
    "mixamo": ("Mixamo", 22),
    "rigify": ("Rigify", 21),
    "rigify_metarig": ("Rigify metarig", 22),
    "smpl_x": ("SMPL-X", 22),
    "unreal": ("Unreal mannequin (UE4)", 22),
    "vrm": ("VRM 1.0", 21),
}


@pytest.mark.parametrize("kind", DETECTED)
def test_conventions_are_detected(stage: RigStage, kind: str) -> None:
    rig = stage.build(kind)
    found = rigs.detected(rig)
    assert (found.name, len(found.joints)) == DETECTED[kind]
    assert not is_character(rig)
    assert is_character(stage.ann)


@pytest.mark.parametrize("prefix", ["", "mixamorig1:", "mixamorig_", "Mia:"])
def test_prefixes_do_not_matter(stage: RigStage, prefix: str) -> None:
    found = rigs.detected(humanoids.mixamo(bpy, prefix=prefix))
    assert (found.name, len(found.joints)) == ("Mixamo", 22)
    assert found.joints["left_hip"] == f"{prefix}LeftUpLeg"


def test_five_spine_bones_of_unreal(stage: RigStage) -> None:
    rig = humanoids.unreal(bpy, spines=5)
    found = rigs.detected(rig)
    assert found.name == "Unreal mannequin (UE5)" and found.joints["spine3"] == "spine_05"
    stage.play("write")
    stage.bake("unreal", rig)
    assert max(distances.mean() for distances in stage.errors("unreal", rig).values()) < CENTIMETRE


GUESSED = {
    "mixamorig:Hips": "hip_ctrl",
    "mixamorig:Spine": "spine_lower",
    "mixamorig:Spine1": "Spine-Mid",
    "mixamorig:Spine2": "Chest",
    "mixamorig:Neck": "neck",
    "mixamorig:Head": "Head",
    "Shoulder": "Clavicle_{}",
    "Arm": "UpperArm_{}",
    "ForeArm": "LowerArm_{}",
    "Hand": "hand.{}",
    "UpLeg": "{}_thigh",
    "Leg": "{}_shin",
    "Foot": "Foot{}",
    "ToeBase": "Toe.{}",
}


def test_names_of_no_convention_are_guessed(stage: RigStage) -> None:
    rig = humanoids.mixamo(bpy)
    meant = rigs.detected(rig).joints
    new = {}
    for joint, bone in meant.items():
        for word, side in (("Left", "L"), ("Right", "R")):
            if word in bone:
                new[joint] = GUESSED[bone.split(word)[1]].format(side)
        new.setdefault(joint, GUESSED.get(bone, bone))
        rig.data.bones[bone].name = new[joint]
    new["left_ankle"], new["right_ankle"] = (
        rig.data.bones[new[f"{side}_ankle"]].name for side in ("left", "right")
    )
    found = rigs.detected(rig)
    assert found.name == "Guessed"
    assert found.joints == new


@pytest.fixture
def user_maps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(rigs, "user_folder", lambda create=False: tmp_path)
    return tmp_path


def test_presets_are_saved_and_found_again(stage: RigStage, user_maps: Path) -> None:
    """By the operators: detect, correct by hand, save; another rig of these names is then detected,
    and can load it.
    """
    rig = stage.build("odd")
    bpy.context.view_layer.objects.active = rig
    assert bpy.ops.dafnet.detect_rig() == {"FINISHED"}
    assert len(rig.dafnet_rig.rows) == 22
    for row in rig.dafnet_rig.rows:
        row.bone = humanoids.ODD.get(row.name, "")
    rig.dafnet_rig.root_bone = "Wurzel"
    assert bpy.ops.dafnet.save_rig_map(name="Otto's Rig") == {"FINISHED"}
    assert [file.suffix for file in user_maps.iterdir()] == [".json"]
    other = humanoids.odd(bpy)
    found = rigs.detected(other)
    assert (found.name, found.joints, found.root) == ("Otto's Rig", humanoids.ODD, "Wurzel")
    key = next(key for key, name, _ in rig_properties.presets(None, None) if name == "Otto's Rig")
    assert key.startswith("my_") and "mixamo" in {
        key for key, _, _ in rig_properties.presets(None, None)
    }
    bpy.context.view_layer.objects.active = other
    assert bpy.ops.dafnet.load_rig_map(preset=key) == {"FINISHED"}
    assert rig_properties.map_of(other).joints == humanoids.ODD
    (user_maps / "broken.json").write_text("{}", encoding="utf-8")
    assert rigs.detected(other).name == "Otto's Rig"
    with pytest.raises(InputError, match=r"'broken\.json'"):
        rigs.load_map(user_maps / "broken.json")


def test_the_panel_shows_a_row_for_each_joint(stage: RigStage) -> None:
    """And offers to bake; the list is there once bones were detected."""

    def called(layout: Layout) -> list[tuple[str, ...]]:
        return [
            (name, *(v for v in values if isinstance(v, str))) for name, values, _ in layout.calls
        ]

    rig = stage.build("vrm")
    bpy.context.view_layer.objects.active = rig
    drawn = called(drawn_by(DAFNET_PT_rig, bpy.context))
    assert ("operator", "dafnet.bake_to_rig") in drawn and not any(
        each[0] == "template_list" for each in drawn
    )
    bpy.ops.dafnet.detect_rig()
    rig.dafnet_rig.root_motion = "BONE"
    drawn = called(drawn_by(DAFNET_PT_rig, bpy.context))
    assert (
        any(each[0] == "template_list" for each in drawn)
        and ("prop_search", "root_bone", "bones") in drawn
    )
    rows = Layout()
    for row in rig.dafnet_rig.rows:
        DAFNET_UL_rig.draw_item(None, bpy.context, rows, rig.dafnet_rig, row, 0, None, "")
    assert called(rows).count(("prop_search", "bone", "bones")) == 22


def test_presets_lie_in_the_extensions_folder(stage: RigStage) -> None:
    folder = rigs.user_folder(create=True)
    assert folder.is_dir() and "dafnet" in folder.parts and folder.name == "rig_maps"
    assert rigs.load_map(rigs.map_files()["mixamo"]).name == "Mixamo"


def test_a_corrected_row_of_rigify_keeps_the_rest(stage: RigStage) -> None:
    """A control chosen by hand replaces the preset's, with its place; IK stays for the other limbs'
    controls only.
    """
    rig = stage.build("rigify")
    rig_properties.show_map(rig, rigs.detected(rig))
    assert rig_properties.map_of(rig) == rigs.detected(rig)
    rig.dafnet_rig.rows["left_wrist"].bone = "hand_tweak.L"
    changed = rig_properties.map_of(rig)
    assert (
        changed.place("left_wrist") == "hand_tweak.L"
        and changed.place("right_wrist") == "ORG-hand.R"
    )
    assert changed.limbs.keys() == {"right_arm", "left_leg", "right_leg"}


def test_the_panel_and_the_button(stage: RigStage) -> None:
    """One press bakes and reports; one undo takes it back. The character is the only one, the
    selected or the chosen one.
    """
    stage.play("walk")
    bpy.context.view_layer.objects.active = stage.ann
    assert not DAFNET_PT_rig.poll(bpy.context) and not bpy.ops.dafnet.bake_to_rig.poll()
    rig = stage.build("mixamo")
    bpy.context.view_layer.objects.active = rig
    assert DAFNET_PT_rig.poll(bpy.context) and bpy.ops.dafnet.bake_to_rig.poll()
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.dafnet.bake_to_rig() == {"FINISHED"}
    assert max(distances.mean() for distances in stage.errors("mixamo", rig).values()) < CENTIMETRE
    bpy.ops.ed.undo_push(message="Bake to Rig")
    bpy.ops.ed.undo()
    rig = bpy.data.objects["Mixamo"]
    assert rig.animation_data is None or rig.animation_data.action is None
    assert "Ann on Mixamo" not in bpy.data.actions

    ann = bpy.data.objects["Ann"]
    bob = create_character(bpy.context, "Bob")
    bob.select_set(False)
    rig = bpy.data.objects["Mixamo"]
    bpy.context.view_layer.objects.active = rig
    with pytest.raises(RuntimeError, match="several characters"):
        bpy.ops.dafnet.bake_to_rig()
    rig.dafnet_rig.character = ann
    assert bpy.ops.dafnet.bake_to_rig() == {"FINISHED"}
    rig.dafnet_rig.character = None
    ann.select_set(True)
    assert bpy.ops.dafnet.bake_to_rig() == {"FINISHED"}


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
    rig_properties.show_map(rig, stage.map(kind, rig))
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
    assert off[:, [7, 12, 13]].mean() < (2.0 if kind == "odd" else 1.0) * CENTIMETRE, (
        "head and wrists"
    )


def test_full_mode_refuses_what_it_does_not_know(stage: RigStage) -> None:
    rig = humanoids.odd(bpy)
    stage.ann.dafnet.upper_body_source = rig
    stage.ann.dafnet.mode = "FULL"
    settings = settings_of(stage.ann, stage.scene)
    with pytest.raises(InputError, match="'Odd' has no bone for the"):
        read_scene(bpy.context, settings)


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
        self.stage, self.rig, self.map = stage, rig, rigs.detected(rig)

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
                rig_reading.pose_matrices(evaluated, [self.map.place(name) for name in JOINTS])
            )
        return rig_reading.joints_of(self.rig, self.map, np.array(bodies), np.array(poses), 1.0)[0]


@pytest.mark.parametrize("rest", humanoids.RESTS)
@pytest.mark.parametrize("kind", ["mixamo", "unreal", "vrm"])
def test_the_rest_pose_does_not_matter(stage: RigStage, kind: str, rest: str) -> None:
    """Arms hanging or ahead, sitting, twisted, bent, leaning: limbs, trunk and head lie in the room
    as the character's.

    And FULL reads them back so.
    """
    stage.play("write")
    rig = stage.build(kind)
    humanoids.rested(bpy, rig, *humanoids.rest_pose(rest, rigs.detected(rig).joints))
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
    for part, off in seen_off(read, source).items():
        most = (
            0.1 if part in ("upper arms", "forearms", "elbows", "thighs", "shins", "knees") else 6.0
        )
        assert off.max() < most, f"{part} {off.mean():.1f} ({off.max():.1f})"
    way = [joints[:, 15] - joints[:, [1, 2]].mean(axis=1) for joints in (read, source)]
    size = np.linalg.norm(way[0], axis=1).max() / np.linalg.norm(way[1], axis=1).max()
    assert np.linalg.norm(way[0] - size * way[1], axis=1).max() < 4.0 * CENTIMETRE, (
        "the head over the hips"
    )


# mean degrees of arms, legs and trunk that the bakes may be off; proportions that differ are all
# that is left
REAL = {
    "mixamo_gltf_woman": (1.0, 4.0, 4.0),
    "mixamo_gltf_soldier": (1.0, 6.0, 4.0),
    "vrm_b": (1.0, 20.0, 5.0),
    "robot_gltf": (1.0, 13.0, 5.0),
    "chibi_gltf": (1.0, 28.0, 6.0),
}


@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize("take", ["walk", "sit", "write"])
def test_real_characters_keep_the_motions_shape(stage: RigStage, name: str, take: str) -> None:
    """And the report says what an eye sees."""
    file = SHARED / "rigs" / f"{name}.json"
    if not file.is_file():
        pytest.skip(f"needs the rest pose {file}")
    rig = humanoids.of_file(bpy, file)
    stage.play(take)
    baked = stage.bake(name, rig)
    assert baked.errors["ankles"][0] < CENTIMETRE, (
        "feet are on the floor, also those that hang on no leg"
    )
    step = 3
    off = seen_off(
        World(stage, rig).played(range(1, len(stage.take) + 1, step)), stage.take.joints[::step]
    )
    arms, legs, trunk = REAL[name]
    for parts, most in (
        (("upper arms", "forearms", "elbows"), arms),
        (("thighs", "shins", "knees"), legs),
        (("trunk", "head"), trunk),
    ):
        for part in parts:
            assert off[part].mean() < most, f"{part} {off[part].mean():.1f} ({off[part].max():.1f})"
    for limb, parts in (
        ("arm", ("upper arms", "forearms", "elbows")),
        ("leg", ("thighs", "shins", "knees")),
    ):
        told = max(baked.angles[f"{side} {limb}"][0] for side in ("left", "right"))
        assert told > max(off[part].mean() for part in parts) - 2.5, (
            "the report is no better than what is seen"
        )


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
    humanoids.rested(bpy, rig, *humanoids.rest_pose(rest, rigs.detected(rig).joints))
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
    known = rigs.detected(rig)
    joints = {
        joint: bone
        for joint, bone in known.joints.items()
        if "spine" not in joint and "collar" not in joint
    }
    rig_properties.show_map(rig, type(known)("Mine", joints=joints))
    rig.pose.bones["mixamorig:Spine1"].rotation_quaternion = (0.383, 0.0, 0.924, 0.0)
    assert "'Mixamo' is copied, but the trunk by" in warnings() and "degrees off" in warnings()


def test_a_bake_that_is_off_is_warned_about(stage: RigStage) -> None:
    """Long arms: the hands land, so the elbows are bent, and the report names the arms in
    degrees.
    """
    stage.play("walk")
    rig = stage.build("mixamo", arms=1.2)
    bpy.context.view_layer.objects.active = rig
    messages: list[tuple[set[str], str]] = []

    class Reporter:
        def report(self, kind: set[str], message: str) -> None:
            messages.append((kind, message))

    DAFNET_OT_bake_to_rig.run(Reporter(), bpy.context)
    warned = [message for kind, message in messages if kind == {"WARNING"}]
    assert len(warned) == 1 and "left arm by" in warned[0] and "degrees" in warned[0]
    assert "wrists 0.0" in messages[-1][1] and "left arm" in messages[-1][1], (
        "places and angles are told together"
    )
    messages.clear()
    bpy.context.view_layer.objects.active = stage.build("mixamo")
    DAFNET_OT_bake_to_rig.run(Reporter(), bpy.context)
    assert [kind for kind, _ in messages] == [{"INFO"}]
