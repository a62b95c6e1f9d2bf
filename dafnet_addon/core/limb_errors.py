"""How well a motion on one body matches the same motion on another."""

import numpy as np

from .rotations import normalised
from .skeleton import HEAD, HIPS, LIMBS, SHOULDERS

__all__ = ["limb_errors"]


def limb_errors(joints: np.ndarray, source: np.ndarray) -> dict[str, np.ndarray]:
    """By how many degrees (T,) the direction of each limb and of the trunk differs from the
    source's; both (T, 22, 3), any size.

    Of a limb the most that either bone's direction, or the bend of elbow or knee, is off; of the
    trunk, the way from the hips to the head or from shoulder to shoulder.
    """
    ours, theirs, found = _directions(joints), _directions(source), {}
    for name in ours:
        off = [_degrees(a, b) for a, b in zip(ours[name], theirs[name], strict=True)]
        if name in LIMBS:
            off.append(np.abs(_degrees(*ours[name]) - _degrees(*theirs[name])))
        found[name.replace("_", " ")] = np.max(off, axis=0)

    return found


def _directions(joints: np.ndarray) -> dict[str, list[np.ndarray]]:
    """What is compared of each part: directions (T, 3), of any length."""
    limbs = {
        name: [
            joints[:, middle] - joints[:, first],
            joints[:, end] - joints[:, middle],
        ]
        for name, (first, middle, end) in LIMBS.items()
    }
    spine = joints[:, HEAD] - joints[:, HIPS].mean(axis=1)
    across = joints[:, SHOULDERS[1]] - joints[:, SHOULDERS[0]]
    return limbs | {"trunk": [spine, across]}


def _degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip((normalised(a) * normalised(b)).sum(-1), -1.0, 1.0)))
