"""Finds where to sit on furniture, and which way to face, by its mesh.

A seat is where a body fits: an even part between knees' and hips' height carries its hips, the
thighs end at an edge or before it, legs hang there, the trunk has room, and, if it can be, a back
is within a lean's reach behind. Every even part of a piece is looked at from all of its sides.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.errors import InputError
from ..core.nearby import extent
from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.root import forward_of
from ..core.softness import kind_by_name
from ..core.solids import Box, Mesh
from ..core.text import metres
from .body_fits import Lines
from .even_parts import CELL, HIGHEST, LOWEST, SNAP, Part, even_parts
from .sitting_body import BEFORE_BACK, ELBOWS, HIPS, ON_IT, SHORTEST, SHOULDERS, THIGH
from .surfaces import columns, parts_of_surfaces

__all__ = ["MarkedSeat", "NoSeat", "SeatPlace", "mark_of", "on_a_seat", "seat_of", "seats_of"]

_MAX_CELLS = 1_000_000
"""Larger furniture is looked at more coarsely."""
_TOPMOST = 0.95
"""What is higher is not looked down upon: it is over the seat, or stands behind it."""
_SMALLEST = 0.15
"""Metres across, of the smallest furniture."""
_LARGEST = 15.0
"""Metres across, of the largest furniture."""
_TABLES = ("table", "desk")
"""Kinds by name, see ``core.softness``."""

_UNDER = 0.08
"""Around a root, in which its seat is looked for."""
_AS_GOOD = 0.15
"""Seats whose goodness differs by less are chosen from by where one comes from."""
_OTHERS = 0.4
"""Seats that are worse by more than this are none."""
_STRAIGHT = 0.86
"""Of its rectangle's area, that a part with straight sides has at least."""
_ROUND = (0.70, 1.2)
"""The same of what is round at least, whose length over width is at most that."""
_WIDE, _ROOMY = 0.6, 0.36
"""How much better it is to have so many metres for the pelvis' middle."""
_WIDER = 0.2
"""How much better it is to have a metre and a half of them."""
_SEVERAL = 1.2
"""Metres of length, of seats for several: one sits square to their sides, at corners as well."""
_SAME = 0.1
"""Metres from a place that is asked for, which make no difference."""
_NEAR = 0.3
"""Metres by which a better seat may be farther from a place that is asked for."""


class NoSeat(InputError):
    """There is nothing to sit on."""


@dataclass(frozen=True)
class SeatPlace:
    """Where somebody sits: the pelvis rests at ``position`` (2,) and faces ``yaw`` (``core.root``).

    ``height``: of the seat's top over the world's zero, metres. ``back``: whether it has one.
    ``aside``: metres to each side within which one may sit as well. ``edge``: metres from the
    pelvis to the front edge.
    """

    position: np.ndarray
    yaw: float
    height: float
    back: bool
    aside: float
    edge: float


@dataclass(frozen=True)
class MarkedSeat:
    """A seat as its maker marked it, in the words of glTF's OMI_seat: where the ``back`` and hips
    are at most, the hollow of the ``knee``, and the ``foot`` (3,); metres, world. ``angle``:
    between thighs and spine, radians.
    """

    back: np.ndarray
    foot: np.ndarray
    knee: np.ndarray
    angle: float = 0.5 * np.pi

    def place(self) -> SeatPlace | None:
        """Where somebody sits on it, thighs ending at the knee or before it; None where back and
        knee are one over the other.
        """
        ahead = (self.knee - self.back) * (1.0, 1.0, 0.0)
        deep = float(np.linalg.norm(ahead))
        if deep < SHORTEST:
            return None
        pelvis = min(max(BEFORE_BACK, deep - THIGH), max(0.5 * deep, deep - ON_IT))
        at = self.back + pelvis / deep * (self.knee - self.back)
        return SeatPlace(
            position=at[:2],
            yaw=facing(ahead[:2]),
            height=float(at[2]),
            back=True,
            aside=0.0,
            edge=deep - pelvis,
        )

    def resized(self, factor: float) -> "MarkedSeat":
        """The same ``factor`` times as large, about the world's origin."""
        return MarkedSeat(factor * self.back, factor * self.foot, factor * self.knee, self.angle)


def mark_of(place: SeatPlace, floor: float) -> MarkedSeat:
    """What is marked where a seat was found."""
    ahead = np.array([*forward_of(place.yaw), 0.0])
    at = np.array([*place.position, place.height])
    knee = at + place.edge * ahead
    return MarkedSeat(back=at - BEFORE_BACK * ahead, foot=np.array([*knee[:2], floor]), knee=knee)


@stepwise
def on_a_seat(
    solids: Sequence[Box | Mesh], position: np.ndarray, floor: float = 0.0
) -> Generator[float, None, bool]:
    """Whether a root that rests at ``position`` (2,) has a seat under it: something between 22 and
    85 cm over ``floor``.
    """
    parts = yield from parts_of_surfaces.steps(solids, CELL, (position - _UNDER, position + _UNDER))
    for points in parts:
        height = points[np.linalg.norm(points[:, :2] - position, axis=-1) < _UNDER, 2] - floor
        if ((height > LOWEST) & (height < HIGHEST)).any():
            return True
        yield 1.0

    return False


@stepwise
def seat_of(
    solids: Sequence[Box | Mesh],
    towards: np.ndarray,
    floor: float = 0.0,
    name: str = "furniture",
    near: np.ndarray | None = None,
    size: float = 1.0,
    tables: bool = False,
) -> Generator[float, None, SeatPlace]:
    """The first of ``seats_of``."""
    found = yield from seats_of.steps(solids, towards, floor, name, near, size, tables)
    return found[0]


@stepwise
def seats_of(
    solids: Sequence[Box | Mesh],
    towards: np.ndarray,
    floor: float = 0.0,
    name: str = "furniture",
    near: np.ndarray | None = None,
    size: float = 1.0,
    tables: bool = False,
) -> Generator[float, None, list[SeatPlace]]:
    """Where to sit on furniture made of ``solids``, the best place first; world, metres, people of
    1.75 m.

    Before a back, facing away from it, where there is one. Without a back, facing across the seat,
    on the side where ``towards`` (2,) lies; so on beds, at a long edge. Of places that are as good,
    the nearest to there, each in the middle of where one may sit; or by ``near`` (2,) where it is
    given. Raises NoSeat where there is nothing to sit on, which is an even part between 22 and
    85 cm over ``floor`` that a body fits on, or where there are only ``tables`` and these do not
    count, or armchairs with their footrest before them. ``size``: of the character, over 1.75 m, by
    which messages give lengths.
    """
    own = solids
    if not tables:
        own = [each for each in solids if kind_by_name(each.name) not in _TABLES]
        if not own or kind_by_name(name) in _TABLES:
            raise NoSeat(_a_table(name))

    points = yield from within(parts_of_surfaces.steps(own, 0.6 * CELL), 0.0, 0.5)
    job = columns.steps(points, floor, CELL, _TOPMOST, _MAX_CELLS)
    seen = yield from within(job, 0.5, 0.6)
    parts = even_parts(seen, towards if near is None else near) if seen is not None else []
    yield 0.7

    found: list[tuple[float, SeatPlace]] = []
    only_tables = footrests = False
    for k, part in enumerate(parts):
        if part.has_footrest:
            footrests = True
            continue
        is_table = part.is_table
        for way in _ways(part, towards):
            fits = [(good, each) for good, each in _fits(part, way, near, floor)]
            if is_table and not tables:
                only_tables |= any(not each.back for _, each in fits)
                fits = [(good, each) for good, each in fits if each.back]
            found += fits
            yield 0.7 + 0.3 * k / len(parts)

    if not found and footrests:
        raise NoSeat(
            f"The footrest of '{name}' is where one comes to sit; take it away, or choose another "
            "seat."
        )
    if not found:
        raise NoSeat(_a_table(name) if only_tables else _why_not_a_seat(solids, name, size))
    return _ordered(found, towards, near)


def _ways(part: Part, towards: np.ndarray) -> list[np.ndarray]:
    """Directions (2,) in which one may face on a part: those of its sides, and away from what
    stands up beside it; to ``towards`` on what is round.
    """
    sides = [part.longer, -part.longer, part.shorter, -part.shorter]
    straight = part.fills > _STRAIGHT
    if part.away.any():
        beside_a_side = straight and max(part.away @ side for side in sides) > SNAP
        if beside_a_side or part.length > _SEVERAL:
            return sides
        is_round = part.fills > _ROUND[0] and part.length < _ROUND[1] * part.width
        return [*_crossed(part.away), *([] if is_round and not straight else sides)]
    if straight or not (towards - part.middle).any():
        return sides
    to = towards - part.middle
    return _crossed(to / np.linalg.norm(to))


def _crossed(way: np.ndarray) -> list[np.ndarray]:
    """A direction (2,) and the three that are square to it."""
    across = np.array([way[1], -way[0]])
    return [way, -way, across, -across]


def _fits(
    part: Part, way: np.ndarray, near: np.ndarray | None, floor: float
) -> list[tuple[float, SeatPlace]]:
    """How good it is to sit on a part, facing a ``way`` (2,), and where: a place for each stretch
    of it, in its middle or by ``near`` (2,).
    """
    line = Lines(part, way)
    fits = [line.fit(k) for k in range(len(line.aside))]
    stretches, last = [], None
    for k, fit in enumerate(fits):
        if fit is None:
            last = None
        elif last is None or abs(fit.ahead - last.ahead) > 0.15 or fit.back != last.back:
            stretches.append([k])
            last = fit
        else:
            stretches[-1].append(k)
            last = fit

    found = []
    across = np.array([way[1], -way[0]])
    for stretch in stretches:
        first, end = line.aside[stretch[0]], line.aside[stretch[-1]]
        middle = 0.5 * (first + end)
        # What ends by an arm is kept clear of it already.
        by_arms = [line.carries(stretch[0] - 1), line.carries(stretch[-1] + 1)]
        kept = SHOULDERS + part.columns.field.cell if all(by_arms) else 0.4 * HIPS
        room = max(0.0, 0.5 * (end - first) - (ELBOWS - kept))
        if near is not None:
            at = float(np.clip(near @ across, middle - room, middle + room))
        elif room < 0.1:
            at = float(np.clip(line.middle, first, end))
        else:
            at = middle
        fit = fits[stretch[int(np.argmin(np.abs(line.aside[stretch] - at)))]]
        assert fit is not None
        good = float(np.median([fits[k].goodness for k in stretch]))  # type: ignore[union-attr]
        good += _WIDE * min(1.0, (end - first) / _ROOMY) + _WIDER * min(1.0, (end - first) / 1.5)
        place = SeatPlace(
            position=fit.ahead * way + at * across,
            yaw=facing(way),
            height=floor + fit.height,
            back=fit.back,
            aside=room,
            edge=fit.edge - fit.ahead,
        )
        found.append((good, place))
    return found


def _ordered(
    found: Sequence[tuple[float, SeatPlace]], towards: np.ndarray, near: np.ndarray | None
) -> list[SeatPlace]:
    """The places, the best first, without those that are far worse."""

    def away(place: SeatPlace) -> tuple[float, float]:
        before = place.position + 0.5 * forward_of(place.yaw)
        to = float(np.linalg.norm(before - towards))
        lap = place.position + 0.1 * forward_of(place.yaw)
        by = 0.0 if near is None else float(np.linalg.norm(lap - near))
        return round(by / _SAME), to

    if near is not None:
        nearest = min(away(place)[0] for _, place in found)
        found = [each for each in found if away(each[1])[0] < nearest + _NEAR / _SAME]
    best = max(good for good, _ in found)
    rest = [each for each in found if each[0] > best - _OTHERS]
    rest.sort(key=lambda each: (each[0] < best - _AS_GOOD, away(each[1])))
    return [place for _, place in rest]


def _a_table(name: str) -> str:
    return f"'{name}' is a table; choose a seat, or ask for a table to be sat on."


def _why_not_a_seat(solids: Sequence[Box | Mesh], name: str, size: float) -> str:
    """What to say of a piece of furniture that nobody can sit on."""
    across = extent(solids)
    if not _SMALLEST < across < _LARGEST:
        return (
            f"'{name}' is {metres(across * size)} across: is its unit right? Scale it to the "
            "character's size."
        )
    return (
        f"'{name}' has no level surface between {100 * LOWEST * size:.0f} and "
        f"{100 * HIGHEST * size:.0f} cm over the floor to sit on; choose a seat."
    )
