"""Whether a motion lives: how much it moves and how fast, how it sways, leans, and lets itself down
onto a seat.

Each measure means little alone; it stands beside the same measure of captured motion. Joints are
(T, 22, 3), world, metres, z up, at ``fps`` frames a second.
"""

import numpy as np

from .root import gaussian
from .skeleton import NECK, PELVIS, WRISTS, joint

__all__ = ["BANDS", "LIVELY", "band_speeds", "descent", "lean", "speed", "sway"]

LIVELY = {
    "head": (joint("head"),),
    "chest": (joint("spine3"),),
    "wrists": tuple(WRISTS),
}
"""The joints that show life."""
BANDS = {"slow": (0.2, 1.0), "middle": (1.0, 3.0), "quick": (3.0, 8.0)}
"""Hertz: shifting one's weight; gestures, breath and steps; trembling."""

_SMOOTH = 0.5  # seconds: sigma of the path that a body sways about
_WALKS = (0.7, 1.6)  # metres a second
_TURNS = 0.35  # radians a second, above which a path is not straight
_FROM = 0.1  # share of the way down at which a descent counts as begun
_TO = 0.9  # share at which it counts as ended
_BEFORE = 4.0  # seconds before a seated episode, within which its descent begins


def speed(joints: np.ndarray, fps: float, which: tuple[int, ...]) -> float:
    """Mean speed of some joints, metres a second; 0 for less than two frames."""
    if len(joints) < 2:
        return 0.0
    return float(np.linalg.norm(np.diff(joints[:, list(which)], axis=0), axis=-1).mean() * fps)


def band_speeds(
    joints: np.ndarray, fps: float, which: tuple[int, ...], periods: float = 2.0
) -> dict[str, float]:
    """Root mean square speed of some joints in each of ``BANDS``, metres a second; NaN where the
    motion is shorter than so many ``periods`` of the band's slowest.
    """
    frames = len(joints)
    frequency = np.fft.rfftfreq(max(frames, 1), 1.0 / fps)
    places = joints[:, list(which)] - joints[:, list(which)].mean(0)
    # The ends of a motion do not meet: a window keeps the step between them out of the spectrum.
    window = np.hanning(frames)[:, None, None] if frames > 2 else np.ones((frames, 1, 1))
    weight = float((window**2).sum()) or 1.0
    power = (np.abs(np.fft.rfft(places * window, axis=0)) ** 2).sum(-1).mean(-1) * (
        2.0 * np.pi * frequency
    ) ** 2
    found = {}
    for name, (low, high) in BANDS.items():
        inside = (frequency >= low) & (frequency < high)
        long_enough = frames / fps >= periods / low
        found[name] = (
            float(np.sqrt(2.0 * power[inside].sum() / (weight * max(frames, 1))))
            if long_enough
            else float("nan")
        )

    return found


def sway(joints: np.ndarray, fps: float) -> float:
    """How far the pelvis goes to and fro across its own smooth path where it walks straight on:
    peak to peak within a second, metres, the median over such seconds; NaN where it does not walk
    straight for a second.
    """
    place = joints[:, PELVIS, :2]
    second = round(fps)
    if len(place) < 2 * second:
        return float("nan")

    path = gaussian(place, _SMOOTH * fps)
    along = np.gradient(path, axis=0) * fps
    pace = np.linalg.norm(along, axis=-1)
    heading = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    straight = (
        (pace > _WALKS[0]) & (pace < _WALKS[1]) & (np.abs(np.gradient(heading)) * fps < _TURNS)
    )
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.maximum(pace, 1e-6)[:, None]
    aside = ((place - path) * across).sum(-1)
    views = np.lib.stride_tricks.sliding_window_view
    whole = views(straight, second).all(-1)
    if not whole.any():
        return float("nan")

    return float(np.median(np.ptp(views(aside, second), axis=-1)[whole]))


def descent(joints: np.ndarray, fps: float, seated: int, before: float = _BEFORE) -> float:
    """Seconds from 10 to 90 % of the pelvis' way down to where it rests from frame ``seated`` on,
    begun within so many seconds ``before``; NaN where it came from no higher.
    """
    start = max(0, seated - round(before * fps))
    height = joints[start : seated + 1, PELVIS, 2]
    resting, highest = height[-1], height.max()
    if highest - resting < 0.15:
        return float("nan")

    share = (highest - height) / (highest - resting)
    above_first = np.flatnonzero(share < _FROM)
    above_last = np.flatnonzero(share < _TO)
    return float((above_last[-1] - above_first[-1]) / fps)


def lean(joints: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """How far the trunk leans forward (T,), radians, negative backward; ``forward`` (T, 2): where
    the root faces.
    """
    trunk = joints[:, NECK] - joints[:, PELVIS]
    return np.arctan2((trunk[:, :2] * forward).sum(-1), trunk[:, 2])
