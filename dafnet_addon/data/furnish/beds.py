"""Beds and sofas of boxes, under a body that lies."""

import numpy as np

from ..motion.interactions import Interaction
from ..motion.rests import Rest
from .boxes import NO_BOXES, box, placed
from .carriers import carrier
from .flesh import GIVES, LIES_SUNK, Furnishing, box_clearance
from .real_pieces import LIES_OVER, carries

__all__ = ["bed_for", "beside"]

_TRIES = 16
_NEAR_BY = 0.8  # metres from where one lies to where one sits on the same bed


def beside(use: Interaction, rests: list[Rest]) -> list[Rest]:
    """The rests on the edge of where one lies."""
    middle = use.points.mean(0)
    return [rest for rest in rests if np.linalg.norm((rest.position - middle)[:2]) < _NEAR_BY]


def bed_for(
    rng: np.random.Generator, use: Interaction, points: np.ndarray, rests: list[Rest]
) -> np.ndarray | None:
    """A bed, or a sofa with its back to one side, under a lying body, head end along +y; it carries
    the rests beside it too.
    """
    middle = use.points.mean(0)
    beside_it = beside(use, rests)
    for attempt in range(_TRIES):
        sofa = rng.random() < 0.35
        x = rng.uniform(0.32, 0.45) if sofa else rng.uniform(0.4, 0.95)
        shift = rng.uniform(-1, 1) * (x - 0.24)
        head, feet = (
            rng.uniform(0.65, 0.95),
            -rng.uniform(0.9, 1.35) * (1.0 - 0.4 * attempt / _TRIES),
        )
        top = middle[2] - LIES_OVER - rng.uniform(0.0, 0.02)
        thick = min(rng.uniform(0.12, 0.3), top - 0.05)
        rows = [box((shift, (head + feet) / 2, top - thick / 2), (2 * x, head - feet, thick))]
        extra = []
        if sofa:
            side, t, h = rng.choice([-1.0, 1.0]), rng.uniform(0.08, 0.2), rng.uniform(0.25, 0.5)
            extra.append(
                box(
                    (shift + side * (x + t / 2), (head + feet) / 2, (top + h) / 2),
                    (t, head - feet, top + h),
                )
            )

        if rng.random() < 0.5:
            t, h = rng.uniform(0.04, 0.1), rng.uniform(0.1, 0.6)
            extra.append(box((shift, head + t / 2, (top + h) / 2), (2 * x, t, top + h)))

        carrying = np.array(rows + carrier(rng, top, thick, x, feet, head, ("block", "legs")))
        carrying[1:, 0] += shift
        extras = np.array(extra) if extra else NO_BOXES
        yaw = use.yaw + rng.normal(0.0, 0.05)
        carrying, extras = (placed(part, middle[:2], yaw) for part in (carrying, extras))
        under = Furnishing(carrying[:1])
        if box_clearance(carrying, points, GIVES, LIES_SUNK) < 0 or not all(
            carries(under, rest) for rest in beside_it
        ):
            continue

        return np.concatenate(
            [carrying, extras if box_clearance(extras, points, 0.02) >= 0 else NO_BOXES]
        )

    return None
