"""What the director knows of a scene: furniture by name, and where other things are."""

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np

from ..core.distance import scaled
from ..core.errors import InputError
from ..core.nearby import bounds
from ..core.progress import stepwise
from ..core.solids import Box, Mesh, Scene
from ..core.text import nearest_known, printable
from .seats import rectangle_axes
from .surfaces import HeightField, height_field, parts_of_surfaces

__all__ = ["Piece", "Room", "axes_from_above", "top_view"]

_MAX_CELLS = 1_000_000  # cells of a field; what is larger is looked at more coarsely


@dataclass(frozen=True)
class Piece:
    """One piece of furniture: its ``name``, and the ``solids`` that it is made of."""

    name: str
    solids: tuple[Box | Mesh, ...]

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


@dataclass(frozen=True)
class Room:
    """A scene for people with tasks; world, metres, z up.

    ``solids``: the furniture; those of one name are one piece. ``parts``: names of solids that
    belong to a piece of another name, as a chair's back does. ``groups``: names of pieces by a name
    for all of them, as collections are. ``points`` (x, y, z): what can be looked at, reached or
    walked to besides furniture. ``lines`` (N, 2): curves to walk along. ``floor``: its height.
    """

    solids: Sequence[Box | Mesh] = ()
    parts: Mapping[str, str] = field(default_factory=dict)
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    points: Mapping[str, Sequence[float] | np.ndarray] = field(default_factory=dict)
    lines: Mapping[str, np.ndarray] = field(default_factory=dict)
    floor: float = 0.0

    def resized(self, factor: float) -> "Room":
        """The room ``factor`` times as large, about the world's origin."""
        return Room(
            solids=scaled(Scene(tuple(self.solids)), factor).solids,
            parts=self.parts,
            groups=self.groups,
            points={name: factor * np.asarray(at, float) for name, at in self.points.items()},
            lines={name: factor * np.asarray(line, float) for name, line in self.lines.items()},
            floor=factor * self.floor,
        )

    def pieces(self) -> dict[str, Piece]:
        """All furniture by its name."""
        found: dict[str, list[Box | Mesh]] = {}
        for solid in self.solids:
            found.setdefault(self.parts.get(solid.name, solid.name), []).append(solid)
        return {name: Piece(name, tuple(solids)) for name, solids in found.items()}

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
