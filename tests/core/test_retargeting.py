"""A motion on bodies of other proportions, without Blender: what the hands lie on, they lie on."""

import numpy as np
import pytest

from dafnet_addon.core.body import Body, canonical_body
from dafnet_addon.core.kinematics import fit, two_bone
from dafnet_addon.core.retargeting import Motion, RetargetedMotion, retarget
from dafnet_addon.core.skeleton import ELBOWS, HIPS, JOINTS, KNEES, PARENTS, REST, SHOULDERS, WRISTS
from dafnet_addon.core.touching import in_lap

FRAMES = 30


def _body(arms: float = 1.0, thighs: float = 1.0) -> Body:
    """The canonical body with arms and thighs of other lengths."""
    rest = np.array(REST)
    longer = {**dict.fromkeys(ELBOWS + WRISTS, arms), **dict.fromkeys(KNEES, thighs)}
    for j in range(1, len(JOINTS)):
        rest[j] = rest[PARENTS[j]] + longer.get(j, 1.0) * (REST[j] - REST[PARENTS[j]])
    own = canonical_body(1.0)
    return Body(rest, own.present, own.alignment)


def _seated(hands: float) -> Motion:
    """Somebody who sits upright, his hands so far along his thighs (0: hips, 1: knees)."""
    joints = np.array(REST)
    for side, (hip, knee) in enumerate(zip(HIPS, KNEES, strict=True)):
        shin = REST[knee + 3] - REST[knee]
        joints[knee] = joints[hip] + (0.0, np.linalg.norm(REST[knee] - REST[hip]), 0.0)
        joints[[knee + 3, knee + 6]] = joints[knee] + [shin, shin + REST[knee + 6] - REST[knee + 3]]
        place = joints[hip] + hands * (joints[knee] - joints[hip]) + (0.0, -0.06, 0.09)
        shoulder, elbow, wrist = SHOULDERS[side], ELBOWS[side], WRISTS[side]
        upper, lower = (
            np.linalg.norm(REST[b] - REST[a]) for a, b in ((shoulder, elbow), (elbow, wrist))
        )
        outward = np.array([[-0.5 if side == 0 else 0.5, -0.5, -0.7]])
        joints[elbow], joints[wrist] = (
            each[0]
            for each in two_bone(
                joints[[shoulder]], place[None], joints[[shoulder]] + outward, upper, lower, outward
            )
        )
    still = np.tile(joints, (FRAMES, 1, 1))
    _, frames = fit(still)
    return Motion(still, frames)


def _onto(body: Body, motion: Motion, landing: bool) -> RetargetedMotion:
    root = np.zeros((FRAMES, 3))
    return retarget(
        motion, canonical_body(1.0), body, root, landing=landing, held=np.zeros((FRAMES, 4))
    )


@pytest.mark.parametrize("landing", [False, True])
@pytest.mark.parametrize(("arms", "thighs"), [(1.2, 1.0), (0.95, 0.9), (1.0, 1.15)])
def test_hands_on_knees_stay_on_knees(arms: float, thighs: float, landing: bool) -> None:
    """Whatever the lengths of arms and thighs: as FULL reads a seated rig, and as a bake goes."""
    motion = _seated(0.75)
    assert in_lap(motion.joints, 30.0)[:, [0, 1], [0, 1]].min() > 0.9, (
        "they lie there to begin with"
    )
    onto = _onto(_body(arms, thighs), motion, landing).motion.joints
    assert in_lap(onto, 30.0)[:, [0, 1], [0, 1]].min() > 0.9
    for side in range(2):
        thigh = onto[0, KNEES[side]] - onto[0, HIPS[side]]
        along = (onto[0, WRISTS[side]] - onto[0, HIPS[side]]) @ thigh / (thigh @ thigh)
        meant = (motion.joints[0, WRISTS[side], 1] - motion.joints[0, HIPS[side], 1]) / (
            motion.joints[0, KNEES[side], 1] - motion.joints[0, HIPS[side], 1]
        )
        assert along == pytest.approx(meant, abs=0.05)


def test_hands_in_the_air_keep_their_arms_pose() -> None:
    motion = _seated(0.75)
    lifted = motion.joints.copy()
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # arms forward and up
    for side in range(2):
        for j in (ELBOWS[side], WRISTS[side]):
            lifted[:, j] = (
                lifted[:, SHOULDERS[side]]
                + (motion.joints[:, j] - motion.joints[:, SHOULDERS[side]]) @ turn.T
            )
    _, frames = fit(lifted)
    onto = _onto(_body(arms=1.25), Motion(lifted, frames), landing=True).motion.joints
    for side in range(2):
        for start, stop in ((SHOULDERS[side], ELBOWS[side]), (ELBOWS[side], WRISTS[side])):
            ours, theirs = onto[0, stop] - onto[0, start], lifted[0, stop] - lifted[0, start]
            assert ours @ theirs > 0.9999 * np.linalg.norm(ours) * np.linalg.norm(theirs)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_a_straight_arm_bends_no_more_than_its_hand_holds_on(share: float) -> None:
    """A body of longer arms, whose hands would have to bend them by far to be in place: as far as
    they hold on, by so much do they bend.
    """
    standing = np.tile(REST, (FRAMES, 1, 1))
    _, frames = fit(standing)
    motion, body = Motion(standing, frames), _body(arms=1.15)

    def bent(hold: float) -> float:
        held = np.zeros((FRAMES, 4))
        held[:, :2] = hold
        onto = retarget(
            motion, canonical_body(1.0), body, np.zeros((FRAMES, 3)), held=held
        ).motion.joints[0]
        upper = onto[ELBOWS[0]] - onto[SHOULDERS[0]]
        lower = onto[WRISTS[0]] - onto[ELBOWS[0]]
        cosine = upper @ lower / np.linalg.norm(upper) / np.linalg.norm(lower)
        return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    assert bent(1.0) > bent(0.0) + 40.0
    assert bent(share) < bent(0.0) + 1.2 * share * (bent(1.0) - bent(0.0))
