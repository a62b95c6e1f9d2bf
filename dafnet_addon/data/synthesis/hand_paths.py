"""Courses of hands at work, made up: typing, writing and handling things on a desk, writing and
drawing on a board.
"""

from collections.abc import Sequence

import numpy as np

__all__ = ["AT_DESKS", "min_jerk_path", "drawing", "lettering", "wandering"]


def min_jerk_path(stops: np.ndarray, frames: Sequence[int]) -> np.ndarray:
    """A course (sum of ``frames`` + 1, …) through ``stops`` (N, …) with the least jerk, at rest in
    each of them.
    """
    parts = [stops[:1]]
    for a, b, n in zip(stops[:-1], stops[1:], frames, strict=True):
        s = (np.arange(n) + 1.0).reshape(-1, *(1,) * (stops.ndim - 1)) / n
        parts.append(a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s))
    return np.concatenate(parts)


def wandering(rng: np.random.Generator, frames: int, columns: int, sigma: float) -> np.ndarray:
    """Smooth noise (T, columns) of unit size; ``sigma`` in frames."""
    reach = np.arange(-int(3 * sigma), int(3 * sigma) + 1)
    kernel = np.exp(-0.5 * (reach / sigma) ** 2)
    kernel /= np.sqrt((kernel**2).sum())
    noise = rng.normal(size=(frames + len(kernel) - 1, columns))
    return np.stack([np.convolve(c, kernel, mode="valid") for c in noise.T], axis=1)


def _typing(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """A hand's course (T, 3) over a desk: x right, y forward, z over the top; small quick moves
    about a slow place.
    """
    home = np.array([side * rng.uniform(0.08, 0.16), rng.uniform(0.28, 0.36), 0.05])
    return (
        home
        + wandering(rng, frames, 3, 25) * (0.012, 0.012, 0.002)
        + wandering(rng, frames, 3, 2.5) * (0.007, 0.006, 0.005)
    )


def _handwriting(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """Lines from left to right, letter by letter, over a desk."""
    width, y = rng.uniform(0.10, 0.18), rng.uniform(0.28, 0.36)
    left = side * rng.uniform(0.08, 0.14) - width / 2
    stops = [np.array([left, y, 0.05])]
    times: list[int] = []
    while sum(times) < frames:
        line = len(stops) // 2 % 6
        stops += [
            np.array([left + width, y - 0.01 * line, 0.05]),
            np.array([left, y - 0.01 * (line + 1), 0.05]),
        ]
        times += [int(rng.integers(80, 150)), int(rng.integers(18, 30))]

    letters = wandering(rng, frames, 2, 2.5) * (0.004, 0.005)
    return min_jerk_path(np.array(stops), times)[:frames] + np.pad(letters, ((0, 0), (0, 1)))


def _handling(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """A hand that moves between places on a desk, stays there, and is lifted between."""
    stops: list[tuple[float, float, float]] = []
    times: list[int] = []
    while sum(times) < frames:
        stops += [(side * rng.uniform(0.02, 0.34), rng.uniform(0.24, 0.40), 0.05)] * 2
        times += [int(rng.integers(8, 75)), int(rng.integers(16, 36))]

    course = min_jerk_path(np.array(stops), times[:-1])
    speed = np.linalg.norm(np.gradient(course[:, :2], axis=0), axis=-1)
    course[:, 2] += rng.uniform(0.02, 0.08) * speed / speed.max()
    return np.concatenate([course, np.repeat(course[-1:], max(0, frames - len(course)), axis=0)])[
        :frames
    ]


def _resting_hand(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """A hand that lies on a desk."""
    home = np.array([side * rng.uniform(0.10, 0.28), rng.uniform(0.24, 0.36), 0.05])
    return home + wandering(rng, frames, 3, 30) * (0.006, 0.006, 0.001)


AT_DESKS = (  # of the left and the right hand; None hangs or lies as captured
    (_typing, _typing),
    (_typing, _typing),
    (_resting_hand, _handwriting),
    (_handling, _handling),
    (_resting_hand, _handling),
    (_typing, _handling),
    (None, _handwriting),
    (None, _handling),
)


def lettering(rng: np.random.Generator, frames: int) -> np.ndarray:
    """The right hand's course (T, 3) over a board: x right, y off the body, z over the floor; lines
    of letters.
    """
    left, width, top, y = (
        rng.uniform(-0.08, 0.05),
        rng.uniform(0.22, 0.34),
        rng.uniform(1.35, 1.62),
        rng.uniform(0.34, 0.42),
    )
    down = rng.uniform(0.06, 0.11)
    stops = [np.array([left, y, top])]
    times: list[int] = []
    while sum(times) < frames:
        z = top - down * (len(stops) // 2 % 5)
        stops += [
            np.array([left + width, y, z]),
            np.array([left, y, top - down * ((len(stops) // 2 + 1) % 5)]),
        ]
        times += [int(rng.integers(50, 110)), int(rng.integers(20, 32))]

    course = min_jerk_path(np.array(stops), times)[:frames]
    off = np.maximum(0.0, np.gradient(-course[:, 0]))  # on its way back the hand is off the board
    letters = wandering(rng, frames, 2, 4) * (0.010, 0.018)
    return course + np.stack(
        [letters[:, 0], -0.06 * off / max(float(off.max()), 1e-6), letters[:, 1]], axis=1
    )


def drawing(rng: np.random.Generator, frames: int) -> np.ndarray:
    """Large strokes in all directions, or wiping."""
    middle = np.array([rng.uniform(0.05, 0.2), rng.uniform(0.34, 0.42), rng.uniform(1.25, 1.5)])
    course: np.ndarray = middle + wandering(rng, frames, 3, rng.uniform(7, 14)) * (0.08, 0.0, 0.09)
    return course
