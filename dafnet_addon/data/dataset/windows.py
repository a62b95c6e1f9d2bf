"""Draws training windows: a captured piece of motion, augmented, with furniture fitted to it and
the sensor read.

Paper, section 5.2. Each draw picks a clip, may move a seat's height, mirror, reverse or re-time it,
may roughen or smooth its root path as an animator would, and furnishes the room anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.root import (
    POSITION_SIGMA,
    RootPath,
    ahead,
    root_from_joints,
    smoothed,
    to_root,
    velocities,
)
from ...core.skeleton import PELVIS
from ..furnish.boxes import near
from ..furnish.flesh import NO_BANK
from ..furnish.furniture import furnished
from ..furnish.shapes import ABSENT_SHAPE, SHAPES, ShapeBank
from ..motion.interactions import working
from ..motion.motion import Motion, mirrored
from ..motion.rests import resting
from ..motion.retarget import at_seat_height, at_top_height
from ..motion.timing import (
    Transition,
    at_clock,
    braced,
    clock_of,
    smoothed_by_hand,
    stretches_of,
    transitions,
)

__all__ = [
    "AS_PEOPLE_DO",
    "Augmentation",
    "HIGHEST",
    "HISTORY",
    "LENGTH",
    "LOWEST",
    "Window",
    "at_another_desk",
    "draw_window",
    "lowest_pelvis",
]

HISTORY, LENGTH = 10, 70
_FRAMES = HISTORY + LENGTH
_MARGIN = 32  # frames around a window, in which a desk leaves the body room
_AROUND = 130  # frames before and after a window, in which the body shows what furniture there is
_KNOWN = 200  # frames before and after a moment that a window may be drawn of
_SITS = 24  # frames of rest by which a seat is known
_SMOOTHING = (POSITION_SIGMA, 20.0)  # frames; sigma of a root's path, from captured to keyed
_WRONG = 0.25  # of the paths, that are a little off
LOWEST, HIGHEST = 0.36, 0.95
"""Metres over the floor at which a pelvis may rest: from a step of 0.22 to a bar stool of 0.81."""
_USUAL = 0.38, 0.66  # metres: the pelvis on sofas and chairs
_USUALLY = 0.45  # of the seats that are moved; the others are of any height
_TOPS = 0.62, 0.82  # metres over the floor, of the desks that people sit at
# metres that a top moves, down more than up (paper, section 5.2), and that its wrists are over a
# pelvis at least: thighs are between; how often it moves at all
_TOP_MOVES, _OVER_PELVIS, _MOVES_TOP = (-0.14, 0.08), 0.10, 0.6
_LOWERED = 0.3  # metres; from a high stool further down, every wave of the pelvis would grow


@dataclass(frozen=True)
class Augmentation:
    """What is done to captured motion so that it is as people and animators are; all of it, but
    where it is measured what each gives.

    ``paths_by_hand``: root paths are smoothed, as drawn curves are. ``retimed``: ways to seats and
    from them take other times.
    """

    paths_by_hand: bool = True
    retimed: bool = True


AS_PEOPLE_DO = Augmentation()


@dataclass(frozen=True)
class Window:
    """``poses`` (80, 66) in each frame's root, ``velocity`` (80, 3); of the last 70 frames:
    ``ahead`` (70, 24) and ``root`` (70, 3), its place x, y and yaw in the world of ``boxes``
    (``boxes.MOST``, 7) and ``shapes`` (``shapes.SHAPES``, 5). Metres, radians.
    """

    poses: np.ndarray
    velocity: np.ndarray
    ahead: np.ndarray
    root: np.ndarray
    boxes: np.ndarray
    shapes: np.ndarray


def _animated_by_hand(
    rng: np.random.Generator, path: RootPath, ways: Sequence[Transition], smooth: bool
) -> RootPath:
    """The root as an animator's curves give it: without the gait's sway where it is to be
    ``smooth``, and now and then smoothly a little wrong.
    """
    wanted = rng.uniform(*_SMOOTHING)
    if smooth:
        path = smoothed_by_hand(path, np.sqrt(wanted**2 - _SMOOTHING[0] ** 2), ways)
    if rng.random() < _WRONG:
        wobble = smoothed(
            RootPath(rng.normal(size=path.position.shape), rng.normal(size=len(path))), 12.0, 12.0
        )
        position = path.position + wobble.position * (1, 1, 0) * rng.uniform(0, 0.09)
        path = RootPath(position, path.yaw + wobble.yaw * rng.uniform(0, 0.25))

    return path


def _farthest(valid: np.ndarray, frame: int, step: int) -> int:
    """The last valid frame within ``_KNOWN`` of a valid one, in the direction of ``step``."""
    for _ in range(_KNOWN):
        if not (0 <= frame + step < len(valid) and valid[frame + step]):
            break
        frame += step
    return frame


def _whole_ways(ways: Sequence[Transition], start: int, stop: int, frames: int) -> slice:
    """The frames ``start`` to ``stop`` of a motion, and as many more as it takes to begin and end
    in the middle of no way to a seat or back: one sits down on what is known to be there.
    """
    for way in ways:
        if way.start - _SITS < start < way.stop:
            start = way.start - _SITS
        if way.start < stop < way.stop + _SITS:
            stop = way.stop + _SITS
    return slice(max(0, start), min(stop, frames))


def lowest_pelvis(height: float) -> float:
    """How low (metres) a pelvis that was captured at rest at this height may be moved."""
    return max(LOWEST, height - _LOWERED)


def _seat_height(rng: np.random.Generator, height: float) -> float:
    """Where a pelvis that was captured at rest at this height (metres) shall rest: mostly where
    furniture carries one.
    """
    if rng.random() < 0.2:
        wanted = height + rng.normal(0, 0.02)
    else:
        wanted = rng.uniform(*(_USUAL if rng.random() < _USUALLY else (LOWEST, HIGHEST)))
    return float(np.clip(wanted, lowest_pelvis(height), HIGHEST))


def at_another_desk(rng: np.random.Generator, joints: np.ndarray) -> np.ndarray:
    """The motion (T, 22, 3) of one that sits with the top that it works at moved, now and then, to
    a height of its own: chairs and desks are of any combination (paper, figure 9).
    """
    uses = working(joints, root_from_joints(joints))
    if not uses or rng.random() > _MOVES_TOP:
        return joints
    use = uses[0]
    wrists = float(use.points[:, 2].min())
    pelvis = float(np.median(joints[use.start : use.end, PELVIS, 2]))
    wanted = max(rng.uniform(*_TOPS), pelvis + _OVER_PELVIS)
    return at_top_height(joints, use, float(np.clip(wanted - wrists, *_TOP_MOVES)))


def _near_shapes(placed: np.ndarray, path: RootPath) -> np.ndarray:
    """The placed shapes nearest to a path, filled up or cut to (SHAPES, 5)."""
    gap = np.linalg.norm(path.position[None, :, :2] - placed[:, None, 1:3], axis=-1).min(
        1, initial=np.inf
    )
    kept = placed[np.argsort(gap)[:SHAPES]]
    return np.concatenate([kept, np.tile(ABSENT_SHAPE, (SHAPES - len(kept), 1))])


def draw_window(
    rng: np.random.Generator,
    motion: Motion,
    focus: int | None = None,
    bank: ShapeBank = NO_BANK,
    augmentation: Augmentation = AS_PEOPLE_DO,
) -> Window | None:
    """One augmented, furnished window, around frame ``focus`` where given; None where this draw
    cannot be used.

    Real pieces of ``bank`` stand among the furniture, where one is given.
    """
    total = len(motion.joints)
    if focus is None:
        focus = int(rng.integers(total))
    if not motion.valid[focus]:
        return None

    # What is used a few seconds earlier or later is there meanwhile.
    low, high = _farthest(motion.valid, focus, -1), _farthest(motion.valid, focus, 1) + 1
    joints = motion.joints[low:high]
    rests = [r for r in motion.rests if r.start < high and r.end > low]
    if rests:
        height = float(rests[0].position[2])
        joints = at_seat_height(joints, height, _seat_height(rng, height))
        joints = at_another_desk(rng, joints)

    backward = bool(rng.random() < (0.4 if rests else 0.08))
    speed = rng.uniform(0.85, 1.2) if rng.random() < 0.4 else 1.0
    ways = transitions(joints, [replace(r, start=r.start - low, end=r.end - low) for r in rests])
    stretches = stretches_of(rng, ways, backward)
    if not augmentation.retimed:
        stretches = [1.0] * len(ways)
    clock = clock_of(len(joints), ways, stretches, speed)
    if len(clock) < _FRAMES:
        return None

    if augmentation.retimed:
        joints = braced(joints, ways, stretches)
    joints = at_clock(joints, clock)
    frame = int(np.searchsorted(clock, focus - low))
    if backward:
        joints, frame = joints[::-1], len(joints) - 1 - frame
    if rng.random() < 0.5:
        joints = mirrored(joints)

    first = int(np.clip(frame - rng.integers(HISTORY, _FRAMES - 10), 0, len(joints) - _FRAMES))
    path = root_from_joints(joints)
    seated = resting(joints, path)
    if rests and not seated:
        return None  # too high, or too short a while, to be known: it would sit on nothing
    ways = transitions(joints, seated)
    # Seconds farther away nobody uses what this window shows.
    kept = _whole_ways(ways, first - _AROUND, first + _FRAMES + _AROUND, len(joints))
    joints, path, first = (
        joints[kept],
        RootPath(path.position[kept], path.yaw[kept]),
        first - kept.start,
    )
    ways = [replace(w, start=w.start - kept.start, stop=w.stop - kept.start) for w in ways]
    seen = slice(max(0, first - _MARGIN), first + _FRAMES + _MARGIN)
    room, _ = furnished(rng, joints, path, bank, seen)
    if room is None:
        return None
    path = _animated_by_hand(rng, path, ways, augmentation.paths_by_hand)

    cut = slice(first, first + _FRAMES)
    poses = to_root(path, joints)[cut].reshape(_FRAMES, -1)
    recent = RootPath(path.position[cut][HISTORY:], path.yaw[cut][HISTORY:])
    root = np.concatenate([recent.position[:, :2], recent.yaw[:, None]], axis=1)
    return Window(
        poses,
        velocities(path)[cut],
        ahead(path)[cut][HISTORY:],
        root,
        near(room.boxes, recent),
        _near_shapes(room.shapes, recent),
    )
