"""Motion moved to seats of other heights keeps bones, contacts and balance: made-up sit-downs, and
real ones where present.
"""

import numpy as np
import pytest

from dafnet_addon.core.kinematics import two_bone
from dafnet_addon.core.metrics import foot_sliding, jerk
from dafnet_addon.core.skeleton import MIRROR, OFFSETS, PARENTS, REST, TOE_HEIGHT, joint
from dafnet_addon.data.capture.mocap import read_clips
from dafnet_addon.data.motion.canonical import calibrate, canonical, pose_legs
from dafnet_addon.data.motion.interactions import Interaction
from dafnet_addon.data.motion.retarget import at_seat_height, at_top_height
from kit.places import MOCAP

BONES = np.linalg.norm(OFFSETS[1:], axis=1)
SEATED = 0.55
HEIGHTS = [0.40, 0.48, 0.65, 0.78, 0.92]
HIPS, KNEES, ANKLES, TOES, SHOULDERS, ELBOWS, WRISTS = (
    [joint("left_" + n), joint("right_" + n)]
    for n in ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist")
)


def _lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def _lean(joints: np.ndarray) -> np.ndarray:
    trunk = joints[:, joint("neck")] - joints[:, 0]
    return np.arctan2(trunk[:, 1], trunk[:, 2])


def _on_thighs(joints: np.ndarray) -> np.ndarray:
    return joints[:, HIPS] + 0.3 * (joints[:, KNEES] - joints[:, HIPS])


def _sit_down(
    frames: int = 140, hands: str = "hanging", feet_off_floor: float = 0.0, seated: float = SEATED
) -> np.ndarray:
    """A made-up sit-down: the trunk leans, the pelvis goes back and down, the trunk comes up again;
    knees a little apart.
    """
    t = np.arange(frames)
    x = np.clip((t - 40) / 40, 0, 1)
    sits = (x * x * (3 - 2 * x))[:, None]
    lean = 0.7 * np.exp(-(((t - 72) / 14.0) ** 2))
    turn = np.zeros((frames, 3, 3))
    turn[:, 0, 0], turn[:, 1, 1], turn[:, 2, 2] = 1.0, np.cos(lean), np.cos(lean)
    turn[:, 1, 2], turn[:, 2, 1] = np.sin(lean), -np.sin(lean)
    pose = REST.copy()
    for side, sign in (("left_", -1), ("right_", 1)):
        pose[joint(side + "elbow")] = pose[joint(side + "shoulder")] + 0.26 * np.array(
            [sign * 0.1, -0.1, -np.sqrt(0.98)]
        )
        pose[joint(side + "wrist")] = pose[joint(side + "elbow")] + 0.25 * np.array(
            [0.0, 0.6, -0.8]
        )
    pelvis = REST[0] + np.array([0.0, -0.42, seated - REST[0, 2]]) * sits
    joints = pelvis[:, None] + np.einsum("tij,nj->tni", turn, pose - pose[0])
    joints[:, ANKLES + TOES] = (
        REST[ANKLES + TOES] + np.array([0.0, 0.0, feet_off_floor]) * sits[:, None]
    )
    joints[:, KNEES] = (joints[:, HIPS] + joints[:, ANKLES]) / 2 + np.array(
        [[-0.08, 0.3, 0.2], [0.08, 0.3, 0.2]]
    )
    joints = pose_legs(joints)
    if hands == "on thighs":
        resting = _on_thighs(joints) + np.array([0.0, 0.0, 0.09])
        wrists = joints[:, WRISTS] + sits[:, None] * (resting - joints[:, WRISTS])
        joints[:, ELBOWS], joints[:, WRISTS] = two_bone(
            joints[:, SHOULDERS], wrists, joints[:, ELBOWS], 0.26, 0.25
        )
    assert np.abs(_lengths(joints) - BONES).max() < 1e-6
    return joints


@pytest.mark.parametrize("wanted", HEIGHTS)
def test_the_pelvis_rests_where_it_is_wanted_and_bones_and_standing_stay(wanted):
    joints = _sit_down()
    moved = at_seat_height(joints, SEATED, wanted)
    assert np.abs(moved[-30:, 0, 2] - wanted).max() < 1e-9
    assert np.abs(moved[:10] - joints[:10]).max() < 1e-6
    assert np.abs(_lengths(moved) - BONES).max() < 1e-6


@pytest.mark.parametrize("wanted", HEIGHTS)
def test_planted_toes_stay_and_on_a_high_seat_heels_lift_before_them(wanted):
    joints = _sit_down()
    moved = at_seat_height(joints, SEATED, wanted)
    if wanted < 0.8:
        assert np.abs(moved[:, TOES] - joints[:, TOES]).max() < 1e-9
    else:
        assert np.abs(moved[:, TOES] - joints[:, TOES]).max() < 0.06
        assert (moved[-1, ANKLES, 2] > joints[-1, ANKLES, 2] + 0.02).all()
    assert (moved[:, ANKLES, 2] > joints[:, ANKLES, 2] - 1e-9).all() and moved[
        :, TOES, 2
    ].min() > TOE_HEIGHT - 1e-9


def test_a_motion_moved_to_its_own_height_is_itself():
    joints = _sit_down(hands="on thighs")
    assert np.abs(at_seat_height(joints, SEATED, SEATED) - joints).max() < 1e-6


@pytest.mark.parametrize("wanted", HEIGHTS)
def test_it_knows_neither_left_from_right_nor_which_way_time_runs_nor_how_often_one_sits(wanted):
    joints = _sit_down(hands="on thighs")
    joints[:, joint("left_wrist")] = joints[:, joint("left_elbow")] + [0.0, 0.25, 0.0]
    moved = at_seat_height(joints, SEATED, wanted)
    assert np.abs(at_seat_height(joints[::-1], SEATED, wanted) - moved[::-1]).max() < 1e-9
    flip = np.array([-1.0, 1.0, 1.0])
    assert (
        np.abs(
            at_seat_height(joints[:, MIRROR] * flip, SEATED, wanted) - moved[:, MIRROR] * flip
        ).max()
        < 1e-9
    )
    twice = at_seat_height(np.concatenate([joints, joints[::-1], joints]), SEATED, wanted)
    assert np.abs(twice[:140] - moved).max() < 1e-9 and np.abs(twice[280:] - moved).max() < 1e-9


def test_the_trunk_leans_further_to_a_lower_seat_less_to_a_higher_one_and_as_before_at_rest():
    joints = _sit_down()
    low, high = (at_seat_height(joints, SEATED, wanted) for wanted in (0.42, 0.75))
    assert np.degrees(_lean(low).max() - _lean(joints).max()) > 4
    assert np.degrees(_lean(joints).max() - _lean(high).max()) > 4
    for moved in (low, high):
        assert np.abs(_lean(moved)[-20:] - _lean(joints)[-20:]).max() < np.radians(1)
    head = low[:, joint("head")] - low[:, joint("neck")]
    assert np.abs(head - (joints[:, joint("head")] - joints[:, joint("neck")])).max() < 1e-9, (
        "the face looks where it did"
    )


@pytest.mark.parametrize("wanted", [0.40, 0.65, 0.75])
def test_balance_is_kept_while_no_seat_carries_the_body(wanted):
    joints = _sit_down()
    moved = at_seat_height(joints, SEATED, wanted)
    free = joints[:, 0, 2] > SEATED + 0.12
    trunk = [0, joint("spine2"), joint("spine3"), joint("head"), *HIPS, *SHOULDERS]
    assert np.abs((moved - joints)[free][:, trunk].mean(1)[:, :2]).max() < 0.015
    assert np.abs((moved - joints)[-30:, 0, :2]).max() < 1e-6, (
        "on the seat the pelvis does not slide"
    )


def test_knees_keep_their_plane():
    joints = _sit_down()

    def hinges(j: np.ndarray) -> np.ndarray:
        normal = np.cross(j[60:, KNEES] - j[60:, HIPS], j[60:, ANKLES] - j[60:, KNEES])
        return normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    for wanted in HEIGHTS:
        turned = (hinges(joints) * hinges(at_seat_height(joints, SEATED, wanted))).sum(-1)
        assert np.degrees(np.arccos(turned.min())) < 12, wanted


@pytest.mark.parametrize("wanted", [0.42, 0.65])
def test_hands_go_with_what_they_are_near_to(wanted):
    joints = _sit_down(hands="on thighs")
    joints[:, joint("left_wrist")] = joints[:, joint("left_elbow")] + [0.0, 0.15, 0.2]
    moved = at_seat_height(joints, SEATED, wanted)
    right = joint("right_wrist")
    shift = (moved - joints)[-30:, right] - (_on_thighs(moved) - _on_thighs(joints))[-30:, 1]
    assert np.linalg.norm(shift, axis=-1).max() < 0.02, "a hand that rests on a thigh stays on it"
    assert np.abs((moved - joints)[-30:, right, 2]).max() < abs(wanted - SEATED) - 0.02
    raised = moved[:, joint("left_wrist")] - moved[:, joint("left_shoulder")]
    assert (
        np.abs(raised - (joints[:, joint("left_wrist")] - joints[:, joint("left_shoulder")])).max()
        < 1e-6
    )


@pytest.mark.parametrize("rise", [-0.12, -0.05, 0.08])
def test_hands_go_with_the_top_that_they_work_on_and_come_to_it_smoothly(rise):
    joints = _sit_down(200)
    place = joints[-1, SHOULDERS[1]] + np.array([0.0, 0.28, -0.24])
    x = np.clip((np.arange(200) - 100) / 40, 0, 1)
    wrists = joints[:, WRISTS].copy()
    share = (x**3 * (10 - 15 * x + 6 * x * x))[:, None]
    wrists[:, 1] += share * (place - wrists[:, 1])
    joints[:, ELBOWS], joints[:, WRISTS] = two_bone(
        joints[:, SHOULDERS], wrists, joints[:, ELBOWS], 0.26, 0.25
    )
    use = Interaction("desk", 145, 200, joints[145:, WRISTS[1]], 0.0)
    moved = at_top_height(joints, use, rise)
    up = moved[:, WRISTS[1], 2] - joints[:, WRISTS[1], 2]
    assert np.abs(up[145:] - rise).max() < 1e-6 and np.abs(up[:115]).max() < 1e-6
    assert np.abs(np.diff(up)).max() < 0.02 and np.abs(_lengths(moved) - BONES).max() < 1e-6
    others = [j for j in range(22) if j not in (ELBOWS[1], WRISTS[1])]
    assert np.abs(moved[:, others] - joints[:, others]).max() < 1e-6, "the other hand hangs"
    assert np.abs(at_top_height(joints, use, 0.0) - joints).max() < 1e-6
    far = at_top_height(joints, use, -0.6)
    arm = np.linalg.norm(far[:, WRISTS[1]] - far[:, SHOULDERS[1]], axis=-1)
    assert arm[145:].max() < 0.49 + 1e-6, "an arm is never stretched for it"


def test_hanging_feet_come_down_with_the_seat_to_the_floor():
    joints = _sit_down(feet_off_floor=0.22, seated=0.80)
    lower, lowest = (at_seat_height(joints, 0.80, wanted) for wanted in (0.70, 0.45))
    assert np.abs(lower[-1, TOES, 2] - (joints[-1, TOES, 2] - 0.10)).max() < 1e-6
    assert (
        np.abs(lowest[-1, TOES, 2] - TOE_HEIGHT).max() < 1e-6
        and lowest[:, TOES, 2].min() > TOE_HEIGHT - 1e-6
    )


@pytest.fixture(scope="module")
def real_sit_downs(tmp_path_factory) -> list[np.ndarray]:
    folder = tmp_path_factory.mktemp("mocap")
    (folder / "rocketbox.npz").symlink_to(MOCAP / "rocketbox.npz")
    clips = [c for c in read_clips(folder) if c.subject == "male"]
    body = calibrate(clips)
    return [canonical(c, body) for c in clips if c.category in ("sit_down", "stand_up")]


@pytest.mark.mocap
@pytest.mark.parametrize("wanted", HEIGHTS)
def test_real_sit_downs_stay_smooth_and_planted(real_sit_downs, wanted):
    for joints in real_sit_downs:
        resting = float(np.median(np.sort(joints[:, 0, 2])[:20]))
        moved = at_seat_height(joints, resting, wanted)
        assert np.abs(_lengths(moved) - BONES).max() < 1e-6
        assert np.abs(moved[joints[:, 0, 2] < resting + 0.002, 0, 2] - wanted).max() < 0.02
        speed, before = (
            np.linalg.norm(np.diff(j, axis=0), axis=-1).max() * 30 for j in (moved, joints)
        )
        assert speed < before + 0.6 and jerk(moved, 30) < 1.35 * jerk(joints, 30)
        assert foot_sliding(moved, 30).sum() <= foot_sliding(joints, 30).sum() + (
            0 if wanted < 0.85 else 5
        )
        planted = (joints[:, TOES, 2] < 0.04) & (
            np.linalg.norm(np.gradient(joints[:, TOES], axis=0), axis=-1) < 0.003
        )
        assert np.abs(moved[:, TOES] - joints[:, TOES])[planted].max() < (
            0.005 if wanted < 0.85 else 0.05
        )
