"""Finds frames of captured motion that are not motion: T-poses, frozen or lost joints, flips,
impossible speeds.

What is found is cut, never mended, and said with its reason.
"""

from dataclasses import dataclass

import numpy as np

from ...core.rotations import normalised
from ...core.series import MODEL_FPS, runs
from ...core.skeleton import PARENTS, UPPER, joint

__all__ = ["REASONS", "Cut", "bad_frames", "cuts"]

REASONS = ("T-pose", "dropout", "flip", "speed")
"""Why frames are cut: straight arms held out over straight legs, as for calibration; joints that
stand still for some frames and then jump, or leave their bone; a body turned by over 70 degrees in
a frame; a joint faster than a body can.
"""

# metres a second: sprinting; a thrown hand or a kicking foot seen from the pelvis
_FASTEST_ROOT, _FASTEST_LIMB = 9.0, 13.0
_JUMP = 0.05  # metres in a frame, after joints stood still to the tenth of a millimetre
_FROZEN = 3  # frames
_T_POSE = 5  # frames


@dataclass(frozen=True)
class Cut:
    """Frames ``start`` to ``end`` (exclusive) are bad because of ``reason``."""

    start: int
    end: int
    reason: str


def _t_pose(joints: np.ndarray, limbs: np.ndarray) -> np.ndarray:
    """Where straight arms are held out to the sides over straight legs, and the raising and
    lowering of the arms around it.
    """

    def direction(a: str, b: str) -> np.ndarray:
        return normalised(joints[:, joint(b)] - joints[:, joint(a)])

    left, right = (
        direction("left_shoulder", "left_wrist"),
        direction("right_shoulder", "right_wrist"),
    )
    apart = (left * right).sum(-1)
    straight = np.ones(len(joints), dtype=bool)
    for side in ("left_", "right_"):
        straight &= (
            direction(side + "shoulder", side + "elbow") * direction(side + "elbow", side + "wrist")
        ).sum(-1) > 0.85
        straight &= direction(side + "hip", side + "ankle")[:, 2] < -0.96

    level = (left[:, 2] > -0.6) & (right[:, 2] > -0.6) & (np.abs(left[:, 2] - right[:, 2]) < 0.25)
    held = (
        straight & level & (apart < -0.6) & (np.concatenate([limbs, limbs[-1:]]) * MODEL_FPS < 0.7)
    )
    out = np.zeros(len(joints), dtype=bool)
    for start, end in runs(straight & (apart < 0.0)):
        out[start:end] = held[start:end].sum() >= _T_POSE

    return out


def _dropout(joints: np.ndarray, step: np.ndarray) -> np.ndarray:
    bad = np.zeros(len(joints), dtype=bool)
    # A frozen joint that jumps when it comes back was not seen meanwhile; one that does not may
    # simply have rested. Planted feet stand quite still in cleaned motion, and leave the floor
    # fast.
    for j in UPPER:
        for start, end in runs(step[:, j] < 1e-4):
            jumps = max(
                step[start - 1, j] if start else 0.0, step[end, j] if end < len(step) else 0.0
            )
            if end - start >= _FROZEN and jumps > _JUMP:
                bad[start : end + 1] = True

    bones = np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)
    usual = np.median(bones, axis=0)
    return bad | (np.abs(bones - usual) > np.maximum(0.35 * usual, 0.06)).any(1)


def _flip(joints: np.ndarray) -> np.ndarray:
    across = normalised(joints[:, joint("right_hip")] - joints[:, joint("left_hip")])
    shoulders = normalised(joints[:, joint("right_shoulder")] - joints[:, joint("left_shoulder")])
    turned = [(v[1:] * v[:-1]).sum(-1) < np.cos(np.radians(70)) for v in (across, shoulders)]
    return turned[0] | turned[1]


def _both_sides(between: np.ndarray) -> np.ndarray:
    """From flags (T - 1,) between frames to flags (T,) on the frames on both sides."""
    return np.concatenate([between, [False]]) | np.concatenate([[False], between])


def bad_frames(joints: np.ndarray) -> dict[str, np.ndarray]:
    """For each of ``REASONS`` the frames (T,) of joints (T, 22, 3), 30 fps, metres, z up, that are
    bad because of it.
    """
    if len(joints) < 2:
        return {reason: np.zeros(len(joints), dtype=bool) for reason in REASONS}

    step = np.linalg.norm(np.diff(joints, axis=0), axis=-1)
    limbs = np.linalg.norm(np.diff(joints - joints[:, :1], axis=0), axis=-1).max(1)
    fast = (step[:, 0] * MODEL_FPS > _FASTEST_ROOT) | (limbs * MODEL_FPS > _FASTEST_LIMB)
    flips = _flip(joints)
    return {
        "T-pose": _t_pose(joints, limbs),
        "dropout": _dropout(joints, step),
        "flip": _both_sides(flips),
        "speed": _both_sides(fast & ~flips),
    }


def cuts(joints: np.ndarray) -> list[Cut]:
    """What to cut from joints (T, 22, 3), 30 fps, metres, z up: runs of bad frames, each with its
    reason, in order of time.
    """
    found = [
        Cut(int(a), int(b), reason)
        for reason, bad in bad_frames(joints).items()
        for a, b in runs(bad)
    ]
    return sorted(found, key=lambda cut: (cut.start, cut.end))
