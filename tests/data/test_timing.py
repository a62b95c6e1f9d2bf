"""The time that sitting down and getting up take: measured, changed, told by the root's path."""

import numpy as np
import pytest

from dafnet_addon.core.root import root_from_joints
from dafnet_addon.core.skeleton import FEET, NECK, OFFSETS, PARENTS, PELVIS
from dafnet_addon.data.dataset import windows
from dafnet_addon.data.motion.motion import Motion, motion_of
from dafnet_addon.data.motion.rests import resting
from dafnet_addon.data.motion.timing import (
    at_clock,
    braced,
    clock_of,
    smoothed_by_hand,
    stretches_of,
    transitions,
)
from kit.sitting import sit_down, standing

BONES = np.linalg.norm(OFFSETS[1:], axis=1)
_SMOOTHSTEP_80 = 0.608  # of its length, in which it goes from 10 to 90 %


def _down_and_up(frames: int) -> Motion:
    """Sits down within so many frames, rests for two seconds and gets up as slowly."""
    down = sit_down(160 + frames, start=60, down=frames)[: 60 + frames + 60]
    return motion_of("made up", "test", "nobody", "sit-stand", np.concatenate([down, down[::-1]]))


@pytest.mark.parametrize("frames", [30, 45, 75])
def test_ways_down_and_up_are_measured(frames: int) -> None:
    motion = _down_and_up(frames)
    down, up = transitions(motion.joints, motion.rests)
    assert down.down and not up.down and down.stop < up.start
    for way in (down, up):
        assert way.seconds == pytest.approx(_SMOOTHSTEP_80 * frames / 30, abs=0.1)
    assert down.begins <= down.start and up.begins >= up.stop


def test_times_are_as_peoples_and_motion_is_as_smooth_as_before() -> None:
    rng, motion = np.random.default_rng(0), _down_and_up(45)
    taken: dict[bool, list[float]] = {True: [], False: []}
    ways = transitions(motion.joints, motion.rests)
    for _ in range(60):
        clock = clock_of(len(motion.joints), ways, stretches_of(rng, ways))
        joints = at_clock(motion.joints, clock)
        again = transitions(joints, resting(joints, root_from_joints(joints)))
        assert len(again) == 2
        for way in again:
            taken[way.down].append(way.seconds)

        lengths = np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)
        assert np.abs(lengths - BONES).max() < 2e-3
        assert np.abs(np.diff(joints[:, FEET], axis=0)).max() < 1e-4, "feet stay where they stand"
        # Twice as quick is four times the change of speed; nobody is asked to be quicker.
        assert (
            np.abs(np.diff(joints, 2, axis=0)).max()
            < 4.2 * np.abs(np.diff(motion.joints, 2, axis=0)).max()
        )

    for down, usual in ((True, 1.3), (False, 0.9)):
        assert min(taken[down]) > 0.5 and max(taken[down]) < 2.4
        assert abs(np.median(taken[down]) - usual) < 0.25
        assert np.ptp(taken[down]) > 0.9


def test_played_backward_what_was_a_way_down_takes_as_long_as_ways_up_do() -> None:
    motion = _down_and_up(45)
    ways = [way for way in transitions(motion.joints, motion.rests) if way.down]
    taken = []
    for seed in range(60):
        stretches = stretches_of(np.random.default_rng(seed), ways, backward=True)
        joints = at_clock(motion.joints, clock_of(len(motion.joints), ways, stretches))
        taken.append(transitions(joints, resting(joints, root_from_joints(joints)))[0].seconds)
    assert abs(np.median(taken) - 1.05) < 0.2, "between 0.6 and 2.2 s, most often 0.9"


def test_who_takes_long_bends_forward_to_keep_the_balance() -> None:
    motion = _down_and_up(30)
    ways = transitions(motion.joints, motion.rests)
    middle = (ways[0].start + ways[0].stop) // 2

    def bent(joints: np.ndarray, frame: int) -> float:
        trunk = joints[frame, NECK] - joints[frame, PELVIS]
        return float(np.degrees(np.arctan2(trunk[1], trunk[2])))

    slow, quick = (braced(motion.joints, ways, [s, s]) for s in (2.2 / ways[0].seconds, 1.0))
    assert bent(motion.joints, middle) < 10.0
    assert bent(slow, middle) == pytest.approx(38.0, abs=4.0)
    assert bent(quick, middle) == pytest.approx(18.0, abs=4.0)
    for joints in (slow, quick):
        assert np.abs(joints[:, FEET] - motion.joints[:, FEET]).max() < 1e-3
        assert abs(bent(joints, ways[0].stop + 40) - bent(motion.joints, ways[0].stop + 40)) < 1.0
        assert abs(bent(joints, 5) - bent(motion.joints, 5)) < 1.0


def test_another_speed_alone_reads_frames_evenly() -> None:
    clock = clock_of(100, [], [], speed=1.25)
    assert np.allclose(np.diff(clock), 1.25) and 79 <= len(clock) <= 80


def _last_quarter(path: np.ndarray, seat: np.ndarray) -> int:
    """Frames that a root is between 90 and 10 % of its last quarter of a metre."""
    away = np.linalg.norm(path[:, :2] - seat[:2], axis=-1)
    return int(((away > 0.025) & (away < 0.225)).sum())


@pytest.mark.parametrize("frames", [30, 60, 100])
def test_a_path_that_is_smoothed_by_hand_tells_the_time_all_the_same(frames: int) -> None:
    joints = sit_down(260, start=80, down=frames, back=0.25)
    path = root_from_joints(joints)
    ways = transitions(joints, resting(joints, path))
    told = _last_quarter(path.position, joints[-1, PELVIS])
    by_hand = smoothed_by_hand(path, 19.8, ways)
    assert _last_quarter(by_hand.position, joints[-1, PELVIS]) == pytest.approx(told, rel=0.3)
    plain = smoothed_by_hand(path, 19.8, [])
    if frames == 30:
        assert _last_quarter(plain.position, joints[-1, PELVIS]) > 1.5 * told


def test_sway_belongs_to_the_pose_where_a_path_is_smooth() -> None:
    """Of a body that sways by 2.5 cm once a second a smooth root does not, and its pose does."""
    joints = standing(240, sway=0.025, period=30)
    path = root_from_joints(joints)
    assert np.ptp(path.position[60:180, 0]) > 0.03
    by_hand = smoothed_by_hand(path, 12.0, [])
    assert np.ptp(by_hand.position[60:180, 0]) < 0.005
    assert np.ptp((joints[:, PELVIS] - by_hand.position)[60:180, 0]) > 0.045


def test_windows_hold_whole_ways_of_all_these_times() -> None:
    motion, rng = _down_and_up(30), np.random.default_rng(3)
    found = []
    for _ in range(300):
        window = windows.draw_window(rng, motion, 75)
        if window is not None:
            height = window.poses.reshape(80, 22, 3)[:, 0, 2]
            share = (height.max() - height) / np.ptp(height) if np.ptp(height) > 0.25 else height
            if abs(share[-1] - share[0]) > 0.95:
                found.append(int(((share > 0.1) & (share < 0.9)).sum()))
    assert len(found) > 8 and np.ptp(found) > 12
