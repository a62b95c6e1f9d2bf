"""Feet and legs that are asked for: what the model is told of them, and that ankles come to their
targets as people's do.
"""

from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, InputError, Scene, generate, load_weights
from dafnet_addon.core.beginning import PREROLL
from dafnet_addon.core.cleanup import cleared, planted, reach_targets
from dafnet_addon.core.conditions import shot_steps, targets_of
from dafnet_addon.core.kinematics import (
    Turn,
    forward_kinematics,
    global_from_local,
    on_bones,
    turned,
)
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import to_root
from dafnet_addon.core.rotations import matrix_from_quaternion, yaw_matrix
from dafnet_addon.core.skeleton import (
    ANKLES,
    FEET,
    HIPS,
    KNEES,
    LOWER,
    MODEL_ORDER,
    OFFSETS,
    PARENTS,
    PELVIS,
    REST,
    TARGETS,
    UPPER,
)
from dafnet_addon.core.storage import packed, unpacked

FRAMES = 60
LEFT, RIGHT = ANKLES
BONES = np.linalg.norm(OFFSETS[1:], axis=1)


def _lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def _standing() -> np.ndarray:
    """A body that stands, its knees bent a little."""
    joints = np.repeat(REST[None], FRAMES, axis=0)
    legs = [*KNEES, *ANKLES, *FEET]
    joints[:, [j for j in range(22) if j not in legs], 2] -= 0.02
    joints[:, KNEES] += (0.0, 0.08, -0.01)
    return on_bones(joints)


def _controls(mode="EE", **more) -> Controls:
    """A root that turns on the spot, two metres off and of another size."""
    root = np.tile(np.eye(4), (FRAMES, 1, 1))
    root[:, :3, :3] = yaw_matrix(np.linspace(0.3, 0.5, FRAMES))
    root[:, :2, 3] = 2.0, 1.0
    return Controls(fps=30.0, root=root, mode=mode, scale=0.9, **more)


def _asked(controls: Controls):
    shot = run_to_end(shot_steps(Scene(), controls))
    told = shot.conditions
    return (
        shot,
        told.observation[PREROLL:].reshape(FRAMES, 22, 3),
        told.given[PREROLL:].astype(bool),
    )


def _slot(joint: int) -> int:
    return MODEL_ORDER.index(joint)


@pytest.mark.parametrize(("mode", "counts"), [("FREE", False), ("EE", True), ("FULL", True)])
def test_a_foot_counts_where_the_mode_lets_it(mode: str, counts: bool):
    place = np.tile((2.1, 1.2, 0.3), (FRAMES, 1))
    upper = np.tile((2.0, 1.0, 1.0), (FRAMES, 14, 1))
    shot, observation, given = _asked(_controls(mode, foot_right=place, upper_body=upper))
    lower = given[:, len(UPPER) :]
    assert lower.any() == counts and lower.sum() == counts * FRAMES
    assert given[:, : len(UPPER)].all() == (mode == "FULL")
    if counts:
        assert given[:, _slot(RIGHT)].all()
        assert np.allclose(observation[:, _slot(RIGHT)], to_root(shot.path, place / 0.9))
    found = targets_of(shot.path, shot.request)
    assert set(found) == set(TARGETS)
    assert np.isfinite(found["foot_right"]).all() == counts and np.isnan(found["foot_left"]).all()


def test_a_turned_foot_tells_where_its_toes_are():
    place, axes = np.tile((2.1, 1.2, 0.1), (FRAMES, 1)), yaw_matrix(np.full(FRAMES, 1.2))
    axes[30:] = np.nan
    shot, observation, given = _asked(_controls(foot_left=place, foot_left_rotation=axes))
    toe = _slot(FEET[0])
    assert given[:30, toe].all() and not given[30:, toe].any() and given[:, _slot(LEFT)].all()
    asked = place / 0.9 + axes @ OFFSETS[FEET[0]]
    assert np.allclose(observation[:30, toe], to_root(shot.path, asked)[:30], atol=1e-6)


def test_a_lower_body_may_be_followed_beside_the_upper_one_or_alone():
    lower = np.tile(REST[list(LOWER)] + (2.0, 1.0, 0.0), (FRAMES, 1, 1))
    shot, observation, given = _asked(_controls("FULL", lower_body=lower))
    assert given[:, len(UPPER) :].all() and not given[:, : len(UPPER)].any()
    assert np.allclose(observation[:, len(UPPER) :], to_root(shot.path, lower / 0.9))
    with pytest.raises(InputError, match="no upper body to follow"):
        _asked(_controls("FULL"))
    lower[3, 2] = np.nan
    with pytest.raises(InputError, match="lower body to follow has a joint that is not a number"):
        _asked(_controls("FULL", lower_body=lower))
    with pytest.raises(InputError, match="'lower_body'"):
        _controls(lower_body=lower[:, :7])


def test_a_foot_out_of_reach_is_said_to_be():
    far = np.tile((2.0, 4.0, 0.1), (FRAMES, 1))
    shot, observation, _ = _asked(_controls(foot_left=far))
    assert any("'foot left' is up to" in each for each in shot.warnings)
    assert np.linalg.norm(observation[:, _slot(LEFT)] - (0.0, 0.0, 0.7), axis=-1).max() < 1.1001


@pytest.mark.parametrize("name", ["foot_left", "foot_right"])
def test_ankles_come_to_their_targets_and_knees_bend_forward(name: str):
    joints, ankle = _standing(), TARGETS[name]
    place = joints[:, ankle] + np.array([0.05, 0.25, 0.2])
    target = np.where((np.arange(FRAMES) >= 25)[:, None], place, np.nan)
    out = reach_targets(joints, {name: target})
    assert np.abs(out[25:, ankle] - place[25:]).max() < 1e-6
    assert np.allclose(out[:10], joints[:10], atol=1e-9), "long before the target nothing moves"
    assert np.linalg.norm(np.diff(out[:, ankle], axis=0), axis=-1).max() < 0.06, "it is led there"
    assert np.abs(_lengths(out) - BONES).max() < 1e-6
    knee, hip = PARENTS[ankle], PARENTS[PARENTS[ankle]]
    straight = (out[25:, hip] + out[25:, ankle]) / 2
    assert (out[25:, knee, 1] > straight[:, 1] + 0.05).all()
    others = [j for j in range(22) if j not in {ankle, knee, PARENTS.index(ankle)}]
    assert np.allclose(out[:, others], joints[:, others], atol=1e-9)
    toes = PARENTS.index(ankle)
    assert np.allclose((out - joints)[:, toes], (out - joints)[:, ankle], atol=1e-9)


def test_the_pelvis_comes_down_where_a_leg_is_too_short():
    joints = _standing()
    place = joints[:, LEFT] + np.array([-0.30, 0.25, 0.0])
    out = reach_targets(joints, {"foot_left": place})
    assert np.abs(out[:, LEFT] - place).max() < 2e-3
    assert (out[:, PELVIS, 2] < joints[:, PELVIS, 2] - 0.02).all()
    assert np.allclose(out[:, RIGHT], joints[:, RIGHT], atol=1e-9), "the other foot stands"
    assert np.abs(_lengths(out) - BONES).max() < 1e-3
    far = joints[:, LEFT] + np.array([0.0, 3.0, 0.0])
    out = reach_targets(joints, {"foot_left": far})
    assert np.isfinite(out).all() and np.abs(_lengths(out) - BONES).max() < 2e-3
    assert out[0, LEFT, 1] > joints[0, LEFT, 1] + 0.3


def test_planting_and_clearing_leave_a_foot_to_its_target():
    joints = _standing()
    slides = joints + np.linspace(0.0, 0.1, FRAMES)[:, None, None] * (0.0, 1.0, 0.0)
    target = {"foot_left": slides[:, LEFT]}
    out = planted(slides, targets=target)
    assert np.abs(out[:, LEFT] - slides[:, LEFT]).max() < 0.02
    assert np.abs(np.diff(out[10:50, RIGHT], axis=0)).max() < 1e-3

    def ball(points: np.ndarray) -> np.ndarray:
        middle = joints[:, None, LEFT] + np.array([0.03, 0.0, 0.0])
        return np.linalg.norm(points - middle, axis=-1) - 0.05

    assert np.abs(cleared(joints, ball, {})[:, LEFT] - joints[:, LEFT]).max() > 0.01
    kept = cleared(joints, ball, {"foot_left": joints[:, LEFT]})
    assert np.allclose(kept[:, LEFT], joints[:, LEFT], atol=1e-9)


def test_a_turned_foot_takes_its_toes_along():
    frames = np.tile(np.eye(3), (4, 22, 1, 1))
    axes = yaw_matrix(np.full(4, 0.7))
    out = turned(frames, {"foot_right": Turn(axes, np.array([1.0, 1.0, 0.5, 0.0]))})
    assert np.allclose(out[:2, RIGHT], axes[:2]) and np.allclose(out[:, FEET[1]], out[:, RIGHT])
    assert np.allclose(out[2, RIGHT], yaw_matrix(np.array(0.35)))
    assert np.allclose(out[3], frames[3]), "where it is free it is as it was made"
    joints = forward_kinematics(out, np.zeros((4, 3)))
    assert np.allclose(joints[0, FEET[1]] - joints[0, RIGHT], axes[0] @ OFFSETS[FEET[1]])


def _sits_with_a_foot_on_a_box() -> tuple[Scene, Controls]:
    seat = Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.22, 0.22, 0.225]))
    made = route(Stop((1.4, 0.9), np.pi / 2), Stop((0.0, 0.0), 0.0, seconds=2.0, seated=True))
    frames = len(made.path)
    place = np.tile((-0.12, 0.5, 0.22), (frames, 1))
    place[: frames - 45] = np.nan
    axes = yaw_matrix(np.full(frames, 0.2))
    controls = Controls(
        30.0, made.path.matrices(), mode="EE", foot_left=place, foot_left_rotation=axes
    )
    return Scene([seat]), controls


def test_takes_reach_feet_that_are_asked_for_and_are_kept_with_them():
    scene, controls = _sits_with_a_foot_on_a_box()
    weights = load_weights()
    take = generate(scene, controls, weights, clean_up=CleanUp(feet=1.0, reach=1.0, seat=1.0))
    last = slice(len(take) - 45, None)
    asked = controls.foot_left[last]
    assert np.linalg.norm(take.joints[last, LEFT] - asked, axis=-1).max() < 1e-3
    toes = asked + controls.foot_left_rotation[last] @ OFFSETS[FEET[0]]
    assert np.linalg.norm(take.joints[last, FEET[0]] - toes, axis=-1).max() < 1e-3
    frames = global_from_local(matrix_from_quaternion(take.rotations))
    assert np.allclose(frames[last, LEFT], controls.foot_left_rotation[last], atol=1e-6)
    assert (take.joints[last, KNEES[0], 1] > take.joints[last, HIPS[0], 1]).all()
    again, kept = unpacked(packed(take, controls))
    assert np.allclose(kept.foot_left, controls.foot_left, atol=1e-6, equal_nan=True)
    assert np.allclose(kept.foot_left_rotation, controls.foot_left_rotation, atol=1e-6)
    assert len(again) == len(take)


def test_weights_are_told_of_feet_only_where_training_gave_them():
    scene, controls = _sits_with_a_foot_on_a_box()
    weights = load_weights()
    deafened, hearing = (
        replace(weights, metadata={**weights.metadata, "told": told})
        for told in ("head hands", "head hands legs")
    )
    assert hearing.heeds_legs and not deafened.heeds_legs
    nothing = generate(scene, replace(controls, foot_left=None), deafened)
    deaf = generate(scene, controls, deafened)
    assert np.array_equal(deaf.poses, nothing.poses)
    assert sum("not trained with targets for feet" in each for each in deaf.warnings) == 1
    assert not any("for feet" in each for each in nothing.warnings)
    told = generate(scene, controls, hearing)
    first = PREROLL + len(controls) - 46
    assert np.array_equal(told.poses[:first], nothing.poses[:first])
    assert not np.allclose(told.poses[first + 2 :], nothing.poses[first + 2 :], atol=1e-4)
    assert not any("for feet" in each for each in told.warnings)
