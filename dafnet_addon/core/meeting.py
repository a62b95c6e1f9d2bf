"""A part of a take that is made anew between two that stay, and meets the later one without a pop.

The flow is handed more and more of the noise that the kept motion is made of, which draws what it
makes to that motion; of several tries the one that comes nearest is taken, and the last half second
leads from it to the kept poses.
"""

from collections.abc import Generator

import numpy as np

from .beginning import PREROLL
from .errors import InputError
from .kinematics import Bent, bent, come_over, on_joints
from .progress import within
from .root import RootPath, to_root, to_world
from .sampler import Conditions, Sampler
from .series import smoothstep

__all__ = ["TRIES", "led_to", "met", "nearest", "require_same_root"]

TRIES = 6
"""How many times a part is made, of which the one that comes nearest is taken."""
_LEAD = 45  # frames in which the noise becomes the kept motion's
_OVER = 15  # frames in which the poses do
_CONTEXT = 30  # frames before those that tell how straight limbs are twisted
_STRANGEST = 3.5  # of the kept motion's noise, whose numbers are standard normal
_ROOT_OFF = 0.05  # metres that the root may be off where the take is kept
_ROOT_TURNED = np.radians(5.0)


def require_same_root(old: RootPath, new: RootPath, start: int) -> None:
    """``InputError`` where the root is elsewhere than it was in the take, from frame ``start`` on,
    where that is kept.
    """
    off = np.linalg.norm(new.position[start:] - old.position[start:], axis=-1)
    turned = np.abs(np.angle(np.exp(1j * (new.yaw[start:] - old.yaw[start:]))))
    if len(off) and (off.max() > _ROOT_OFF or turned.max() > _ROOT_TURNED):
        raise InputError(
            f"The root no longer goes as in the take after the part that is made anew: up to "
            f"{off.max():.2f} m and {np.degrees(turned.max()):.0f}° off; let it, or generate from "
            "here on."
        )


def led_to(
    sampler: Sampler, conditions: Conditions, poses: np.ndarray, start: int, z: np.ndarray
) -> Generator[float, None, np.ndarray]:
    """The noise ``z`` (T, B, 66) of takes that are to come to the ``poses`` (N, 66) of a take from
    its frame ``start`` on: before it, it becomes the noise that those are made of. Yields progress.
    """
    stop = PREROLL + start
    made = yield from within(
        sampler.noise_of(conditions.between(0, stop), poses[:stop, None]), 0.0, 1.0
    )
    kept = np.clip(made, -_STRANGEST, _STRANGEST)
    share = smoothstep((np.arange(stop) - (stop - _LEAD)) / _LEAD)[:, None, None]
    out = z.copy()
    out[:stop] = (1.0 - share) * z[:stop] + share * kept
    return out


def _over(middle: tuple[int, int]) -> int:
    """Frames in which a middle part's poses lead to the kept ones."""
    return min(_OVER, (middle[1] - middle[0]) // 2)


def _joints_of(poses: np.ndarray, path: RootPath, begin: int, stop: int) -> np.ndarray:
    """World joints (M, 22, 3) of poses (PREROLL + N, 66) between two frames."""
    there = RootPath(path.position[begin:stop], path.yaw[begin:stop])
    return to_world(there, poses[PREROLL + begin : PREROLL + stop].reshape(-1, 22, 3))


def nearest(
    made: np.ndarray, kept: np.ndarray, path: RootPath, middle: tuple[int, int]
) -> np.ndarray:
    """Which of K tries for each of D takes (T, D, K, 66) comes nearest to the kept poses (N, 66) at
    the end of the ``middle`` (first, stop): (D,).
    """
    span = middle[1] - max(1, _over(middle)), middle[1]
    meant = _joints_of(kept, path, *span)
    off = [
        [
            ((_joints_of(made[:, d, k], path, *span) - meant) ** 2).sum(-1).mean()
            for k in range(made.shape[2])
        ]
        for d in range(made.shape[1])
    ]
    return np.argmin(np.array(off), axis=1)


def met(made: np.ndarray, kept: np.ndarray, path: RootPath, middle: tuple[int, int]) -> np.ndarray:
    """Poses (T, 66) whose ``middle`` (first, stop) leads to the ``kept`` ones (N, 66) after it."""
    over, stop = _over(middle), middle[1]
    if over == 0:
        return made
    begin = max(0, stop - over - _CONTEXT)
    new, old = (bent(_joints_of(each, path, begin, stop)) for each in (made, kept))
    ease = smoothstep((np.arange(over) + 1.0) / (over + 1.0))
    tail = Bent(new.local[-over:], new.pelvis[-over:])
    joints = on_joints(come_over(old, [(len(old.pelvis) - over, ease, tail)]))[-over:]
    there = RootPath(path.position[stop - over : stop], path.yaw[stop - over : stop])
    out = made.copy()
    out[PREROLL + stop - over : PREROLL + stop] = to_root(there, joints).reshape(over, 66)
    return out
