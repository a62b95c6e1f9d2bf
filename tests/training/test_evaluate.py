"""The frozen test, and the figures that weights are judged by, on motion whose answers are
known.
"""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.generate import generate
from dafnet_addon.core.metrics import action_information, mutual_information
from dafnet_addon.core.root import raw_root_from_joints
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.skeleton import REST, SEAT_TO_PELVIS, STATURE, UPPER
from dafnet_addon.core.take import Controls
from dafnet_addon.core.weights import load_weights
from dafnet_addon.data.capture.mocap import read_clips
from dafnet_addon.data.furnish.boxes import box
from dafnet_addon.data.held_out import captured as h
from dafnet_addon.data.motion.rests import Rest
from dafnet_addon.training.evaluation import clips as e
from kit.places import MOCAP


@cache
def _clips() -> list[h.HeldClip]:
    return h.held_out(MOCAP)


def _clip(frames: int = 60, seated: int = 30, **changes: object) -> h.HeldClip:
    """The rest pose, which in its last ``seated`` frames is 0.4 m lower, on a block of 0.45 m."""
    joints = np.tile(REST, (frames, 1, 1))
    joints[frames - seated :, :, 2] -= REST[0, 2] - 0.57
    rests = (Rest(frames - seated, frames, joints[-1, 0], 0.0),) if seated else ()
    block = box((0.0, 0.0, 0.225), (0.4, 0.4, 0.45))[None]
    clip = h.HeldClip(
        "made up",
        "no/body",
        "sit",
        True,
        False,
        "",
        joints,
        raw_root_from_joints(joints),
        block,
        rests,
    )
    return replace(clip, **changes)  # type: ignore[arg-type]


def _figure(figures: e.Figures, name: str) -> float:
    total, weight = figures.sums[name]
    return total / weight


def test_fingerprint_tells_motions_apart():
    joints = np.random.default_rng(0).normal(size=(30, 22, 3)).cumsum(0) * 0.01
    own = np.array(h.fingerprint(joints))
    assert np.abs(own - h.fingerprint(joints + 1e-5)).max() < 2e-4
    for other in (joints + np.array([0.02, 0, 0]), joints[5:], joints * (-1, 1, 1), joints * 1.05):
        assert np.abs(own - h.fingerprint(other)).max() > 1e-3


def test_a_test_clip_that_is_not_the_frozen_one_is_refused(monkeypatch, tmp_path):
    joints = np.random.default_rng(0).normal(size=(40, 22, 3))
    motion = h.Motion("a", "b", "c", "walk", joints, np.ones(40, bool), ())
    frozen = {
        "name": "b/a",
        "unseen": True,
        "start": 5,
        "frames": 30,
        "rests": [[0, 10]],
        "boxes": [[0, 0, 1, 1, 1, 1, 0.5]],
        "fingerprint": h.fingerprint(joints[5:35]),
    }
    monkeypatch.setattr(h, "FROZEN", tmp_path / "held_out.json")

    def read(clip: dict[str, object], motions: dict[str, h.Motion]) -> list[h.HeldClip]:
        h.FROZEN.write_text(json.dumps({"version": 1, "clips": [clip]}), encoding="utf-8")
        monkeypatch.setattr(h, "held_out_motions", lambda folder: motions)
        return h.held_out(tmp_path)

    (clip,) = read(frozen, {"b/a": motion})
    assert (
        clip.activity == "walk" and clip.body == "b/c" and np.array_equal(clip.joints, joints[5:35])
    )
    assert len(clip.scene.solids) == 1 and (clip.rests[0].start, clip.rests[0].end) == (0, 10)
    for changed, motions in (
        (frozen, {"b/a": replace(motion, joints=joints * 1.1)}),
        ({**frozen, "frames": 50}, {"b/a": motion}),
        (frozen, {}),
    ):
        with pytest.raises(InputError, match="b/a"):
            read(changed, motions)


@pytest.mark.mocap
def test_no_body_of_the_unseen_test_clips_is_in_training():
    trained = {
        f"{clip.source}/{clip.subject}" for clip in read_clips(MOCAP) if clip.split == "train"
    }
    assert trained.isdisjoint(clip.body for clip in _clips() if clip.unseen)
    assert {clip.body for clip in _clips() if not clip.unseen} <= trained
    walkers = [
        c["composed"]["walk"]
        for c in json.loads(h.FROZEN.read_text(encoding="utf-8"))["clips"]
        if "composed" in c
    ]
    names = {
        f"{clip.source}/{clip.name}": f"{clip.source}/{clip.subject}" for clip in read_clips(MOCAP)
    }
    assert walkers and trained.isdisjoint(names[walker] for walker in walkers)


@pytest.mark.mocap
def test_the_frozen_furniture_is_under_those_who_sit():
    clips = _clips()
    assert len(clips) == len(json.loads(h.FROZEN.read_text(encoding="utf-8"))["clips"])
    assert sum(len(clip.rests) for clip in e.captured_clips(clips)) >= 40
    for clip in clips:
        for rest in clip.rests:
            tops = [solid.center[2] + solid.half_size[2] for solid in clip.scene.solids]
            gaps = np.abs(rest.position[2] - SEAT_TO_PELVIS - np.array(tops))
            assert gaps.min() < (0.10 if clip.room == "bed" else 0.041), clip.name


def test_the_real_motion_has_no_errors():
    clip = _clip()
    figures = e.measure_takes(clip, clip.joints[None], "FULL")
    for name, value in (
        ("sits_within_6cm", 1),
        ("stands_when_it_should", 1),
        ("end_effector_error", 0),
        ("upper_body_error", 0),
        ("skate_cm", 0),
        ("feet_off_floor", 0),
    ):
        assert _figure(figures, name) == pytest.approx(value), name
    assert figures.seats == [0.0] and "apd_upper" not in figures.sums


def test_errors_are_those_that_were_made():
    clip = _clip()
    high = clip.joints + np.array([0.0, 0.0, 0.1])
    figures = e.measure_takes(clip, np.stack([clip.joints, high]), "FULL")
    assert _figure(figures, "sits_within_6cm") == 0.5 and figures.seats == [0.0, pytest.approx(0.1)]
    assert _figure(figures, "upper_body_error") == pytest.approx(0.05 / STATURE)
    assert _figure(figures, "end_effector_error") == pytest.approx(0.05 / 1.7)
    assert _figure(figures, "apd_upper") == pytest.approx(0.1) == _figure(figures, "apd_legs")
    # the standing half of the second take
    assert _figure(figures, "feet_off_floor") == pytest.approx(0.25)
    crouching = clip.joints - np.array([0.0, 0.0, 0.15])
    assert _figure(e.measure_takes(clip, crouching[None]), "stands_when_it_should") == 0.0


def test_rows_pool_clips_by_their_frames():
    one, other = (
        e.Figures({"a": (10.0, 100.0)}, [0.01]),
        e.Figures({"a": (90.0, 100.0), "b": (1.0, 2.0)}, [-0.05, 0.2]),
    )
    row = e.pooled_row([one, other])
    assert row["clips"] == 2 and row["seat_episodes"] == 3 and row["seat_error_median"] == 0.05
    assert row["a"] == 0.5 and row["intervals"]["a"] == [0.1, 0.9] and row["b"] == 0.5
    many = e.pooled_row(
        [
            e.Figures({"a": (float(value), 1.0)})
            for value in np.random.default_rng(1).normal(3.0, 1.0, 400)
        ]
    )
    low, high = many["intervals"]["a"]
    assert low < many["a"] < high and high - low == pytest.approx(2 * 1.96 / 20, rel=0.25)
    assert many == e.pooled_row(
        [
            e.Figures({"a": (float(value), 1.0)})
            for value in np.random.default_rng(1).normal(3.0, 1.0, 400)
        ]
    )


def test_rows_keep_kinds_of_clips_apart():
    names = (
        "ground_truth",
        *(f"{mode}_t{t}" for mode in ("free", "ee", "full") for t in ("0", "0_clean", "1")),
    )
    runs = {run: e.Figures({"a": (1.0, 1.0)}) for run in names}
    kinds = [
        {},
        {},
        {},
        {"composed": True},
        {"composed": True},
        {"room": "desk"},
        {"unseen": False},
    ]
    kinds.append({"room": "bed", "composed": True})
    rows = e.rows_by_group([e.MeasuredClip(_clip(**kind), runs) for kind in kinds])
    counts = {
        name: values["clips"]
        for name, values in rows.items()
        if name.startswith("free_t0") and "clean" not in name
    }
    assert counts == {
        "free_t0": 3,
        "free_t0_composed": 2,
        "free_t0_at_desks_and_shelves": 1,
        "free_t0_on_beds": 1,
        "free_t0_bodies_in_training": 1,
    }
    text = e.table(rows)
    assert len(text.splitlines()) == 2 + len(rows) and "free t0 composed" in text


def test_takes_made_together_are_those_that_generate_makes():
    weights, clip = load_weights(), _clip(40)
    sampler = Sampler(weights)
    shot = e.shot_of(clip, "FREE")
    frames = len(shot.conditions)
    calm = sampler.noise(frames, 0, temperature=0.0)
    lively = sampler.noise(frames, 3), sampler.noise(frames, 3, 5)
    takes = e.sample_takes(sampler, shot, np.concatenate([calm, *lively], axis=1))
    controls = Controls(fps=30.0, root=clip.path.matrices())
    for take, (seed, lower, temperature) in zip(
        takes, ((0, None, 0.0), (3, None, 1.0), (3, 5, 1.0)), strict=True
    ):
        alone = generate(
            clip.scene, controls, weights, seed=seed, lower_seed=lower, temperature=temperature
        )
        assert np.abs(take - alone.joints).max() < 2e-3


@pytest.mark.parametrize("mode", ["FREE", "FULL"])
def test_who_begins_seated_is_measured_as_he_is_made(mode):
    sampler, clip = Sampler(load_weights()), _clip(60, seated=60)
    shot = e.shot_of(clip, mode)
    takes = e.sample_takes(sampler, shot, np.zeros((1, 66)))
    made = e.measure_takes(clip, takes, mode)
    runs = e.measure_clip(sampler, clip, seeds=2, modes=(mode,), clean=False).runs
    measured = runs[f"{mode.lower()}_t0"]
    assert np.allclose(measured.seats, made.seats, atol=1e-3)
    assert _figure(measured, "end_effector_error") == pytest.approx(
        _figure(made, "end_effector_error"), abs=1e-3
    )


@pytest.mark.torch
def test_beside_measures_all_modes_and_the_likelihood_of_real_poses():
    from dafnet_addon.training.evaluation.actions import follow

    beside = box((1.0, 0.0, 0.225), (0.4, 0.4, 0.45))[None]
    sampler, clip = Sampler(load_weights()), _clip(40, seated=0, boxes=beside)
    runs = e.measure_clip(sampler, clip, seeds=2).runs
    assert set(runs) == {
        "ground_truth",
        "legs",
        *(f"{m}_t{t}" for m in ("free", "ee", "full") for t in ("0", "0_clean", "1")),
    }
    assert _figure(runs["ee_t0_clean"], "end_effector_error") < 0.5 * _figure(
        runs["ee_t0"], "end_effector_error"
    )
    untouched = (
        _figure(runs["free_t0_clean"], "end_effector_error"),
        _figure(runs["free_t0"], "end_effector_error"),
    )
    assert abs(untouched[0] - untouched[1]) < 0.2 * untouched[1], (
        "in FREE the clean-up knows of no target"
    )
    assert _figure(runs["legs"], "apd_upper") < 0.1 * _figure(runs["free_t1"], "apd_upper")
    own = follow(sampler, (clip, None))
    assert own.actions.shape == (40, 10) and np.allclose(own.actions.sum(1), 1.0, atol=1e-4)
    again = follow(sampler, (clip, own.actions))
    assert np.allclose(own.nats, again.nats, atol=1e-2)
    bent = replace(
        clip,
        joints=clip.joints
        + np.where(np.isin(np.arange(22), UPPER), 0.3, 0.0)[:, None] * (0.0, 1.0, 0.0),
    )
    assert follow(sampler, (bent, None)).nats.mean() > own.nats.mean() + 10.0


@pytest.mark.torch
def test_the_rounds_of_a_long_walk_are_alike():
    from dafnet_addon.training.evaluation.rooms import long_rooms, seat_rooms

    for room in long_rooms():
        path, rests = room.walked.path, room.walked.rests
        starts = [rest.start for rest in rests[::3]]
        length = starts[1] - starts[0]
        assert len(starts) == 4 and np.allclose(np.diff(starts), length) and abs(length - 600) < 3
        first, last = path.position[: length - 1], path.position[starts[2] : starts[2] + length - 1]
        assert np.abs(first - last).max() < 1e-6
        turn = path.yaw[starts[2] : starts[2] + length - 1] - path.yaw[: length - 1]
        assert np.abs(np.exp(1j * turn) - 1.0).max() < 1e-6
    for room in [*long_rooms(), *seat_rooms()]:
        for rest in room.walked.rests:
            if rest.place.seated:
                at = np.array(rest.place.position)
                below = room.boxes[(np.abs(room.boxes[:, :2] - at) < 0.05).all(1)]
                assert np.isclose(below[:, 2] + below[:, 5], room.heights[rest.place.name]).any()


def test_actions_that_tell_frames_apart():
    distinct, always = np.tile(np.eye(4), (5, 1)), np.tile(np.eye(4)[0], (20, 1))
    assert action_information(distinct) == pytest.approx(np.log(4.0)) and action_information(
        always
    ) == pytest.approx(0.0)
    assert action_information(np.full((20, 4), 0.25)) == pytest.approx(0.0)
    labels = np.array(["walk", "sit", "stand", "walk"] * 5)
    names = np.array([2 if label == "walk" else 7 if label == "sit" else 0 for label in labels])
    assert mutual_information(names, labels) == pytest.approx(1.0)
    assert mutual_information(np.tile([0, 1], 10), np.repeat([0, 1], 10)) == pytest.approx(
        0.0, abs=1e-9
    )
    assert mutual_information(np.zeros(20, int), labels) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.torch
def test_criteria_know_what_is_at_most_and_what_is_at_least():
    from dafnet_addon.training.evaluation.criteria import Criterion

    def met(value: float, most: bool) -> str:
        return Criterion("", value, 2.0, 1.5 if most else 2.5, most, "").met

    assert [met(value, True) for value in (1.4, 1.9, 2.1)] == ["goal", "must", "no"]
    assert [met(value, False) for value in (2.6, 2.1, 1.9)] == ["goal", "must", "no"]
