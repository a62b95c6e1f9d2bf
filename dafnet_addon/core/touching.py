"""What hands and feet hold on to, frame by frame: where they are, not how limbs lie, is what counts
there on another body.
"""

from collections.abc import Mapping

import numpy as np

from .resting import Distance
from .root import gaussian
from .rotations import normalised
from .series import smoothstep
from .skeleton import ELBOWS, FEET, HEAD, HIPS, KNEES, LIMBS, TARGETS, TOE_HEIGHT, WRISTS

__all__ = ["in_lap", "touches"]

_PALM = 0.08  # metres from the wrist on
_NEAR, _FAR = 0.03, 0.06  # metres from what a palm touches, and where it is free
_THIGH, _SKULL, _OTHER = 0.075, 0.11, 0.04  # metres of flesh around thighs, head and the other palm
# Upwards, of the way from a thigh to a palm that hangs beside it, and that lies on it.
_BESIDE, _ON = 0.1, 0.5
_ASIDE = 0.12  # metres by which a palm that hangs beside a thigh counts as farther from it
_UPRIGHT = 0.8  # of a thigh: nothing lies in the lap of one who stands
_LOW, _HIGH = 0.10, 0.25  # metres of a toe over the floor: it may touch, and it is free
_EASE = 0.15  # seconds in which a hold begins and ends


def touches(
    joints: np.ndarray,
    fps: float,
    floor: np.ndarray | float = 0.0,
    distance: Distance | None = None,
    targets: Mapping[str, np.ndarray] | None = None,
) -> np.ndarray:
    """How far (T, 4) the ends of ``LIMBS`` hold on to something, from 0, free, to 1.

    ``joints`` (T, 22, 3): world, canonical metres, ``fps`` a second. Hands hold on to furniture, by
    its ``distance`` where that is given, to thighs that are no more upright, the head and each
    other, and to ``targets``, as of ``conditions.targets_of``; feet to the ``floor``, and to
    targets.
    """
    shares = np.zeros((len(joints), len(LIMBS)))
    palms = _palms(joints)
    gaps = [_to_own_body(joints, palms)]
    if distance is not None:
        gaps.append(np.minimum(distance(palms), distance(joints[:, WRISTS])))
    shares[:, :2] = smoothstep((_FAR - np.min(gaps, axis=0)) / (_FAR - _NEAR))

    height = joints[:, FEET, 2] - np.reshape(floor, (-1, 1)) - TOE_HEIGHT
    shares[:, 2:] = smoothstep((_HIGH - height) / (_HIGH - _LOW))

    ends = [end for _, _, end in LIMBS.values()]
    for name, joint in TARGETS.items():
        if targets is not None and name in targets and joint in ends:
            asked = np.isfinite(targets[name]).all(axis=-1)
            shares[asked, ends.index(joint)] = 1.0

    return _eased(shares, fps)


def in_lap(joints: np.ndarray, fps: float) -> np.ndarray:
    """How far (T, 2, 2) each hand lies on the left and the right thigh, from 0, free, to 1; joints
    as for ``touches``.
    """
    gaps = np.stack(_to_thighs(joints, _palms(joints)), axis=-1)
    return _eased(smoothstep((_FAR - gaps) / (_FAR - _NEAR)), fps)


def _palms(joints: np.ndarray) -> np.ndarray:
    """Places (T, 2, 3)."""
    wrists = joints[:, WRISTS]
    return wrists + _PALM * normalised(wrists - joints[:, ELBOWS])


def _eased(shares: np.ndarray, fps: float) -> np.ndarray:
    """Shares (T, …) that begin and end softly."""
    return np.maximum(shares, np.clip(gaussian(shares, _EASE * fps), 0.0, 1.0))


def _to_own_body(joints: np.ndarray, palms: np.ndarray) -> np.ndarray:
    """Metres (T, 2) from the palms to the body's own thighs, head, and the other palm."""
    to_head = np.linalg.norm(palms - joints[:, [HEAD]], axis=-1) - _SKULL
    apart = np.repeat(np.linalg.norm(np.diff(palms, axis=1), axis=-1), 2, axis=1) - _OTHER
    return np.min([to_head, apart, *_to_thighs(joints, palms)], axis=0)


def _to_thighs(joints: np.ndarray, palms: np.ndarray) -> list[np.ndarray]:
    """Metres (T, 2) from the palms to the left and to the right thigh; more to one that they only
    hang beside, inf to one that is upright.
    """
    gaps = []
    for hip, knee in zip(HIPS, KNEES, strict=True):
        thigh = joints[:, [knee]] - joints[:, [hip]]
        length = np.linalg.norm(thigh, axis=-1)
        along = ((palms - joints[:, [hip]]) * thigh).sum(-1) / np.maximum(length, 1e-9) ** 2
        nearest = joints[:, [hip]] + np.clip(along, 0.0, 1.0)[..., None] * thigh
        upright = -thigh[..., 2] > _UPRIGHT * length
        offset = palms - nearest
        away = np.linalg.norm(offset, axis=-1)
        up = offset[..., 2] / np.maximum(away, 1e-9)
        beside = 1.0 - smoothstep((up - _BESIDE) / (_ON - _BESIDE))
        gaps.append(np.where(upright, np.inf, away - _THIGH + _ASIDE * beside))
    return gaps
