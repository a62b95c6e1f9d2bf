"""Drawings of the overlays as plain arrays: stick figures, paths, rings, the circle of actions.

Nothing here knows the scene, and nothing draws (``display`` does).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.root import RootPath
from ...core.skeleton import PARENTS, joint

__all__ = [
    "ABOVE_FLOOR",
    "NOW",
    "Colour",
    "Drawing",
    "circle_of_actions",
    "compose",
    "figure",
    "floor_path",
    "ring",
]

Colour = tuple[float, float, float, float]
"""Red, green, blue, opacity, as the screen shows them."""

NOW: Colour = (1.0, 0.85, 0.2, 1.0)
"""What belongs to the current frame."""
_PATH: Colour = (0.95, 0.95, 0.95, 0.8)
_FACING: Colour = (0.45, 0.85, 0.45, 0.9)
_BRIGHT = (1.0, 1.0, 1.0)
_DIM = (0.62, 0.64, 0.67)

ABOVE_FLOOR = 0.01
"""Metres above the floor at which lines lie, so that it does not hide them."""
_FACING_LENGTH = 0.14
"""Metres; of the tick that shows where the root faces."""


@dataclass(frozen=True)
class Drawing:
    """Lines, beads and labels in the world, Blender units.

    ``lines`` (L, 2, 3) with ``line_colours`` (L, 4), ``width`` pixels; ``beads`` (B, 3) with
    ``bead_colours`` (B, 4) and ``radii`` (B,); ``labels``: place (3,), text and colour of each.
    """

    lines: np.ndarray
    line_colours: np.ndarray
    beads: np.ndarray
    bead_colours: np.ndarray
    radii: np.ndarray
    labels: tuple[tuple[np.ndarray, str, Colour], ...] = ()
    width: float = 2.0


def compose(
    lines: Iterable[tuple[np.ndarray, Sequence[float] | np.ndarray]] = (),
    beads: Iterable[tuple[np.ndarray, Sequence[float] | np.ndarray, float | np.ndarray]] = (),
    labels: Iterable[tuple[np.ndarray, str, Colour]] = (),
    width: float = 2.0,
) -> Drawing:
    """One drawing of groups of lines (L, 2, 3) with their colour, and of beads (B, 3) with their
    colour and radius; colours and radii are one for the group or one for each.
    """
    segments, line_colours = [np.zeros((0, 2, 3))], [np.zeros((0, 4))]
    for segment, colour in lines:
        segments.append(segment)
        line_colours.append(np.broadcast_to(np.asarray(colour, float), (len(segment), 4)))

    places, bead_colours, radii = [np.zeros((0, 3))], [np.zeros((0, 4))], [np.zeros(0)]
    for place, colour, radius in beads:
        places.append(place)
        bead_colours.append(np.broadcast_to(np.asarray(colour, float), (len(place), 4)))
        radii.append(np.broadcast_to(np.asarray(radius, float), len(place)))

    return Drawing(
        lines=np.concatenate(segments),
        line_colours=np.concatenate(line_colours),
        beads=np.concatenate(places),
        bead_colours=np.concatenate(bead_colours),
        radii=np.concatenate(radii),
        labels=tuple(labels),
        width=width,
    )


def figure(
    joints: np.ndarray, colour: Colour, size: float = 1.0, width: float = 2.0, name: str = ""
) -> Drawing:
    """Lines along the bones of ``joints`` (22, 3), a bead for the head, and ``name`` above it.

    ``size``: Blender units for a metre of the body.
    """
    head = joints[joint("head")]
    labels = [(head + np.array((0.0, 0.0, 0.25 * size)), name, colour)] if name else []
    bones = np.stack([joints[list(PARENTS[1:])], joints[1:]], axis=1)
    return compose([(bones, colour)], [(head[None], colour, 0.05 * size)], labels, width)


def floor_path(path: RootPath, unit: float, facing_every: int, now: int) -> Drawing:
    """A root's path, where it faces every so many frames, and where it is in its frame ``now`` if
    that is one of its frames.

    ``path`` is in metres; ``unit``: a Blender unit in metres.
    """
    places = path.position + np.array((0.0, 0.0, ABOVE_FLOOR))
    ahead = places + _FACING_LENGTH * path.rotation[:, :, 1]
    lines = [
        (np.stack([places[:-1], places[1:]], axis=1) / unit, _PATH),
        (np.stack([places, ahead], axis=1)[::facing_every] / unit, _FACING),
    ]

    beads = []
    if 0 <= now < len(path):
        lines.append((np.array([[places[now], 2.5 * ahead[now] - 1.5 * places[now]]]) / unit, NOW))
        beads.append((places[now, None] / unit, NOW, 0.03 / unit))

    return compose(lines, beads)


def ring(middle: np.ndarray, radius: float, corners: int = 24) -> np.ndarray:
    """Lines (corners, 2, 3) of a level circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, corners + 1)
    points = middle + radius * np.stack(
        [np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1
    )
    return np.stack([points[:-1], points[1:]], axis=1)


def circle_of_actions(shares: np.ndarray) -> tuple[Drawing, Drawing]:
    """The paper's circle of action probabilities ``shares`` (K,), with radius 1 around the origin
    in the plane z = 0.

    First its rim with K labels, the most likely one bright; then a ray to each label, as opaque as
    its action is likely.
    """
    angle = 0.5 * np.pi - 2.0 * np.pi * np.arange(len(shares)) / len(shares)
    rays = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    labels = [
        (1.2 * ray, str(k + 1), (*(_BRIGHT if share >= shares.max() else _DIM), 1.0))
        for k, (ray, share) in enumerate(zip(rays, shares, strict=True))
    ]
    rim = compose([(ring(np.zeros(3), 1.0, 64), (*_DIM, 0.8))], labels=labels, width=1.5)

    ends = np.stack([np.zeros_like(rays), rays], axis=1)
    colours = np.concatenate(
        [np.tile(_BRIGHT, (len(shares), 1)), np.clip(shares, 0.0, 1.0)[:, None]], axis=1
    )
    return rim, compose([(ends, colours)], width=6.0)
