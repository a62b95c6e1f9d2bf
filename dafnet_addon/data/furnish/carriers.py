"""What carries a seat, a top or a bed: blocks, legs, columns, panels."""

import numpy as np

from .boxes import box

__all__ = ["STYLES", "carrier"]

STYLES = ("block", "legs", "legs", "column", "panels")
"""What may carry a piece, the likelier the more often it stands here."""


def carrier(
    rng: np.random.Generator,
    top: float,
    thick: float,
    x: float,
    back: float,
    front: float,
    styles: tuple[str, ...] = STYLES,
) -> list[np.ndarray]:
    """What carries a seat or table top between ``back`` and ``front`` (y), ``x`` to either side."""
    middle, depth, under = (front + back) / 2, front - back, top - thick
    style = styles[rng.integers(len(styles))]
    if style == "block":
        gap = rng.choice([0.0, rng.uniform(0.05, 0.15)])
        return [box((0, middle, (under + gap) / 2), (2 * x, depth, max(under - gap, 0.02)))]
    if style == "legs":
        t = rng.uniform(0.03, 0.07)
        ys = (back + t / 2, front - t / 2)
        return [box((sx * (x - t / 2), y, under / 2), (t, t, under)) for sx in (-1, 1) for y in ys]
    if style == "wall":
        return [box((0, front - 0.02, under / 2), (2 * x, 0.04, under))]

    if style == "column":
        t, foot = rng.uniform(0.05, 0.12), rng.uniform(0.3, 0.5)
        column = box((0, middle, under / 2), (t, t, under))
        if rng.random() < 0.5:
            return [column, box((0, middle, 0.03), (foot, foot, 0.06))]

        star = [np.pi / 2 + 2 * np.pi * k / 5 for k in range(5)]
        arms = [(foot / 4 * np.cos(a), middle + foot / 4 * np.sin(a), 0.06) for a in star]
        return [
            column,
            *(box(arm, (foot / 2, 0.04, 0.08), a) for arm, a in zip(arms, star, strict=True)),
        ]

    return [box((sx * (x - 0.02), middle, under / 2), (0.04, depth, under)) for sx in (-1, 1)]
