"""Postures of sitting: what they are said to be, and still whole bodies on planted feet."""

import numpy as np
import pytest

from dafnet_addon.core.root import root_from_joints, to_root
from dafnet_addon.core.skeleton import FEET, HIPS, NECK, OFFSETS, PARENTS, PELVIS, WRISTS
from dafnet_addon.data.furnish.flesh import GIVES, TRUNK, box_clearance, nearest_box, probes
from dafnet_addon.data.furnish.seats import seat_for
from dafnet_addon.data.furnish.sitters import forearm_of, leans_back
from dafnet_addon.data.motion.rests import resting
from dafnet_addon.data.synthesis.pieces import fluent
from dafnet_addon.data.synthesis.postures import POSTURES, Posture, posture_of, sitting_in
from kit.sitting import sit_down

BONES = np.linalg.norm(OFFSETS[1:], axis=1)
START = 100  # frames; from here on the body below sits still


def _sitting(frames: int = 320) -> np.ndarray:
    return sit_down(frames, start=40, down=45)


def _in(*postures: Posture, seed: int = 0) -> np.ndarray:
    return sitting_in(np.random.default_rng(seed), _sitting(), START, postures)


def _lean(joints: np.ndarray) -> float:
    """Degrees that the trunk leans back in the last frame."""
    path = root_from_joints(joints)
    trunk = (to_root(path, joints[:, NECK]) - to_root(path, joints[:, PELVIS]))[-1]
    return float(np.degrees(np.arctan2(-trunk[1], trunk[2])))


@pytest.mark.parametrize("name", POSTURES)
@pytest.mark.parametrize("seed", range(4))
def test_bodies_stay_whole_and_feet_stand(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    before, joints = _sitting(), _in(posture_of(rng, name), posture_of(rng, "upright"), seed=seed)
    lengths = np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)
    assert np.abs(lengths - BONES).max() < 1e-6
    assert np.abs(joints[: START - 40] - before[: START - 40]).max() < 1e-9, (
        "it sits down as before"
    )
    assert fluent(joints).all(), "no speed or acceleration that no capture has"

    toes = joints[:, FEET]
    moves = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1) * 30
    low = toes[1:, :, 2] < before[0, FEET, 2].max() + 0.012
    assert (moves[low] < 0.25).all(), "a foot that goes is lifted"
    assert toes[..., 2].min() > before[0, FEET, 2].min() - 1e-3
    rests = [r for r in resting(joints, root_from_joints(joints)) if r.end > START]
    assert rests, "it still sits"


@pytest.mark.parametrize("degrees", [10.0, 20.0, 35.0])
def test_who_leans_back_leans_as_far_as_asked_with_the_pelvis_forward(degrees: float) -> None:
    lean = float(np.radians(degrees))
    joints = _in(Posture(slide=0.08, lean=lean, tilt=lean))
    assert _lean(joints) == pytest.approx(degrees, abs=4.0)
    ahead = (joints[-1, HIPS] - _sitting()[-1, HIPS]).mean(0) @ (0.0, 1.0, 0.0)
    assert ahead == pytest.approx(0.08, abs=0.01)
    face = joints[-1, NECK + 3] - joints[-1, NECK]
    assert np.degrees(np.arctan2(-face[1], face[2])) < _lean(joints), "the gaze stays ahead"


def test_hands_are_on_arms_and_seats_and_stay_there() -> None:
    joints = _in(Posture(hands=("arm", "seat")))
    arm, seat = joints[-60:, WRISTS[0]], joints[-60:, WRISTS[1]]
    assert np.ptp(arm, axis=0).max() < 0.04 and np.ptp(seat, axis=0).max() < 0.04
    assert abs(seat[-1, 2] - joints[-1, PELVIS, 2]) < 0.05
    (rest,) = [r for r in resting(joints, root_from_joints(joints)) if r.end > 300]
    last = type(rest)(260, 320, rest.position, rest.yaw)
    forearm = forearm_of(last, probes(joints))
    assert forearm is not None and 0.1 < forearm.over < 0.3


def test_ankles_are_crossed_and_a_leg_is_forward() -> None:
    rng = np.random.default_rng(0)
    crossed = _in(posture_of(rng, "ankles crossed"))[-1]
    assert crossed[FEET[0], 0] > crossed[FEET[1], 0], "the left one is on the right"
    forward = _in(posture_of(rng, "leg forward"))[-1]
    assert abs(forward[FEET[0], 1] - forward[FEET[1], 1]) > 0.1


def test_a_back_meets_who_leans_on_it() -> None:
    """Real sitters touch their backs; and nobody leans far back on a stool."""
    joints = _in(Posture(slide=0.08, lean=0.55, tilt=0.6))[START + 60 :]
    (rest, *_) = resting(joints, root_from_joints(joints))
    points, rng, met = probes(joints), np.random.default_rng(0), 0
    assert leans_back(rest, points)
    for _ in range(40):
        boxes = seat_for(rng, rest, points)
        assert boxes is not None and box_clearance(boxes, points, GIVES + 0.05, 0.2) > -1e-6
        near = nearest_box(boxes, points[:, TRUNK].reshape(-1, 3)).reshape(-1, len(TRUNK))
        met += bool(near.min() < 0.14)
    assert met > 32

    upright = _sitting()[START:]
    (still, *_) = resting(upright, root_from_joints(upright))
    assert not leans_back(still, probes(upright))
