"""Where the body touches: feet on the floor, hands at work, the pelvis at rest, told from height,
speed and duration.
"""

import numpy as np

from ...core.series import MODEL_FPS, runs
from ...core.skeleton import ANKLES, TOE_HEIGHT, joint

__all__ = ["CONTACTS", "contacts"]

CONTACTS = ("left_foot", "right_foot", "left_hand", "right_hand", "pelvis")
"""Columns of ``contacts``."""

_MEDIAN = 5  # frames: a lone frame neither makes nor breaks a contact
_TOE_HIGH, _ANKLE_HIGH, _FOOT_SLOW = TOE_HEIGHT + 0.035, 0.13, 0.35
_HAND_SLOW, _HAND_FRAMES = 0.10, 9
_AT_WORK = 0.40, 1.9  # heights of hands that may have something to touch
_PELVIS_LOW, _PELVIS_SLOW, _PELVIS_FRAMES = 0.86, 0.12, 8


def _median(values: np.ndarray) -> np.ndarray:
    """Running median of ``values`` (T, …) over ``_MEDIAN`` frames; the ends are held."""
    half = _MEDIAN // 2
    padded = np.concatenate(
        [np.repeat(values[:1], half, axis=0), values, np.repeat(values[-1:], half, axis=0)]
    )
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, _MEDIAN, axis=0), axis=-1)


def _lasting(flags: np.ndarray, shortest: int) -> np.ndarray:
    out = np.zeros_like(flags)
    for start, end in runs(flags, shortest):
        out[start:end] = True
    return out


def contacts(joints: np.ndarray) -> np.ndarray:
    """Contacts (T, 5) bool of a motion (T, 22, 3) in metres at 30 fps: left foot, right foot, left
    hand, right hand, pelvis.

    A foot touches while its toe base or heel is near the floor z = 0 and slow. A hand touches while
    it is still for 0.3 s where there may be furniture and the arm does not simply hang. The pelvis
    touches while it is low and still for a quarter of a second, in sitting or lying; in a squat the
    feet are under it.
    """
    out = np.zeros((len(joints), len(CONTACTS)), dtype=bool)
    if len(joints) < 2:
        return out

    height = _median(joints[..., 2])
    speed = _median(np.linalg.norm(np.gradient(joints, axis=0), axis=-1) * MODEL_FPS)
    for column, side in enumerate(("left_", "right_")):
        toe, ankle, elbow, wrist = (
            joint(side + part) for part in ("foot", "ankle", "elbow", "wrist")
        )
        on_toe = (height[:, toe] < _TOE_HIGH) & (speed[:, toe] < _FOOT_SLOW)
        on_heel = (height[:, ankle] < _ANKLE_HIGH) & (speed[:, ankle] < _FOOT_SLOW)
        out[:, column] = _lasting(_median((on_toe | on_heel).astype(float)) > 0.5, 3)
        drop = height[:, elbow] - height[:, wrist]
        hangs = drop > 0.85 * np.linalg.norm(joints[:, elbow] - joints[:, wrist], axis=-1)
        there = (height[:, wrist] > _AT_WORK[0]) & (height[:, wrist] < _AT_WORK[1])
        out[:, 2 + column] = _lasting((speed[:, wrist] < _HAND_SLOW) & there & ~hangs, _HAND_FRAMES)

    pelvis, ankles = joint("pelvis"), ANKLES
    to_feet = joints[:, ankles].mean(1) - joints[:, pelvis]
    carried = (np.linalg.norm(to_feet[:, :2], axis=-1) > 0.15) | (to_feet[:, 2] > -0.2)
    low = (height[:, pelvis] < _PELVIS_LOW) & (speed[:, pelvis] < _PELVIS_SLOW)
    out[:, 4] = _lasting(low & carried, _PELVIS_FRAMES)
    return out
