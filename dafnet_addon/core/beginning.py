"""What came before a shot's first frame, where nobody says: the body stood there, or, where the
root is over a seat, it came to that seat and sat down.

The network knows how high a seat is from having come to it. Whoever is on it from the start with an
empty memory rests 8 cm off in the mean, and half as far after he has sat down.
"""

from dataclasses import dataclass

import numpy as np

from .drawn_up import in_frames_of, under
from .occupancy import occupancy, tops_under
from .root import RootPath, forward_of, smoothed
from .sensor import SPHERES
from .solids import Scene

__all__ = ["PREROLL", "Beginning", "beginning_at"]

PREROLL = 70
"""Frames before the first one, in which the model's memory settles."""

_EDGE = 0.05
"""Metres that a seat goes on at least before whoever sits on it; whoever stands with the calves
against it has its edge under the hips.
"""
_WAY = 0.3  # metres in front of a seat from which one came to it
_COMES = 40  # frames in which
_RESTS = 16  # frames for which one had sat by the first one
_UPRIGHT = (
    (np.hypot(SPHERES[:, 0], SPHERES[:, 1]) < 0.2)
    & (SPHERES[:, 1] > -0.01)
    & (SPHERES[:, 2] > 0.5)
    & (SPHERES[:, 2] < 1.6)
)
"""Spheres where who stands has hips, trunk and head, but not those behind him."""
_SOLID = 0.65  # occupancy of a sphere whose centre is 5 cm from a solid


@dataclass(frozen=True)
class Beginning:
    """The ``PREROLL`` frames before a shot: the root's ``path``, canonical metres; what the sensor
    sees there, ``occupancy`` (PREROLL, 2640); and the frame from which the root is where the shot
    begins, ``arrives``: before it nothing is asked of the body.
    """

    path: RootPath
    occupancy: np.ndarray
    arrives: int = 0


def beginning_at(
    scene: Scene, start: RootPath, seen: np.ndarray, lead: RootPath | None = None
) -> Beginning:
    """How a body came to be where its root is ``start`` (one frame), which sees ``seen`` (2640,),
    in the first frame of a scene; canonical metres. ``lead``: the root's frames before, where they
    are known.

    Who is beside furniture stood there, and sees none of it yet, so that he starts standing. Who is
    over a seat came to it from in front while nothing but that seat was there: a chair is drawn up
    to a table afterwards. Where the seat itself leaves him no room to stand, as a room in one piece
    does, he has always sat there.
    """
    still = RootPath(np.repeat(start.position, PREROLL, axis=0), np.repeat(start.yaw, PREROLL))
    there = Scene(tuple(in_frames_of(solid, 0) for solid in scene.solids))
    over = _is_over_seat(there, start)
    held = np.repeat(seen[None] if over else np.zeros_like(seen[None]), PREROLL, axis=0)
    if lead is not None or not over:
        return Beginning(still if lead is None else lead, held)

    left = np.clip((PREROLL - _RESTS - np.arange(PREROLL)) / _COMES, 0.0, 1.0)
    way = _WAY * left[:, None] * np.append(forward_of(start.yaw[0]), 0.0)
    came = smoothed(RootPath(still.position + way, still.yaw))

    seen_coming = occupancy(Scene(under(there, start)), came)
    if seen_coming[0, _UPRIGHT].max() > _SOLID:
        return Beginning(still, held)
    return Beginning(came, seen_coming, PREROLL - _RESTS)


def _is_over_seat(scene: Scene, start: RootPath) -> bool:
    ahead = RootPath(start.position + _EDGE * np.append(forward_of(start.yaw[0]), 0.0), start.yaw)
    return all(bool(np.isfinite(tops_under(scene, each))[0]) for each in (start, ahead))
