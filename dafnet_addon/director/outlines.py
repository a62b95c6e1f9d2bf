"""The outlines of level parts seen from above: which cells hang together, and along which sides
they lie.
"""

import numpy as np

__all__ = ["connected", "rectangle_axes"]


def _hull(points: np.ndarray) -> np.ndarray:
    """Convex hull (N, 2) of points, counter-clockwise (Andrew's monotone chain)."""
    ordered = np.unique(points, axis=0).tolist()

    def half(chain: list[list[float]]) -> list[list[float]]:
        out: list[list[float]] = []
        for p in chain:
            while len(out) > 1 and (
                (out[-1][0] - out[-2][0]) * (p[1] - out[-2][1])
                - (out[-1][1] - out[-2][1]) * (p[0] - out[-2][0])
                <= 0
            ):
                out.pop()
            out.append(p)

        return out[:-1]

    return np.array(half(ordered) + half(ordered[::-1])) if len(ordered) > 2 else np.array(ordered)


def rectangle_axes(cells: np.ndarray) -> np.ndarray:
    """The two directions (2, 2) of the smallest rectangle around points (N, 2), the longer side
    first.
    """
    hull = _hull(cells)
    best, found = np.inf, np.eye(2)
    edges = np.roll(hull, -1, axis=0) - hull
    for angle in np.unique(np.round(np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2), 3)):
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        length, width = np.ptp(hull @ along), np.ptp(hull @ across)
        if length * width < best - 1e-9:
            best = length * width
            found = np.stack([along, across] if length >= width else [across, along])

    return found


def connected(heights: np.ndarray, step: float) -> np.ndarray:
    """Numbers (X, Y) of the parts that cells belong to, 0 and up; -1 where ``heights`` (X, Y) are
    not finite. Two neighbours are of one part if their heights differ by at most ``step``.
    """
    there = np.isfinite(heights)
    number = np.full(heights.shape, -1)
    number[there] = np.arange(there.sum())
    pairs = []
    for one, other in (
        ((slice(None, -1),), (slice(1, None),)),
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        with np.errstate(invalid="ignore"):
            alike = np.abs(heights[one] - heights[other]) <= step
        alike &= there[one] & there[other]
        pairs.append(np.stack([number[one][alike], number[other][alike]]))

    first, second = np.concatenate(pairs, axis=1)
    parent = np.arange(there.sum())
    while len(first):
        a, b = parent[first], parent[second]
        apart = a != b
        first, second, a, b = first[apart], second[apart], a[apart], b[apart]
        lower = np.minimum(a, b)
        np.minimum.at(parent, a, lower)
        np.minimum.at(parent, b, lower)
        while (parent[parent] != parent).any():
            parent = parent[parent]

    _, number[there] = np.unique(parent, return_inverse=True)
    return number
