"""What hands work at, of boxes: desks, boards and shelves, and a desk that nobody uses."""

import numpy as np

from ...core.root import RootPath, forward_of
from ..motion.interactions import Interaction, across
from ..motion.rests import Rest
from .boxes import box, distances, placed
from .carriers import STYLES, carrier
from .flesh import box_clearance, pressed
from .real_pieces import ON_DESK

__all__ = ["board_for", "desk_for", "shelf_for", "spare_desk"]

_TRIES = 16
_OVER_THE_EDGE = 0.12  # metres; a chair is drawn up as one sits down

# A stretched wrist would carry the hand's probe; on a board, as on a top, the wrist bends.
_ON_BOARD = pressed(0.0, wrist=0.01, hand=0.12)


def desk_for(rng: np.random.Generator, use: Interaction, points: np.ndarray) -> np.ndarray | None:
    """A desk, table or counter whose top is 2 to 5 cm under the lowest wrist that works there."""
    origin = use.points[:, :2].mean(0)
    right, ahead = across(use, origin)
    top = use.points[:, 2].min() - rng.uniform(0.02, 0.05)
    for attempt in range(_TRIES):
        share = 1.0 - attempt / _TRIES
        near = ahead.min() - rng.uniform(0.0, 0.22) * share
        far = ahead.max() + 0.12 + rng.uniform(0.0, 0.4) * share
        left_side, right_side = (
            (-0.1, 0.1) + rng.uniform(0.0, 0.6, 2) * (-share, share) + (right.min(), right.max())
        )
        x, thick = (right_side - left_side) / 2, rng.uniform(0.02, 0.06)
        rows = [box((0, (near + far) / 2, top - thick / 2), (2 * x, far - near, thick))]
        # Knees and feet go under what is carried at its ends, and under a top on the wall if under
        # nothing else.
        styles = ("wall", "panels", "legs", "column")[: 1 if attempt > 0.6 * _TRIES else 4]
        rows += carrier(
            rng, top, thick, x, near, far, STYLES if rng.random() < 0.3 * share else styles
        )
        desk = np.array(rows)
        desk[:, 0] += (left_side + right_side) / 2
        desk = placed(desk, origin, use.yaw)
        if box_clearance(desk, points, ON_DESK) >= 0:
            return desk

    return None


def board_for(rng: np.random.Generator, use: Interaction, points: np.ndarray) -> np.ndarray | None:
    """A board or wall 5 to 9 cm beyond the furthest wrist that strokes it."""
    origin = use.points[:, :2].mean(0)
    right, ahead = across(use, origin)
    low, high = use.points[:, 2].min(), use.points[:, 2].max()
    face = ahead.max() + rng.uniform(0.05, 0.09)
    for attempt in range(_TRIES):
        share = 1.0 - attempt / _TRIES
        left_side, right_side = (
            right.min() - 0.1 - rng.uniform(0, 1.0) * share,
            right.max() + 0.1 + rng.uniform(0, 1.0) * share,
        )
        thick, upper = rng.uniform(0.02, 0.12), high + rng.uniform(0.1, 0.6)
        lower = 0.0 if rng.random() < 0.3 * share else max(0.0, low - rng.uniform(0.1, 0.5))
        size = (right_side - left_side, thick, upper - lower)
        board = placed(
            box(((left_side + right_side) / 2, face + thick / 2, (lower + upper) / 2), size)[None],
            origin,
            use.yaw,
        )
        if box_clearance(board, points, _ON_BOARD) >= 0:
            return board

    return None


def shelf_for(rng: np.random.Generator, use: Interaction, points: np.ndarray) -> np.ndarray | None:
    """A shelf, bookcase or counter a little under a hand that reached for it."""
    origin = use.points[:, :2].mean(0)
    _, ahead = across(use, origin)
    under = use.points[:, 2].min()
    for _ in range(_TRIES // 2):
        top, x = under - rng.uniform(0.03, 0.08), rng.uniform(0.15, 0.7)
        near, thick = ahead.min() - rng.uniform(0.0, 0.12), rng.uniform(0.02, 0.05)
        far = ahead.max() + rng.uniform(0.1, 0.35)
        rows = [box((0, (near + far) / 2, top - thick / 2), (2 * x, far - near, thick))]
        style = rng.choice(
            ["board", "counter", "bookcase"], p=[0.4, 0.2, 0.4] if top > 1.0 else [0.1, 0.7, 0.2]
        )
        if style == "counter":
            rows += carrier(rng, top, thick, x, near, far)

        if style == "bookcase":
            height = top + rng.uniform(0.1, 0.8)
            rows.append(box((0, far + 0.01, height / 2), (2 * x, 0.02, height)))
            rows += [
                box((s * x, (near + far) / 2, height / 2), (0.03, far - near, height))
                for s in (-1, 1)
            ]
            rows += [
                box((0, (near + far) / 2, z), (2 * x, far - near, thick))
                for z in np.arange(top - 0.35, 0.1, -0.35)
            ]

        shelf = np.array(rows)
        shelf[:, 0] += rng.uniform(-0.6, 0.6) * x
        shelf = placed(shelf, origin, use.yaw + rng.normal(0.0, 0.1))
        if box_clearance(shelf, points, ON_DESK) >= 0:
            return shelf

    return None


def spare_desk(
    rng: np.random.Generator, rest: Rest, points: np.ndarray, path: RootPath
) -> np.ndarray | None:
    """A desk before a body that rests and leaves it alone, drawn up until it would touch the body's
    ``points``, or until a root on this ``path`` would go through its top and not only over its
    edge.
    """
    top, x, depth, thick = (
        rng.uniform(0.6, 0.85),
        rng.uniform(0.3, 0.8),
        rng.uniform(0.4, 0.8),
        rng.uniform(0.02, 0.06),
    )
    style = ("legs", "panels", "wall", "column")[rng.integers(4)]
    rows = [
        box((0, depth / 2, top - thick / 2), (2 * x, depth, thick)),
        *carrier(rng, top, thick, x, 0, depth, (style,)),
    ]
    desk = np.array(rows)
    desk[:, 0] += rng.uniform(-0.5, 0.5) * x
    forward = forward_of(rest.yaw)
    gap = rng.uniform(0.01, 0.08)
    for distance in np.arange(0.2, 1.0, 0.08):
        candidate = placed(desk, rest.position[:2] + distance * forward, rest.yaw)
        at_top = np.c_[path.position[:, :2], np.full(len(path), candidate[0, 2])]
        crossed = distances(candidate[:1], at_top).min() < -_OVER_THE_EDGE
        if not crossed and box_clearance(candidate, points) >= gap:
            return candidate

    return None
