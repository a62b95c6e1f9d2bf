"""What changes during a shot: the mode, how far a target counts, and a take that is gone on with at
another rate or size.
"""

from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, InputError, Scene, Take, generate, load_weights
from dafnet_addon.core.generate import clean_again_steps
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.resampling import frame_times, resample_path
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.rotations import matrix_from_quaternion, yaw_matrix
from dafnet_addon.core.skeleton import END_EFFECTORS, UPPER, joint
from dafnet_addon.core.storage import packed, unpacked

TOES = [joint("left_foot"), joint("right_foot")]
ALL = CleanUp(feet=1.0, reach=1.0, seat=1.0)
RATES = [12.0, 24000 / 1001, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 120.0]


@pytest.fixture(scope="module")
def weights():
    return load_weights()


def _walk(fps: float = 30.0, seconds: float = 4.0) -> Controls:
    walked = resample_path(
        route(Stop((0.0, 0.0), 0.0, 0.5), Stop((0.0, 3.0), 0.0, 1.0), fps=120.0).path, 120.0, fps
    )
    count = min(len(walked), round(seconds * fps))
    return Controls(fps=fps, root=RootPath(walked.position[:count], walked.yaw[:count]).matrices())


def _steps(joints: np.ndarray) -> np.ndarray:
    """How far points (T, N, 3) move to each frame from the one before (T, N)."""
    return np.linalg.norm(np.diff(joints, axis=0, prepend=joints[:1]), axis=-1)


def _modes(controls: Controls, at: int, before: str, after: str) -> list[str]:
    return [before] * at + [after] * (len(controls) - at)


@pytest.mark.slow
@pytest.mark.parametrize("clean_up", [CleanUp(), ALL], ids=["raw", "clean"])
@pytest.mark.parametrize(("before", "after"), [("FREE", "EE"), ("EE", "FREE")])
def test_a_change_of_mode_with_nothing_given_changes_nothing(weights, clean_up, before, after):
    controls = _walk()
    nothing = replace(controls, hand_left=np.full((len(controls), 3), np.nan))
    unheard = replace(
        controls,
        head=controls.root[:, :3, 3] + (0.0, 0.0, 1.5),
        head_influence=np.zeros(len(controls)),
        head_rotation=controls.root[:, :3, :3] @ yaw_matrix(1.5),
    )
    free = generate(Scene(), controls, weights, clean_up=clean_up)
    for asked in (controls, nothing, unheard):
        for at in (40, 55, 62):
            changing = replace(asked, mode=_modes(controls, at, before, after))
            assert (
                np.abs(
                    generate(Scene(), changing, weights, clean_up=clean_up).joints - free.joints
                ).max()
                < 1e-9
            )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["hand_left", "head"])
def test_a_foot_that_stands_where_the_mode_changes_stays(weights, name: str, seed: int):
    controls, effector = _walk(), END_EFFECTORS[name]
    made = {"seed": seed, "temperature": 0.8, "clean_up": ALL}
    free = generate(Scene(), controls, weights, **made)
    target = free.joints[:, effector] + (0.0, 0.2, 0.25 if name == "hand_left" else -0.05)
    for at in (30, 40, 48, 56, 64, 72, 80):
        asked = replace(controls, **{name: target}, mode=_modes(controls, at, "FREE", "EE"))
        take = generate(Scene(), asked, weights, **made)
        stands = (free.joints[at, TOES, 2] < 0.03) & (
            _steps(free.joints[:, TOES])[at - 2 : at + 3] < 0.002
        ).all(axis=0)
        assert (_steps(take.joints[:, TOES])[at][stands] < 0.005).all()
        assert np.abs(take.joints[: at - 12] - free.joints[: at - 12]).max() < 0.01, (
            "nothing moves long before"
        )


@pytest.mark.slow
@pytest.mark.parametrize("clean_up", [CleanUp(), ALL], ids=["raw", "clean"])
def test_what_a_change_of_mode_asks_is_come_to_and_left_without_a_pop(weights, clean_up):
    controls = _walk()
    free = generate(Scene(), controls, weights, clean_up=clean_up)
    target = free.joints[:, 20] + (0.0, 0.25, 0.3)
    there = generate(
        Scene(), replace(controls, mode="EE", hand_left=target), weights, clean_up=clean_up
    )
    for at in (45, 60, 75):
        for modes in (("FREE", "EE"), ("EE", "FREE")):
            asked = replace(controls, hand_left=target, mode=_modes(controls, at, *modes))
            jump, slow = (
                _steps(
                    generate(
                        Scene(), replace(asked, blend=blend), weights, clean_up=clean_up
                    ).joints[:, [15, 20, 21]]
                )
                for blend in (1 / 3, 2 / 3)
            )
            usual = max(
                _steps(take.joints[:, [15, 20, 21]])[at - 12 : at + 25].max()
                for take in (free, there)
            )
            assert jump[at - 12 : at + 25].max() < usual + 0.06
            assert slow[at - 12 : at + 25].max() < usual + 0.04
        entering = replace(asked, mode=_modes(controls, at, "FREE", "EE"))
        reached = generate(Scene(), entering, weights, clean_up=clean_up).joints
        gap = np.linalg.norm(reached[:, 20] - target, axis=-1)
        # The clean-up looks ahead, and lowers the pelvis a little before it has to.
        before = 0.02 if clean_up is ALL else 0.005
        assert np.abs((reached - free.joints)[:at, [15, 20, 21]]).max() < before, (
            "it begins where the mode changes"
        )
        assert gap[at + 12 :].mean() < (0.03 if clean_up is not ALL else 0.0005)


def test_targets_that_end_with_the_mode_are_left_as_softly(weights):
    controls, at = _walk(), 60
    free = generate(Scene(), controls, weights)
    target = free.joints[:, 20] + (0.0, 0.25, 0.3)
    target[at:] = np.nan
    body = generate(Scene(), replace(controls, mode="EE", hand_left=target), weights).joints[
        :, list(UPPER)
    ]
    body[at:] = np.nan
    for mode, given in (("EE", {"hand_left": target}), ("FULL", {"upper_body": body})):
        asked = replace(controls, mode=_modes(controls, at, mode, "FREE"), **given)
        jump = [
            np.abs(
                np.diff(
                    generate(Scene(), replace(asked, blend=blend), weights).joints[:, 20], axis=0
                )
            )[at - 1].max()
            for blend in (0.0, 1 / 3)
        ]
        # A network may let go softly by itself; a blend makes it no harder.
        assert jump[1] < 0.06 and jump[1] < jump[0] + 0.015


def _turned_by(take: Take, reference: Take) -> np.ndarray:
    """By how much (T,) the head is turned more than in the reference, degrees."""

    def head(each: Take) -> np.ndarray:
        local = matrix_from_quaternion(each.rotations)
        return local[:, 0] @ local[:, 3] @ local[:, 6] @ local[:, 9] @ local[:, 12] @ local[:, 15]

    trace = np.einsum("tij,tij->t", head(take), head(reference))
    return np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))


@pytest.mark.slow
@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_rotations_count_by_mode_and_influence_and_come_over_softly(weights, fps):
    controls = _walk(fps)
    frames, at = len(controls), len(controls) // 2
    free = generate(Scene(), controls, weights)
    asked = replace(controls, head_rotation=controls.root[:, :3, :3] @ yaw_matrix(np.radians(90.0)))
    made = lambda **more: _turned_by(generate(Scene(), replace(asked, **more), weights), free)  # noqa: E731
    whole = made(mode="EE")
    assert whole.min() > 60.0, "the rotation is asked for"
    assert made(mode="FREE").max() < 1e-3, "in FREE there are no targets"
    assert made(mode="EE", head_influence=np.zeros(frames)).max() < 1e-3
    half = made(mode="EE", head_influence=np.full(frames, 0.5))
    assert (half > 0.35 * whole).all() and (half < 0.8 * whole).all()
    coming = made(mode=_modes(controls, at, "FREE", "EE"))
    assert coming[:at].max() < 1e-3 and np.allclose(
        coming[at + round(fps / 3) :], whole[at + round(fps / 3) :], atol=1e-3
    )
    assert np.abs(np.diff(coming)).max() < 20.0 * 30.0 / fps, "by slerp over a third of a second"
    value = asked.head_rotation.copy()
    value[at:] = np.nan
    leaving = made(mode=_modes(controls, at, "EE", "FREE"), head_rotation=value)
    assert (
        np.abs(np.diff(leaving)).max() < 20.0 * 30.0 / fps
        and leaving[at + round(fps / 3) :].max() < 1e-3
    )
    at_once = made(mode=_modes(controls, at, "FREE", "EE"), blend=0.0)
    assert at_once[at - 1] < 1e-3 and np.isclose(at_once[at], whole[at], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("fps", RATES)
@pytest.mark.parametrize("scale", [1.0, 0.6])
def test_targets_are_reached_at_the_scenes_own_frames(weights, fps, scale):
    controls = _walk(fps)
    controls = replace(controls, root=controls.root.copy(), scale=scale)
    controls.root[:, :3, 3] *= scale
    free = generate(Scene(), controls, weights)
    time = frame_times(len(controls), fps)
    circle = np.stack(
        [0.1 * np.sin(6 * time), 0.2 + 0 * time, 0.3 + 0.1 * np.cos(6 * time)], axis=1
    )
    targets = {
        "head": free.joints[:, 15] + scale * np.array([0.0, 0.05, -0.03]),
        "hand_right": free.joints[:, 21] + scale * circle,
    }
    targets["head"][: len(time) // 4] = np.nan
    take = generate(
        Scene(), replace(controls, mode="EE", **targets), weights, clean_up=CleanUp(reach=1.0)
    )

    def off(made: Take) -> np.ndarray:
        """How far the effectors are off their targets, of a body of canonical size."""
        away = [
            np.linalg.norm(made.joints[:, END_EFFECTORS[name]] - place, axis=-1)
            for name, place in targets.items()
        ]
        return np.concatenate(away)[np.isfinite(np.concatenate(away))] / scale

    missed = off(take)
    assert missed.max() < 2e-4
    assert take.metrics["end_effector_error"] * 1.7 == pytest.approx(missed.mean(), abs=1e-9), (
        "what is told is what is baked"
    )
    loose = generate(Scene(), replace(controls, mode="EE", **targets), weights)
    assert loose.metrics["end_effector_error"] * 1.7 == pytest.approx(off(loose).mean(), abs=1e-9)


@pytest.mark.parametrize(
    ("before", "after"), [(30.0, 60.0), (60.0, 24.0), (24.0, 120.0), (30.0, 12.0)]
)
def test_a_take_is_gone_on_with_at_another_rate_for_as_many_seconds(weights, before, after):
    first = generate(Scene(), _walk(before), weights, seed=2, temperature=1.0)
    onward = _walk(after)
    there = generate(
        Scene(),
        onward,
        weights,
        seed=9,
        temperature=1.0,
        resume=first,
        resume_frame=round(2.0 * after),
    )
    for seconds in (0.5, 1.0, 1.5):
        kept, was = there.joints[round(seconds * after)], first.joints[round(seconds * before)]
        assert np.abs(kept - was).max() < 0.012, "kept until then"
    late = 2.6
    assert (
        np.abs(there.joints[round(late * after)] - first.joints[round(late * before)]).max() > 0.03
    ), "and not after it"


@pytest.mark.parametrize("size", [0.5, 1.3, 3.0])
def test_a_take_is_gone_on_with_at_another_size_on_its_root(weights, size):
    controls = _walk()
    first = generate(Scene(), controls, weights, seed=2, temperature=1.0)
    grown = replace(controls, scale=size)
    there = generate(
        Scene(), grown, weights, seed=2, temperature=1.0, resume=first, resume_frame=60
    )
    for take in (first, there):
        off = np.linalg.norm(take.joints[:, 0, :2] - take.root[:, :2, 3], axis=-1)
        assert off[:60].max() < 0.12 * take.scale
    kept = (there.joints - there.root[:, None, :3, 3])[:55] / size
    assert np.abs(kept - (first.joints - first.root[:, None, :3, 3])[:55]).max() < 0.05, (
        "the same poses, larger"
    )


@pytest.mark.parametrize("frame", [-1, 121, 10_000])
def test_what_lies_outside_a_take_cannot_be_kept(weights, frame):
    controls = _walk()
    first = generate(Scene(), controls, weights)
    assert len(first) == 120
    with pytest.raises(InputError, match=r"not inside the take, which lasts 4\.00 s"):
        generate(Scene(), controls, weights, resume=first, resume_frame=frame)
    all_of_it = generate(
        Scene(), controls, weights, seed=5, temperature=1.0, resume=first, resume_frame=120
    )
    assert np.abs(all_of_it.joints - first.joints).max() < 2e-3


def test_a_change_of_mode_is_cleaned_again_as_it_was_made(weights):
    controls = _walk()
    target = generate(Scene(), controls, weights).joints[:, 20] + (0.0, 0.25, 0.3)
    modes = ["FREE"] * 40 + ["EE"] * 4 + ["FREE"] * 40 + ["EE"] * (len(controls) - 84)
    asked = replace(controls, hand_left=target, mode=modes)
    raw, clean = (generate(Scene(), asked, weights, clean_up=each) for each in (CleanUp(), ALL))
    kept, told = unpacked(packed(raw, asked))
    again = run_to_end(clean_again_steps(Scene(), told, kept, ALL))
    assert np.abs(again.joints - clean.joints).max() < 1e-3
    resumed = generate(Scene(), asked, weights, resume=raw, resume_frame=100, clean_up=ALL)
    assert np.abs(resumed.joints - clean.joints).max() < 0.01, (
        "changes in what is kept are eased as well"
    )


@pytest.mark.parametrize("changed", ["rate", "size", "root", "modes"])
def test_a_take_is_not_cleaned_again_for_other_controls(weights, changed):
    controls = _walk(seconds=2.0)
    take = generate(Scene(), controls, weights)
    moved = controls.root.copy()
    moved[:, 0, 3] += 0.5
    modes = {
        "mode": _modes(controls, 30, "FREE", "EE"),
        "hand_left": take.joints[:, 20] + (0.0, 0.2, 0.2),
    }
    other = {
        "rate": {"fps": 30.5},
        "size": {"scale": 1.2},
        "root": {"root": moved},
        "modes": modes,
    }[changed]
    with pytest.raises(InputError, match="generate it again"):
        run_to_end(clean_again_steps(Scene(), replace(controls, **other), take, ALL))


@pytest.mark.parametrize("fps", [12.0, 30.0, 60.0])
def test_one_frame_reaches_turns_and_is_cleaned_again(weights, fps):
    place = np.array([[0.2, 0.4, 1.1]])
    controls = Controls(
        fps,
        np.eye(4)[None],
        mode="EE",
        hand_right=place,
        head_rotation=yaw_matrix(np.radians([40.0])),
    )
    seat = Scene([Box(center=np.array([3.0, 0.0, 0.2]), half_size=np.full(3, 0.2))])
    take = generate(seat, controls, weights, clean_up=ALL)
    assert np.abs(take.joints[:, 21] - place).max() < 2e-4
    again = run_to_end(clean_again_steps(seat, controls, take, ALL))
    assert np.abs(again.joints - take.joints).max() < 1e-6


def test_modes_that_change_at_every_frame_take_no_longer_than_three_shots(weights):
    controls = _walk(seconds=2.0)
    target = generate(Scene(), controls, weights).joints[:, 20] + (0.0, 0.25, 0.3)
    modes = [("FREE", "EE")[frame % 2] for frame in range(len(controls))]
    take = generate(
        Scene(), replace(controls, mode=modes, hand_left=target, blend=10.0), weights, clean_up=ALL
    )
    assert 0 < len(take.unchanged) <= 2 * len(controls)
    assert _steps(take.joints).max() < 0.25
