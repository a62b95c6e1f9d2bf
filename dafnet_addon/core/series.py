"""A series of frames: how many there are to a second, its runs, and soft changes along it."""

import numpy as np

__all__ = ["MODEL_FPS", "minimum_jerk", "runs", "smoothstep"]

MODEL_FPS = 30.0
"""Frames a second inside the model."""


def smoothstep(x: np.ndarray) -> np.ndarray:
    """From 0 to 1 as ``x`` goes there, beginning and ending softly."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def minimum_jerk(share: np.ndarray) -> np.ndarray:
    """Way done, from 0 to 1, as ``share`` of the time goes there: that of unhurried reaches (Flash
    and Hogan 1985), with no sudden force at either end; its peak is 1.875 times the mean.
    """
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def runs(flags: np.ndarray, at_least: float = 1, gap: float = 0) -> list[tuple[int, int]]:
    """The (start, stop) of runs of at least ``at_least`` frames in which the flags (T,) are set;
    stop is exclusive. Runs with no more than ``gap`` frames between them are one.
    """
    padded = np.zeros(len(flags) + 2, bool)
    padded[1:-1] = flags
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    found: list[tuple[int, int]] = []
    for start, stop in edges.reshape(-1, 2).tolist():
        if found and start - found[-1][1] <= gap:
            found[-1] = found[-1][0], stop
        else:
            found.append((start, stop))
    return [(start, stop) for start, stop in found if stop - start >= at_least]
