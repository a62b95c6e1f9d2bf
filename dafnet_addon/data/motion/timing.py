"""How long bodies take to sit down and to get up, and the same motion in another time.

A descent is measured where most of it happens: from 10 to 90 % of the pelvis' way down. Captured
exercises take 0.6 s for it, people who come to furniture 1.3 (1.1 to 1.9), and 0.9 to get up. What
a root path tells of it is how slowly it goes the last quarter of a metre, so motion and root are
retimed together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.root import RootPath, gaussian, root_from_joints, to_root
from ...core.series import MODEL_FPS, smoothstep
from ...core.skeleton import NECK, PELVIS
from ..synthesis.joins import lean_and_turn
from .rests import Rest

__all__ = [
    "Transition",
    "at_clock",
    "braced",
    "clock_of",
    "smoothed_by_hand",
    "stretches_of",
    "transitions",
]

QUICKEST, SLOWEST = 0.6, 2.2
"""Seconds from 10 to 90 % of the way down or up, between which motion is retimed."""
USUAL_DOWN, USUAL_UP = 1.3, 0.9
"""Seconds that most take for it."""

_SHORTEST_WAY = 0.12  # metres; what is less is shifting on a seat
_LONGEST = 90  # frames of a captured way down
_STRETCHED = (0.5, 3.7)  # of a captured transition's length: quick ones last 0.6 s
_EVENLY = 0.5  # of the times, drawn evenly from the quickest to the slowest: the usual are many
_STANDS = 0.35  # metres a second, of the fastest joint: a body that has not begun yet
_BEFORE = 45  # frames before the pelvis' way, in which a body bends forward
_ROUND = 6  # frames on both sides of the way that keep its speed
_BLEND = 4.0  # frames; sigma of the change from one speed to another
_OF_TRANSITION = 0.25
"""Sigma of a root's smoothing at a seat, at most, as a share of the way's time: a path that was
smoothed more would tell of a slower descent than the body's."""
_BENT = np.radians([18.0, 38.0])  # of a trunk half-way, on the quickest and the slowest ways
_FADES = 20  # frames over which one smoothing goes over into another


@dataclass(frozen=True)
class Transition:
    """Frames ``start`` to ``stop``, between which the pelvis goes from 10 to 90 % of its way to a
    seat (``down``) or back; ``begins``: the frame in which the body starts to move for it, of a way
    up that in which it stands.
    """

    start: int
    stop: int
    down: bool
    begins: int

    @property
    def seconds(self) -> float:
        return (self.stop - self.start) / MODEL_FPS


def _way_down(height: np.ndarray, speed: np.ndarray, rest: int, after: int) -> Transition | None:
    """The descent that ends where a body comes to rest, not before frame ``after``."""
    first = max(after, rest - _LONGEST)
    if rest - first < 3:
        return None

    bottom, top = height[rest], height[first : rest + 1].max()
    if top - bottom < _SHORTEST_WAY:
        return None
    gone = (top - height[first : rest + 1]) / (top - bottom)
    above = np.flatnonzero(gone < 0.1)
    below = np.flatnonzero(gone[above[-1] :] > 0.9)
    if not len(below) or below[0] < 2:
        return None

    start, stop = first + int(above[-1]), first + int(above[-1] + below[0])
    still = np.flatnonzero(speed[max(after, start - _BEFORE) : start] < _STANDS)
    begins = max(after, start - _BEFORE) + int(still[-1]) if len(still) else start - _ROUND
    return Transition(start, stop, True, max(begins, 0))


def transitions(joints: np.ndarray, rests: Sequence[Rest]) -> list[Transition]:
    """How a body (T, 22, 3) comes to its rests and leaves them, in order of time."""
    frames, found = len(joints), []
    height = joints[:, PELVIS, 2]
    step = np.linalg.norm(np.diff(joints, axis=0, prepend=joints[:1]), axis=-1).max(1)
    speed = step * MODEL_FPS
    ended = 0
    for rest in rests:
        if 0 < rest.start < frames:
            found.append(_way_down(height, speed, rest.start, ended))
        ended = max(0, min(rest.end, frames))

    begun = 0
    for rest in reversed(rests):
        if 0 < rest.end < frames:
            back = _way_down(height[::-1], speed[::-1], frames - rest.end, begun)
            if back:
                last = frames - 1
                back = Transition(last - back.stop, last - back.start, False, last - back.begins)
            found.append(back)
        begun = max(0, frames - max(rest.start, 0))

    return sorted((t for t in found if t), key=lambda t: t.start)


def stretches_of(
    rng: np.random.Generator, ways: Sequence[Transition], backward: bool = False
) -> list[float]:
    """How many times as long each way is to take as it was captured, for times as people's are;
    ``backward``: it will be played so.
    """
    stretches = []
    for way in ways:
        usual = USUAL_DOWN if way.down != backward else USUAL_UP
        low, most, high = np.log([QUICKEST, usual, SLOWEST])
        evenly = rng.random() < _EVENLY
        wanted = np.exp(rng.uniform(low, high) if evenly else rng.triangular(low, most, high))
        stretches.append(float(np.clip(wanted / way.seconds, *_STRETCHED)))
    return stretches


def braced(
    joints: np.ndarray, ways: Sequence[Transition], stretches: Sequence[float]
) -> np.ndarray:
    """The motion (T, 22, 3) whose trunk bends forward as far on its ways as it takes to keep one's
    balance for so long: who drops onto a seat falls the last of it, who takes two seconds cannot.
    """
    path = root_from_joints(joints)
    trunk = to_root(path, joints[:, NECK]) - to_root(path, joints[:, PELVIS])
    bent = np.arctan2(trunk[:, 1], trunk[:, 2])
    further = np.zeros(len(joints))
    frames = np.arange(len(joints))
    for way, stretch in zip(ways, stretches, strict=True):
        middle = (way.start + way.stop) // 2
        wanted = np.interp(way.seconds * stretch, (QUICKEST, SLOWEST), _BENT)
        lacks = max(0.0, float(wanted - bent[middle]))
        first, last = sorted((way.begins, way.stop if way.down else way.start))
        half = max(middle - first, last - middle) + _ROUND
        further += lacks * smoothstep(1.5 * (1.0 - np.abs(frames - middle) / half))
    return lean_and_turn(joints, -further, np.zeros(len(joints))) if further.any() else joints


def clock_of(
    frames: int,
    ways: Sequence[Transition],
    stretches: Sequence[float],
    speed: float = 1.0,
) -> np.ndarray:
    """Frames of a motion (N,), fractions of them too, at which it is to be read to go at another
    ``speed``, and its ways down and up in so many times as long as they were.
    """
    rate = np.full(frames, np.log(speed))
    for way, stretch in zip(ways, stretches, strict=True):
        first, last = (
            (way.begins, way.stop + _ROUND) if way.down else (way.start - _ROUND, way.begins)
        )
        rate[max(0, first) : last + 1] = -np.log(stretch)

    times = np.cumsum(np.exp(-gaussian(rate, _BLEND))) if ways else np.arange(frames) / speed
    times = times - times[0]
    read: np.ndarray = np.interp(np.arange(0.0, times[-1]), times, np.arange(frames))
    return read


def at_clock(joints: np.ndarray, clock: np.ndarray) -> np.ndarray:
    """The motion (T, 22, 3) at fractional frames (N,): by cubics through its frames, so that what
    is slowed down stays smooth.
    """
    low = np.clip(clock.astype(int), 0, len(joints) - 2)
    s = (clock - low)[:, None, None]
    slope = np.gradient(joints, axis=0)
    a, b = joints[low], joints[low + 1]
    return (
        a
        + (b - a) * smoothstep(s)
        + slope[low] * s * (1 - s) ** 2
        - slope[low + 1] * s**2 * (1 - s)
    )


def smoothed_by_hand(path: RootPath, sigma: float, ways: Sequence[Transition]) -> RootPath:
    """The path smoothed as an animator's curves are, by Gaussians of ``sigma`` frames beyond what
    it has had; less at a seat, where it has to tell how long the body takes.
    """
    smooth = gaussian(path.position, sigma)
    for way in ways:
        at_seat = gaussian(path.position, min(sigma, _OF_TRANSITION * (way.stop - way.start)))
        frames = np.arange(len(path))
        away = np.maximum(way.start - frames, frames - way.stop)
        share = smoothstep(1.0 - (away - _ROUND) / _FADES)
        smooth = smooth + (at_seat - smooth) * share[:, None]
    return RootPath(smooth, gaussian(path.yaw, sigma))
