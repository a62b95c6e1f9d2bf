"""Root paths along lines that are there already: one drawn on the floor, or the way that something
else moved.

A drawn line has no times, so it is walked as people walk (``core.paths``), corners rounded; of what
moved the times are kept, and only the shake and the too quick turns taken out. Yaw is as in
``core.root``.
"""

import numpy as np

from .errors import InputError
from .paths import AFTER_SEAT, Rest, Route, Stop, facing, walked_along
from .root import RootPath, forward_of, gaussian, yaw_of
from .series import MODEL_FPS, runs, smoothstep

__all__ = ["FASTEST", "SHORTEST", "SLOWEST", "followed", "trail"]

SLOWEST = 0.4
"""Metres a second that people walk at, at least."""
FASTEST = 3.0
"""Metres a second that people walk or run at, at most."""
SHORTEST = 0.5
"""Length that a line needs to be walked along, metres."""

_STEP = 0.005  # metres between samples along a line
# metres, the smoothing's standard deviation: a right angle becomes an arc of about 0.3 m
_ROUNDING = 0.2
_MOVES = 0.15  # metres a second, under which something stands
_STANDS = 0.5  # seconds that it does so, at least
_SHAKE = 0.15  # seconds: standard deviation of the Gaussian over a recorded position
_SWAY = 0.2  # seconds: that of the one over its heading
_TURN_RATE = np.radians(160.0)  # a second: nobody walks and turns faster
_TURN_SECONDS = 1.7  # of half a turn


def _even(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Polyline (N, 2) sampled evenly, and its length; points that coincide count once."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    grid = np.linspace(0.0, arc[-1], max(2, int(np.ceil(arc[-1] / _STEP)) + 1))
    return np.stack([np.interp(grid, arc, points[:, k]) for k in range(2)], axis=1), float(arc[-1])


def trail(
    points: np.ndarray,
    start: Stop | None = None,
    *,
    speed: float = 1.1,
    fps: float = MODEL_FPS,
    floor: float = 0.0,
    yaw: float | None = None,
    seconds: float = 1.0,
    name: str = "line",
) -> Route:
    """Walk along a line ``points`` (N, 2), metres, and stand at its end for some ``seconds``.

    ``start``: where the walker rests at first and from where it goes to the line; None rests for an
    instant at the line's beginning and looks along it. ``yaw``: the heading that is kept all the
    way; None looks where one goes. Corners are rounded, bends taken more slowly. Raises InputError
    where the line is shorter than ``SHORTEST``, not a number, or the speed not one of people.
    """
    points = np.asarray(points, float)
    if not np.isfinite(points).all():
        raise InputError(f"The {name} has a point that is not a number; fix its transform.")
    if not SLOWEST <= speed <= FASTEST:
        raise InputError(f"People walk at {SLOWEST} to {FASTEST} m/s; choose a speed between them.")

    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) if len(points) else 0.0
    if length < SHORTEST:
        raise InputError(
            f"The {name} is only {length:.2f} m long; it needs {SHORTEST} m to walk along."
        )
    if start is not None:
        origin = np.array(start.position)
        ahead = origin + AFTER_SEAT * forward_of(start.yaw)
        points = np.concatenate([[origin, ahead] if start.seated else [origin], points])

    # Twice: the smoothing shortens corners, so its samples are no more evenly apart.
    curve, length = _even(points)
    curve, length = _even(gaussian(curve, _ROUNDING / (length / (len(curve) - 1))))
    told = AFTER_SEAT + _ROUNDING if start is not None and start.seated else 0.0, length
    ends = [facing(curve[k] - curve[j]) if yaw is None else yaw for j, k in ((0, 1), (-2, -1))]
    begin = start or Stop((float(curve[0, 0]), float(curve[0, 1])), ends[0], 0.0)
    end = Stop((float(curve[-1, 0]), float(curve[-1, 1])), ends[1], seconds)
    leg = walked_along(curve, length, begin, end, told, speed, fps, yaw)

    before, after = (max(1, round(stop.seconds * fps)) for stop in (begin, end))
    resting = np.tile([*begin.position, 0.0], (before, 1)), np.tile(leg.position[-1], (after, 1))
    position = np.concatenate([resting[0], leg.position, resting[1]])
    position[:, 2] = floor
    turns = 2 * np.pi * round((begin.yaw - float(leg.yaw[0])) / (2 * np.pi))
    heading = np.concatenate(
        [np.full(before, begin.yaw), leg.yaw + turns, np.full(after, leg.yaw[-1] + turns)]
    )
    frames = len(heading)
    return Route(
        RootPath(position, heading), (Rest(begin, 0, before), Rest(end, frames - after, frames))
    )


def _headings(
    velocity: np.ndarray, stands: list[tuple[int, int]], yaw: float, fps: float
) -> np.ndarray:
    """Yaw (T,) of the direction of travel; held in ``stands``, with the turn to where it leaves in
    their last part.
    """
    frames = len(velocity)
    moving = np.ones(frames, bool)
    for a, b in stands:
        moving[a:b] = False

    if not moving.any():
        return np.full(frames, yaw)

    told = np.flatnonzero(moving & (np.linalg.norm(velocity, axis=1) > 1e-6))
    heading = np.unwrap(yaw_of(velocity[told]))
    out = np.interp(np.arange(frames), told, heading)
    for a, b in stands:
        before = (
            out[a - 1]
            if a > 0
            else yaw + 2 * np.pi * round((out[min(b, frames - 1)] - yaw) / (2 * np.pi))
        )
        after = out[b] if b < frames else before
        needed = (0.6 + (_TURN_SECONDS - 0.6) * abs(after - before) / np.pi) * fps
        u = (np.arange(a, b) - max(a, b - needed)) / max(min(needed, b - a), 1.0)
        out[a:b] = before + smoothstep(u) * (after - before)

    return out


def followed(positions: np.ndarray, fps: float, yaw: float = 0.0, floor: float = 0.0) -> Route:
    """The root of what moved: ``positions`` (T, 2), metres, at ``fps``; the frames stay the same.

    Smoothed; it looks where it goes, holds its heading where it stands (``yaw`` where it stands
    from the first) and turns before it leaves. ``rests``: where it stands. Raises InputError where
    it does not move or is not a number.
    """
    positions = np.asarray(positions, float)
    if not np.isfinite(positions).all():
        raise InputError(
            "The object to follow has a place that is not a number; fix its keys, drivers or "
            "constraints."
        )

    if len(positions) < 2 or np.ptp(positions, axis=0).max() < SHORTEST / 2:
        raise InputError("The object to follow hardly moves over the floor; choose one that does.")

    smooth = gaussian(positions, _SHAKE * fps)
    velocity = np.gradient(smooth, axis=0) * fps
    stands = runs(np.linalg.norm(velocity, axis=1) < _MOVES, max(2, round(_STANDS * fps)))
    for a, b in stands:
        # What is left there of the movement would be a creeping root under feet that stand.
        way = np.linspace(0.0, 1.0, b - a)[:, None] if a > 0 and b < len(smooth) else 0.0
        ends = smooth[a if a > 0 else b - 1], smooth[b - 1 if b < len(smooth) else a]
        smooth[a:b] = ends[0] + (ends[1] - ends[0]) * way

    raw = _headings(velocity, stands, yaw, fps)
    sway = _SWAY * fps
    heading = gaussian(raw, sway)
    while np.abs(np.diff(heading)).max() * fps > _TURN_RATE and sway < 2.0 * fps:
        sway *= 1.3
        heading = gaussian(raw, sway)

    path = RootPath(np.c_[smooth, np.full(len(smooth), floor)], heading)
    rests = [
        Rest(
            place=Stop(
                (float(smooth[a, 0]), float(smooth[a, 1])), float(heading[a]), (b - a) / fps
            ),
            start=a,
            stop=b,
        )
        for a, b in stands
    ]
    return Route(path, tuple(rests))
