"""Root paths of people who walk, sit down, rest and get up again, made from a few points on the
floor.

The profiles are those measured on captured sit-downs and stand-ups: people hardly stop before a
seat, they turn round while they go the last metre, slowing down evenly (0.7 m/s²), and their
heading has settled a quarter of a metre before they sit; that last quarter they go backward at an
even pace while they sit down, so how slowly it is gone tells how long they take for it. They rise
at an even pace along the direction they sat in and turn away after 0.2 m. Yaw is as in
``core.root``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .errors import InputError
from .root import RootPath, forward_of, yaw_of
from .series import MODEL_FPS, smoothstep

__all__ = [
    "AFTER_SEAT",
    "BEFORE_SEAT",
    "GETS_UP",
    "SEATED_WAY",
    "SITS_DOWN",
    "Rest",
    "Route",
    "Stop",
    "facing",
    "pace_at_seat",
    "route",
    "turn_seconds",
    "walked_along",
]

BEFORE_SEAT = 0.55
"""Metres straight in front of a seat from which one comes to it, less the rounding."""
AFTER_SEAT = 0.45
"""Metres straight in front of a seat to which one goes from it, less the rounding."""

SITS_DOWN, GETS_UP = 1.3, 0.9
"""Seconds from 10 to 90 % of the pelvis' way down to a seat, and up from it: medians of people who
come to furniture.
"""

Point = tuple[float, float]

_QUICKEST, _SLOWEST = 0.3, 10.0  # seconds of sitting down or getting up
_STEP = 0.005  # metres between samples along a leg

# Accelerations, metres a second squared, measured on captured motion.
_START = 1.4  # from standing
_HALT = 1.2  # to standing
_SIT = 0.7  # to where one sits down
_RISE = 0.9  # from where one has got up

SEATED_WAY = 0.25
"""Metres over the floor before a seat, that are gone while one sits down or gets up."""

# Metres that the root goes, at an even pace, while the pelvis does the middle 80 % of its way
# down, from 0.24 before the seat to 0.07, or up. Medians of 125 captured sit-downs and 139
# stand-ups, alike where they are retimed to take 0.8 to 2 s and smoothed as drawn paths are.
_GONE_DOWN, _GONE_UP = 0.165, 0.20

# turning rate, a second, that slows a walker who looks along the path in a corner
_CORNER_RATE = np.radians(90.0)
_SIDEWAYS = 2.0  # acceleration to the side that slows a walker who does not, m/s²
_CORNER_CUT = 0.45  # metres of a straight that a rounded corner may use
_CORNER_SPEED = 0.3  # metres a second, the slowest in a corner
_NEAREST = 0.05  # metres between two points of a way, at least
_SETTLED = 0.25  # metres before a seat, where the heading has settled
_TURN_AWAY = 0.20  # metres after a seat, where the heading lets go


@dataclass(frozen=True)
class Stop:
    """A place to rest: ``position`` (x, y) of the pelvis, ``yaw`` it faces, ``seconds`` of rest,
    seated or standing.

    ``sits_down``, ``gets_up``: seconds that most of the way to a seat and from it takes, from 10 to
    90 % of the pelvis' height. ``before``: metres straight in front of a seat from which one comes
    to it and to which one goes, less where something stands there.
    """

    position: Point
    yaw: float
    seconds: float = 3.0
    seated: bool = False
    name: str = ""
    sits_down: float = SITS_DOWN
    gets_up: float = GETS_UP
    before: float = BEFORE_SEAT


@dataclass(frozen=True)
class Rest:
    """Frames from ``start`` to ``stop`` (exclusive) in which the root stands still at ``place``."""

    place: Stop
    start: int
    stop: int


@dataclass(frozen=True)
class Route:
    """A root ``path`` and its ``rests``, in order of time."""

    path: RootPath
    rests: tuple[Rest, ...]


def facing(direction: Sequence[float] | np.ndarray) -> float:
    """Yaw of a horizontal direction (x, y), radians; 0 looks along +y."""
    return float(yaw_of(np.asarray(direction)))


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def turn_seconds(turn: float) -> float:
    """How long people take to turn by ``turn`` radians: measured 0.8 s for 30 degrees, 1.2 s for
    90, 1.7 s for 180.
    """
    return 0.6 + 1.1 * abs(turn) / np.pi


def _rounded(points: np.ndarray) -> tuple[np.ndarray, float, list[tuple[float, float]]]:
    """Polyline (N, 2) with rounded corners, evenly sampled; its length; where each corner starts
    and ends along it.
    """
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    pieces, corners, travelled = [points[:1]], [], 0.0

    def append(piece: np.ndarray) -> None:
        nonlocal travelled
        travelled += float(
            np.linalg.norm(np.diff(np.concatenate([pieces[-1][-1:], piece]), axis=0), axis=1).sum()
        )
        pieces.append(piece)

    for i in range(1, len(points) - 1):
        before, after = points[i - 1] - points[i], points[i + 1] - points[i]
        free_before, free_after = (0.8 if i == 1 else 0.5), (0.8 if i == len(points) - 2 else 0.5)
        cut = min(_CORNER_CUT, free_before * lengths[i - 1], free_after * lengths[i])
        a, b = points[i] + before / lengths[i - 1] * cut, points[i] + after / lengths[i] * cut
        append(a[None])
        u = np.linspace(0.0, 1.0, 65)[1:, None]
        start = travelled
        append((1 - u) ** 2 * a + 2 * u * (1 - u) * points[i] + u * u * b)
        corners.append((start, travelled))

    append(points[-1:])
    dense = np.concatenate(pieces)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    grid = np.linspace(0.0, arc[-1], max(2, int(np.ceil(arc[-1] / _STEP)) + 1))
    return (
        np.stack([np.interp(grid, arc, dense[:, k]) for k in range(2)], axis=1),
        float(arc[-1]),
        corners,
    )


def pace_at_seat(seconds: float, down: bool) -> float:
    """Metres a second at which the last ``SEATED_WAY`` to a seat is gone, ``down``, or the first
    from it, where most of the pelvis' way, from 10 to 90 %, is to take so many ``seconds``.
    """
    return (_GONE_DOWN if down else _GONE_UP) / seconds


def _speeds(
    arc: np.ndarray,
    tangent: np.ndarray,
    heading: np.ndarray,
    cruise: np.ndarray,
    start: float,
    end: float,
) -> np.ndarray:
    """Fastest speeds along a curve within ``cruise`` (N,), what its corners allow and the
    accelerations from its start and to its end.
    """
    step = float(arc[1])
    bend, turn = (
        np.maximum(np.abs(np.gradient(angle, step)), 1e-6) for angle in (tangent, heading)
    )
    limit = np.minimum(
        cruise,
        np.maximum(_CORNER_SPEED, np.minimum(_CORNER_RATE / turn, np.sqrt(_SIDEWAYS / bend))),
    )
    squared = limit**2
    squared[0] = squared[-1] = 0.0
    for i in range(1, len(arc)):
        squared[i] = min(squared[i], squared[i - 1] + 2.0 * start * step)
    for i in range(len(arc) - 2, -1, -1):
        squared[i] = min(squared[i], squared[i + 1] + 2.0 * end * step)

    return np.sqrt(squared)


def _leg(origin: Stop, via: Sequence[Point], goal: Stop, cruise: float, fps: float) -> RootPath:
    """From rest at ``origin`` to rest at ``goal``: from one frame after the one to the first frame
    at the other.
    """
    points: list[np.ndarray] = [np.asarray(origin.position, float)]
    if origin.seated:
        points.append(points[0] + min(AFTER_SEAT, origin.before) * forward_of(origin.yaw))

    points += [np.asarray(p, float) for p in via]
    if goal.seated:
        seat, ahead = np.asarray(goal.position, float), forward_of(goal.yaw)
        before = seat + goal.before * ahead
        if np.linalg.norm(before - points[-1]) < _NEAREST:  # one is there, and goes on from there
            before = before - 2.0 * _NEAREST * ahead
        points.append(before)

    points.append(np.asarray(goal.position, float))
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not np.isfinite(gaps).all() or (gaps < _NEAREST).any():
        raise InputError(
            "Two neighbouring points of the root's path are less than 5 cm apart; move or remove "
            "one."
        )

    curve, length, corners = _rounded(np.array(points))
    # The short straights at a seat are taken forwards and backwards: they say nothing about where
    # the walker looks.
    told = (corners[0][1] if origin.seated else 0.0), (corners[-1][0] if goal.seated else length)
    return walked_along(curve, length, origin, goal, told, cruise, fps)


def walked_along(
    curve: np.ndarray,
    length: float,
    origin: Stop,
    goal: Stop,
    told: Point,
    cruise: float,
    fps: float,
    yaw: float | None = None,
) -> RootPath:
    """A smooth ``curve`` (N, 2), evenly sampled and ``length`` metres long, walked from rest at
    ``origin`` to rest at ``goal``.

    The walker looks along it between ``told`` metres of the way, or keeps the heading ``yaw``, and
    turns away from ``origin.yaw`` and to ``goal.yaw`` as people do. From one frame after the rest
    to the first frame of the other; z is 0.
    """
    step = np.diff(curve, axis=0)
    arc = np.linspace(0.0, length, len(curve))
    tangent = np.unwrap(yaw_of(step))
    tangent = np.concatenate([tangent, tangent[-1:]])
    heading = (
        np.interp(np.clip(arc, *told), arc, tangent) if yaw is None else np.full(len(arc), yaw)
    )
    pace = np.full(len(arc), cruise)
    if origin.seated:
        near = arc < SEATED_WAY
        pace[near] = np.minimum(pace[near], pace_at_seat(origin.gets_up, down=False))
    if goal.seated:
        near = length - arc < SEATED_WAY
        pace[near] = np.minimum(pace[near], pace_at_seat(goal.sits_down, down=True))
    start, end = _RISE if origin.seated else _START, _SIT if goal.seated else _HALT
    speed = _speeds(arc, tangent, heading, pace, start, end)
    clock = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(arc) / (speed[1:] + speed[:-1]))])

    def at(distance: float) -> float:
        return float(np.interp(distance, arc, clock))

    def walked(time: float) -> float:
        return float(np.interp(time, clock, heading))

    leave_turn = _wrapped(heading[0] - origin.yaw)
    wait = 0.0 if origin.seated else 0.5 * (turn_seconds(leave_turn) - 0.6)
    leave = at(_TURN_AWAY) if origin.seated else -wait
    for _ in range(3):  # the turn's length depends on the heading at its end
        leave_end = leave + turn_seconds(leave_turn)
        leave_turn = _wrapped(walked(leave_end) - origin.yaw)

    arrive_turn = _wrapped(goal.yaw - heading[-1])
    linger = 0.0 if goal.seated else 0.5 * (turn_seconds(arrive_turn) - 0.6)
    arrive_end = at(arc[-1] - _SETTLED) if goal.seated else clock[-1] + linger
    for _ in range(3):
        arrive = arrive_end - turn_seconds(arrive_turn)
        arrive_turn = _wrapped(goal.yaw - walked(arrive))

    frames = int(np.ceil((clock[-1] + wait + linger) * fps))
    time = np.arange(1, frames + 1) / fps - wait
    distance = np.interp(time, clock, arc)
    position = np.stack(
        [np.interp(distance, arc, curve[:, k]) for k in range(2)] + [np.zeros(frames)], axis=1
    )
    walking = np.interp(time, clock, heading)
    # Both turns are offsets from the walker's heading that fade out and in, so they may overlap on
    # a short leg.
    leaving = 1.0 - smoothstep((time - leave) / (leave_end - leave))
    arriving = smoothstep((time - arrive) / (arrive_end - arrive))
    from_origin = _wrapped(origin.yaw - walked(leave_end)) + walked(leave_end)
    to_goal = walked(arrive) + arrive_turn
    return RootPath(
        position, walking + leaving * (from_origin - walking) + arriving * (to_goal - walking)
    )


def route(
    start: Stop,
    *places: Point | Stop,
    speed: float = 1.1,
    fps: float = MODEL_FPS,
    floor: float = 0.0,
) -> Route:
    """Root path that rests at ``start``, passes the points and rests at every ``Stop``; it must end
    at a stop.

    >>> start, goal = Stop((0.0, 0.0), yaw=0.0, seconds=1.0), Stop((1.0, 3.0), yaw=0.0)
    >>> walked = route(start, (0.0, 2.0), goal)
    >>> [(rest.start, rest.stop) for rest in walked.rests][0]
    (0, 30)
    >>> walked.path.position[-1].round(6).tolist()
    [1.0, 3.0, 0.0]

    ``speed``: of walking, metres a second. ``floor``: height of the floor (metres). Raises
    InputError where points coincide or the path does not end at a stop.
    """
    if not places or not isinstance(places[-1], Stop):
        raise InputError("A root path has to end at a stop; add one as its last place.")
    for stop in (start, *(place for place in places if isinstance(place, Stop))):
        if not (_QUICKEST <= stop.sits_down <= _SLOWEST and _QUICKEST <= stop.gets_up <= _SLOWEST):
            raise InputError(
                f"Nobody sits down or gets up in less than {_QUICKEST} or more than {_SLOWEST:g} "
                "seconds here; give a time between."
            )
    if speed <= _CORNER_SPEED or fps <= 0:
        raise InputError(
            f"Walking needs a speed above {_CORNER_SPEED} m/s and a positive frame rate."
        )

    positions: list[np.ndarray] = []
    yaws: list[np.ndarray] = []
    rests: list[Rest] = []
    count = 0

    def rest(stop: Stop, yaw: float) -> None:
        nonlocal count
        frames = max(1, round(stop.seconds * fps))
        positions.append(np.broadcast_to([*stop.position, 0.0], (frames, 3)))
        yaws.append(np.full(frames, yaw))
        rests.append(Rest(stop, count, count + frames))
        count += frames

    rest(start, start.yaw)
    via: list[Point] = []
    origin = start
    for place in places:
        if not isinstance(place, Stop):
            via.append(place)
            continue

        leg = _leg(origin, via, place, speed, fps)
        turns = round((float(yaws[-1][-1]) - float(leg.yaw[0])) / (2 * np.pi))
        positions.append(leg.position)
        yaws.append(leg.yaw + 2 * np.pi * turns)
        count += len(leg)
        rest(place, float(yaws[-1][-1]))
        origin, via = place, []

    position = np.concatenate(positions)
    position[:, 2] = floor
    return Route(RootPath(position, np.concatenate(yaws)), tuple(rests))
