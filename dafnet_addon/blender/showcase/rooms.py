"""Rooms for several people, built of tables of parts: a café, a cinema, an office."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import pi, radians

import bpy
import numpy as np

from ...core.paths import facing
from ...demo import Place
from .demo_room import FURNITURE, Part, Triple, add_piece, four_legs, new_collection
from .preview import look_at

__all__ = ["FPS", "ROOMS", "build", "build_hall"]

FPS = 30

Shape = tuple[Part, ...]


@dataclass(frozen=True)
class Layout:
    """``pieces``: name, parts and place of each; ``shell``: floors and walls, each by its name, at
    the origin; ``points``: empties, things that can be walked to or looked at; the camera's
    ``eye``, what it looks ``at``, and its ``lens`` in millimetres.
    """

    pieces: tuple[tuple[str, Shape, Place], ...]
    shell: dict[str, Shape]
    points: dict[str, Triple]
    eye: Triple
    at: Triple
    lens: float = 35.0
    lamps: tuple[Triple, ...] = field(default=())


def _raised(parts: Shape, by: float) -> Shape:
    """Parts that stand on something."""
    return tuple(
        replace(part, center=(part.center[0], part.center[1], part.center[2] + by))
        for part in parts
    )


_ROUND_TABLE: Shape = (
    Part("Walnut", (0.68, 0.68, 0.030), (0, 0, 0.725), bevel=0.010, round=True),
    Part("Graphite", (0.050, 0.050, 0.69), (0, 0, 0.365), bevel=0.006, round=True),
    Part("Graphite", (0.40, 0.40, 0.022), (0, 0, 0.011), bevel=0.006, round=True),
)
_CUP: Shape = (
    Part("Paper", (0.075, 0.075, 0.070), (0, 0, 0.035), bevel=0.008, round=True),
    Part("Paper", (0.13, 0.13, 0.012), (0, 0, 0.006), bevel=0.004, round=True),
)
_COUNTER: Shape = (
    Part("Teal", (2.30, 0.50, 0.86), (0, 0, 0.43), bevel=0.012),
    Part("Walnut", (2.42, 0.62, 0.045), (0, 0.02, 0.8825), bevel=0.010),
    *(Part("Walnut", (0.030, 0.016, 0.70), (x, 0.252, 0.45)) for x in np.linspace(-1.0, 1.0, 9)),
)
_MACHINE: Shape = (
    Part("Coral", (0.46, 0.34, 0.30), (0, 0, 0.23), bevel=0.030),
    Part("Graphite", (0.42, 0.34, 0.06), (0, 0, 0.03), bevel=0.010),
    Part("Paper", (0.40, 0.26, 0.03), (0, 0, 0.395), bevel=0.006),
    Part("Graphite", (0.05, 0.12, 0.05), (-0.10, -0.20, 0.17), bevel=0.010),
    Part("Graphite", (0.05, 0.12, 0.05), (0.10, -0.20, 0.17), bevel=0.010),
)
_ON_COUNTER = _raised(_MACHINE, 0.905)
_ON_TABLE = _raised(_CUP, 0.74)
_BAR_STOOL: Shape = (
    Part("Coral", (0.36, 0.36, 0.060), (0, 0, 0.61), bevel=0.020, round=True),
    *four_legs("Graphite", 0.11, 0.11, 0.585, 0.026, 6.0),
    Part("Graphite", (0.29, 0.016, 0.016), (0, 0.150, 0.24), bevel=0.005),
    Part("Graphite", (0.29, 0.016, 0.016), (0, -0.150, 0.24), bevel=0.005),
    Part("Graphite", (0.016, 0.29, 0.016), (0.150, 0, 0.24), bevel=0.005),
    Part("Graphite", (0.016, 0.29, 0.016), (-0.150, 0, 0.24), bevel=0.005),
)
_PLANT: Shape = (
    Part("Coral", (0.36, 0.36, 0.40), (0, 0, 0.20), bevel=0.030, round=True),
    *(
        Part(
            "Leaf",
            (0.05, 0.20, 0.66 + 0.10 * (k % 2)),
            (0.16 * np.cos(a), 0.16 * np.sin(a), 0.68),
            (0, 26 - 8 * (k % 2), float(np.degrees(a))),
            0.020,
        )
        for k, a in enumerate(np.linspace(0.0, 2 * pi, 9)[:-1])
    ),
)
_MENU: Shape = (
    Part("Graphite", (2.10, 0.030, 0.90), (0, 0, 1.75), bevel=0.006),
    Part("Walnut", (2.20, 0.040, 0.050), (0, 0, 2.22), bevel=0.006),
    Part("Walnut", (2.20, 0.040, 0.050), (0, 0, 1.28), bevel=0.006),
    *(
        Part("Paper", (length, 0.008, 0.030), (x, 0.018, z), bevel=0.0)
        for x, z, length in (
            (-0.55, 2.04, 0.62),
            (-0.60, 1.90, 0.50),
            (-0.52, 1.76, 0.66),
            (-0.62, 1.62, 0.46),
            (-0.56, 1.48, 0.58),
            (0.50, 2.04, 0.56),
            (0.46, 1.90, 0.48),
            (0.52, 1.76, 0.60),
        )
    ),
    Part("Coral", (0.22, 0.010, 0.22), (0.52, 0.018, 1.53), bevel=0.0),
)
_PENDANT: Shape = (
    Part("Brass", (0.34, 0.34, 0.16), (0, 0, 2.03), bevel=0.060, round=True),
    Part("Graphite", (0.012, 0.012, 0.55), (0, 0, 2.38), bevel=0.0),
)
_CINEMA_SEAT: Shape = (
    Part("Velvet", (0.50, 0.46, 0.12), (0, 0.03, 0.385), bevel=0.035),
    Part("Velvet", (0.50, 0.10, 0.66), (0, -0.245, 0.72), (9, 0, 0), 0.035),
    Part("Graphite", (0.46, 0.06, 0.34), (0, -0.10, 0.17), bevel=0.010),
    Part("Graphite", (0.050, 0.42, 0.050), (-0.285, 0.00, 0.60), bevel=0.014),
    Part("Graphite", (0.050, 0.42, 0.050), (0.285, 0.00, 0.60), bevel=0.014),
    Part("Graphite", (0.040, 0.10, 0.58), (-0.285, -0.08, 0.29), bevel=0.010),
    Part("Graphite", (0.040, 0.10, 0.58), (0.285, -0.08, 0.29), bevel=0.010),
)
_SCREEN: Shape = (
    Part("Paper", (7.2, 0.04, 3.0), (0, 0, 2.2), bevel=0.0),
    Part("Graphite", (7.5, 0.06, 0.12), (0, -0.02, 3.76), bevel=0.0),
    Part("Graphite", (7.5, 0.06, 0.12), (0, -0.02, 0.64), bevel=0.0),
    Part("Graphite", (7.5, 0.9, 0.40), (0, 0.30, 0.20), bevel=0.02),
)
_OFFICE_CHAIR: Shape = (
    Part("Slate", (0.48, 0.46, 0.075), (0, 0.015, 0.4225), bevel=0.030),
    Part("Slate", (0.44, 0.060, 0.46), (0, -0.265, 0.76), (8, 0, 0), 0.028),
    Part("Graphite", (0.060, 0.030, 0.36), (0, -0.270, 0.52), (8, 0, 0), 0.008),
    Part("Graphite", (0.050, 0.050, 0.34), (0, 0, 0.22), bevel=0.006, round=True),
    *(
        Part(
            "Graphite",
            (0.28, 0.045, 0.030),
            (0.14 * np.cos(a), 0.14 * np.sin(a), 0.06),
            (0, 0, float(np.degrees(a))),
            0.008,
        )
        for a in np.linspace(0.0, 2 * pi, 6)[:-1] + 0.3
    ),
)
_WORK_DESK: Shape = (
    Part("Oak", (1.40, 0.68, 0.032), (0, 0, 0.724), bevel=0.010),
    *four_legs("Graphite", 0.62, 0.27, 0.71, 0.036, 1.5),
    Part("Graphite", (0.62, 0.030, 0.38), (0, -0.20, 1.02), bevel=0.008),
    Part("Graphite", (0.06, 0.040, 0.14), (0, -0.22, 0.80), bevel=0.008),
    Part("Graphite", (0.26, 0.17, 0.012), (0, -0.20, 0.746), bevel=0.004),
    Part("Paper", (0.42, 0.14, 0.016), (0, 0.12, 0.748), bevel=0.004),
    Part("Coral", (0.075, 0.075, 0.095), (-0.50, 0.10, 0.7875), bevel=0.006, round=True),
)
_SHELF: Shape = (
    *(Part("Oak", (1.60, 0.32, 0.026), (0, 0, z)) for z in (0.05, 0.45, 0.85, 1.25, 1.65)),
    *(Part("Oak", (0.028, 0.32, 1.66), (x, 0, 0.84)) for x in (-0.80, 0.0, 0.80)),
    *(
        Part(("Coral", "Teal", "Paper", "Slate")[k % 4], (0.045, 0.22, h), (x, 0.0, z + h / 2))
        for k, (x, z, h) in enumerate(
            (x + 0.048 * i, z, 0.24 + 0.03 * ((3 * i + j) % 4))
            for j, (x, z, count) in enumerate(
                ((-0.72, 0.463, 9), (0.12, 0.463, 6), (-0.50, 0.863, 8), (0.08, 1.263, 11))
            )
            for i in range(count)
        )
    ),
)


def _wall(size: Triple, center: Triple) -> Shape:
    return (Part("Wall", size, center, bevel=0.0),)


def _at_table(x: float, y: float, degrees: float) -> Iterator[tuple[str, Shape, Place]]:
    """A round table, cups on it, and two chairs that face each other across it."""
    yield "Table", _ROUND_TABLE, Place((x, y), 0.0)
    across = np.array([np.cos(radians(degrees)), np.sin(radians(degrees))])
    for side in (-1.0, 1.0):
        spot = np.array([x, y]) + side * 0.80 * across
        yield "Chair", FURNITURE["Chair"], Place((spot[0], spot[1]), facing(-side * across))
        cup = np.array([x, y]) + side * (0.16 * across + 0.10 * np.array([-across[1], across[0]]))
        yield "Cup", _ON_TABLE, Place((cup[0], cup[1]), 0.0)


def _cafe() -> Layout:
    tables = ((-1.45, -1.55, 10.0), (1.35, -1.75, 160.0), (3.05, -0.05, 75.0), (0.25, 0.30, 20.0))
    pieces = [piece for table in tables for piece in _at_table(*table)]
    pieces += [
        ("Sofa", FURNITURE["Sofa"], Place((3.35, -2.05), radians(90.0))),
        ("Counter", _COUNTER, Place((-2.05, 1.70), pi)),
        ("Coffee Machine", _ON_COUNTER, Place((-2.55, 1.66), pi)),
        ("Stool", _BAR_STOOL, Place((-1.35, 0.98), 0.0)),
        ("Stool", _BAR_STOOL, Place((-2.65, 0.98), 0.0)),
        ("Menu", _MENU, Place((-2.05, 2.93), pi)),
        ("Plant", _PLANT, Place((3.55, 2.55), 0.0)),
        ("Plant", _PLANT, Place((-3.60, -2.55), 0.6)),
    ]
    pieces += [("Lamp", _PENDANT, Place((x, y), 0.0)) for x, y, _ in tables]
    return Layout(
        pieces=tuple(pieces),
        shell={
            "Floor": (Part("Floor", (8.2, 6.2, 0.10), (0, 0, -0.05), bevel=0.0),),
            "Pavement": (Part("Concrete", (6.0, 7.5, 0.06), (-7.1, -0.6, -0.05), bevel=0.0),),
            "Rug": (Part("Rug", (2.3, 1.7, 0.010), (2.3, -1.95, 0.005), bevel=0.003),),
            "Wall Back": _wall((8.2, 0.10, 2.6), (0, 3.05, 1.30)),
            "Wall Left": _wall((0.10, 3.9, 2.6), (-4.05, 1.05, 1.30)),
            "Wall Door": _wall((0.10, 0.9, 2.6), (-4.05, -2.65, 1.30)),
            "Wall Over Door": _wall((0.10, 1.3, 0.45), (-4.05, -1.55, 2.375)),
        },
        points={"Door": (-5.1, -1.5, 0.0), "Exit": (-5.6, 0.8, 0.0)},
        eye=(6.3, -8.4, 4.6),
        at=(-0.25, -0.05, 0.55),
        lamps=tuple((x, y, 1.9) for x, y, _ in tables),
    )


_PITCH = 1.40  # metres from row to row, so that people pass before those who sit
_WIDTH = 0.62  # metres from seat to seat
_AISLE = 1.3  # metres in the middle


def _cinema(row_count: int = 6) -> Layout:
    """Rows of ten seats."""
    half = 0.5 * _AISLE
    across = [half + (k + 0.5) * _WIDTH for k in range(5)]
    rows = [-_PITCH * row for row in range(row_count)]
    pieces = [
        ("Seat", _CINEMA_SEAT, Place((side * x, y), 0.0))
        for y in rows
        for side, xs in ((-1.0, across[::-1]), (1.0, across))
        for x in xs
    ]
    pieces.append(("Screen", _SCREEN, Place((0.0, 5.2), 0.0)))
    back = rows[-1] - 2.6
    middle = 0.5 * (6.0 + back)
    deep = 6.0 - back
    return Layout(
        pieces=tuple(pieces),
        shell={
            "Floor": (
                Part("Carpet", (12.0, deep + 4.0, 0.10), (0, middle - 2.0, -0.05), bevel=0.0),
            ),
            "Aisle": (Part("Rug", (1.1, deep - 3.0, 0.008), (0, middle - 1.0, 0.004), bevel=0.0),),
            "Wall Left": (Part("Night", (0.10, deep, 3.9), (-5.6, middle, 1.95), bevel=0.0),),
            "Wall Back": (
                Part("Night", (5.0, 0.10, 3.9), (-3.2, back, 1.95), bevel=0.0),
                Part("Night", (5.0, 0.10, 3.9), (3.2, back, 1.95), bevel=0.0),
                Part("Night", (1.4, 0.10, 1.6), (0.0, back, 3.1), bevel=0.0),
            ),
            "Wall Screen": (Part("Night", (11.3, 0.10, 4.2), (0, 6.0, 2.10), bevel=0.0),),
        },
        points={
            "Door": (0.0, back - 0.9, 0.0),
            "Film": (0.0, 5.1, 1.9),
        },
        eye=(6.6, 5.0, 4.4),
        at=(-0.7, -3.0, 0.3),
        lens=28.0,
        lamps=((0.0, 3.0, 3.2),),
    )


def _office() -> Layout:
    pieces: list[tuple[str, Shape, Place]] = []
    for x in (-2.3, -0.75, 0.80):
        for y, turn in ((0.36, 0.0), (-0.36, pi)):  # two rows, monitors back to back
            pieces.append(("Desk", _WORK_DESK, Place((x, y), turn)))
            away = 0.86 if y > 0 else -0.86
            pieces.append(("Chair", _OFFICE_CHAIR, Place((x, y + away), pi if y > 0 else 0.0)))
    pieces += [
        ("Whiteboard", FURNITURE["Whiteboard"], Place((-1.2, 3.35), pi)),
        ("Shelf", _SHELF, Place((1.6, 3.30), pi)),
        ("Sofa", FURNITURE["Sofa"], Place((3.75, 0.9), radians(90.0))),
        ("Counter", _COUNTER, Place((3.45, -2.3), radians(90.0))),
        ("Coffee Machine", _ON_COUNTER, Place((3.45, -2.85), radians(90.0))),
        ("Plant", _PLANT, Place((3.85, 2.65), 0.3)),
        ("Plant", _PLANT, Place((-3.85, 2.95), 0.0)),
    ]
    return Layout(
        pieces=tuple(pieces),
        shell={
            "Floor": (Part("Floor", (8.8, 7.2, 0.10), (0, 0.05, -0.05), bevel=0.0),),
            "Hall": (Part("Concrete", (2.6, 7.2, 0.06), (-5.6, 0.05, -0.05), bevel=0.0),),
            "Rug": (Part("Rug", (2.0, 2.4, 0.010), (2.7, 0.9, 0.005), bevel=0.003),),
            "Wall Back": _wall((8.8, 0.10, 2.6), (0, 3.60, 1.30)),
            "Wall Left": _wall((0.10, 4.6, 2.6), (-4.35, 1.35, 1.30)),
            "Wall Door": _wall((0.10, 1.2, 2.6), (-4.35, -2.95, 1.30)),
            "Wall Over Door": _wall((0.10, 1.4, 0.45), (-4.35, -1.65, 2.375)),
        },
        points={"Door": (-5.4, -1.6, 0.0)},
        eye=(6.4, -8.2, 5.2),
        at=(-0.2, 0.2, 0.5),
        lamps=((-0.8, 0.0, 2.4), (3.0, 0.0, 2.4)),
    )


ROOMS: dict[str, Callable[[], Layout]] = {"cafe": _cafe, "cinema": _cinema, "office": _office}
"""The rooms by the names that a shot's file gives them."""


def build(scene: bpy.types.Scene, name: str) -> None:
    """Furnish an empty scene as one of ``ROOMS``, with a camera and lights."""
    _build(scene, ROOMS[name]())


def build_hall(scene: bpy.types.Scene, rows: int) -> None:
    """Furnish an empty scene as a cinema of so many rows of ten seats."""
    _build(scene, _cinema(rows))


def _build(scene: bpy.types.Scene, layout: Layout) -> None:
    scene.render.fps, scene.render.fps_base = FPS, 1.0

    shell = new_collection(scene, "Room")
    for each, parts in layout.shell.items():
        add_piece(shell, each, parts, Place((0.0, 0.0), 0.0))

    furniture = new_collection(scene, "Furniture")
    made: dict[int, bpy.types.Object] = {}
    for each, parts, place in layout.pieces:
        first = made.get(id(parts))
        if first is None:
            made[id(parts)] = add_piece(furniture, each, parts, place)
            continue
        copy = bpy.data.objects.new(each, first.data)
        copy.location = (*place.position, 0.0)
        copy.rotation_euler = (0.0, 0.0, place.yaw)
        furniture.objects.link(copy)

    places = new_collection(scene, "Places")
    for each, at in layout.points.items():
        empty = bpy.data.objects.new(each, None)
        empty.location, empty.empty_display_size = at, 0.2
        places.objects.link(empty)

    _camera_and_lights(scene, layout)


def _camera_and_lights(scene: bpy.types.Scene, layout: Layout) -> None:
    collection = new_collection(scene, "Camera and Lights")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = layout.lens
    look_at(camera, layout.eye, layout.at)
    scene.camera = camera

    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 2.0, radians(8)
    look_at(sun, (2.5, -3.0, 5.0), (0.0, 0.0, 0.0))
    lights = [camera, sun]
    for place in layout.lamps:
        lamp = bpy.data.objects.new("Light", bpy.data.lights.new("Light", "POINT"))
        lamp.data.energy, lamp.data.shadow_soft_size = 60.0, 0.15
        lamp.data.color = (1.0, 0.85, 0.68)
        lamp.location = place
        lights.append(lamp)

    for each in lights:
        collection.objects.link(each)
