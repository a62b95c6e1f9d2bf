"""What the director knows of a scene: furniture by name, and where other things are."""

from collections.abc import Generator, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from math import prod
from typing import Any

import numpy as np

from ..core.distance import scaled
from ..core.errors import InputError
from ..core.nearby import bounds
from ..core.progress import stepwise, within
from ..core.solids import Box, Mesh, Scene
from ..core.text import nearest_known, printable
from .outlines import rectangle_axes
from .seats import MarkedSeat
from .surfaces import HeightField, height_field, parts_of_surfaces

__all__ = ["HEAD_HIGH", "KNEE_LOW", "Piece", "Room", "axes_from_above", "top_view"]

KNEE_LOW = 0.07
"""Metres over the floor; what lies lower is stepped over."""
HEAD_HIGH = 1.85
"""Metres over the floor; what hangs higher is not met."""
_FINE = 0.04  # metres between points on furniture, however small who walks round it
_TABLE_AT_MOST = 8_000_000  # numbers that are looked up instead of sorted
_MAX_CELLS = 1_000_000  # cells of a field; what is larger is looked at more coarsely


@dataclass(frozen=True)
class Piece:
    """One piece of furniture: its ``name``, and the ``solids`` that it is made of."""

    name: str
    solids: tuple[Box | Mesh, ...]

    def shape(self) -> tuple[Hashable, np.ndarray]:
        """What pieces of one shape have in common, wherever on the floor they stand, and where (2,)
        this one does.
        """
        found, place = [], None
        for solid in self.solids:
            if isinstance(solid, Box):
                made, frames = tuple(np.ravel(solid.half_size)), solid.matrices()
            else:
                # the points themselves are kept by whoever keeps this
                made, frames = (id(solid.vertices), len(solid.triangles)), solid.matrix
            if np.ndim(frames) == 3:
                return object(), np.zeros(2)
            place = frames[:2, 3] if place is None else place
            moved = np.array(frames, float)
            moved[:2, 3] -= place
            found.append((made, np.round(moved, 5).tobytes()))
        return tuple(found), np.zeros(2) if place is None else np.array(place, float)

    def box(self) -> np.ndarray:
        """The lowest and the highest corner (2, 3) of the upright box around it at first."""
        corners = [
            np.stack(bounds(solid)).reshape(2, -1, 3)[:, 0]
            for solid in self.solids
            if isinstance(solid, Box) or len(solid.triangles)
        ]
        if not corners:
            return np.zeros((2, 3))
        return np.stack([np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]])


@dataclass
class Known:
    """What has been found out about a room, for whoever asks next: the room in other ``sizes``, its
    ``pieces``, their ``boxes``, and, of those that were asked for, their ``surfaces`` and
    ``footprints``, and what was found on ``shapes`` of furniture. A room that is ``factor`` times
    another one knows which (``of``).
    """

    of: "Room | None" = None
    factor: float = 1.0
    sizes: "dict[float, Room]" = field(default_factory=dict)
    pieces: "dict[str, Piece] | None" = None
    boxes: dict[str, np.ndarray] = field(default_factory=dict)
    surfaces: dict[str, np.ndarray] = field(default_factory=dict)
    footprints: dict[str, np.ndarray] = field(default_factory=dict)
    shapes: dict[Hashable, Any] = field(default_factory=dict)


def _thinned(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Points (N, k) float32, of those closer together than a centimetre only one."""
    every, parts = parts, [part for part in parts if len(part)]
    if not parts:
        return np.zeros((0, every[0].shape[1] if every else 3), np.float32)
    points = np.concatenate(parts)
    columns = [np.ascontiguousarray(column) for column in points.T]
    low = [column.min() for column in columns]
    cells = [
        np.rint((column - least) * 100.0).astype(np.int64)
        for column, least in zip(columns, low, strict=True)
    ]
    counts = [int(cell.max()) + 1 for cell in cells]
    keys = cells[0]
    for cell, count in zip(cells[1:], counts[1:], strict=True):
        keys = keys * count + cell
    if prod(counts) > _TABLE_AT_MOST:
        first = np.unique(keys, return_index=True)[1]
    else:  # much faster than sorting
        table = np.full(prod(counts), -1, np.int32)
        table[keys[::-1]] = np.arange(len(keys) - 1, -1, -1, dtype=np.int32)
        first = table[table >= 0]
    return points[first].astype(np.float32)


@dataclass(frozen=True)
class Room:
    """A scene for people with tasks; world, metres, z up.

    ``solids``: the furniture; those of one name are one piece. ``parts``: names of solids that
    belong to a piece of another name, as a chair's back does. ``groups``: names of pieces by a name
    for all of them, as collections are. ``points`` (x, y, z): what can be looked at, reached or
    walked to besides furniture. ``lines`` (N, 2): curves to walk along. ``marked``: seats by the
    names of pieces that say themselves where they are; ``misread``: what is wrong with what others
    say, a sentence each. ``floor``: its height.
    """

    solids: Sequence[Box | Mesh] = ()
    parts: Mapping[str, str] = field(default_factory=dict)
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    points: Mapping[str, Sequence[float] | np.ndarray] = field(default_factory=dict)
    lines: Mapping[str, np.ndarray] = field(default_factory=dict)
    marked: Mapping[str, Sequence[MarkedSeat]] = field(default_factory=dict)
    misread: Mapping[str, str] = field(default_factory=dict)
    floor: float = 0.0
    known: "Known" = field(default_factory=lambda: Known(), repr=False, compare=False)

    def resized(self, factor: float) -> "Room":
        """The room ``factor`` times as large, about the world's origin; the same one for whoever
        asks again.
        """
        if factor not in self.known.sizes:
            self.known.sizes[factor] = self._resized(factor)
        return self.known.sizes[factor]

    def _resized(self, factor: float) -> "Room":
        return Room(
            solids=scaled(Scene(tuple(self.solids)), factor).solids,
            parts=self.parts,
            groups=self.groups,
            points={name: factor * np.asarray(at, float) for name, at in self.points.items()},
            lines={name: factor * np.asarray(line, float) for name, line in self.lines.items()},
            marked={
                name: [seat.resized(factor) for seat in seats]
                for name, seats in self.marked.items()
            },
            misread=self.misread,
            floor=factor * self.floor,
            known=Known(of=self, factor=factor),
        )

    def surfaces(
        self, between: tuple[np.ndarray, np.ndarray] | None = None
    ) -> Generator[float, None, dict[str, np.ndarray]]:
        """Points (N, 3) all over each piece, by name; a job. ``between``: two corners (2,) of the
        floor; only of pieces that reach over what is between them, if they are given.
        """
        known = self.known.surfaces
        names = self._between(between)
        missing = [name for name in names if name not in known]
        if missing and self.known.of is not None:
            factor = self.known.factor
            corners = None if between is None else (between[0] / factor, between[1] / factor)
            found = yield from self.known.of.surfaces(corners)
            for name in missing:
                known[name] = (factor * found[name]).astype(np.float32)
        elif missing:
            pieces = self.pieces()
            for k, name in enumerate(missing):
                job = parts_of_surfaces.steps(pieces[name].solids, _FINE)
                parts = yield from within(job, k / len(missing), (k + 1) / len(missing))
                known[name] = _thinned(parts)
        return {name: known[name] for name in names}

    def _between(self, between: tuple[np.ndarray, np.ndarray] | None) -> list[str]:
        """The names of the pieces that reach over the floor between two corners (2,); of all, where
        none are given.
        """
        pieces, boxes = self.pieces(), self.known.boxes
        if between is None:
            return [*pieces]
        for name in pieces.keys() - boxes.keys():
            boxes[name] = pieces[name].box()
        low, high = between[0] - _FINE, between[1] + _FINE
        return [
            name
            for name in pieces
            if (boxes[name][1, :2] >= low).all() and (boxes[name][0, :2] <= high).all()
        ]

    def footprints(
        self, between: tuple[np.ndarray, np.ndarray] | None = None
    ) -> Generator[float, None, dict[str, np.ndarray]]:
        """Where (N, 2) each piece stands in the way of a body, from knee-low to head-high, by name;
        canonical metres. A job. ``between``: as for ``surfaces``.
        """
        known = self.known.footprints
        for name, points in (yield from self.surfaces(between)).items():
            if name not in known:
                over = points[:, 2] - self.floor
                stands = points[(over > KNEE_LOW) & (over < HEAD_HIGH), :2]
                known[name] = _thinned([stands]).astype(float)
                yield 1.0
        return {name: known[name] for name in self._between(between)}

    def pieces(self) -> dict[str, Piece]:
        """All furniture by its name."""
        if self.known.pieces is None:
            found: dict[str, list[Box | Mesh]] = {}
            for solid in self.solids:
                found.setdefault(self.parts.get(solid.name, solid.name), []).append(solid)
            self.known.pieces = {name: Piece(name, tuple(each)) for name, each in found.items()}
        return self.known.pieces

    def named(self, pattern: str) -> list[Piece]:
        """The pieces that a name, pattern or group means; raises InputError where none is meant."""
        pieces = self.pieces()
        names = list(meant(pattern, pieces))
        for group in meant(pattern, self.groups):
            names += [name for name in self.groups[group] if name in pieces]
        if not names:
            raise _unknown(pattern, [*pieces, *self.groups], "furniture")
        return [pieces[name] for name in dict.fromkeys(names)]

    def things(self, pattern: str) -> list[Piece | np.ndarray]:
        """The pieces and points (3,) that a name, pattern or group means."""
        points = [np.asarray(self.points[name], float) for name in meant(pattern, self.points)]
        try:
            return [*points, *self.named(pattern)]
        except InputError:
            if points:
                return [*points]
            known = [*self.points, *self.pieces(), *self.groups]
            raise _unknown(pattern, known, "thing") from None

    def line(self, name: str) -> np.ndarray:
        """The points (N, 2) of the curve that is meant."""
        for each in meant(name, self.lines):
            return np.asarray(self.lines[each], float)[:, :2]
        raise _unknown(name, self.lines, "curve")


def meant(pattern: str, names: Iterable[str]) -> list[str]:
    """The names that a name or pattern means: itself where it is one; ``Chair.*`` is Chair and its
    copies Chair.001, Chair.002 …
    """
    known = list(names)
    if pattern in known:
        return [pattern]
    return [
        name
        for name in known
        if fnmatchcase(name, pattern) or (pattern.endswith(".*") and name == pattern[:-2])
    ]


def _unknown(pattern: str, known: Iterable[str], what: str) -> InputError:
    return InputError(
        f"'{printable(pattern, 60)}' is not the name of any {what} there; "
        f"{nearest_known(pattern, known)}"
    )


@stepwise
def top_view(
    solids: Sequence[Box | Mesh], cell: float, low: float, high: float
) -> Generator[float, None, tuple[HeightField, np.ndarray]]:
    """Solids seen from above, between two heights: the field of their highest points, and the
    points (N, 3) themselves; metres.
    """
    parts = yield from parts_of_surfaces.steps(solids, 0.6 * cell)
    points = np.concatenate([np.zeros((0, 3)), *parts])
    points = points[(points[:, 2] > low) & (points[:, 2] < high)]
    if not len(points):
        return height_field(points, np.zeros(2), np.zeros(2), cell), points

    corners = points[:, :2].min(0), points[:, :2].max(0)
    cell = max(cell, float(np.sqrt((corners[1] - corners[0]).prod() / _MAX_CELLS)))
    return height_field(points, *corners, cell), points


def axes_from_above(field: HeightField) -> np.ndarray:
    """The two directions (2, 2) along which a piece seen from above lies, the longer side first."""
    return rectangle_axes(field.middles(np.argwhere(np.isfinite(field.top))))
