"""What stands about: each piece's origin is where a pelvis rests, or where somebody who works at
it stands.
"""

from collections.abc import Iterable
from dataclasses import replace

from dafnet_addon import Scene
from dafnet_addon.blender.showcase.demo_room import FURNITURE, Part
from dafnet_addon.blender.showcase.stage import solids
from dafnet_addon.demo import Place

__all__ = ["HERE", "Piece", "bench", "bookcase", "chair", "desk", "scene_of", "stool"]

Piece = tuple[tuple[Part, ...], Place]
HERE = Place((0.0, 0.0), 0.0)


def chair(height: float = 0.45) -> tuple[Part, ...]:
    return _raised(FURNITURE["Chair"], 0.45, height)


def stool(height: float) -> tuple[Part, ...]:
    return _raised(FURNITURE["Stool"], 0.63, height)


def bench(height: float) -> tuple[Part, ...]:
    ends = [
        Part("Oak", (0.05, 0.36, height - 0.06), (x, 0.0, 0.5 * (height - 0.06)))
        for x in (-0.55, 0.55)
    ]
    return Part("Teal", (1.40, 0.42, 0.06), (0.0, 0.0, height - 0.03), bevel=0.015), *ends


def desk(height: float, near: float, width: float = 1.20, depth: float = 0.60) -> tuple[Part, ...]:
    """A desk whose edge lies ``near`` metres in front of the origin, and a sheet on it."""
    legs = [
        Part("Graphite", (0.04, 0.04, height - 0.03), (x, near + y, 0.5 * (height - 0.03)))
        for x in (0.05 - width / 2, width / 2 - 0.05)
        for y in (0.05, depth - 0.05)
    ]
    top = Part("Oak", (width, depth, 0.03), (0.0, near + depth / 2, height - 0.015))
    return (
        top,
        Part("Paper", (0.21, 0.30, 0.004), (0.10, near + 0.18, height + 0.002), bevel=0.0),
        *legs,
    )


def bookcase() -> tuple[Part, ...]:
    boards = [
        Part("Oak", (0.90, 0.28, 0.025), (0.0, 0.0, z)) for z in (0.05, 0.42, 0.80, 1.18, 1.55)
    ]
    sides = [Part("Oak", (0.025, 0.28, 1.57), (x, 0.0, 0.785)) for x in (-0.45, 0.45)]
    books = [
        Part(colour, (width, 0.20, tall), (x, 0.02, z + 0.5 * tall), bevel=0.004)
        for colour, width, tall, x, z in (
            ("Teal", 0.22, 0.24, -0.28, 0.815),
            ("Coral", 0.12, 0.27, -0.09, 0.815),
            ("Slate", 0.30, 0.22, 0.20, 1.195),
            ("Paper", 0.16, 0.25, -0.30, 1.195),
            ("Slate", 0.26, 0.25, -0.24, 0.435),
            ("Coral", 0.18, 0.21, 0.25, 0.435),
        )
    ]
    return Part("Paper", (0.90, 0.01, 1.55), (0.0, -0.135, 0.80)), *boards, *sides, *books


def scene_of(pieces: Iterable[Piece]) -> Scene:
    return Scene([solid for parts, place in pieces for solid in solids(parts, place)])


def _raised(parts: Iterable[Part], now: float, height: float) -> tuple[Part, ...]:
    """A piece whose top lies at ``now``, with its top at ``height``: what is under it is stretched,
    what is over it moved.
    """
    out = []
    for part in parts:
        x, y, z = part.center
        width, depth, tall = part.size
        if z > now:
            out.append(replace(part, center=(x, y, z + height - now)))
        else:
            size = (width, depth, tall * height / now)
            out.append(replace(part, center=(x, y, z * height / now), size=size))

    return tuple(out)
