"""What a bake does to the rig and to the file, what it refuses, and what it reports."""

from collections.abc import Generator
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender import compat
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import create_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import add_take
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.baker import bake
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import baker, detection
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig.eyes import eyes_of
from bl_ext.user_default.dafnet.dafnet_addon.core.cleanup import CleanUp
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.generate import generate
from bl_ext.user_default.dafnet.dafnet_addon.core.progress import run_to_end
from bl_ext.user_default.dafnet.dafnet_addon.core.solids import Scene
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Controls
from bl_ext.user_default.dafnet.dafnet_addon.core.weights import load_weights
from bl_ext.user_default.dafnet.operators.bake_to_rig import DAFNET_OT_bake_to_rig
from bl_ext.user_default.dafnet.panels.rig import DAFNET_PT_rig

from kit.rig_stage import RigStage, made_takes

CENTIMETRE = 0.01


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
    shoulder, wrist = stage.heads(stage.ann, ["right_shoulder", "right_wrist"], 20)
    assert np.linalg.norm(wrist - stage.take.joints[19, 21]) > 0.2
    theirs = np.subtract(*stage.heads(rig, ["mixamorig:RightHand", "mixamorig:RightArm"], 20))
    along = (wrist - shoulder) @ theirs / np.linalg.norm(wrist - shoulder) / np.linalg.norm(theirs)
    assert along > np.cos(np.radians(1.0)), "a free arm lies as it was edited"


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
    detected = detection.detect_map(rig)
    follows = {kind: rows for kind, rows in detected.settings.items() if kind != "BOTH"}
    rig_map = type(detected)(**{**vars(detected), "settings": follows})
    baker.bake_onto_rig(bpy.context, stage.ann, rig, rig_map)
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
            baker.bake_onto_rig(
                bpy.context, stage.ann, rig, rig_map or detection.detect_map(rig), **options
            )
        assert str(caught.value).count(". ") == 0
        assert set(bpy.data.actions) == actions and rig.animation_data is None
        assert [bone.matrix_basis for bone in rig.pose.bones] == pose

    detected = detection.detect_map(rig)
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


def test_a_bake_that_is_stopped_anywhere_changes_nothing(stage: RigStage) -> None:
    """Esc while the motion is read; at each step the frame is the user's."""
    stage.play("walk")
    rig = stage.build("mixamo")
    stage.scene.frame_set(7)
    before, shares = stage.state(), []
    while True:
        steps = baker.bake_onto_rig.steps(bpy.context, stage.ann, rig, stage.map("mixamo", rig))
        try:
            for _ in range(len(shares) + 1):
                share = next(steps)
        except StopIteration as done:
            assert rig.animation_data.action == done.value.action
            break
        shares.append(share)
        assert stage.state() == before
        steps.close()
        assert stage.state() == before
    assert len(shares) > 2 and shares == sorted(shares) and shares[-1] < 1.0
    assert stage.scene.frame_current == 7


def test_what_changes_while_a_bake_reads_is_seen(stage: RigStage) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")

    def begun() -> Generator[float, None, Any]:
        steps = baker.bake_onto_rig.steps(bpy.context, stage.ann, rig, stage.map("mixamo", rig))
        next(steps)
        return steps

    steps = begun()
    rig.data.pose_position = "REST"
    with pytest.raises(InputError, match="shows its rest position"):
        run_to_end(steps)
    rig.data.pose_position = "POSE"
    assert rig.animation_data is None or rig.animation_data.action is None

    for gone in (rig, stage.ann):
        steps, actions = begun(), len(bpy.data.actions)
        bpy.data.objects.remove(gone)
        with pytest.raises(InputError, match="deleted while the motion was read; bake again"):
            run_to_end(steps)
        assert len(bpy.data.actions) == actions
        rig = stage.build("mixamo")


def test_a_bake_that_is_off_is_warned_about(stage: RigStage) -> None:
    """Long arms whose hand is held at a board: it stays there, so the elbow is bent, and the report
    names the arm in degrees.
    """
    stage.play("write")
    rig = stage.build("mixamo", arms=1.25)
    bpy.context.view_layer.objects.active = rig
    messages: list[tuple[set[str], str]] = []

    class Reporter:
        steps, report_result = DAFNET_OT_bake_to_rig.steps, DAFNET_OT_bake_to_rig.report_result

        def report(self, kind: set[str], message: str) -> None:
            messages.append((kind, message))

    DAFNET_OT_bake_to_rig.run(Reporter(), bpy.context)
    warned = [message for kind, message in messages if kind == {"WARNING"}]
    assert len(warned) == 1 and "right arm by" in warned[0] and "degrees" in warned[0]
    assert "wrists 0.0" in messages[-1][1] and "right arm" in messages[-1][1], (
        "places and angles are told together"
    )

    messages.clear()
    rig = bpy.context.view_layer.objects.active = stage.build("mixamo", legs=0.8)
    DAFNET_OT_bake_to_rig.run(Reporter(), bpy.context)
    warned = [message for kind, message in messages if kind == {"WARNING"}]
    assert "another size, and scaled by 0.8" in warned[0], (
        "what misses its seat is not called right"
    )

    stage.play("walk")
    messages.clear()
    bpy.context.view_layer.objects.active = stage.build("mixamo")
    DAFNET_OT_bake_to_rig.run(Reporter(), bpy.context)
    assert [kind for kind, _ in messages] == [{"INFO"}]


def test_the_character_is_made_as_large_as_the_rig(stage: RigStage) -> None:
    """Whatever their objects' scales; then nothing is scaled any more. A scale that is locked or
    keyed is left.
    """
    rig = stage.build("mixamo", legs=0.8)
    rig.scale = rig.scale * 1.1
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = rig
    assert bpy.ops.dafnet.size_as_rig() == {"FINISHED"}
    assert stage.ann.scale[0] == pytest.approx(0.88, abs=0.02)
    stage.takes = made_takes(stage.ann.scale[0])
    stage.play("walk")
    assert stage.bake("mixamo", rig).ratio == 1.0

    stage.ann.lock_scale = (True, False, False)
    before = tuple(stage.ann.scale)
    rig.scale = rig.scale * 1.2
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="locked, keyed or driven"):
        bpy.ops.dafnet.size_as_rig()
    assert tuple(stage.ann.scale) == before

    stage.ann.lock_scale = (False, False, False)
    stage.ann.keyframe_insert("scale", frame=1)
    with pytest.raises(RuntimeError, match="locked, keyed or driven"):
        bpy.ops.dafnet.size_as_rig()
    assert tuple(stage.ann.scale) == before
    stage.play("walk")
    assert bpy.ops.dafnet.size_as_rig() == {"FINISHED"}, "a take leaves the scale alone"


def _with_eyes(rig: Any, names: tuple[str, str]) -> None:
    """Give a Mixamo rig eyes whose bones point anywhere."""
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    head = rig.data.edit_bones["mixamorig:Head"]
    middle, size = np.array(head.head), head.length
    for side, name in zip((1.0, -1.0), names, strict=True):
        eye = rig.data.edit_bones.new(name)
        eye.parent = head
        eye.head = middle + np.array([0.3 * side, 0.3, 0.4]) * size
        eye.tail = np.array(eye.head) + np.array([0.1, 0.2 * side, 0.4]) * size
    bpy.ops.object.mode_set(mode="OBJECT")


def _looks(rig: Any, name: str, frame: int, ahead: np.ndarray) -> np.ndarray:
    """Where (3,) an eye looks in the world, that looked ``ahead`` at rest, in the rig's space."""
    bpy.context.scene.frame_set(frame)
    shown = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
    rest = np.array(rig.data.bones[name].matrix_local, float)[:3, :3]
    pose = np.array(shown.matrix_world @ shown.pose.bones[name].matrix, float)[:3, :3]
    looks = pose @ rest.T @ ahead
    return looks / np.linalg.norm(looks)


@pytest.mark.parametrize("names", [("mixamorig:LeftEye", "mixamorig:RightEye"), ("eye.L", "eye.R")])
def test_eyes_look_at_what_the_head_does_not_turn_to_far_enough(
    stage: RigStage, names: tuple[str, str]
) -> None:
    still = np.tile(np.eye(4), (60, 1, 1))
    behind = np.array([0.3, -4.0, 1.6])
    aside = 4.0 * np.array([-np.sin(1.9), np.cos(1.9), 0.4])
    for place, left in ((aside, 15.0), (np.array([0.3, 3.0, 1.5]), 0.0), (behind, None)):
        controls = Controls(fps=30, root=still, look_at=np.tile(place, (60, 1)))
        take = generate(Scene(()), controls, load_weights(), clean_up=CleanUp(feet=1.0))
        action = bake(take, stage.ann, 1, "looks")
        add_take(stage.ann, action, take, controls, 1)
        rig = stage.build("mixamo")
        ahead = np.linalg.inv(np.array(rig.matrix_world)[:3, :3]) @ [0.0, -1.0, 0.0]
        _with_eyes(rig, names)
        stage.take = take
        stage.bake("mixamo", rig)
        for name in names:
            (eye,) = stage.heads(rig, [name], 55)
            away = (place - eye) / np.linalg.norm(place - eye)
            astray = np.degrees(np.arccos(np.clip(_looks(rig, name, 55, ahead) @ away, -1.0, 1.0)))
            shown = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
            turn = shown.pose.bones[name].matrix_basis.to_quaternion().angle
            assert np.degrees(turn) < 45.0, "within what eyes can"
            if left is not None:
                assert astray < 6.0
                assert np.degrees(turn) > left, "the head alone does not come so far"


def test_eyes_that_nothing_is_looked_at_with_or_that_others_move_have_no_keys(
    stage: RigStage,
) -> None:
    stage.play("walk")
    rig = stage.build("mixamo")
    _with_eyes(rig, ("LeftEye", "RightEye"))
    assert eyes_of(rig, stage.map("mixamo", rig)) == ["LeftEye", "RightEye"]
    stage.bake("mixamo", rig)
    assert not [c for c in compat.action_curves(rig) if "Eye" in c.data_path]
    for name in ("J_Adj_R_FaceEye", "CC_Base_R_Eye", "right_eye_smplhf", "DEF-eye.R", "eye_r"):
        rig.data.bones["RightEye"].name = name
        assert len(eyes_of(rig, stage.map("mixamo", rig))) == 2, name
        rig.data.bones[name].name = "RightEye"
    for name in ("LeftEyeLid", "eyebrow.L", "eyes", "Eyelash_R"):
        rig.data.bones["RightEye"].name = name
        assert eyes_of(rig, stage.map("mixamo", rig)) == [], name
        rig.data.bones[name].name = "RightEye"
    rig.pose.bones["LeftEye"].constraints.new("DAMPED_TRACK")
    assert eyes_of(rig, stage.map("mixamo", rig)) == []
