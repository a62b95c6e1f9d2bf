"""Pieces of boxes that stand about and that nobody uses."""

import numpy as np

from ...core.root import RootPath
from .boxes import NO_BOXES, box, placed
from .carriers import carrier
from .flesh import FAR, box_clearance
from .seats import SEAT_SHARES, SEATS, seat

__all__ = ["scattered"]


def _desk_alone(rng: np.random.Generator) -> np.ndarray:
    top, x, y = rng.uniform(0.4, 1.05), rng.uniform(0.25, 0.9), rng.uniform(0.2, 0.45)
    thick = rng.uniform(0.02, 0.08)
    desk = np.array(
        [box((0, 0, top - thick / 2), (2 * x, 2 * y, thick)), *carrier(rng, top, thick, x, -y, y)]
    )
    if top > 0.65 and rng.random() < 0.4:  # its chair is drawn up, and nobody sits on it
        chair = np.concatenate(seat(rng, rng.uniform(0.38, 0.5), SEATS[1], 1.0))
        desk = np.concatenate(
            [desk, placed(chair, np.array([0.0, -y - rng.uniform(0.1, 0.5)]), rng.normal(0, 0.3))]
        )

    return desk


def _piece(rng: np.random.Generator) -> np.ndarray:
    """Something that nobody uses, about the origin."""
    kind = rng.choice(["block", "wall", "desk", "seat", "bed"], p=[0.25, 0.15, 0.25, 0.3, 0.05])
    if kind == "block":
        size = rng.uniform((0.2, 0.2, 0.2), (1.2, 0.8, 1.9))
        return box((0, 0, size[2] / 2 + rng.choice([0.0, rng.uniform(0, 0.8)])), tuple(size))[None]

    if kind == "wall":
        length, height = rng.uniform(1.0, 4.0), rng.uniform(1.0, 2.6)
        return box(
            (0, 0, height / 2 + rng.choice([0.0, 0.8])), (length, rng.uniform(0.03, 0.2), height)
        )[None]

    if kind == "desk":
        return _desk_alone(rng)
    if kind == "bed":
        size = rng.uniform((0.8, 1.9, 0.3), (1.8, 2.1, 0.6))
        return box((0, 0, size[2] / 2), tuple(size))[None]

    what = SEATS[rng.choice(len(SEATS), p=SEAT_SHARES)]
    return np.concatenate(seat(rng, rng.uniform(0.3, 0.75), what, 1.0))


def scattered(
    rng: np.random.Generator, points: np.ndarray, path: RootPath, count: int
) -> np.ndarray:
    """Up to ``count`` random pieces near the path, none of which the body (``points``) comes near
    to.

    Half of them are pushed to within 5 to 20 cm of the body's path: what one has to walk around.
    """
    kept = [NO_BOXES]
    for _ in range(count):
        piece = _piece(rng)
        wanted = rng.uniform(0.05, 0.2) if rng.random() < 0.5 else FAR
        for _ in range(5):
            at = path.position[rng.integers(len(path)), :2]
            direction, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.25, 1.5)
            towards = np.array([np.cos(direction), np.sin(direction)])
            candidate = placed(piece, at + distance * towards, rng.uniform(0, 2 * np.pi))
            clearance = box_clearance(candidate, points)
            if clearance < 0.03:
                continue
            for _ in range(4):  # no step can be longer than what is free
                if clearance > wanted + 0.01:
                    candidate[:, :2] -= (clearance - wanted) * towards
                    clearance = box_clearance(candidate, points)
            kept.append(candidate)
            break

    return np.concatenate(kept)
