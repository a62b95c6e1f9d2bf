"""How people move their hands and heads: reaches, typing, writing, handling things, strokes on a
board, and how far a neck turns.

Paths of wrists are over the thing that is worked on: x to the right of who works, y away from him,
z up; metres. On a top the origin is on its near edge, on a board on its surface.
"""

import numpy as np

from ..core.root import forward_of, gaussian, yaw_of
from ..core.rotations import normalised
from ..core.series import minimum_jerk

__all__ = [
    "HAND",
    "NECK_ASIDE",
    "bounded_look",
    "handling",
    "look_matrices",
    "look_seconds",
    "reach_seconds",
    "strokes",
    "typing",
    "writing",
]

HAND = 0.09
"""Metres from the wrist to the palm."""
NECK_ASIDE = np.radians(70.0)
"""How far a neck turns to each side."""
_NECK_UP = np.radians(45.0)
_NECK_DOWN = np.radians(50.0)

_WRIST_OVER_TOP = 0.055  # metres, of who types
_PEN_OVER_TOP = 0.045  # metres, of who writes
_GRIP_OVER_TOP = 0.075  # metres, of who handles things
_PEN_REACH = 0.13  # metres from a board to the wrist whose pen touches it
_PEN_LIFT = 0.05  # metres
_LETTER_RATE = 1.7  # up and down strokes a second, on a board
_PEN_RATE = 2.4  # the same on paper
_BACK = 0.15  # of a line's time, in which the hand goes back to the next one


def reach_seconds(metres: float) -> float:
    """How long a hand takes: 0.8 s for half a metre, which peaks at 1.2 m/s; never over 2.3 m/s."""
    return 0.4 + 0.8 * metres


def look_seconds(angle: float) -> float:
    """How long a head takes to turn by ``angle`` radians: 0.6 s for 60 degrees."""
    return 0.3 + 0.3 * angle


def _sway(rng: np.random.Generator, frames: int, sigma: float, spread: np.ndarray) -> np.ndarray:
    """Noise (frames, K), smooth over ``sigma`` frames, of a standard deviation ``spread`` (K,)."""
    beyond = int(4.0 * sigma) + 1  # frames at both ends, where the smoothing knows one side only
    noise = gaussian(rng.normal(size=(frames + 2 * beyond, len(spread))), sigma)
    return np.asarray(noise[beyond:-beyond] * np.sqrt(2.0 * np.sqrt(np.pi) * sigma) * spread)


def typing(rng: np.random.Generator, seconds: float, fps: float) -> dict[str, np.ndarray]:
    """Both wrists (N, 3) over a keyboard: they rest before the keys, drift along them, and tap."""
    frames = max(1, round(seconds * fps))
    found = {}
    for name, side in (("hand_left", -1.0), ("hand_right", 1.0)):
        drift = _sway(rng, frames, 0.30 * fps, np.array([0.012, 0.006, 0.002]))
        taps = _sway(rng, frames, 0.05 * fps, np.array([0.001, 0.001, 0.0025]))
        found[name] = np.array([0.11 * side, 0.07, _WRIST_OVER_TOP]) + drift + taps
    return found


def _lines(
    seconds: np.ndarray, *, width: float, tall: float, rate: float, line: float
) -> tuple[np.ndarray, ...]:
    """A pen at times (N,): metres (N,) along its line, and up from it; the line's number, and how
    far (0 to 1) the pen is off it. ``tall``: height of letters; ``line``: seconds of each line.
    """
    number, share = np.floor(seconds / line), (seconds % line) / line
    written, back = np.clip(share / (1.0 - _BACK), 0.0, 1.0), (share - 1.0 + _BACK) / _BACK
    eased = minimum_jerk(back)
    still = np.sin(np.pi * written) ** 0.25  # at both ends of a line
    loops = np.sin(2.0 * np.pi * rate * seconds) * (0.7 + 0.3 * np.sin(2.8 * seconds))
    along = width * written * (1.0 - eased)
    off = np.sin(np.pi * np.clip(back, 0.0, 1.0))
    return along, 0.5 * tall * still * loops, number + eased, off


def writing(seconds: float, fps: float, hand: str) -> dict[str, np.ndarray]:
    """A wrist (N, 3) that writes line by line on paper, and the other that rests on it."""
    time = np.arange(max(1, round(seconds * fps))) / fps
    along, up, _, off = _lines(time, width=0.14, tall=0.014, rate=_PEN_RATE, line=4.0)
    begins = 0.02 if hand == "right" else -0.16
    pen = [begins + along, 0.15 + up, _PEN_OVER_TOP + 0.02 * off]  # the paper is pushed on
    side = 1.0 if hand == "right" else -1.0
    rests = np.tile([-0.16 * side, 0.12, _PEN_OVER_TOP], (len(time), 1))
    other = "hand_left" if hand == "right" else "hand_right"
    return {f"hand_{hand}": np.stack(pen, axis=1), other: rests}


def handling(
    rng: np.random.Generator, seconds: float, fps: float, depth: float
) -> dict[str, np.ndarray]:
    """Both wrists (N, 3) that take things from one place of a top to another, one hand at a time;
    ``depth``: metres of the top that they reach.
    """
    frames = max(1, round(seconds * fps))
    sides = {"hand_left": -1.0, "hand_right": 1.0}
    found = {
        name: np.tile([0.16 * side, min(0.14, depth), _GRIP_OVER_TOP], (frames, 1))
        for name, side in sides.items()
    }
    at = rng.uniform(0.2, 0.6)
    while (first := round(at * fps)) < frames:
        name = str(rng.choice(list(sides)))
        across, away = rng.uniform(0.02, 0.30), rng.uniform(min(0.08, depth), max(0.10, depth))
        goal = np.array([sides[name] * across, away, _GRIP_OVER_TOP])
        here = found[name][first]
        length = float(np.linalg.norm(goal - here))
        lasts = reach_seconds(length)
        share = np.arange(1, frames - first + 1) / (lasts * fps)
        way = minimum_jerk(share)[:, None]
        found[name][first:] = here + way * (goal - here)
        lift = (0.03 + 0.1 * length) * np.sin(np.pi * minimum_jerk(share)) ** 2
        found[name][first:, 2] += lift
        at += lasts + rng.uniform(0.2, 0.8)

    return found


def strokes(seconds: float, fps: float, low: float, high: float) -> np.ndarray:
    """A wrist (N, 3) that writes on a board, line under line, between two heights over its
    origin.
    """
    time = np.arange(max(1, round(seconds * fps))) / fps
    tall = min(0.08, 0.4 * (high - low))
    along, up, number, off = _lines(time, width=0.30, tall=tall, rate=_LETTER_RATE, line=3.0)
    room = max(high - low - tall, 1e-3)
    # Lines go down and then up again, so that no hand jumps from the last one to the first.
    down = room - np.abs((1.4 * tall * number) % (2.0 * room) - room)
    across, away = along - 0.10, -_PEN_REACH - _PEN_LIFT * off
    return np.stack([across, away, high - 0.5 * tall - down + up], axis=1)


def bounded_look(direction: np.ndarray, yaw: float) -> tuple[np.ndarray, float]:
    """The direction (3,) nearest to the one wanted that a neck on a body that faces ``yaw`` allows,
    and the angle between them, radians.
    """
    wanted = normalised(np.asarray(direction, float))
    aside = np.angle(np.exp(1j * (yaw_of(wanted) - yaw)))
    up = np.arcsin(np.clip(wanted[2], -1.0, 1.0))
    around = yaw + np.clip(aside, -NECK_ASIDE, NECK_ASIDE)
    raised = np.clip(up, -_NECK_DOWN, _NECK_UP)
    found = np.array([*(np.cos(raised) * forward_of(around)), np.sin(raised)])
    return found, float(np.arccos(np.clip(found @ wanted, -1.0, 1.0)))


def look_matrices(directions: np.ndarray) -> np.ndarray:
    """Rotations (N, 3, 3) of a head that looks along ``directions`` (N, 3), its crown up: y where
    the face looks, z the crown; NaN where the direction is.
    """
    y = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    x = np.cross(y, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)
