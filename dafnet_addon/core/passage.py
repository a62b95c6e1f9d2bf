"""Where a root path leads a body through furniture, and which furniture that is.

The body is told by its upright axis from the thighs to the chest. What it sits on, comes to sit on
or gets up from is not a hindrance, and neither is what its legs are under while it sits: near a
seat only what stands higher than it is met.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np

from .distance import prepared, rigid_frames
from .nearby import solids_near
from .occupancy import distance
from .progress import stepwise, within
from .root import RootPath
from .rotations import rotate, transpose
from .series import runs
from .solids import Box, Mesh, Scene

__all__ = ["Passage", "SatOn", "listed", "met_along", "passages", "seats_along"]

_BESIDE = 0.2  # metres from the axis within which furniture is looked at
# metres over the floor, from a standing body's thighs to its chest
_HEIGHTS = np.arange(0.50, 1.36, 0.025)
# metres between the axis and what is in the body, so that no board slips between two heights
_MEETS = 0.03
# metres to the left and right of the axis, where what it only passes along is on one side
_ASIDE = 0.06
_PAUSE = 0.5  # seconds between two passages through one piece

# metres over the floor between which seats and the room over them are looked for
_COLUMN = np.arange(0.22, 1.125, 0.025)
_HIGHEST = 0.95
_TOUCHES = 0.03  # metres from the axis
_ROOM = 5  # steps of the column that are free over a seat, unlike inside one
_STILL = 0.1  # metres a second, over what carries the body
_OVER_SEAT = 0.12  # metres over a seat's top that belong to it
_COMES = 0.6  # metres from the place on a seat, within which a body is on its way to it
_RESTS = 0.15  # metres from it, within which the body is there
_NAMED = 3  # passages that a sentence names
_SOLIDS_AT_ONCE = 100  # solids between two steps of a job


@dataclass(frozen=True)
class SatOn:
    """A body sits at ``place`` (2,) on ``pieces``, names of furniture, whose ``top`` is at this
    height; world, metres.
    """

    place: np.ndarray
    top: float
    pieces: frozenset[str]


@dataclass(frozen=True)
class Passage:
    """The body's axis is in the furniture ``name`` from frame ``start`` to ``stop`` (exclusive) of
    the path.
    """

    name: str
    start: int
    stop: int


def _upright(path: RootPath, heights: np.ndarray) -> np.ndarray:
    """Points (T, H, 3) over the root."""
    return np.asarray(path.position[:, None] + heights[:, None] * (0.0, 0.0, 1.0))


def _near(scene: Scene, path: RootPath) -> Generator[float, None, Scene]:
    """The furniture beside the axis."""
    found: list[Box | Mesh] = []
    for k in range(0, len(scene.solids), _SOLIDS_AT_ONCE):
        some = Scene(tuple(scene.solids[k : k + _SOLIDS_AT_ONCE]))
        found += solids_near(some, path.position, _BESIDE).solids
        yield k / len(scene.solids)
    return Scene(tuple(found))


def _pieces(scene: Scene, path: RootPath) -> Generator[float, None, dict[str, Scene]]:
    """The furniture beside the axis by its names."""
    found: dict[str, Scene] = {}
    for solid in (yield from _near(scene, path)).solids:
        found[solid.name] = Scene((*found.get(solid.name, Scene()).solids, solid))
    return found


def _still_over(solid: Box | Mesh, path: RootPath, fps: float) -> np.ndarray:
    """Whether (T,) the root stands still over a solid, which may itself be moving."""
    if len(path) < 2:
        return np.ones(len(path), bool)
    frames = rigid_frames(solid)
    over = rotate(transpose(frames[..., :3, :3]), path.position - frames[..., :3, 3])
    return np.asarray(np.linalg.norm(np.gradient(over, axis=0), axis=1) * fps < _STILL)


@stepwise
def seats_along(
    scene: Scene, path: RootPath, fps: float
) -> Generator[float, None, tuple[SatOn, ...]]:
    """What a root sits on: the lowest piece that is under it while it stands still, where there is
    room above.

    ``scene``: canonical metres, static or with a matrix for each frame of ``path``, ``fps`` of them
    a second.
    """
    pieces = yield from within(_pieces(scene, path), 0.0, 0.3)
    if not pieces:
        return ()

    floor, column = path.position[:, 2], _upright(path, _COLUMN)
    touching, standing = [], []
    for k, piece in enumerate(pieces.values()):
        touching.append(distance(piece, column, floor) < _TOUCHES)
        standing.append(_still_over(piece.solids[0], path, fps))
        yield 0.3 + 0.7 * k / len(pieces)

    touched, still = np.stack(touching), np.stack(standing)
    carries = touched & still[..., None] & (_COLUMN < _HIGHEST)

    # The lowest piece's own parts may be apart, a chair's cross-bar and its seat; over its highest
    # one there has to be room.
    steps = np.arange(len(_COLUMN))
    first = np.where(carries, steps, len(steps)).min(axis=2)
    lowest = np.take_along_axis(carries, np.argmin(first, axis=0)[None, :, None], axis=0)[0]
    highest = np.where(lowest, steps, 0).max(axis=1)
    free = np.lib.stride_tricks.sliding_window_view(~touched.any(axis=0), _ROOM, axis=1).all(axis=2)
    # 0 where there is no room
    ends = np.argmax(free & (steps[: free.shape[1]] > highest[:, None]), axis=1)
    resting = lowest.any(axis=1) & (ends > 0) & (_COLUMN[ends] < _HIGHEST)

    found = []
    while resting.any():
        place = path.position[resting, :2][-1]
        there = resting & (np.linalg.norm(path.position[:, :2] - place, axis=1) < _COMES)
        under = (carries & (steps < ends[:, None]))[:, there].any(axis=(1, 2))
        top = float(np.median(floor[there] + _COLUMN[ends[there]] - _TOUCHES))
        found.append(SatOn(place, top, frozenset(np.array(list(pieces))[under].tolist())))
        resting &= ~there

    return tuple(found[::-1])


def _inside(piece: Scene, path: RootPath, fps: float) -> np.ndarray:
    """Whether (T, H) the axis is in a piece of furniture, not just at an edge of it that the body
    passes along.
    """
    axis = _upright(path, _HEIGHTS)
    forward = path.rotation[:, :2, 1]
    if len(path) > 1:
        velocity = np.gradient(path.position[:, :2], axis=0) * fps
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        forward = np.where(speed > _STILL, velocity / np.maximum(speed, _STILL), forward)

    right = np.stack([forward[:, 1], -forward[:, 0], np.zeros(len(path))], axis=1)[:, None] * _ASIDE
    points = np.concatenate([axis - right, axis, axis + right], axis=1)
    left, middle, right = np.split(distance(piece, points, path.position[:, 2]) < _MEETS, 3, axis=1)
    return np.asarray(middle & (left == right))


@stepwise
def passages(
    scene: Scene, path: RootPath, fps: float, seats: Sequence[SatOn]
) -> Generator[float, None, tuple[Passage, ...]]:
    """Where the body is in furniture, in order of time; ``seats``: see ``seats_along``, whose
    arguments the others are.
    """
    floor = path.position[:, 2]
    away = [np.linalg.norm(path.position[:, :2] - seat.place, axis=1) for seat in seats]
    lowest = np.full(len(path), _HEIGHTS[0] - 1e-6)
    for seat, gap in zip(seats, away, strict=True):
        lowest = np.where(gap < _COMES, np.maximum(lowest, seat.top + _OVER_SEAT - floor), lowest)

    met: dict[str, np.ndarray] = {}
    pieces = yield from within(_pieces(scene, path), 0.0, 0.3)
    for k, (name, piece) in enumerate(pieces.items()):
        yield 0.3 + 0.7 * k / len(pieces)
        inside = _inside(piece, path, fps)
        limit = lowest.copy()
        for seat, gap in zip(seats, away, strict=True):
            if name not in seat.pieces:
                continue

            over_seat = np.maximum(limit, seat.top + _OVER_SEAT - floor)
            for start, stop in _visits(inside.any(axis=1), fps):
                # A bed or a deep sofa is under the body for longer than where it sits.
                around = slice(max(start - round(_PAUSE * fps), 0), stop + round(_PAUSE * fps))
                if (gap[around] < _COMES).any():
                    limit[start:stop] = over_seat[start:stop]

            limit[gap < _RESTS] = np.inf

        met[name] = (inside & (limit[:, None] <= _HEIGHTS)).any(axis=1)

    found = [
        Passage(name, start, stop)
        for name, frames in met.items()
        for start, stop in _visits(frames, fps)
    ]
    return tuple(sorted(found, key=lambda each: each.start))


def _visits(flags: np.ndarray, fps: float) -> list[tuple[int, int]]:
    """The (start, stop) of runs in which the flags (T,) are set; short pauses do not part them."""
    return runs(flags, gap=max(_PAUSE * fps - 1, 0))


@stepwise
def met_along(
    scene: Scene, path: RootPath, fps: float, end: Sequence[SatOn] | None = None
) -> Generator[float, None, tuple[Passage, ...]]:
    """``passages`` of a path that is about to be keyed, through a ``scene`` not yet measured.

    ``end``: what the body sits on at the path's end, nothing where it stands there; None for what
    it seems to sit on.
    """
    floor = float(np.median(path.position[:, 2]))
    near = yield from within(_near(scene, path), 0.0, 0.2)
    near = (yield from within(prepared.steps(near, floor), 0.2, 0.6))[0]
    seats = yield from within(seats_along.steps(near, path, fps), 0.6, 0.8)
    if end is not None:
        last = path.position[-1, :2]
        seats = (*(seat for seat in seats if np.linalg.norm(seat.place - last) > _COMES), *end)
    return (yield from within(passages.steps(near, path, fps, seats), 0.8, 1.0))


def listed(found: Sequence[Passage], when: Callable[[Passage], str]) -> str:
    """The furniture that is met and ``when``, as part of a sentence."""
    names = [f"'{each.name}' {when(each)}" for each in found[:_NAMED]]
    if len(found) > _NAMED:
        names.append(f"{len(found) - _NAMED} more")
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
