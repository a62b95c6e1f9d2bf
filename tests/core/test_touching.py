"""Hands and feet that hold on to something are told from those that are free."""

import numpy as np

from dafnet_addon import Box, Controls, Scene, generate, load_weights
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.skeleton import ANKLES, FEET, HIPS, KNEES, REST, WRISTS
from dafnet_addon.core.touching import touches


def _standing(frames: int = 40) -> np.ndarray:
    return np.tile(REST, (frames, 1, 1))


def test_who_stands_with_arms_out_stands_on_both_feet_only() -> None:
    assert np.allclose(touches(_standing(), 30.0), [0, 0, 1, 1])


def test_a_raised_foot_is_free_and_holds_on_its_floor() -> None:
    joints = _standing()
    joints[:, [ANKLES[0], FEET[0]], 2] += 0.3
    assert np.allclose(touches(joints, 30.0), [0, 0, 0, 1])
    joints[..., 2] += 3.0
    assert np.allclose(touches(joints, 30.0, floor=np.full(40, 3.0)), [0, 0, 0, 1])


def test_hands_hold_on_in_the_lap_but_not_beside_legs_that_stand() -> None:
    hanging = _standing()
    hanging[:, WRISTS[0]] = 0.5 * (hanging[:, HIPS[0]] + hanging[:, KNEES[0]])
    assert np.allclose(touches(hanging, 30.0)[:, 0], 0.0)

    seated = _standing()
    for hip, knee in zip(HIPS, KNEES, strict=True):
        seated[:, knee] = seated[:, hip] + (0.0, 0.42, 0.0)
    seated[:, WRISTS[0]] = 0.5 * (seated[:, HIPS[0]] + seated[:, KNEES[0]]) + (0.0, 0.0, 0.06)
    seated[:, WRISTS[0] - 2] = seated[:, WRISTS[0]] + (0.0, -0.2, 0.1)
    assert touches(seated, 30.0)[:, 0].min() > 0.9


def test_a_hand_that_hangs_beside_a_seat_holds_on_to_nothing() -> None:
    """Neither to the thigh that it hangs beside nor to the seat, before it touches that."""
    seated = _standing()
    for hip, knee in zip(HIPS, KNEES, strict=True):
        seated[:, knee] = seated[:, hip] + (0.0, 0.42, 0.0)
    for side, (hip, wrist) in enumerate(zip(HIPS, WRISTS, strict=True)):
        outward = -1.0 if side == 0 else 1.0
        seated[:, wrist] = seated[:, hip] + (0.12 * outward, 0.12, 0.08)
        seated[:, wrist - 2] = seated[:, wrist] + (0.0, 0.0, 0.25)
    assert touches(seated, 30.0)[:, :2].max() == 0.0

    def seat(away: float) -> np.ndarray:
        return touches(seated, 30.0, distance=lambda points: np.full(points.shape[:2], away))[:, 0]

    assert seat(0.07).max() == 0.0 and seat(0.02).min() == 1.0
    assert 0.2 < seat(0.045).min() < 0.8


def test_a_hold_begins_and_ends_softly_and_targets_are_held() -> None:
    joints, target = _standing(60), np.full((60, 3), np.nan)
    target[20:40] = joints[20:40, WRISTS[1]]
    share = touches(joints, 30.0, targets={"hand_right": target})[:, 1]
    assert (share[20:40] == 1.0).all() and share[0] == share[-1] == 0.0
    assert np.abs(np.diff(share)).max() < 0.6 and (np.diff(share[:21]) >= 0.0).all()


def test_a_take_knows_what_it_touches() -> None:
    """A hand that is led along a table, and one that is not."""
    root = route(Stop((0.0, -0.6), 0.0, 0.2), Stop((0.0, 0.0), 0.0, 1.0))
    table = Scene((Box([0.0, 0.6, 0.45], [0.5, 0.3, 0.45]),))
    hand = np.tile([0.2, 0.42, 0.95], (len(root.path), 1))
    take = generate(
        table,
        Controls(30.0, root.path.matrices(), mode="EE", hand_right=hand),
        load_weights(),
    )
    assert take.touches.shape == (len(take), 4)
    assert (take.touches[:, 1] == 1.0).all() and take.touches[:, 0].mean() < 0.2
