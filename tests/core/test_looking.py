"""Who looks at something turns the head, then the chest, as people do, and stays where he is."""

import numpy as np
import pytest

from dafnet_addon import Controls, Scene, generate, load_weights
from dafnet_addon.core.cleanup import CleanUp
from dafnet_addon.core.kinematics import global_from_local
from dafnet_addon.core.rotations import matrix_from_quaternion
from dafnet_addon.core.skeleton import HEAD, joint

CLEAN = CleanUp(feet=1.0, reach=1.0, seat=1.0)
FRAMES = 110
CHEST, STANDS = joint("spine3"), [joint(n) for n in ("pelvis", "left_ankle", "right_ankle")]


@pytest.fixture(scope="module")
def weights():
    return load_weights()


def _standing(**more) -> Controls:
    return Controls(fps=30, root=np.tile(np.eye(4), (FRAMES, 1, 1)), **more)


@pytest.fixture(scope="module")
def plain(weights):
    return generate(Scene(()), _standing(), weights, clean_up=CLEAN)


def _frames(take) -> np.ndarray:
    return global_from_local(matrix_from_quaternion(take.rotations))


def _yaw(axes: np.ndarray) -> np.ndarray:
    """Degrees to the left of rotations (T, 3, 3)."""
    return np.degrees(np.arctan2(-axes[:, 0, 1], axes[:, 1, 1]))


def _off(take, target: np.ndarray) -> np.ndarray:
    """Degrees between where the face looks and the target."""
    frames = _frames(take)[:, HEAD]
    away = target - (take.joints[:, HEAD] + frames @ np.array([0.0, 0.09, 0.08]))
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    return np.degrees(np.arccos(np.clip((frames[:, :, 1] * away).sum(-1), -1.0, 1.0)))


@pytest.mark.parametrize(
    ("place", "astray"),
    [
        ((0.0, 6.0, 1.6), 3.0),
        ((-4.0, 4.0, 1.6), 3.0),
        ((300.0, 200.0, 1.6), 6.0),
        ((0.4, 1.5, 0.4), 6.0),
        ((0.5, 4.0, 3.5), 6.0),
    ],
)
def test_the_face_turns_to_it_and_the_body_stays(weights, plain, place, astray) -> None:
    target = np.tile(np.array(place), (FRAMES, 1))
    target[:30] = np.nan
    take = generate(Scene(()), _standing(look_at=target), weights, clean_up=CLEAN)
    assert _off(take, target)[70:].max() < astray
    assert np.abs(take.rotations - plain.rotations)[:15].max() < 1e-3, "not before"
    moved = np.linalg.norm(take.joints - plain.joints, axis=-1)
    assert moved[:, STANDS].max() < 1e-4 and moved[:, HEAD].max() < 0.1, "nothing is dragged"


def test_the_chest_helps_only_where_it_is_far_to_the_side(weights, plain) -> None:
    turned = {}
    for degrees in (20.0, 80.0):
        far = 5.0 * np.array([-np.sin(np.radians(degrees)), np.cos(np.radians(degrees)), 0.32])
        look = _standing(look_at=np.tile(far, (FRAMES, 1)))
        take = generate(Scene(()), look, weights, clean_up=CLEAN)
        turned[degrees] = np.median(_yaw(_frames(take)[:, CHEST]) - _yaw(_frames(plain)[:, CHEST]))
    assert abs(turned[20.0]) < 2.0 and 10.0 < turned[80.0] < 35.0


def test_nobody_turns_farther_or_faster_than_people_do(weights) -> None:
    """Not to what is behind, and not after what jumps from one side to the other."""
    target = np.tile([3.0, 1.0, 1.6], (FRAMES, 1))
    target[40:75] = -3.0, 1.0, 1.6
    target[75:] = 0.3, -4.0, 1.6
    take = generate(Scene(()), _standing(look_at=target), weights, clean_up=CLEAN)
    frames = _frames(take)
    neck = _yaw(np.swapaxes(frames[:, CHEST], 1, 2) @ frames[:, HEAD])
    assert np.abs(neck).max() < 75.0
    assert 30.0 * np.abs(np.diff(neck)).max() < 260.0
    assert 900.0 * np.abs(np.diff(neck, 2)).max() < 4000.0, "it begins and ends softly"


def test_a_hand_on_its_target_stays_there(weights, plain) -> None:
    hand = plain.joints[:, joint("right_wrist")].copy()
    hand += [0.0, 0.15, 0.2]
    target = np.tile([-4.0, 0.5, 1.6], (FRAMES, 1))
    look = _standing(mode="EE", hand_right=hand, look_at=target)
    take = generate(Scene(()), look, weights, clean_up=CLEAN)
    assert np.linalg.norm(take.joints[:, joint("right_wrist")] - hand, axis=-1).max() < 0.01


def test_influence_leads_to_it_and_away(weights, plain) -> None:
    target = np.tile([-4.0, 4.0, 1.6], (FRAMES, 1))
    none = _standing(look_at=target, look_at_influence=np.zeros(FRAMES))
    same = generate(Scene(()), none, weights, clean_up=CLEAN)
    assert np.array_equal(same.joints, plain.joints)
    assert np.array_equal(same.rotations, plain.rotations), "to the last bit"
    half = generate(
        Scene(()),
        _standing(look_at=target, look_at_influence=np.full(FRAMES, 0.5)),
        weights,
        clean_up=CLEAN,
    )
    looks = _off(half, target)[60:].mean(), _off(plain, target)[60:].mean()
    assert 0.3 * looks[1] < looks[0] < 0.7 * looks[1]
