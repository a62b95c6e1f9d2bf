"""Takes in Blender: listed, judged, varied, gone on from, cleaned again, and found when the file is
opened again.
"""

from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.properties import _is_take
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import (
    PACKED,
    frames_of,
    stored_take,
    takes_of,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay.contents import drawings
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.core import drawing
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.progress import run_to_end
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import END_EFFECTORS, UPPER

from kit.stage import Stage


class Shot(Stage):
    """A character that walks 1.2 m in a second and a half past a box."""

    def __init__(self) -> None:
        super().__init__(fps=30, frames=(11, 55))
        self.box("Box", (-0.25, -0.25, -0.25), (0.25, 0.25, 0.25), location=(0.7, 0.6, 0.25))
        self.walk((11, 0.0), (55, 1.2))

    def choose(self) -> None:
        bpy.context.view_layer.objects.active = self.ann

    def listed(self) -> list[Any]:
        return takes_of(self.ann)

    def motion(self, action: Any) -> np.ndarray:
        """Joints (T, 22, 3) that the stored take has."""
        return stored_take(action)[0].joints


@pytest.fixture
def shot(blender: ModuleType) -> Shot:
    return Shot()


def test_several_takes_in_one_go_are_listed_and_the_first_plays(shot: Shot) -> None:
    own = shot.ann.dafnet
    own.take_count, own.seed = 3, 7
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    takes = shot.listed()
    assert [(a.dafnet.seed, a.dafnet.temperature) for a in takes] == [(7, 0.0), (8, 1.0), (9, 1.0)]
    assert shot.ann.animation_data.action == takes[0] and own.active_take == 0
    assert all(
        a.use_fake_user and a.dafnet.frame_start == 11 and frames_of(a) == (11, 55) for a in takes
    )
    assert takes[0].dafnet.log_likelihood > takes[1].dafnet.log_likelihood
    assert (
        takes[0].dafnet.sliding <= takes[0].dafnet.raw_sliding and takes[0].dafnet.miss_cm == -1.0
    ), "there are no targets"
    assert np.abs(shot.played() - shot.motion(takes[0])).max() < 2e-3
    assert np.abs(shot.motion(takes[1]) - shot.motion(takes[2])).max() > 0.02


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_figures_are_centimetres_of_the_character_and_its_scene(
    blender: ModuleType, unit: float
) -> None:
    child = Stage(height=1.2, fps=30, frames=(1, 40), unit=unit, furnished=False)
    child.own.mode, child.own.reach_targets = "EE", 0.0
    targets = {"head": (0.1, 0.1, 1.0), "hand_left": (-0.4, 0.3, 0.9), "hand_right": (0.3, 0.4, 1)}
    for name, place in targets.items():
        getattr(child.own, name).location = np.array(place) / unit
    bpy.context.view_layer.update()
    bpy.ops.dafnet.generate()
    (action,) = takes_of(child.ann)
    ends = [END_EFFECTORS[name] for name in targets]
    off = np.linalg.norm(stored_take(action)[0].joints[:, ends] - [*targets.values()], axis=-1)
    assert action.dafnet.miss_cm == pytest.approx(100.0 * off.mean(), rel=0.02)


def test_takes_are_played_judged_and_renamed_and_none_is_lost(shot: Shot) -> None:
    ops, own = bpy.ops.dafnet, shot.ann.dafnet
    mine = bpy.data.actions.new("Mine")
    shot.ann.animation_data_create().action = mine
    own.take_count = 3
    ops.generate()
    one, two, three = shot.listed()
    assert mine.use_fake_user and "Mine" in bpy.data.actions
    ops.play_take(index=2)
    assert shot.ann.animation_data.action == three and own.active_take == 2
    assert np.abs(shot.played() - shot.motion(three)).max() < 2e-3
    ops.play_take(step="NEXT")
    assert shot.ann.animation_data.action == one
    ops.play_take(step="PREVIOUS")
    assert shot.ann.animation_data.action == three
    three.name, three.dafnet.accepted = "The one", True
    own.active_take = 1
    ops.reject_take()
    assert shot.listed() == [one, three] and not two.use_fake_user and two.name in bpy.data.actions
    ops.keep_accepted()
    assert (
        shot.listed() == [three]
        and shot.ann.animation_data.action == three
        and three.name == "The one"
    )
    three.dafnet.accepted = False
    with pytest.raises(RuntimeError, match="No take is accepted"):
        ops.keep_accepted()
    ops.reject_take()
    assert not shot.listed() and not ops.play_take.poll() and not ops.reject_take.poll()


def test_rejecting_the_take_that_plays_plays_another(shot: Shot) -> None:
    shot.ann.dafnet.take_count = 2
    bpy.ops.dafnet.generate()
    one, two = shot.listed()
    bpy.ops.dafnet.reject_take()
    assert (
        shot.ann.animation_data.action == two
        and shot.listed() == [two]
        and one.name in bpy.data.actions
    )


def test_takes_stay_as_they_are_while_a_strip_is_edited(shot: Shot) -> None:
    own = shot.ann.dafnet
    own.take_count = 2
    bpy.ops.dafnet.generate()
    one, two = shot.listed()
    two.dafnet.accepted = True
    own.active_take = 0
    bpy.ops.dafnet.take_to_nla()
    data = shot.ann.animation_data
    data.nla_tracks.active = data.nla_tracks[0]
    data.nla_tracks[0].strips[0].select = True
    data.use_tweak_mode = True
    assert data.use_tweak_mode and data.action == one
    for change in (
        lambda: bpy.ops.dafnet.play_take(index=1),
        lambda: bpy.ops.dafnet.play_take(step="NEXT"),
        bpy.ops.dafnet.reject_take,
        bpy.ops.dafnet.keep_accepted,
    ):
        with pytest.raises(RuntimeError, match="'Ann' edits a strip in tweak mode"):
            change()
        assert shot.listed() == [one, two] and own.active_take == 0 and data.action == one
        assert one.use_fake_user and two.dafnet.accepted
    data.use_tweak_mode = False
    assert bpy.ops.dafnet.play_take(index=1) == {"FINISHED"} and data.action == two


def test_a_deleted_action_leaves_a_row_that_can_be_removed(shot: Shot) -> None:
    shot.ann.dafnet.take_count = 2
    bpy.ops.dafnet.generate()
    bpy.data.actions.remove(shot.listed()[1])
    assert len(shot.listed()) == 1 and len(shot.ann.dafnet.takes) == 2
    with pytest.raises(RuntimeError, match="was deleted"):
        bpy.ops.dafnet.play_take(index=1)
    shot.ann.dafnet.active_take = 1
    for task in ("LEGS", "ONWARD"):
        with pytest.raises(RuntimeError, match="Choose a take"):
            bpy.ops.dafnet.generate(task=task)
    bpy.ops.dafnet.reject_take()
    assert len(shot.ann.dafnet.takes) == 1


def test_next_and_previous_step_over_rows_whose_action_was_deleted(shot: Shot) -> None:
    shot.own.take_count = 4
    bpy.ops.dafnet.generate()
    one, two, three, four = shot.listed()
    for deleted in (two, four):
        bpy.data.actions.remove(deleted)
    data = shot.ann.animation_data
    for step, plays in (("NEXT", three), ("NEXT", one), ("PREVIOUS", three), ("PREVIOUS", one)):
        assert bpy.ops.dafnet.play_take(step=step) == {"FINISHED"}
        assert data.action == plays
    assert shot.own.active_take == 0


def test_next_begins_with_the_first_take_where_none_plays(shot: Shot) -> None:
    shot.own.take_count = 3
    bpy.ops.dafnet.generate()
    one, _, three = shot.listed()
    data = shot.ann.animation_data
    for nothing in (None, bpy.data.actions.new("Mine")):
        for step, plays in (("NEXT", one), ("PREVIOUS", three)):
            data.action = nothing
            bpy.ops.dafnet.play_take(step=step)
            assert data.action == plays
    shot.ann.animation_data_clear()
    bpy.ops.dafnet.play_take(step="NEXT")
    assert shot.ann.animation_data.action == one


def test_legs_vary_under_the_same_upper_body(shot: Shot) -> None:
    shot.ann.dafnet.seed, shot.ann.dafnet.temperature = 4, 0.6
    bpy.ops.dafnet.generate()
    shot.ann.dafnet.seed, shot.ann.dafnet.temperature = 9, 0.0
    bpy.ops.dafnet.generate(task="LEGS")
    first, second = shot.listed()
    assert (second.dafnet.seed, second.dafnet.lower_seed, round(second.dafnet.temperature, 3)) == (
        4,
        5,
        0.6,
    )
    apart = np.abs(shot.motion(first) - shot.motion(second)).mean(axis=(0, 2))
    assert apart[[4, 5, 7, 8]].mean() > apart[[9, 12, 15]].mean() > 0
    bpy.ops.dafnet.generate(task="LEGS")
    assert shot.listed()[2].dafnet.lower_seed == 6


def test_legs_are_not_varied_under_an_upper_body_that_no_seed_makes(shot: Shot) -> None:
    """The seed of a take that was gone on with makes the part after the frame, not the one before,
    and that stays so when it is cleaned up again.
    """
    bpy.ops.dafnet.generate()
    bpy.context.scene.frame_set(bpy.context.scene.frame_start + 10)
    bpy.ops.dafnet.generate(task="ONWARD")
    assert bpy.ops.dafnet.clean_again() == {"FINISHED"}
    for index, whole in enumerate((True, False, False)):
        shot.ann.dafnet.active_take = index
        assert shot.listed()[index].dafnet.whole == whole
        if not whole:
            with pytest.raises(RuntimeError, match=r"mode to FULL and copy the upper body"):
                bpy.ops.dafnet.generate(task="LEGS")
    assert len(shot.listed()) == 3
    shot.ann.dafnet.active_take = 0
    assert bpy.ops.dafnet.generate(task="LEGS") == {"FINISHED"}


def test_a_take_that_was_drawn_anew_is_listed_as_it_was_drawn(
    shot: Shot, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = shot.ann.dafnet
    monkeypatch.setattr(drawing, "_stands", lambda take: take.draw.seed == 3)
    own.seed, own.temperature, own.take_count = 2, 1.0, 2
    made = job.run(bpy.context, shot.settings())
    seeds = [2, 3 + 7919]
    assert [action.dafnet.seed for action in shot.listed()] == seeds
    assert [take.draw.seed for take in made.takes] == seeds
    (said,) = [each for each in made.warnings if "stays standing" in each]
    assert said == (
        f"'{made.actions[1].name}': With seed 3 the character stays standing before a seat, so it "
        "was drawn with 7922."
    )

    own.active_take = 1
    bpy.ops.dafnet.generate(task="LEGS")
    legs = shot.listed()[2]
    assert (legs.dafnet.seed, legs.dafnet.lower_seed) == (7922, 7923)
    apart = np.abs(shot.motion(legs) - shot.motion(made.actions[1])).mean(axis=(0, 2))
    assert apart[[4, 5, 7, 8]].mean() > 2.0 * apart[[9, 12, 15]].mean(), "the same upper body"

    own.active_take = 1
    bpy.ops.dafnet.clean_again()
    assert shot.listed()[3].dafnet.seed == 7922


def test_takes_remember_whether_their_noise_was_held(shot: Shot) -> None:
    own = shot.ann.dafnet
    assert own.noise == "COMES_AND_GOES" and not job.draws_of(shot.settings())[0].held
    own.noise, own.take_count = "HELD", 2
    assert all(draw.held for draw in job.draws_of(shot.settings()))
    own.take_count, own.temperature = 1, 0.5
    bpy.ops.dafnet.generate()
    own.noise = "COMES_AND_GOES"
    bpy.ops.dafnet.generate(task="LEGS")
    assert [take.dafnet.held for take in shot.listed()] == [True, True], "as the take it varies"


def test_from_here_on_keeps_what_comes_before(shot: Shot) -> None:
    bpy.ops.dafnet.generate()
    first = shot.listed()[0]
    shot.ann.dafnet.seed, shot.ann.dafnet.temperature = 3, 1.5
    shot.scene.frame_set(40)
    bpy.ops.dafnet.generate(task="ONWARD")
    second = shot.listed()[1]
    apart = np.abs(stored_take(first)[0].poses - stored_take(second)[0].poses).max(axis=1)[70:]
    assert apart[:28].max() < 1e-5 and apart[-3:].max() > 0.01 and shot.scene.frame_current == 40
    shot.scene.frame_set(200)
    with pytest.raises(RuntimeError, match="go to a frame in it"):
        bpy.ops.dafnet.generate(task="ONWARD")


@pytest.mark.parametrize("task", ["LEGS", "ONWARD", "BETWEEN"])
def test_a_take_that_plays_at_another_rate_now_is_not_gone_by(shot: Shot, task: str) -> None:
    bpy.ops.dafnet.generate()
    seen = shot.played()
    scene = shot.scene
    scene.render.fps *= 2
    assert np.array_equal(shot.played(), seen), "keys stay at their frames, so it is twice as fast"
    scene.use_preview_range = True
    scene.frame_preview_start, scene.frame_preview_end = 30, 40
    scene.frame_set(30)
    before = shot.state()
    with pytest.raises(RuntimeError, match=r"'Ann take' was made at 30 .* the scene has 60 now"):
        bpy.ops.dafnet.generate(task=task)
    assert shot.state() == before
    scene.render.fps //= 2
    assert bpy.ops.dafnet.generate(task=task) == {"FINISHED"}


def test_from_the_first_frame_on_nothing_is_kept_and_that_is_said(shot: Shot) -> None:
    bpy.ops.dafnet.generate()
    shot.scene.frame_set(11)
    with pytest.raises(RuntimeError, match=r"begins at frame 11, so nothing.*press Generate"):
        bpy.ops.dafnet.generate(task="ONWARD")
    shot.scene.frame_set(10)
    with pytest.raises(RuntimeError, match="Frame 10 is not inside the take"):
        bpy.ops.dafnet.generate(task="ONWARD")


def test_the_preview_range_is_made_anew_between_two_ends_that_stay(shot: Shot) -> None:
    scene, own = shot.scene, shot.ann.dafnet
    scene.frame_end = 130
    shot.walk((11, 0.0), (130, 3.2))
    own.temperature = 1.0
    bpy.ops.dafnet.generate()
    (old,) = shot.listed()
    assert bpy.ops.dafnet.generate.poll()
    with pytest.raises(RuntimeError, match=r"Mark the part .* as the preview range"):
        bpy.ops.dafnet.generate(task="BETWEEN")

    scene.use_preview_range = True
    scene.frame_preview_start, scene.frame_preview_end = 51, 100
    own.seed = 5
    assert bpy.ops.dafnet.generate(task="BETWEEN") == {"FINISHED"}
    new = shot.listed()[1]
    assert frames_of(new) == frames_of(old) == (11, 130) and new.dafnet.seed == 5
    was, now = shot.motion(old), shot.motion(new)
    off = np.linalg.norm(now - was, axis=-1).max(axis=1)
    first, stop = 51 - 11, 101 - 11
    assert off[first:stop].max() > 0.05, "another middle"
    assert max(off[: first - 10].max(), off[stop + 10 :].max()) < 0.01, "the ends stay"
    fastest = np.abs(np.diff(was, 2, axis=0)).max()
    assert np.abs(np.diff(now, 2, axis=0)).max() < 1.5 * fastest, "and nothing pops"

    scene.frame_preview_start = 11
    with pytest.raises(RuntimeError, match="begins at frame 11, so nothing of it would be kept"):
        bpy.ops.dafnet.generate(task="BETWEEN")
    scene.frame_preview_start, scene.frame_preview_end = 51, 130
    with pytest.raises(RuntimeError, match=r"ends at frame 130, so nothing.*From Here On"):
        bpy.ops.dafnet.generate(task="BETWEEN")
    scene.frame_preview_end = 131
    with pytest.raises(RuntimeError, match="Frame 132 is not inside the take"):
        bpy.ops.dafnet.generate(task="BETWEEN")
    scene.frame_preview_end = 100
    shot.walk((115, 2.0))
    with pytest.raises(RuntimeError, match="The root no longer goes as in the take"):
        bpy.ops.dafnet.generate(task="BETWEEN")
    assert len(shot.listed()) == 2


def test_a_take_begins_as_the_character_is(shot: Shot) -> None:
    """From the take before it, while it walks; its own list goes on from it as well."""
    scene, own = shot.scene, shot.ann.dafnet
    scene.frame_end = 130
    shot.walk((11, 0.0), (130, 3.2))
    bpy.ops.dafnet.generate()
    scene.frame_start, own.begins, own.temperature = 91, "AS_IT_IS", 1.0
    bpy.ops.dafnet.generate()
    whole, later = (shot.motion(action) for action in shot.listed())
    assert np.linalg.norm(later[0] - whole[80], axis=-1).max() < 0.03
    joined = np.concatenate([whole[:80], later])
    swiftest = np.abs(np.diff(whole, 2, axis=0)).max()
    assert np.abs(np.diff(joined, 2, axis=0))[76:84].max() < 1.5 * swiftest, "in mid-stride"
    own.begins = "STANDING"
    bpy.ops.dafnet.generate()
    standing = shot.motion(shot.listed()[2])
    assert np.linalg.norm(standing[0] - whole[80], axis=-1).max() > 0.1

    own.begins, own.active_take = "AS_IT_IS", 1
    bpy.ops.dafnet.generate(task="LEGS")
    first, second = (stored_take(shot.listed()[k])[0].poses[:71] for k in (1, 3))
    assert np.abs(first - second).max() < 1e-4, "it begins as the chosen one"

    shot.root.animation_data_clear()
    shot.root.location = (5.0, 0.0, 0.0)
    with pytest.raises(RuntimeError, match=r"The character is 5\.\d m from its root"):
        bpy.ops.dafnet.generate()


def test_cleaned_again_makes_a_new_take_and_leaves_the_old(shot: Shot) -> None:
    own = shot.ann.dafnet
    own.plant_feet = 0.0
    bpy.ops.dafnet.generate()
    own.plant_feet = 1.0
    before = {
        name: np.array([p.co for p in c.keyframe_points]) for name, c in _curves(shot).items()
    }
    assert bpy.ops.dafnet.clean_again() == {"FINISHED"}
    raw, clean = shot.listed()
    assert shot.ann.animation_data.action == clean and clean.dafnet.sliding < raw.dafnet.sliding
    assert clean.dafnet.raw_sliding == pytest.approx(raw.dafnet.sliding)
    assert np.abs(stored_take(raw)[0].poses - stored_take(clean)[0].poses).max() == 0
    bpy.ops.dafnet.play_take(index=0)
    after = {name: np.array([p.co for p in c.keyframe_points]) for name, c in _curves(shot).items()}
    assert all(np.array_equal(before[name], after[name]) for name in before)


def test_cleaning_again_may_be_stopped_and_sees_what_is_deleted(shot: Shot) -> None:
    bpy.ops.dafnet.generate()
    (raw,) = shot.listed()
    shot.scene.frame_set(30)
    before, shares = shot.state(), []
    while True:
        steps = job.clean_up_again.steps(bpy.context, shot.ann, raw)
        try:
            for _ in range(len(shares) + 1):
                share = next(steps)
        except StopIteration as done:
            assert shot.listed() == [raw, done.value.action]
            break
        shares.append(share)
        assert shot.state() == before
        steps.close()
        assert shot.state() == before and shot.listed() == [raw]
    assert len(shares) > 4 and shares == sorted(shares) and shares[-1] <= 1.0

    bpy.ops.dafnet.play_take(index=0)
    steps = job.clean_up_again.steps(bpy.context, shot.ann, raw)
    next(steps)
    bpy.data.actions.remove(raw)
    assert run_to_end(steps).action in shot.listed(), "all of it that is needed was read at first"

    (clean, _) = shot.listed()
    steps = job.clean_up_again.steps(bpy.context, shot.ann, clean)
    next(steps)
    actions = len(bpy.data.actions)
    bpy.data.objects.remove(shot.ann)
    with pytest.raises(InputError, match=r"clean up again|'Ann' is not in the scene"):
        run_to_end(steps)
    assert len(bpy.data.actions) == actions


def test_takes_are_there_when_the_file_is_opened_again(shot: Shot, tmp_path: Path) -> None:
    shot.ann.dafnet.take_count = 2
    bpy.ops.dafnet.generate()
    motion = [shot.motion(action) for action in shot.listed()]
    bpy.ops.dafnet.play_take(index=1)
    file = str(tmp_path / "takes.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    ann = bpy.data.objects["Ann"]
    takes = takes_of(ann)
    assert len(takes) == 2 and ann.animation_data.action == takes[1]
    for action, joints in zip(takes, motion, strict=True):
        assert np.abs(shot.motion(action) - joints).max() < 1e-6
    bpy.context.view_layer.objects.active = ann
    assert bpy.ops.dafnet.clean_again() == {"FINISHED"}, "what is needed to go on is in the file"


def test_all_takes_are_one_undo_step(shot: Shot) -> None:
    shot.ann.dafnet.take_count = 3
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.dafnet.generate("EXEC_DEFAULT", True)
    assert len(bpy.data.objects["Ann"].dafnet.takes) == 3
    bpy.ops.ed.undo()
    assert len(bpy.data.objects["Ann"].dafnet.takes) == 0 and not bpy.data.actions.get("Ann take")
    bpy.ops.ed.redo()
    assert len(takes_of(bpy.data.objects["Ann"])) == 3


def test_influence_and_blend_are_read_from_the_scene(shot: Shot) -> None:
    own = shot.ann.dafnet
    own.mode, own.blend_frames = "EE", 6
    own.hand_left.location = (-0.3, 0.9, 1.3)
    for frame, share in ((20, 0.0), (30, 1.0)):
        own.hand_left_influence = share
        own.keyframe_insert("hand_left_influence", frame=frame)
    read = shot.read().controls
    assert (
        read.hand_left_influence[[0, 9, 19, 44]].tolist() == [0, 0, 1, 1]
        and 0 < read.hand_left_influence[14] < 1
    )
    assert read.head_influence is None and read.blend == pytest.approx(0.2)
    bpy.ops.dafnet.generate()
    bpy.ops.dafnet.generate()
    assert any(c.data_path == "dafnet.hand_left_influence" for c in _curves(shot).values()), (
        "keys come along to the new action"
    )


def _curves(shot: Shot) -> dict:
    curves = action_curves(shot.ann)
    return {(c.data_path, c.array_index): c for c in curves}


@pytest.mark.parametrize("before", [True, False])
def test_cancelled_between_two_bakes_none_is_left(shot: Shot, before: bool) -> None:
    if before:
        bpy.ops.dafnet.generate()
    listed, actions = shot.listed(), {action.name for action in bpy.data.actions}
    steps = job.steps(bpy.context, job.settings_of(shot.ann, shot.scene, take_count=4))
    while {action.name for action in bpy.data.actions} == actions:
        next(steps)
    next(steps)
    assert len(shot.listed()) == len(listed) + 2
    steps.close()
    assert shot.listed() == listed and {action.name for action in bpy.data.actions} == actions
    data = shot.ann.animation_data
    assert data.action in listed if before else data is None


def test_deleted_between_two_bakes_none_is_left(shot: Shot) -> None:
    actions = {action.name for action in bpy.data.actions}
    steps = job.steps(bpy.context, job.settings_of(shot.ann, shot.scene, take_count=4))
    while {action.name for action in bpy.data.actions} == actions:
        next(steps)
    bpy.data.objects.remove(shot.ann)
    with pytest.raises(InputError, match="not in the scene"):
        next(steps)
    assert {action.name for action in bpy.data.actions} == actions


def test_presets_set_how_takes_are_made(shot: Shot) -> None:
    own, folders = shot.ann.dafnet, bpy.utils.preset_paths("dafnet")
    shipped = {file.stem: file for folder in folders for file in Path(folder).glob("*.py")}
    assert {"calm", "lively", "raw", "tidy"} <= set(shipped)
    for name, expected in (
        ("lively", (1.0, 5, 1.0, 0.0)),
        ("raw", (0.0, 1, 0.0, 0.0)),
        ("tidy", (0.0, 1, 1.0, 1.0)),
    ):
        bpy.ops.script.execute_preset(filepath=str(shipped[name]), menu_idname="DAFNET_MT_presets")
        assert (own.temperature, own.take_count, own.plant_feet, own.clear_furniture) == expected
    own.temperature = 0.7
    assert bpy.ops.dafnet.add_preset(name="Mine") == {"FINISHED"}
    own.temperature = 0.0
    mine = next(
        file for folder in bpy.utils.preset_paths("dafnet") for file in Path(folder).glob("Mine.py")
    )
    bpy.ops.script.execute_preset(filepath=str(mine), menu_idname="DAFNET_MT_presets")
    assert own.temperature == pytest.approx(0.7)
    mine.unlink()


def test_full_copies_the_upper_body_of_a_take(shot: Shot) -> None:
    own = shot.ann.dafnet
    own.temperature, own.seed, own.plant_feet = 1.0, 2, 0.0
    bpy.ops.dafnet.generate()
    source = shot.listed()[0]
    assert not _is_take(own, bpy.data.actions.new("Mine"))
    own.mode, own.upper_body_take, own.seed, own.temperature = "FULL", source, 8, 0.0
    bpy.ops.dafnet.generate()
    upper = list(UPPER)
    apart = np.linalg.norm(
        shot.motion(source)[5:, upper] - shot.motion(shot.listed()[1])[5:, upper], axis=-1
    )
    assert apart.mean() < 0.02
    shot.scene.frame_end = 70
    with pytest.raises(RuntimeError, match="does not cover"):
        bpy.ops.dafnet.generate()
    shot.scene.frame_end, shot.scene.render.fps = 55, 24
    with pytest.raises(RuntimeError, match="30 frames per second, the scene 24"):
        bpy.ops.dafnet.generate()


def _of_zeros(data: bytes) -> bytes:
    """A stored take whose joints unpack to 64 MB."""
    out = BytesIO()
    with ZipFile(BytesIO(data)) as file, ZipFile(out, "w", ZIP_DEFLATED) as other:
        for name in file.namelist():
            other.writestr(name, bytes(1 << 26) if name == "take.joints.npy" else file.read(name))
    return out.getvalue()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda data: data[: len(data) // 2], "it is damaged"),
        (lambda data: b"", "it is damaged"),
        (_of_zeros, "'take.joints' is larger than the take's frames ask for"),
    ],
)
def test_a_damaged_take_is_told_in_a_sentence_wherever_it_is_used(
    shot: Shot, spoil, words: str
) -> None:
    bpy.ops.dafnet.generate()
    own, take = shot.ann.dafnet, shot.listed()[0]
    packed = PACKED
    data = spoil(take[packed])
    del take[packed]  # Blender writes over bytes that are there up to the first zero
    take[packed] = data
    before, curves = [a.name for a in bpy.data.actions], shot.played()
    shot.scene.frame_set(30)
    drawings(bpy.context, ("reach", "ghosts"))
    uses = [
        bpy.ops.dafnet.clean_again,
        lambda: bpy.ops.dafnet.generate(task="LEGS"),
        lambda: bpy.ops.dafnet.generate(task="ONWARD"),
        bpy.ops.dafnet.mark_frames,
    ]
    for use in uses:
        with pytest.raises(RuntimeError) as caught:
            use()
        said = str(caught.value).strip().removeprefix("Error: ")
        assert (
            words in said
            and said.endswith("; generate it again.")
            and "\n" not in said
            and "Traceback" not in said
        )
    own.mode, own.upper_body_take = "FULL", take
    with pytest.raises(RuntimeError, match="cannot be read"):
        bpy.ops.dafnet.generate()
    assert [a.name for a in bpy.data.actions] == before and np.array_equal(shot.played(), curves)
