"""What has been planned of a person's motion up to now: root, hands and head, frame by frame.

Canonical metres, world. A track grows at its end; hands and head that are asked for anything are
led there and let go as people do it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.paths import turn_seconds
from ..core.root import RootPath
from ..core.series import minimum_jerk, runs, smoothstep
from ..core.skeleton import END_EFFECTORS
from .movements import look_matrices

__all__ = ["LETS_GO", "Targets", "Track"]

LETS_GO = 0.7
"""Seconds in which a hand or head goes back to where it would be."""
_BLEND = 0.4  # seconds of the mode EE before and after anything counts in it
_APART = 2.5  # seconds between two uses of a hand, within which it goes from one to the other


@dataclass(frozen=True)
class _Use:
    """A hand's or head's ``values`` (N, 3), places or directions, from frame ``start`` on; it is
    led there for ``lead`` frames before.
    """

    start: int
    values: np.ndarray
    lead: int

    @property
    def stop(self) -> int:
        return self.start + len(self.values)


@dataclass(frozen=True)
class Targets:
    """``places`` (T, 3) of head and wrists and ``looks`` (T, 3, 3) of the head, NaN where free;
    ``influences`` (T,); ``mode`` of each frame; by the names of ``END_EFFECTORS``.
    """

    places: dict[str, np.ndarray]
    looks: np.ndarray | None
    influences: dict[str, np.ndarray]
    mode: tuple[str, ...]


class Track:
    """Begins with one frame at ``position`` (2,), ``yaw``; ``fps`` frames a second."""

    def __init__(self, position: Sequence[float], yaw: float, floor: float, fps: float) -> None:
        self.fps = fps
        self._floor = floor
        self._positions = [np.array([[*position, floor]], float)]
        self._yaws = [np.array([float(yaw)])]
        self._uses: dict[str, list[_Use]] = {name: [] for name in (*END_EFFECTORS, "look")}
        self.frames = 1

    @property
    def position(self) -> np.ndarray:
        """(2,): where the root is now."""
        return np.asarray(self._positions[-1][-1, :2])

    @property
    def yaw(self) -> float:
        return float(self._yaws[-1][-1])

    def path(self) -> RootPath:
        return RootPath(np.concatenate(self._positions), np.concatenate(self._yaws))

    def follow(self, positions: np.ndarray, yaws: np.ndarray) -> None:
        """Go on along positions (N, 2 or 3) with yaws (N,), unwrapped from the present one."""
        if not len(yaws):
            return
        on_floor = np.column_stack([positions[:, :2], np.full(len(yaws), self._floor)])
        turns = 2.0 * np.pi * round((self.yaw - float(yaws[0])) / (2.0 * np.pi))
        self._positions.append(on_floor)
        self._yaws.append(np.asarray(yaws, float) + turns)
        self.frames += len(yaws)

    def rest(self, seconds: float) -> None:
        frames = max(0, round(seconds * self.fps))
        self.follow(np.tile(self.position, (frames, 1)), np.full(frames, self.yaw))

    def turn(self, yaw: float) -> None:
        """Turn on the spot."""
        by = float((yaw - self.yaw + np.pi) % (2.0 * np.pi) - np.pi)
        frames = max(1, round(turn_seconds(by) * self.fps))
        share = smoothstep(np.arange(1, frames + 1) / frames)
        self.follow(np.tile(self.position, (frames, 1)), self.yaw + by * share)

    def last_place(self, name: str) -> np.ndarray | None:
        """Where (3,) a hand or head is that has not been let go; None where it is free."""
        uses = self._uses[name]
        return uses[-1].values[-1] if uses and uses[-1].stop >= self.frames else None

    def lead(self, seconds: dict[str, float], values: dict[str, np.ndarray]) -> None:
        """Lead hands, head or look to their first values, each in its ``seconds`` (all at once,
        ending together), and along the ``values`` (N, 3) from then on.
        """
        self.rest(max(seconds.values()))
        for name, along in values.items():
            ahead = round(seconds[name] * self.fps)
            self._uses[name].append(_Use(self.frames, along, ahead))
        self.rest(max(len(along) for along in values.values()) / self.fps)

    def hold(self, values: dict[str, np.ndarray], lead: float) -> None:
        """``values`` (N, 3) that have gone along with the last N frames, led to from ``lead``
        seconds before.
        """
        for name, along in values.items():
            self._uses[name].append(_Use(self.frames - len(along), along, round(lead * self.fps)))

    def letting_go(self) -> float:
        """Seconds that hands and head need to go back, before the root leaves."""
        led = any(uses and uses[-1].stop >= self.frames for uses in self._uses.values())
        return LETS_GO if led else 0.0

    def let_go(self) -> None:
        """Give hands and head the time to go back, before the root leaves."""
        self.rest(self.letting_go())

    def targets(self, size: float) -> Targets:
        """What is asked of hands and head at all frames, in metres of which a canonical one is
        ``size``.
        """
        places: dict[str, np.ndarray] = {}
        influences: dict[str, np.ndarray] = {}
        looks = None
        for name, uses in self._uses.items():
            values, share = self._led(uses)
            if not uses:
                continue
            if name == "look":
                looks = look_matrices(values)
                known = influences.get("head", np.zeros(self.frames))
                influences["head"] = np.maximum(known, share)
            else:
                places[name], influences[name] = values * size, share

        used = np.zeros(self.frames, bool)
        for share in influences.values():
            used |= share > 0.0
        mode = np.full(self.frames, "FREE", dtype=object)
        around = round(_BLEND * self.fps)
        for start, stop in runs(used, gap=2 * around):
            mode[max(0, start - around) : stop + around] = "EE"
        return Targets(places, looks, influences, tuple(mode.tolist()))

    def _led(self, uses: Sequence[_Use]) -> tuple[np.ndarray, np.ndarray]:
        """Values (T, 3), NaN where free, and how far they count (T,)."""
        values, share = np.full((self.frames, 3), np.nan), np.zeros(self.frames)
        for use in uses:
            values[use.start : use.stop], share[use.start : use.stop] = use.values, 1.0

        for before, after in zip([None, *uses], [*uses, None], strict=True):
            if before and after and after.start - before.stop <= _APART * self.fps:
                between = slice(before.stop, after.start)
                count = after.start - before.stop
                moved = max(1, min(after.lead, count + 1))
                way = minimum_jerk((np.arange(1, count + 1) - (count + 1 - moved)) / moved)
                here, there = before.values[-1], after.values[0]
                values[between] = here + way[:, None] * (there - here)
                share[between] = 1.0
                continue

            if before:
                self._let_go(values, share, before, after)
            if after and after.start > 0:
                first = max(0, after.start - after.lead, before.stop if before else 0)
                frames = np.arange(first, after.start)
                way = minimum_jerk((frames - first + 1) / (after.start - first + 1))
                behind = way > share[frames]
                values[frames[behind]], share[frames[behind]] = after.values[0], way[behind]

        return values, share

    def _let_go(
        self, values: np.ndarray, share: np.ndarray, before: _Use, after: _Use | None
    ) -> None:
        end = self.frames if after is None else after.start
        frames = np.arange(before.stop, min(end, before.stop + round(LETS_GO * self.fps)))
        way = 1.0 - minimum_jerk((frames - before.stop + 1) / (LETS_GO * self.fps + 1))
        values[frames], share[frames] = before.values[-1], way
