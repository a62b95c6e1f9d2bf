"""Metrics on motions whose answers are known."""

import json

import numpy as np
import pytest

from dafnet_addon.core.metrics import (
    BAD_COLLISION_JOINTS,
    Seat,
    bad_collisions,
    body_points,
    bone_length_variation,
    diversity,
    end_effector_distance,
    foot_sliding,
    jerk,
    motion_metrics,
    penetration,
    seat_episodes,
    seat_report,
    skate,
    standing_pelvis_height,
)
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.skeleton import JOINTS, REST, STANDING_PELVIS

LEFT_TOE, RIGHT_TOE = JOINTS.index("left_foot"), JOINTS.index("right_foot")


def standing(frames: int = 60) -> np.ndarray:
    return np.tile(REST, (frames, 1, 1))


def gliding(metres_per_second: float, fps: float = 30.0, frames: int = 60) -> np.ndarray:
    """The rest pose that slides forward over the floor."""
    joints = standing(frames)
    joints[..., 1] += (metres_per_second * np.arange(frames) / fps)[:, None]
    return joints


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize(
    ("speed", "frame_reading", "second_reading"),
    [
        (0.0, 0, 0),
        (0.003, 0, 0),
        (0.005, 0, 2),
        (0.11, 0, 2),
        (0.13, 2, 2),
    ],
)
def test_foot_sliding_in_both_readings_at_any_rate(
    fps: float,
    speed: float,
    frame_reading: int,
    second_reading: int,
) -> None:
    joints = gliding(speed, fps)
    assert (foot_sliding(joints, fps) == frame_reading).all()
    assert (foot_sliding(joints, fps, per_frame=False) == second_reading).all()


def test_foot_sliding_counts_low_feet_over_their_own_floor() -> None:
    joints = gliding(1.0)
    joints[:, LEFT_TOE, 2] = 0.08
    assert (foot_sliding(joints, 30.0) == 1).all()
    storey = np.where(np.arange(60) < 30, 0.0, 3.0)
    joints[..., 2] += storey[:, None]
    assert (np.delete(foot_sliding(joints, 30.0, floor=storey), 30) == 1).all()
    assert (foot_sliding(joints, 30.0)[30:] == 0).all()


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_skate_weighs_speed_by_height(fps: float) -> None:
    assert skate(standing(), fps) == 0.0
    # 0.3 m/s is 1 cm a frame; a planted foot has weight 1
    assert skate(gliding(0.3, fps), fps) == pytest.approx(1.0)
    half = gliding(0.3, fps)
    half[:, [LEFT_TOE, RIGHT_TOE], 2] += 0.025 * np.log2(1.5)
    assert skate(half, fps) == pytest.approx(0.5)
    half[:, [LEFT_TOE, RIGHT_TOE], 2] += 0.025
    assert skate(half, fps) == 0.0


def test_end_effector_distance_over_given_targets_only() -> None:
    joints = standing(4)
    head = joints[:, 15] + [0.17, 0, 0]
    head[2:] = np.nan
    left = joints[:, 20] + [0, 0, 0.34]
    assert end_effector_distance(joints, {"head": head, "hand_left": None}) == pytest.approx(0.1)
    expected = (2 * 0.1 + 4 * 0.2) / 6
    assert end_effector_distance(joints, {"head": head, "hand_left": left}) == pytest.approx(
        expected
    )
    assert np.isnan(end_effector_distance(joints, {"hand_right": np.full((4, 3), np.nan)}))
    assert np.isnan(end_effector_distance(joints, {}))


def test_bad_collisions_touch_within_the_colliders() -> None:
    names = {JOINTS[j] for j in BAD_COLLISION_JOINTS}
    assert len(BAD_COLLISION_JOINTS) == 13
    assert not names & {
        "pelvis",
        "left_hip",
        "left_wrist",
        "right_ankle",
        "left_foot",
        "right_hip",
        "right_wrist",
    }
    distance = np.full((3, 13), 0.15)
    distance[1, [0, 4]] = 0.09, -0.2
    distance[2, 12] = 0.11
    assert bad_collisions(distance).tolist() == [0, 2, 0]


def test_body_points_lie_along_the_bones() -> None:
    points = body_points(standing(2), per_bone=4)
    assert points.shape == (2, 85, 3)
    assert np.allclose(points[:, 4::4], REST[1:]) and np.allclose(points[:, 0], REST[0])
    assert np.allclose(points[0, 2], (REST[0] + REST[1]) / 2)


def test_penetration_of_a_floor_raised_into_the_feet() -> None:
    height = 0.05
    distance = standing(3)[..., 2] - height
    mean, largest = penetration(distance)
    assert largest == pytest.approx(height - 0.02)
    assert mean == pytest.approx(2 * (height - 0.02) / 22)
    assert penetration(np.full((3, 4), 0.1)) == (0.0, 0.0)


def walk_and_sit(fps: float, seat: float = 0.45, floor: float = 3.0) -> tuple[np.ndarray, RootPath]:
    """Two seconds of walking 2 m, three of sitting there, two of walking on, one of standing; on
    the third storey.
    """
    time = np.arange(int(8 * fps)) / fps
    forward = np.interp(time, [0, 2, 5, 7], [0, 2, 2, 4])
    path = RootPath(np.stack([0 * time, forward, 0 * time + floor], axis=1), 0 * time)
    joints = REST + path.position[:, None]
    joints[..., 2] -= np.where((time > 2) & (time < 5), STANDING_PELVIS - seat - 0.15, 0.0)[:, None]
    return joints, path


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_seats_are_reported_with_their_errors(fps: float) -> None:
    joints, path = walk_and_sit(fps)
    episodes = seat_episodes(joints, path, fps)
    assert [round((e.stop - e.start) / fps) for e in episodes] == [3, 1]
    assert [e.pelvis_height for e in episodes] == pytest.approx([0.60, STANDING_PELVIS])
    assert np.allclose(episodes[0].position, [0, 2, 3], atol=0.01)
    chair, stool = Seat("Chair", np.array([0.1, 2.1, 3.45])), Seat("Stool", np.array([4.0, 0, 3.6]))
    taken, missed = seat_report(joints, path, fps, [chair, stool])
    assert taken["name"] == "Chair" and taken["seat_height"] == pytest.approx(0.45)
    assert taken["pelvis_height"] == pytest.approx(0.60) and taken["error"] == pytest.approx(0.03)
    assert (
        missed["pelvis_height"] is None
        and missed["error"] is None
        and missed["seat_height"] == pytest.approx(0.6)
    )
    assert standing_pelvis_height(joints, path, fps) == pytest.approx(STANDING_PELVIS)
    assert np.isnan(
        standing_pelvis_height(joints[:1], RootPath(path.position[:1], path.yaw[:1]), fps)
    )


def test_short_stops_are_no_rest() -> None:
    joints, path = walk_and_sit(30.0)
    assert len(seat_episodes(joints, path, 30.0, seconds=2.0)) == 1
    assert seat_episodes(joints[:60], RootPath(path.position[:60], path.yaw[:60]), 30.0) == []


def test_bone_lengths_that_change_are_seen() -> None:
    joints = gliding(1.0)
    assert bone_length_variation(joints) < 1e-12
    joints[::2, 21, 0] += 0.025  # a forearm of 25 cm that is 10 % longer in every other frame
    assert bone_length_variation(joints) == pytest.approx(0.0125 / 0.2625)


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_jerk_of_a_cubic(fps: float) -> None:
    time = np.arange(50) / fps
    joints = standing(50)
    joints[..., 0] += (2.0 * time**3 + time**2 - time)[:, None]
    assert jerk(joints, fps) == pytest.approx(12.0)
    assert jerk(joints[:3], fps) == 0.0


def test_diversity_is_the_mean_distance_of_pairs() -> None:
    samples = np.stack([standing(5) + np.array([x, 0.0, 0.0]) for x in (0.0, 0.1, 0.3)])
    assert diversity(samples) == pytest.approx((0.1 + 0.2 + 0.3) / 3)
    assert diversity(samples[:1]) == 0.0


def test_summary_is_fit_for_json_and_agrees() -> None:
    joints = gliding(0.13)

    def below(points: np.ndarray) -> np.ndarray:
        return points[..., 2] - 0.5  # furniture that fills everything under half a metre

    report = motion_metrics(
        joints, 30.0, targets={"head": joints[:, 15] + [0, 0, 0.17]}, distance=below
    )
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["foot_sliding_per_frame"] == 2.0 and report["foot_sliding_4mm_s"] == 2.0
    assert report["skate_cm"] == pytest.approx(13 / 30)
    assert report["bad_collisions_per_frame"] == 2.0  # the knees
    assert report["penetration_max"] == pytest.approx(0.48)
    assert report["end_effector_error"] == pytest.approx(0.1)
    bare = motion_metrics(joints[:1], 24.0)
    assert bare["bad_collisions_per_frame"] is None and bare["penetration_mean"] is None
    assert bare["end_effector_error"] is None and bare["foot_sliding_per_frame"] == 0.0
    assert json.dumps(bare, allow_nan=False)
