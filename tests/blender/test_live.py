"""Live: the character follows what is dragged, what is recorded becomes a take, and everything else
is put back, whatever comes between.
"""

import math
from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import stored_take
from bl_ext.user_default.dafnet.dafnet_addon.blender.live.keeping import keep_clips
from bl_ext.user_default.dafnet.dafnet_addon.blender.live.listening import (
    begin_live,
    end_live,
    live_state,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.live.session import LiveSession, Over
from bl_ext.user_default.dafnet.dafnet_addon.blender.live.trial import Trial
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay import contents
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.progress import run_to_end
from bl_ext.user_default.dafnet.operators.live import met_floor
from bl_ext.user_default.dafnet.panels.main import DAFNET_PT_character, DAFNET_PT_shot

from kit.panels import drawn_by
from kit.stage import Stage, key, keys_of

HEIGHT = 1.7


@pytest.fixture
def shot(blender: ModuleType) -> Stage:
    """A character before a chair, in a scene of 24 frames a second."""
    made = Stage(height=HEIGHT, fps=24, frames=(1, 48))
    made.seat("Chair", location=(0, 2.0, 0))
    made.box("Chair Back", (-0.25, 0.2, 0.45), (0.25, 0.25, 0.95), location=(0, 2.0, 0))
    made.scene.frame_set(5)
    return made


class Played:
    """A session that is stepped by a clock of its own, as the operator's timer steps it."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.session = LiveSession(bpy.context, stage.ann)
        self.session.busy = math.inf
        self.state = begin_live(self.session)
        self.clock = 0.0
        self.session.tick(bpy.context, self.clock)

    def run(self, seconds: float, place: tuple[float, float] | None = None) -> list[np.ndarray]:
        """Let time pass, the root dragged to a ``place`` within the first half second; where the
        pelvis is after each frame.
        """
        start = np.array(self.stage.root.location)
        seen = []
        for k in range(round(seconds * 30)):
            if place is not None:
                share = min(1.0, (k + 1) / 15)
                self.stage.root.location[:2] = (1 - share) * start[:2] + share * np.array(place)
            self.clock += 1 / 30 + 1e-9
            bpy.context.view_layer.update()
            self.session.tick(bpy.context, self.clock)
            seen.append(self.pelvis())
        return seen

    def pelvis(self) -> np.ndarray:
        bpy.context.view_layer.update()
        ann = self.stage.ann
        return np.array(ann.matrix_world @ ann.pose.bones["pelvis"].head)


@pytest.fixture
def ended() -> object:
    """No session outlives a test."""
    yield
    end_live()


def test_it_follows_the_root_and_puts_all_back(shot: Stage, ended: object) -> None:
    shot.walk((1, 0.0), (40, 1.0))
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    shot.scene.frame_set(5)
    before, playing = shot.state(), shot.ann.animation_data.action
    undoes = bpy.context.preferences.edit.use_global_undo
    played = Played(shot)
    assert not bpy.context.preferences.edit.use_global_undo
    assert shot.ann.animation_data.action is None

    way = np.array(played.run(5.0, (2.0, 0.0)))
    assert np.linalg.norm(way[-1][:2] - (2.0, 0.0)) < 0.15, "it has come to the root"
    speed = np.linalg.norm(np.diff(way[:, :2], axis=0), axis=1) * 30
    assert speed.max() < 2.0, "it walks, though the root jumped"
    end_live()
    assert shot.state() == before and shot.ann.animation_data.action == playing
    assert bpy.context.preferences.edit.use_global_undo == undoes
    assert live_state() is None


def test_it_sits_on_a_chair_that_the_root_is_dragged_onto_and_gets_up(
    shot: Stage, ended: object
) -> None:
    played = Played(shot)
    stands = played.pelvis()[2]
    sits = np.array(played.run(9.0, (0.0, 2.05)))[-1]
    assert abs(sits[2] - 0.59 * HEIGHT / 1.75) < 0.06, f"the pelvis is at {sits[2]:.2f}"
    assert np.linalg.norm(sits[:2] - (0.0, 2.0)) < 0.25
    facing = shot.ann.matrix_world.to_3x3() @ bpy.context.scene.cursor.location.__class__(
        (0, -1, 0)
    )
    assert facing.y < -0.9, "its back is at the chair's back"
    stood = np.array(played.run(5.0, (1.0, 0.0)))[-1]
    assert abs(stood[2] - stands) < 0.06


def test_a_dragged_hand_is_reached_for_and_let_go(shot: Stage, ended: object) -> None:
    hand = shot.own.hand_right
    played = Played(shot)
    played.run(0.5)
    hand.location = 0.3, 0.35, 1.45
    played.run(1.5)
    wrist = shot.ann.matrix_world @ shot.ann.pose.bones["right_wrist"].head
    assert (wrist - hand.location).length < 0.08
    played.run(4.0, (0.0, -2.0))
    wrist = shot.ann.matrix_world @ shot.ann.pose.bones["right_wrist"].head
    assert (wrist - hand.location).length > 1.0, "it walks away"
    assert not played.session.body.frame.targets


def test_recorded_is_a_take_that_can_be_generated_again(shot: Stage, ended: object) -> None:
    key(shot.root, "location", (1, (0.0, 0.0, 0.0)), (20, (0.5, 0.0, 0.0)))
    own = shot.root.animation_data.action
    played = Played(shot)
    played.run(0.5)
    played.session.record()
    seen = np.array(played.run(4.0, (1.5, 0.0)))
    shot.own.hand_right.location = 1.75, 0.3, 1.3
    seen = np.concatenate([seen, played.run(1.5)])
    played.session.stop_recording()
    end_live()
    (result,) = run_to_end(keep_clips(played.session))

    take, controls = stored_take(shot.ann.animation_data.action)
    assert result.action == shot.ann.animation_data.action == shot.own.takes[0].action
    assert len(take) == len(controls) == 1 + int((len(seen) - 1) * 24 / 30)
    assert own.use_fake_user and shot.root.animation_data.action != own
    assert keys_of(shot.root)["location", 0].shape == (len(take), 2)
    assert shot.own.mode == "EE" and controls.mode == "EE"
    assert shot.scene.frame_end >= len(take) and shot.scene.frame_current == 5

    # What plays is what was played, but for the clean-up with its look ahead.
    for frame in range(0, len(take), 10):
        shot.scene.frame_set(1 + frame)
        now = seen[min(len(seen) - 1, round(frame / 24 * 30))]
        assert np.linalg.norm(played.pelvis() - now) < 0.06
    assert bpy.ops.dafnet.clean_again() == {"FINISHED"}
    again = shot.read(frame_start=1, frame_end=len(take)).controls
    assert np.abs(again.root - controls.root).max() < 1e-3
    assert np.nanmax(np.abs(again.hand_right - controls.hand_right)[-20:]) < 1e-3
    assert np.abs(again.hand_right_influence - controls.hand_right_influence).max() < 0.02
    assert bpy.ops.dafnet.generate() == {"FINISHED"}


def test_late_ticks_lose_no_time(shot: Stage, ended: object) -> None:
    played = Played(shot)
    session = played.session
    assert session.tick(bpy.context, 0.2 + 1e-6) == 6, "all that were due are made"
    assert session.tick(bpy.context, 10.0) == 15 and session.lost == 279, "and then no more"
    assert session.tick(bpy.context, 10.0) == 0
    assert session.tick(bpy.context, 10.04) == 1
    session.busy = 1e-6
    assert session.tick(bpy.context, 10.24) == 1 and session.lost == 284, "Blender is not kept busy"


def test_furniture_that_is_moved_is_seen_where_it_is(shot: Stage, ended: object) -> None:
    played = Played(shot)
    played.run(0.2)
    bpy.data.objects["Chair"].location.x = 3.0
    played.run(1.0)
    (seat, _) = played.session.furniture.scene.solids
    assert abs(np.asarray(seat.matrix)[0, 3] - 3.0) < 1e-6
    bpy.data.objects.remove(bpy.data.objects["Chair"])
    bpy.data.objects.remove(bpy.data.objects["Chair Back"])
    with pytest.raises(Over, match="Live ended"):
        played.run(2.0)


def test_what_was_drawn_is_walked_along(shot: Stage, ended: object) -> None:
    played = Played(shot)
    for x in np.linspace(0.2, 2.5, 30):
        played.session.way.add(np.array([x, 0.3 * np.sin(3 * x)]))
    (line,) = contents.drawn_way(bpy.context, played.session.way_left())
    assert len(line.lines) == 30 and np.abs(line.lines[..., 2]).max() < 0.02
    played.run(4.0)
    assert not played.session.way and not len(played.session.way_left())
    assert np.linalg.norm(np.array(shot.root.location)[:2] - (2.5, 0.3 * np.sin(7.5))) < 0.06
    assert np.linalg.norm(played.pelvis()[:2] - np.array(shot.root.location)[:2]) < 0.2
    played.session.way.add(np.array([-2.0, 0.0]))
    played.run(0.3)
    shot.root.location = (0.0, -1.0, 0.0)
    played.run(0.2)
    assert not played.session.way, "who drags the root ends the way"


def test_what_ends_it(shot: Stage, ended: object, tmp_path) -> None:
    before = shot.state()
    played = Played(shot)
    played.run(0.3, (1.0, 0.0))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert live_state() is None and "saved" in str(played.state.why)
    assert shot.state() == before
    for collection in shot.head.users_collection:
        collection.objects.unlink(shot.head)
    shot.own.mode = "EE"
    with pytest.raises(InputError, match="head' 'Ann Head' is not in the scene"):
        LiveSession(bpy.context, shot.ann)
    shot.own.mode = "FREE"

    played = Played(shot)
    assert "head" not in played.session.targets
    played.run(0.2, (1.0, 0.0))
    bpy.ops.object.mode_set(mode="OBJECT")
    shot.select(bpy.data.objects["Chair"])
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(Over, match="object and pose mode"):
        played.run(0.2)
    bpy.ops.object.mode_set(mode="OBJECT")
    end_live()

    bpy.context.scene.tool_settings.use_keyframe_insert_auto = True
    played = Played(shot)
    assert not bpy.context.scene.tool_settings.use_keyframe_insert_auto, "drags are not keyed"
    played.session.record()
    played.run(0.2)
    assert "temperature" in drawn_by(DAFNET_PT_character, bpy.context).words()
    bpy.data.objects.remove(shot.root)
    assert "temperature" not in drawn_by(DAFNET_PT_character, bpy.context).words()
    with pytest.raises(Over, match="Live ended"):
        played.session.tick(bpy.context, played.clock + 1.0)
    end_live()
    assert bpy.context.scene.tool_settings.use_keyframe_insert_auto
    with pytest.raises(InputError, match="its character is gone"):
        run_to_end(keep_clips(played.session))
    assert [tuple(bone.rotation_quaternion) for bone in shot.ann.pose.bones] == [(1, 0, 0, 0)] * 22

    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    ann = bpy.data.objects["Ann"]
    session = LiveSession(bpy.context, ann)
    state = begin_live(session)
    session.tick(bpy.context, 0.0)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert live_state() is None and "opened" in str(state.why)


def test_a_bone_that_is_renamed_ends_it_and_the_rest_is_put_back(
    shot: Stage, ended: object
) -> None:
    undoes, place = bpy.context.preferences.edit.use_global_undo, tuple(shot.root.location)
    played = Played(shot)
    played.run(0.3, (1.0, 0.0))
    shot.ann.data.bones["left_knee"].name = "Knee"
    with pytest.raises(Over, match="'left_knee' was renamed or removed"):
        played.run(0.1)
    shot.scene.frame_set(9)
    end_live()
    assert tuple(shot.root.location) == place and shot.scene.frame_current == 5
    assert tuple(shot.ann.pose.bones["left_hip"].rotation_quaternion) == (1, 0, 0, 0)
    assert bpy.context.preferences.edit.use_global_undo == undoes


def test_a_step_back_that_fails_keeps_no_other_from_being_taken(shot: Stage, ended: object) -> None:
    undoes, place = bpy.context.preferences.edit.use_global_undo, tuple(shot.root.location)
    played = Played(shot)
    played.run(0.3, (1.0, 0.0))
    played.session._undo.insert(0, {}.popitem)
    with pytest.raises(KeyError):
        end_live()
    assert tuple(shot.root.location) == place
    assert bpy.context.preferences.edit.use_global_undo == undoes


def test_what_is_renamed_is_still_led_and_recorded(shot: Stage, ended: object) -> None:
    played = Played(shot)
    played.session.record()
    played.run(0.3)
    for named in (shot.ann, shot.root, shot.scene, shot.furniture, shot.own.hand_right):
        named.name += " renamed"
    bpy.data.objects["Chair"].location.x = 3.0
    played.run(1.0, (0.5, 0.0))
    (seat, _) = played.session.furniture.scene.solids
    assert abs(np.asarray(seat.matrix)[0, 3] - 3.0) < 1e-6
    end_live()
    (result,) = run_to_end(keep_clips(played.session))
    assert shot.ann.animation_data.action == result.action


def test_a_free_recording_takes_nothing_over_from_one_that_reached(
    shot: Stage, ended: object
) -> None:
    hand, at_first = shot.own.hand_right, tuple(shot.own.hand_right.location)
    played = Played(shot)
    played.session.record()
    played.run(0.3)
    hand.location = 0.3, 0.35, 1.45
    played.run(0.5)
    played.session.stop_recording()
    hand.location = at_first
    played.run(2.0)
    played.session.record()
    played.run(0.5)
    end_live()
    reached, free = run_to_end(keep_clips(played.session))
    assert [stored_take(each.action)[1].mode for each in (reached, free)] == ["EE", "FREE"]
    assert shot.ann.animation_data.action == free.action
    paths = {path for path, _ in keys_of(shot.ann)}
    assert not [path for path in paths if path.endswith("_influence")]
    assert keys_of(shot.ann)["dafnet.mode", 0].shape == (1, 2)
    shot.scene.frame_set(7)
    assert shot.own.mode == "FREE"


def test_a_target_keeps_how_it_was_turned(shot: Stage, ended: object) -> None:
    hand = shot.own.hand_right
    key(hand, "location", (1, (0.3, 0.2, 0.9)), (20, (0.3, 0.2, 1.0)))
    key(hand, "rotation_euler", (1, (0.0, 0.0, 0.0)), (20, (0.0, 0.5, 1.0)))
    turned = {name: keys for name, keys in keys_of(hand).items() if name[0] == "rotation_euler"}
    played = Played(shot)
    played.session.record()
    played.run(0.3)
    hand.location = 0.3, 0.35, 1.45
    played.run(0.5)
    end_live()
    run_to_end(keep_clips(played.session))
    keys = keys_of(hand)
    assert len(keys["location", 0]) > 10, "it is keyed as it led"
    assert len(turned) == 3
    for name, those in turned.items():
        assert np.array_equal(keys[name], those)


def test_the_action_that_waits_is_not_purged_and_may_be_renamed(shot: Stage, ended: object) -> None:
    key(shot.ann, "location", (1, (0.0, 0.0, 0.0)), (20, (0.5, 0.0, 0.0)))
    own = shot.ann.animation_data.action
    own.use_fake_user = False
    played = Played(shot)
    played.run(0.1)
    bpy.data.orphans_purge()
    own.name = "Walks"
    end_live()
    assert shot.ann.animation_data.action == own == bpy.data.actions["Walks"]
    assert not own.use_fake_user


def test_what_was_recorded_is_in_the_file_that_is_saved(
    shot: Stage, ended: object, tmp_path
) -> None:
    played = Played(shot)
    played.session.record()
    played.run(0.5, (0.5, 0.0))
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    (result,) = played.state.kept
    name = result.action.name
    bpy.ops.wm.open_mainfile(filepath=path)
    ann = bpy.data.objects["Ann"]
    assert ann.animation_data.action == ann.dafnet.takes[0].action == bpy.data.actions[name]
    assert len(ann.dafnet.takes) == 1


def test_a_recording_that_cannot_be_kept_stops_no_saving(
    shot: Stage, ended: object, tmp_path
) -> None:
    played = Played(shot)
    played.session.record()
    played.run(0.2)
    bpy.data.objects.remove(shot.root)
    assert bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend")) == {"FINISHED"}
    assert "its character is gone" in str(played.state.why) and played.state.kept == ()


def test_a_way_is_drawn_where_the_mouse_meets_the_floor(blender: ModuleType) -> None:
    eye, down = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.6, -0.8])
    for in_perspective in (True, False):
        place = met_floor(eye, down, 1.0, in_perspective=in_perspective)
        assert np.abs(place - (1.0, 3.5)).max() < 1e-9
        level = np.array([0.0, 1.0, 0.0])
        assert met_floor(eye, level, 1.0, in_perspective=in_perspective) is None
    assert met_floor(eye, -down, 1.0, in_perspective=True) is None, "it looks at the sky"
    behind = met_floor(eye - (0.0, 0.0, 4.0), down, 1.0, in_perspective=False)
    assert np.abs(behind - (1.0, 0.5)).max() < 1e-9, "an orthographic eye may be below"


def test_what_it_cannot_lead_is_said_and_nothing_changes(shot: Stage, ended: object) -> None:
    before = shot.state()
    with pytest.raises(RuntimeError, match="needs a window"):
        bpy.ops.dafnet.live()
    shot.own.mode = "FULL"
    with pytest.raises(InputError, match="FREE or EE"):
        LiveSession(bpy.context, shot.ann)
    shot.own.mode = "FREE"
    shot.own.root = None
    with pytest.raises(InputError, match="has no root"):
        LiveSession(bpy.context, shot.ann)
    shot.own.root = shot.root
    assert shot.state() == before

    played = Played(shot)
    for operator in (bpy.ops.dafnet.generate, bpy.ops.dafnet.walk_to):
        assert not operator.poll()
    shot.root.lock_location[0] = False
    shot.root.rotation_mode = "QUATERNION"
    with pytest.raises(RuntimeError, match="rotation mode"):
        bpy.ops.dafnet.live_record()
    shot.root.rotation_mode = "XYZ"
    assert bpy.ops.dafnet.live_record() == {"FINISHED"} and played.session.recording
    assert bpy.ops.dafnet.live_draw() == {"FINISHED"} and played.state.draws
    played.run(0.2)
    words = drawn_by(DAFNET_PT_character, bpy.context).words()
    assert "dafnet.live" in words and "dafnet.live_record" in words
    assert not DAFNET_PT_shot.poll(bpy.context)
    end_live()
    assert not bpy.ops.dafnet.live_record.poll()
    assert DAFNET_PT_shot.poll(bpy.context)
    assert "dafnet.live" in drawn_by(DAFNET_PT_shot, bpy.context).words()


@pytest.mark.slow
def test_a_hand_in_a_hurry_in_a_full_room(blender: ModuleType, ended: object) -> None:
    """What ``dafnet bench live`` does for five minutes."""
    trial = Trial()
    assert trial.triangles > 50_000
    trial.begin()
    bones = bpy.data.objects["Ann"].pose.bones
    for k in range(1, 151):
        trial.drag(k / 30 + 1e-6)
        assert trial.tick(k / 30 + 1e-6) == 1
    assert np.isfinite(trial.session.body.frame.joints).all()
    assert tuple(bones["left_knee"].rotation_quaternion) != (1, 0, 0, 0)
    trial.end()
    assert tuple(bones["left_knee"].rotation_quaternion) == (1, 0, 0, 0)
