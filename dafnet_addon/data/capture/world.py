"""From a file's units and axes to ours, found on the body itself: metres, z up, 30 frames a second,
the floor at zero.
"""

from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.resampling import frame_times, resample_positions
from ...core.series import MODEL_FPS
from ...core.skeleton import ANKLES, FEET, PELVIS, TOE_HEIGHT, joint

__all__ = ["unit_of", "uprightness", "z_up", "floor_height", "at_model_rate"]

_UNITS = {  # the third is CMU's and HDM05's
    "metres": 1.0,
    "feet": 0.3048,
    "0.45 inches": 0.0254 / 0.45,
    "inches": 0.0254,
    "centimetres": 0.01,
    "millimetres": 0.001,
}
# hip to ankle of a grown body, metres; what units are told apart by
_LEG, _SHORTEST, _LONGEST = 0.85, 0.57, 1.25
_LEGS = [[joint(s + n) for n in ("hip", "knee", "ankle")] for s in ("left_", "right_")]


def unit_of(joints: np.ndarray, stated: float | None, file: Path) -> float:
    """Metres of one unit of joints (T, 22, 3): as the file states it where that gives a body, else
    the one that does.

    Raises InputError where none does.
    """
    legs = joints[:, _LEGS]
    leg = float(np.median(np.linalg.norm(np.diff(legs, axis=2), axis=-1).sum(-1)))
    if stated is not None and _SHORTEST <= leg * stated <= _LONGEST:
        return stated

    nearest = min(_UNITS.values(), key=lambda unit: abs(np.log(max(leg, 1e-12) * unit / _LEG)))
    if not _SHORTEST <= leg * nearest <= _LONGEST:
        raise InputError(
            f"The body in '{file}' has legs of {leg:.4g} units, which is not a grown person's in "
            f"{', '.join(_UNITS)}; "
            "scale the file to metres."
        )

    return nearest


def uprightness(joints: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """How much speaks for y (first) and for z (second) as the way up: joints (T, 22, 3) and the
    rest pose (22, 3), any unit.

    Where the head is above the feet along an axis counts, and above all where the body travels so:
    a lying body looks as if it stood along another axis, but stays where it is. A skeleton built
    upright counts as a travel of one leg's length.
    """

    def standing(pose: np.ndarray) -> np.ndarray:
        span = pose[:, joint("head")] - pose[:, ANKLES].mean(1)
        return span[:, 1:] > 0.85 * np.linalg.norm(span, axis=-1, keepdims=True)

    leg = float(np.median(np.linalg.norm(np.diff(joints[:, _LEGS], axis=2), axis=-1).sum(-1)))
    step = np.abs(np.diff(joints[:, PELVIS], axis=0, prepend=joints[:1, PELVIS])) / max(leg, 1e-12)
    travel = np.stack([np.hypot(step[:, 0], step[:, 2]), np.hypot(step[:, 0], step[:, 1])], -1)
    return (standing(joints) * (travel + 5e-4)).sum(0) + standing(rest[None])[0]


def z_up(joints: np.ndarray, up: str) -> np.ndarray:
    """Joints with the axis ``up`` ('y' or 'z') turned to z, right-handed."""
    return joints if up == "z" else joints[..., [0, 2, 1]] * (1.0, -1.0, 1.0)


def floor_height(joints: np.ndarray) -> float:
    """Height of the floor under joints (T, 22, 3), metres, z up: a planted toe base is at
    ``TOE_HEIGHT`` over it.

    Toes count while they hardly move with the pelvis well above them. A body that only lies has
    none such: nothing of it is under the floor. (Elsewhere that does not hold: captured hands that
    push off the floor may lie 20 cm in it.)
    """
    toes = joints[:, FEET]
    speed = (
        np.linalg.norm(np.gradient(toes, axis=0), axis=-1) * MODEL_FPS
        if len(joints) > 1
        else np.zeros(toes.shape[:2])
    )
    carried = joints[:, :1, 2] - toes[..., 2] > 0.3
    if not carried.any():
        return float(np.percentile(joints[..., 2].min(1), 2))

    planted = toes[..., 2][carried & (speed < 0.15)]
    # Low among them, since a foot may rest on a step; a runner's toes hardly stand, so that the
    # lower of the two counts too.
    lower = (
        float(np.percentile(toes[..., 2].min(1)[carried.all(1)], 8))
        if carried.all(1).any()
        else np.inf
    )
    lowest = float(np.percentile(planted, 10)) if len(planted) >= 10 else np.inf
    return min(lower, lowest, float(toes[..., 2][carried].max())) - TOE_HEIGHT


def at_model_rate(joints: np.ndarray, rate: float) -> np.ndarray:
    """Joints of ``rate`` frames a second at 30, as long as the frames reach, linearly
    interpolated.
    """
    if abs(rate - MODEL_FPS) < 1e-3 * MODEL_FPS:
        return joints
    frames = int((len(joints) - 1) * MODEL_FPS / rate + 1e-6) + 1
    return resample_positions(
        joints, frame_times(len(joints), rate), frame_times(frames, MODEL_FPS)
    )
