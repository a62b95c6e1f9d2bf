"""Other people, whose plans are made already: where they are at any time, and which places they
keep.

Bodies are upright capsules around their roots.
"""

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError
from ..core.solids import Box
from .plans import Plan

__all__ = ["APART", "Occupied", "Others"]

APART = 0.5
"""Metres between two people's roots; a body's capsule has half of it as its radius."""

_STAYS = 0.15  # metres within which somebody counts as standing still
_WATCHED = 15.0  # seconds for which he has to
_SOON = (0.0, 5.0, 10.0, 15.0)  # seconds from now at which it is looked who stands still
_TALL = 0.85  # metres; half the height of one who is walked round
_WIDE = 0.34  # metres; half the width of one, since ways cut corners


class Occupied(InputError):
    """Others are where somebody is to be, or in the way there."""


class Others:
    """People in the metres of one whose size over the canonical body is ``size``."""

    def __init__(self, plans: Sequence[Plan], fps: float, size: float, floor: float) -> None:
        self._floor = floor
        self._fps = fps
        self._holds = [
            (hold.place / size, hold.radius / size, hold.start, hold.stop)
            for plan in plans
            for hold in plan.holds
        ]
        self._wider = np.array([0.5 * APART * (plan.scale / size - 1.0) for plan in plans])
        self._paths = []
        for plan in plans:
            first = round(plan.begins * fps)
            seconds = np.arange(round(len(plan) / plan.fps * fps)) / fps
            rows = np.minimum((seconds * plan.fps).round().astype(int), len(plan) - 1)
            self._paths.append((first, plan.path.position[rows, :2] / size))

    def keep(self, place: np.ndarray, radius: float, now: float, until: float) -> bool:
        """Whether a place (2,) is theirs, ``now`` or later; those who are there now and leave
        before ``until`` do not count. Seconds of the shot.
        """
        return any(
            stop > now
            and not (start <= now and stop <= until)
            and np.linalg.norm(held - place) < max(radius, around)
            for held, around, start, stop in self._holds
        )

    def at(self, frames: np.ndarray) -> np.ndarray:
        """Where (P, N, 2) they are at frames (N,) of the shot; before and after their plans they
        stand.
        """
        if not self._paths:
            return np.zeros((0, len(frames), 2))
        return np.stack(
            [path[np.clip(frames - first, 0, len(path) - 1)] for first, path in self._paths]
        )

    def gap(self, path: np.ndarray, first: int) -> np.ndarray:
        """Metres (N,) to the nearest of them along a path (N, 2) that begins at frame ``first`` of
        the shot, as if they were as wide as oneself; infinite without any.
        """
        there = self.at(first + np.arange(len(path)))
        away = np.linalg.norm(there - path, axis=2) - self._wider[:, None]
        return np.asarray(away.min(axis=0, initial=np.inf))

    def last_frame(self) -> int:
        """Of the shot, in which any of them moves."""
        return max((first + len(path) for first, path in self._paths), default=0)

    def standing(self, first: int, besides: Sequence[np.ndarray]) -> list[Box]:
        """Those who stay where they are, or are soon going to, for a while from frame ``first`` on,
        as what one goes round; not those right ``besides`` where one comes from or goes to (2,).
        """
        found: list[Box] = []
        watched = np.arange(0, round(_WATCHED * self._fps), 5)
        for soon in _SOON:
            for path in self.at(first + round(soon * self._fps) + watched):
                middle = path[0]
                near = min(float(np.linalg.norm(place - middle)) for place in besides)
                stays = np.linalg.norm(path - middle, axis=1).max() < _STAYS
                known = any(np.linalg.norm(box.center[:2] - middle) < _STAYS for box in found)
                if stays and near > APART + 0.05 and not known:
                    center = np.array([*middle, self._floor + _TALL])
                    found.append(Box(center, np.array([_WIDE, _WIDE, _TALL]), name="somebody"))
        return found
