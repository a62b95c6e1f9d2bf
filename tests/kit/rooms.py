"""Furniture of boxes, and an office of it, for people with tasks."""

import numpy as np

from dafnet_addon import Box
from dafnet_addon.core.rotations import rotate, yaw_matrix
from dafnet_addon.director.room import Room

__all__ = ["block", "chair", "desk", "office", "put"]

Corner = tuple[float, float, float]


def block(name: str, low: Corner, high: Corner) -> Box:
    """A box between two corners."""
    a, b = np.array(low), np.array(high)
    return Box((a + b) / 2, (b - a) / 2, name=name)


def put(boxes: list[Box], place: tuple[float, float], degrees: float = 0.0) -> list[Box]:
    """The boxes turned about the world's z axis, then moved."""
    turn = yaw_matrix(np.array(np.radians(degrees)))
    return [
        Box(rotate(turn, box.center) + np.array([*place, 0.0]), box.half_size, turn, box.name)
        for box in boxes
    ]


def chair(name: str = "Chair", height: float = 0.45) -> list[Box]:
    """A chair that looks along +y."""
    seat = block(name, (-0.22, -0.22, height - 0.05), (0.22, 0.22, height))
    return [seat, block(name, (-0.22, -0.26, height), (0.22, -0.22, height + 0.4))]


def desk(name: str = "Desk") -> list[Box]:
    """A desk on two sides, 1.4 m wide."""
    top = block(name, (-0.7, -0.35, 0.70), (0.7, 0.35, 0.74))
    sides = [block(name, (x, -0.35, 0.0), (x + 0.04, 0.35, 0.7)) for x in (-0.7, 0.66)]
    return [top, *sides]


def office() -> Room:
    """Chair and desk in the middle, two more chairs to the left, a board to the north, a counter
    with a cup on it to the east; a lamp.
    """
    return Room(
        solids=[
            *put(desk(), (0.0, 0.85)),
            *chair(),
            *put(chair("Chair.001"), (-2.0, 0.0), 90.0),
            *put(chair("Chair.002"), (-2.0, 1.5), 90.0),
            block("Whiteboard", (-1.0, 3.0, 0.9), (1.0, 3.04, 2.0)),
            block("Counter", (2.5, -0.5, 0.0), (3.1, 1.5, 0.92)),
            block("Cup", (2.58, 0.2, 0.92), (2.65, 0.27, 1.02)),
        ],
        groups={"Seats": ["Chair.001", "Chair.002"]},
        points={"Lamp": (2.0, -2.0, 1.5)},
        lines={"Path": np.array([(-1.0, -2.0), (0.0, -2.4), (1.5, -1.5)])},
    )
