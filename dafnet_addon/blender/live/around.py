"""What stands around a character that is led live: its furniture, read again where it moves, and
the seats in it.
"""

from collections.abc import Generator, Iterable
from time import perf_counter

import bpy
import numpy as np

from ...core.distance import FLOOR
from ...core.following import Seat
from ...core.live import Surroundings
from ...core.solids import Scene
from ...director.seats import NoSeat, SeatPlace, seats_of
from ..character.settings import Settings
from ..scene.dependencies import Dependencies
from ..scene.furniture import furniture_of
from ..scene.lookup import find_collection

__all__ = ["LiveFurniture"]

_REREAD = 0.5
"""Seconds between two readings of furniture that is moving."""
_AROUND = 0.9
"""Canonical metres around a dragged root, within which furniture is looked at for seats."""
_UNDER = 0.05
"""Canonical metres around it, within which it is what is to be sat on."""

_ONE_SEAT = 0.25
"""Metres between two seats, under which they are one that can be sat on in several ways."""
_LOOKS = 0.012
"""Seconds of a tick that are spent on looking for seats."""


class LiveFurniture:
    """The furniture of a character ``scale`` times the canonical size; ``unit``: of a Blender unit,
    metres. ``members``: the objects that are furniture; ``scene``: as it was read, world, metres;
    ``surroundings``: the same as the body senses it.
    """

    def __init__(
        self,
        context: bpy.types.Context,
        settings: Settings,
        *,
        unit: float,
        scale: float,
        floor: float,
    ) -> None:
        self._unit, self._scale = unit, scale
        self._moved, self._read_at = False, -np.inf
        self._read(context, settings, floor)

    def _read(self, context: bpy.types.Context, settings: Settings, floor: float) -> None:
        furniture = furniture_of(settings, Dependencies(context.scene))
        self._count, self._floor = _objects_of(settings), floor
        self.members: set[bpy.types.Object] = set()
        self.scene = Scene()
        if furniture is not None:
            self.members = furniture.members
            furniture.begin(context.evaluated_depsgraph_get())
            self.scene = Scene(furniture.solids(self._unit))
        self.surroundings = Surroundings(self.scene, floor, self._scale)
        self._seats: dict[frozenset[int], tuple[Seat, ...]] = {}
        self._looking: dict[frozenset[int], Generator[float, None, list[SeatPlace]]] = {}

    def note(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Blender has evaluated something anew: it may have been furniture."""
        if not self._moved:
            self._moved = any(
                (update.is_updated_transform or update.is_updated_geometry)
                and update.id.original in self.members
                for update in depsgraph.updates
            )

    def read_again(
        self, context: bpy.types.Context, settings: Settings, floor: float, now: float
    ) -> bool:
        """Read what was moved, added or removed, or all of it where the root is on another floor,
        twice a second while that goes on; ``settings``: with the present names; ``now``: seconds.
        Whether it did.

        ``InputError``: there is none any more.
        """
        if now - self._read_at < _REREAD:
            return False
        same_floor = abs(floor - self._floor) < FLOOR
        if not self._moved and same_floor and _objects_of(settings) == self._count:
            return False
        self._moved, self._read_at = False, now
        self._read(context, settings, floor)
        return True

    def seats(
        self, place: np.ndarray, towards: np.ndarray, patience: float = _LOOKS
    ) -> tuple[Seat, ...] | None:
        """The seats around a root at ``place`` (3,), metres, for who comes from ``towards`` (3,);
        None where nothing is under it that could carry a body, or as long as they are looked for:
        each time for ``patience`` seconds, and once for all.
        """
        here = place / self._scale
        if not self.scene.solids or not self.surroundings.carries(here):
            return None
        under = frozenset(map(id, self.surroundings.near(here, _UNDER).solids))
        if under not in self._seats:
            # One search at a time: each holds on to megabytes.
            if under not in self._looking:
                self._looking.clear()
                self._looking[under] = seats_of.steps(
                    self.surroundings.near(here, _AROUND).solids,
                    towards[:2] / self._scale,
                    float(here[2]),
                    near=here[:2],
                )
            found = _looked_on(self._looking[under], patience)
            if found is None:
                return None
            self._looking.clear()
            self._seats[under] = _apart(
                Seat(each.position * self._scale, each.yaw, each.aside * self._scale)
                for each in found
            )
        return self._seats[under]


def _objects_of(settings: Settings) -> int:
    """How many objects the collection of furniture holds."""
    name = settings.furniture
    return len(find_collection(name).all_objects) if name else 0


def _apart(found: Iterable[Seat]) -> tuple[Seat, ...]:
    """The best seats, the first, of those that are in each other's place but face other ways."""
    kept: list[Seat] = []
    for seat in found:
        if all(np.linalg.norm(seat.position - each.position) > _ONE_SEAT for each in kept):
            kept.append(seat)
    return tuple(kept)


def _looked_on(
    looking: Generator[float, None, list[SeatPlace]], patience: float
) -> list[SeatPlace] | None:
    """What a search for seats has found within ``patience`` seconds; None where it goes on."""
    until = perf_counter() + patience
    try:
        while perf_counter() < until:
            next(looking)
    except StopIteration as done:
        found: list[SeatPlace] = done.value
        return found
    except NoSeat:
        return []
    return None
