"""Rooms of the furniture library's pieces as people arrange them, and who is sent to which seat."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.marks import MARKS, piece
from dafnet_addon import Mesh
from dafnet_addon.core.paths import Route, Stop
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import forward_of
from dafnet_addon.core.rotations import rotate, yaw_matrix
from dafnet_addon.core.solids import BOX_CORNERS, BOX_TRIANGLES, Box
from dafnet_addon.director.approach import Tucked, walk_to_seat
from dafnet_addon.director.places import before_a_top, towards_top
from dafnet_addon.director.room import Room
from dafnet_addon.director.seats import SeatPlace, seats_of

__all__ = ["SCENES", "Arranged", "Asked", "asked_of", "seats_asked", "sent_to"]

Place = tuple[float, float]
_ANY = {"facing": [0, 90, 180, -90]}


@dataclass(frozen=True)
class Asked:
    """A seat that somebody is sent to, ``near`` a place (2,) on it if one is given; ``marks``: as
    of a piece, in the room, cm.
    """

    name: str
    marks: Sequence[dict[str, Any]]
    near: Place | None = None


@dataclass
class Arranged:
    """A room of a ``library``'s pieces: its solids, the seats that are asked for, and the two
    places that one comes from.
    """

    library: Path
    starts: tuple[Place, Place]
    solids: list[Box | Mesh] = field(default_factory=list)
    asked: list[Asked] = field(default_factory=list)

    def put(
        self, name: str, kind: str, at: Place, degrees: float = 0.0, facing: float | None = None
    ) -> Mesh:
        """A piece of the library, turned about the vertical, then moved; one is sent to it if it is
        a seat, and is to look to ``facing`` there if that is given.
        """
        made, turn = piece(self.library, kind, name), yaw_matrix(np.array(np.radians(degrees)))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:2, 3] = turn, at
        solid = Mesh(made.vertices, made.triangles, matrix, name)
        self.solids.append(solid)
        marks = [_moved(mark, at, degrees) for mark in MARKS.get(kind, {}).get("seats", ())]
        if facing is not None:
            marks = [{**mark, "facing": [facing]} for mark in marks]
        if marks:
            self.asked.append(Asked(name, marks))
        return solid

    def box(self, name: str, low: Sequence[float], high: Sequence[float]) -> None:
        a, b = np.array(low, float), np.array(high, float)
        self.solids.append(Box((a + b) / 2, (b - a) / 2, name=name))

    def room(self) -> Room:
        return Room(tuple(self.solids))


def _moved(mark: dict[str, Any], at: Place, degrees: float) -> dict[str, Any]:
    """A mark of a piece that is turned by right angles and moved."""
    ends = np.array([np.resize(mark["x"], 2), np.resize(mark["y"], 2), np.zeros(2)], float).T
    there = rotate(yaw_matrix(np.array(np.radians(degrees))), ends)[:, :2] + 100.0 * np.array(at)
    low, high = there.min(axis=0), there.max(axis=0)
    return {
        **mark,
        "x": [low[0], high[0]],
        "y": [low[1], high[1]],
        "facing": [each + degrees for each in mark.get("facing", _ANY["facing"])],
    }


def _mesh(name: str, solids: Sequence[Box | Mesh]) -> Mesh:
    """Several solids as a single mesh."""
    vertices, triangles, count = [], [], 0
    for solid in solids:
        if isinstance(solid, Box):
            points, faces = BOX_CORNERS * solid.half_size + solid.center, BOX_TRIANGLES
        else:
            points = rotate(solid.matrix[:3, :3], solid.vertices) + solid.matrix[:3, 3]
            faces = solid.triangles
        vertices.append(points)
        triangles.append(faces + count)
        count += len(points)
    return Mesh(np.concatenate(vertices), np.concatenate(triangles), name=name)


def _dining(library: Path, out: float) -> Arranged:
    """A table 93 cm deep, two chairs on each side, their backs so many metres from its edge."""
    made = Arranged(library, ((2.6, -2.2), (-2.6, 2.4)))
    made.put("Table", "table_013", (0.0, 0.0))
    away = 0.467 + out - 0.18
    for k, x in enumerate((-0.35, 0.35)):
        made.put(f"Chair {k}", "chair_018", (x, away))
        made.put(f"Chair {k + 2}", "chair_018", (x, -away), 180.0)
    return made


def _office(library: Path) -> Arranged:
    made = Arranged(library, ((2.6, 2.6), (-2.8, 2.6)))
    for k, x in enumerate((-1.0, 1.0)):
        made.put(f"Desk {k}", "desk_003", (x, 0.0))
        made.put(f"Office Chair {k}", "chair_024", (x, 0.4 + 0.45 - 0.12))
    made.put("Shelf", "shelf_001", (0.0, -0.7), 180.0)
    return made


def _bar(library: Path) -> Arranged:
    made = Arranged(library, ((2.5, 2.0), (-2.5, 1.6)))
    made.box("Bar", (-1.6, -0.5, 0.0), (1.6, 0.0, 1.10))
    for k, (kind, x) in enumerate((("stool_003", -1.1), ("stool_005", 0.0), ("stool_002", 1.1))):
        made.put(f"Stool {k}", kind, (x, 0.45), facing=180.0)
    return made


def _cinema(library: Path) -> Arranged:
    made = Arranged(library, ((2.4, -1.2), (-2.4, 3.4)))
    for row in range(3):
        for k in range(4):
            made.put(f"Seat {row}{k}", "chair_013", (-0.9 + 0.6 * k, 1.25 * row))
    made.asked = [each for each in made.asked if each.name in ("Seat 01", "Seat 12", "Seat 21")]
    return made


def _sofas(library: Path) -> Arranged:
    made = Arranged(library, ((2.6, -2.4), (-2.6, -1.8)))
    made.put("Sofa", "sofa_012", (0.0, 0.0))
    made.put("Armchair", "armchair_014", (-1.9, -1.2), 90.0)
    made.put("Coffee Table", "table_011", (0.0, -1.30))
    made.box("Wall", (-3.0, 0.5, 0.0), (3.0, 0.6, 2.4))
    return made


def _bedroom(library: Path) -> Arranged:
    made = Arranged(library, ((2.2, -1.4), (-2.4, -1.0)))
    made.put("Bed", "bed_001", (0.0, 0.0))
    for x in (-1.0, 1.0):
        made.put(f"Bedside {x:+.0f}", "table_001", (x, 0.75))
    made.put("Chair", "chair_014", (1.9, 0.6), -90.0)
    made.box("Wall", (-3.0, 1.1, 0.0), (3.0, 1.2, 2.4))
    return made


def _toilet(library: Path) -> Arranged:
    made = Arranged(library, ((0.3, -3.0), (-1.6, -2.6)))
    made.put("Toilet", "toilet_002", (0.0, 0.0))
    for x in (-0.65, 0.6):
        made.box("Wall", (x, -1.3, 0.0), (x + 0.05, 0.4, 2.2))
    made.box("Wall", (-0.65, 0.35, 0.0), (0.65, 0.4, 2.2))
    return made


def _benches(library: Path) -> Arranged:
    made = Arranged(library, ((2.4, -2.4), (-2.6, -1.4)))
    made.put("Bench", "bench_004", (0.0, 0.0))
    made.put("Low Bench", "bench_001", (0.0, -2.0), facing=None)
    made.box("Wall", (-3.0, 0.35, 0.0), (3.0, 0.45, 2.4))
    made.put("Bin", "table_001", (1.1, 0.0))
    return made


def _stairs(library: Path) -> Arranged:
    """Steps of 17 by 28 cm, which go up to +y."""
    made = Arranged(library, ((0.8, -2.6), (-1.8, -2.0)))
    steps = [
        Box(
            np.array([0.0, 0.28 * k + 0.14, 0.085 * (k + 1)]),
            np.array([0.6, 0.14, 0.085 * (k + 1)]),
        )
        for k in range(8)
    ]
    made.solids.append(_mesh("Stairs", steps))
    mark = {"x": [-35, 35], "y": [36, 48], "top": 34, "facing": [180]}
    third = {"x": [-35, 35], "y": [64, 76], "top": 51, "facing": [180]}
    made.asked.append(Asked("Stairs", [mark, third]))
    return made


def _car(library: Path) -> Arranged:
    """Two seats under a roof, behind a dashboard; the doors are open."""
    made = Arranged(library, ((2.6, -0.6), (-2.6, 0.4)))
    for name, x in (("Seat Left", -0.38), ("Seat Right", 0.38)):
        made.put(name, "chair_021", (x, 0.0))
    made.box("Dashboard", (-0.75, -1.05, 0.45), (0.75, -0.85, 0.85))
    made.box("Floor Pan", (-0.75, -1.2, 0.0), (0.75, 0.6, 0.04))
    made.box("Roof", (-0.7, -0.5, 1.38), (0.7, 0.6, 1.42))
    made.box("Rear", (-0.75, 0.5, 0.0), (0.75, 0.6, 1.38))
    return made


def _one_mesh(library: Path) -> Arranged:
    """A room with floor, walls, a table and chairs, all a single mesh; the place on it says which
    chair.
    """
    made = _dining(library, 0.55)
    made.box("Floor", (-3.2, -3.2, -0.1), (3.2, 3.2, 0.0))
    made.box("Wall", (-3.2, 3.1, 0.0), (3.2, 3.2, 2.4))
    made.box("Wall", (-3.2, -3.2, 0.0), (-3.1, 3.2, 2.4))
    asked = []
    for each in made.asked:
        mark = each.marks[0]
        near = 0.01 * float(np.mean(mark["x"])) + 0.05, 0.01 * float(np.mean(mark["y"])) - 0.04
        asked.append(Asked("Room", each.marks, near))
    return Arranged(library, made.starts, [_mesh("Room", made.solids)], asked)


SCENES: dict[str, Callable[[Path], Arranged]] = {
    "dining, 55 cm out": lambda library: _dining(library, 0.55),
    "dining, 30 cm out": lambda library: _dining(library, 0.30),
    "dining, 12 cm out": lambda library: _dining(library, 0.12),
    "office": _office,
    "bar": _bar,
    "cinema of three rows": _cinema,
    "sofa corner with table": _sofas,
    "bedroom": _bedroom,
    "toilet": _toilet,
    "bench": _benches,
    "stairs": _stairs,
    "car": _car,
    "room in one mesh": _one_mesh,
}
"""What arranges a room of a library's pieces, by its name."""


def asked_of(made: Arranged) -> Iterator[tuple[Asked, Place]]:
    """Who is sent where, from both places."""
    for each in made.asked:
        for start in made.starts:
            yield each, start


def seats_asked(room: Room, asked: Asked, start: Place) -> list[SeatPlace]:
    """The seats that *Sit on Selected* tries, the best first."""
    own = room.pieces()[asked.name]
    near = None if asked.near is None else np.array(asked.near)
    seats = seats_of(own.solids, np.array(start), 0.0, asked.name, near)
    if near is None and not seats[0].back:
        top = run_to_end(before_a_top(room, own, seats[0]))
        if top is not None:
            seats = towards_top(seats_of(own.solids, top, 0.0, asked.name), top)
    return seats


def sent_to(made: Arranged, asked: Asked, start: Place) -> tuple[Room, Route, SeatPlace, float]:
    """Send somebody to a seat, which is pulled out where it is tucked under something: the room as
    it is then, the way, the seat as it stood before, and the metres by which it was pulled out.
    """
    room = made.room()
    seats, here = seats_asked(room, asked, start), Stop(start, 0.0, 0.2)
    try:
        route, seat = walk_to_seat(room, room.pieces()[asked.name], here, seats)
        return room, route, seat, 0.0
    except Tucked as error:
        offset = -error.out * forward_of(seats[0].yaw)
        shift = np.eye(4)
        shift[:2, 3] = offset
        room = Room(
            tuple(
                replace(solid, matrix=shift @ solid.matrix)
                if isinstance(solid, Mesh) and solid.name == asked.name
                else solid
                for solid in made.solids
            )
        )
        moved = replace(seats[0], position=seats[0].position + offset)
        route, seat = walk_to_seat(room, room.pieces()[asked.name], here, [moved])
        return room, route, replace(seat, position=seat.position - offset), error.out
