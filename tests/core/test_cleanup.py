"""The clean-up: planted feet stay, targets are met, bones keep their lengths, and where nothing is
asked nothing changes.
"""

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, InputError, Scene, generate, load_weights
from dafnet_addon.core.cleanup import (
    cleaned,
    cleared,
    planted,
    reach_targets,
    smoothed_out,
    standing_still,
)
from dafnet_addon.core.generate import clean_again_steps
from dafnet_addon.core.kinematics import on_bones
from dafnet_addon.core.metrics import foot_sliding, jerk
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.skeleton import (
    END_EFFECTORS,
    JOINTS,
    OFFSETS,
    PARENTS,
    REST,
    TOE_HEIGHT,
    joint,
)
from dafnet_addon.core.sliding import slides
from dafnet_addon.core.solids import box_distance
from dafnet_addon.core.storage import packed, unpacked

BONES = np.linalg.norm(OFFSETS[1:], axis=1)
TOES = [joint("left_foot"), joint("right_foot")]
ALL = CleanUp(feet=1.0, reach=1.0, seat=1.0)


def _lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def _hanging() -> np.ndarray:
    """The rest pose with bent knees and arms, hands before the body."""
    pose = REST.copy()
    for side, sign in (("left_", -1.0), ("right_", 1.0)):
        pose[joint(side + "elbow")] = pose[joint(side + "shoulder")] + np.array(
            [sign * 0.05, -0.05, -0.25014]
        )
        pose[joint(side + "wrist")] = pose[joint(side + "elbow")] + np.array([0.0, 0.2, -0.15])
    return pose


def _sliding(frames: int = 60) -> np.ndarray:
    """A body that stands, carried along by 6 mm a frame for a second, its right foot in the air
    meanwhile.
    """
    joints = np.repeat(_hanging()[None], frames, axis=0)
    joints[..., 2] -= 0.02
    joints[:, :, 0] += np.clip(np.arange(frames) - 15, 0, 20)[:, None] * 0.005
    joints[15:36, [joint("right_ankle"), joint("right_foot")], 2] += (
        0.1 * np.sin(np.linspace(0, np.pi, 21))[:, None]
    )
    return joints


def test_feet_that_stand_stay_and_those_in_the_air_do_not():
    joints = _sliding()
    stands = standing_still(joints)
    assert {foot for foot, _, _ in stands} == {0, 1} and any(
        end - start > 50 for foot, start, end in stands if foot == 0
    )
    out = planted(joints)
    for foot, start, end in stands:
        toe = out[start:end, TOES[foot]]
        assert np.abs(np.diff(toe, axis=0)).max() < 1e-6 and np.allclose(toe[:, 2], TOE_HEIGHT)
    assert np.ptp(out[:, TOES[1], 2]) > 0.06, "the foot in the air keeps its step"
    assert (
        foot_sliding(out, 30.0)[stands[0][1] : stands[0][2]].sum()
        <= foot_sliding(joints, 30.0).sum()
    )
    assert np.abs(_lengths(out) - BONES).max() < 1e-3


def test_a_foot_that_creeps_under_a_body_that_rests_stays_and_under_one_that_leaves_goes_along():
    """Twenty centimetres in a second: no stand is given up for it, unless the pelvis goes too."""
    joints = np.repeat(REST[None], 30, axis=0)
    creeps = np.linspace(0.0, 0.2, 30)[:, None, None] * (0.0, 1.0, 0.0)
    joints[..., 2] -= 0.25
    joints[:, [joint("left_ankle"), joint("left_foot")], 2] += 0.25
    joints[:, [joint("left_ankle"), joint("left_foot")]] += creeps
    out = on_bones(joints)
    assert np.ptp(planted(out)[:, TOES[0], 1]) < 0.005
    assert np.ptp(planted(out + creeps)[:, TOES[0], 1]) > 0.1


def test_a_foot_that_is_drawn_over_the_floor_to_its_next_place_is_lifted():
    joints = np.repeat(_hanging()[None], 60, axis=0)
    joints[..., 2] -= joints[0, TOES, 2].min() - TOE_HEIGHT + 0.05
    joints[:, [joint("right_ankle"), TOES[1]], 2] += 0.05
    joints[:, [joint("left_ankle"), TOES[0]], 2] += 0.05
    way = 0.4 * np.clip((np.arange(60) - 20) / 15, 0.0, 1.0)
    joints[:, [joint("right_knee"), joint("right_ankle"), TOES[1]], 1] += way[:, None] - 0.2
    joints = on_bones(joints)
    scrapes = slides(joints, 30.0)[:, 1].max()
    made = planted(joints)
    height = made[:, TOES[1], 2] - TOE_HEIGHT
    assert scrapes > 0.2 and slides(made, 30.0)[:, 1].max() == 0.0
    assert 0.012 < height.max() < 0.03 and np.abs(height[[10, 50]]).max() < 1e-6
    assert np.abs(np.diff(height)).max() < 0.008, "softly"
    assert np.abs(made[:, TOES[0], 2] - TOE_HEIGHT).max() < 1e-6, "the other one stands"


def test_the_pelvis_comes_down_where_legs_are_too_short():
    joints = np.repeat(REST[None], 40, axis=0)
    # Straight legs, and a foot that is led 12 cm out while the other stands: only a lower pelvis
    # lets both reach.
    joints[:, [joint("left_ankle"), joint("left_foot")]] += np.linspace(0, 0.1, 40)[
        :, None, None
    ] * (-1.0, 0.0, 0.0)
    out = planted(joints)
    assert (out[:, 0, 2] <= joints[:, 0, 2] + 1e-9).all() and np.abs(
        np.diff(out[:, 0, 2], 2)
    ).max() < 2e-3
    for foot, start, end in standing_still(joints):
        assert np.abs(np.diff(out[start:end, TOES[foot]], axis=0)).max() < 1e-3


def test_heights_follow_the_floor():
    joints = _sliding() + np.array([0.0, 0.0, 3.0])
    assert not standing_still(joints)
    assert np.allclose(planted(joints, 3.0), planted(_sliding()) + np.array([0.0, 0.0, 3.0]))


@pytest.mark.parametrize("name", list(END_EFFECTORS))
def test_targets_within_reach_are_met_and_bones_keep_their_length(name):
    frames = 40
    joints = np.repeat(_hanging()[None], frames, axis=0)
    place = joints[:, END_EFFECTORS[name]] + np.array([0.03, 0.06, 0.0 if name == "head" else 0.12])
    if name == "head":
        place[:, 2] -= 0.03
    target = np.where((np.arange(frames) >= 15)[:, None], place, np.nan)
    out = reach_targets(joints, {name: target})
    assert np.linalg.norm(out[15:, END_EFFECTORS[name]] - place[15:], axis=-1).max() < 1e-3
    assert np.abs(_lengths(out) - BONES).max() < 1e-3
    assert np.abs(out[:4] - joints[:4]).max() < 1e-3, "long before the target nothing moves"
    assert np.linalg.norm(np.diff(out, axis=0), axis=-1).max() < 0.05, "it is led there, not thrown"
    legs = [
        j
        for j, name in enumerate(JOINTS)
        if name.split("_")[-1] in ("pelvis", "hip", "knee", "ankle", "foot")
    ]
    assert np.array_equal(out[:, legs], joints[:, legs])


def test_targets_out_of_reach_are_approached_without_folding_the_body():
    joints = np.repeat(_hanging()[None], 30, axis=0)
    far = joints[:, joint("right_shoulder")] + np.array([0.0, 3.0, 0.0])
    out = reach_targets(joints, {"hand_right": far})
    assert 0.4 < out[0, joint("right_wrist"), 1] - joints[0, joint("right_shoulder"), 1] < 0.9
    assert np.linalg.norm(out[:, joint("neck")] - joints[:, joint("neck")], axis=-1).max() < 0.35
    assert np.abs(_lengths(out) - BONES).max() < 1e-3


def test_nothing_is_done_where_nothing_is_asked():
    joints = _sliding()
    free = dict.fromkeys(END_EFFECTORS, np.full((len(joints), 3), np.nan))
    assert reach_targets(joints, free) is joints and cleaned(joints, free, CleanUp()) is joints
    half = planted(joints, strength=0.5)
    whole = planted(joints)
    moved = (whole - joints)[:, TOES[0], 0]
    assert np.allclose((half - joints)[:, TOES[0], 0], moved / 2, atol=2e-3)
    for strengths in ((-0.1, 0.0), (0.0, 1.5), (float("nan"), 0.0), (0.0, 0.0, 2.0)):
        with pytest.raises(InputError, match="from 0 to 1"):
            CleanUp(*strengths)


@pytest.mark.slow
@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
def test_takes_are_cleaned_at_any_rate(fps):
    weights = load_weights()
    seat = Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.22, 0.22, 0.225]))
    path = route(Stop((2.0, 0.9), np.pi / 2), Stop((0.0, 0.0), 0.0, seconds=2.0, seated=True)).path
    times = np.arange(0.0, (len(path) - 1) / 30.0, 1.0 / fps)
    root = path.matrices()[np.round(times * 30).astype(int)]
    target = np.tile(path.position[-1] + np.array([0.25, 0.35, 1.0]), (len(times), 1))
    begin = len(times) - int(1.2 * fps)
    target[:begin] = np.nan
    controls = Controls(fps, root, mode="EE", hand_right=target)
    raw, clean = (generate(Scene([seat]), controls, weights, clean_up=c) for c in (CleanUp(), ALL))
    last = slice(begin + 2, len(times) - 1)
    before, after = (
        np.linalg.norm(t.joints[last, 21] - target[last], axis=-1).mean() for t in (raw, clean)
    )
    assert after < 0.002 + 0.1 * before
    assert foot_sliding(clean.joints, fps).mean() <= foot_sliding(raw.joints, fps).mean()
    assert np.abs(_lengths(clean.joints) - BONES).max() < 1e-5
    assert jerk(clean.joints, fps) < 2.5 * jerk(raw.joints, fps) + 60.0
    assert np.array_equal(raw.poses, clean.poses), "the take's own poses are untouched"


def _box(low: tuple[float, float, float], high: tuple[float, float, float]):
    """Distance to a box between two corners."""
    middle, half = np.add(low, high) / 2, np.subtract(high, low) / 2
    return lambda points: box_distance(points - middle, half)


def test_hands_and_feet_come_out_of_furniture_and_the_rest_stays():
    joints = on_bones(np.repeat(_hanging()[None], 60, axis=0))
    hand, foot = END_EFFECTORS["hand_left"], joint("right_ankle")
    reach = _box(joints[0, hand] + (-0.2, -0.05, -0.5), joints[0, hand] + (0.2, 0.5, 0.06))
    out = cleared(joints, reach, {})
    assert reach(joints[:, [hand]]).max() < -0.04 and reach(out[20:40, [hand]]).min() > 0.025
    assert np.abs(_lengths(out) - BONES).max() < 1e-6
    moved = {JOINTS[j] for j in range(22) if np.abs(out[:, j] - joints[:, j]).max() > 1e-6}
    assert moved == {"left_elbow", "left_wrist"}
    target = {"hand_left": joints[:, hand]}
    assert np.allclose(cleared(joints, reach, target), joints, atol=1e-6), (
        "what has a target is left to it"
    )
    low = _box(joints[0, foot] - (0.02, 0.08, 0.08), joints[0, foot] + (0.08, 0.08, 0.08))
    out = cleared(joints, low, {})
    assert (
        np.allclose(out[:, foot, 2], joints[:, foot, 2], atol=3e-3)
        and low(out[20:40, [foot]]).min() > 0.01
    )
    far = _box((5.0, 5.0, 0.0), (6.0, 6.0, 1.0))
    assert cleared(joints, far, {}) is joints
    half, whole = ((each - joints)[30, foot] for each in (cleared(joints, low, {}, 0.5), out))
    assert np.allclose(half, whole / 2, atol=1e-3)


def test_smoothing_evens_out_and_keeps_bones_and_straight_ways():
    rng = np.random.default_rng(0)
    still = np.repeat(_hanging()[None], 60, axis=0) + np.arange(60)[:, None, None] * (
        0.0,
        0.03,
        0.0,
    )
    shaking = on_bones(still + 0.01 * rng.normal(size=still.shape))
    out = smoothed_out(shaking)
    assert (
        jerk(out, 30.0) < 0.1 * jerk(shaking, 30.0)
        and np.abs(out - still).mean() < np.abs(shaking - still).mean()
    )
    assert np.abs(_lengths(out) - BONES).max() < 1e-6
    assert np.allclose(smoothed_out(on_bones(still)), on_bones(still), atol=1e-6)


def test_cleaned_again_is_as_if_generated_so():
    weights, scene = (
        load_weights(),
        Scene([Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.22, 0.22, 0.225]))]),
    )
    path = route(Stop((1.6, 0.9), np.pi / 2), Stop((0.0, 0.0), 0.0, seconds=1.0, seated=True)).path
    controls = Controls(30.0, path.matrices())
    raw, clean = (generate(scene, controls, weights, clean_up=c) for c in (CleanUp(), ALL))
    kept, asked = unpacked(packed(raw, controls))
    again = run_to_end(clean_again_steps(scene, asked, kept, ALL))
    assert np.abs(again.joints - clean.joints).max() < 1e-4 and np.array_equal(
        again.poses, kept.poses
    )
    assert clean.metrics["foot_sliding_per_frame"] < clean.raw_metrics["foot_sliding_per_frame"]
    assert clean.raw_metrics == raw.metrics and again.log_likelihood == raw.log_likelihood
    with pytest.raises(InputError, match="other frames"):
        run_to_end(clean_again_steps(scene, Controls(30.0, path.matrices()[:40]), kept, ALL))
    with pytest.raises(InputError, match="generate it again"):
        unpacked(b"no take")


def test_a_head_that_is_asked_out_of_reach_does_not_shake():
    path = route(Stop((0.0, 0.0), 0.0, 0.2), Stop((0.0, 2.0), 0.0, 0.2)).path
    head = np.tile((0.0, 0.0, 1.6), (len(path), 1))
    controls = Controls(
        30.0, path.matrices(), mode="EE", head=head, hand_left=head - (0.3, 0.0, 0.7)
    )
    raw, clean = (
        generate(Scene(), controls, load_weights(), clean_up=c)
        for c in (CleanUp(), CleanUp(reach=1.0))
    )
    assert jerk(clean.joints, 30.0) < jerk(raw.joints, 30.0) + 78.0, (
        "no more than real motion has on top"
    )
