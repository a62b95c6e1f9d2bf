"""Metrics of a weights file on held-out clips, beside those of the clips themselves (paper, section 6.2)."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..core.generate import generate
from ..core.metrics import summary
from ..core.occupancy import distance
from ..core.skeleton import END_EFFECTORS, UPPER
from ..core.take import Controls
from ..core.weights import Weights
from ..data.held_out import HeldClip

__all__ = ["evaluate", "table"]

_SITS_WITHIN = 0.06
_STANDS_ABOVE = 0.86
_REPORTED = (
    "foot_sliding_per_frame", "foot_sliding_4mm_s", "skate_cm", "bad_collisions_per_frame", "penetration_mean",
    "end_effector_error", "jerk",
)


def _seats(clip: HeldClip, joints: np.ndarray) -> list[float]:
    """Error of the pelvis' height over each seated episode (metres, made minus real)."""
    return [
        float(np.median(joints[r.start : r.end, 0, 2]) - np.median(clip.joints[r.start : r.end, 0, 2])) for r in clip.rests
    ]


def _row(clips: list[HeldClip], made: list[np.ndarray]) -> dict[str, Any]:
    """Means over frames of all clips, each with the number of clips that it was measured on."""
    totals: dict[str, list[tuple[float, int]]] = {name: [] for name in _REPORTED}
    seats: list[float] = []
    upright: list[bool] = []
    for clip, joints in zip(clips, made, strict=True):
        targets = {name: clip.joints[:, j] for name, j in END_EFFECTORS.items()}
        values = summary(joints, 30.0, targets=targets, distance=partial(distance, clip.scene, floor=0.0))
        for name in _REPORTED:
            value = values[name]
            if value is not None:
                totals[name].append((value, len(joints)))
        seats += _seats(clip, joints)
        standing = clip.joints[:, 0, 2] > 0.9
        upright += (joints[standing, 0, 2] > _STANDS_ABOVE).tolist()
    row: dict[str, Any] = {"clips": len(clips), "seat_episodes": len(seats)}
    for name, pairs in totals.items():
        value, frames = np.array(pairs).T
        row[name] = round(float((value * frames).sum() / frames.sum()), 5)
    errors = np.abs(np.array(seats))
    row["sits_within_6cm"] = round(float((errors <= _SITS_WITHIN).mean()), 4) if seats else None
    row["seat_error_median"] = round(float(np.median(errors)), 4) if seats else None
    row["stands_when_it_should"] = round(float(np.mean(upright)), 4) if upright else None
    return row


def evaluate(
    weights: Weights, clips: list[HeldClip], progress: Callable[[float], None] = lambda share: None, seed: int = 0
) -> dict[str, dict[str, Any]]:
    """Rows of metrics: ground truth first, then FREE and EE at temperature 0 and 1 and FULL at 0, on unseen bodies; last,
    FREE on clips of bodies that are also in training.

    The true root is given in all modes, the true head and hands in EE, the true upper body in FULL.
    ``end_effector_error`` in FREE is no fault, it says how far an unconstrained body is from the real one.
    """
    unseen, partly = [c for c in clips if c.unseen], [c for c in clips if not c.unseen]
    runs = [
        ("free_t0", unseen, "FREE", 0.0), ("ee_t0", unseen, "EE", 0.0), ("free_t1", unseen, "FREE", 1.0),
        ("ee_t1", unseen, "EE", 1.0), ("full_t0", unseen, "FULL", 0.0),
        ("free_t0_bodies_in_training", partly, "FREE", 0.0),
    ]
    rows = {
        "ground_truth": _row(unseen, [c.joints for c in unseen]),
        "ground_truth_bodies_in_training": _row(partly, [c.joints for c in partly]),
    }
    total, done = sum(len(c) for _, c, _, _ in runs), 0
    for name, chosen, mode, temperature in runs:
        made = []
        for clip in chosen:
            targets = {effector: clip.joints[:, j] for effector, j in END_EFFECTORS.items()}
            controls = Controls(
                fps=30.0, root=clip.path.matrices(), mode=mode, head=targets["head"], hand_left=targets["hand_left"],
                hand_right=targets["hand_right"], upper_body=clip.joints[:, list(UPPER)],
            )
            made.append(generate(clip.scene, controls, weights, seed=seed, temperature=temperature).joints)
            done += 1
            progress(done / total)
        rows[name] = _row(chosen, made)
    return rows


def table(rows: dict[str, dict[str, Any]]) -> str:
    """The rows as a Markdown table."""
    names = list(rows["ground_truth"])
    lines = ["| | " + " | ".join(name.replace("_", " ") for name in names) + " |", "|---" * (len(names) + 1) + "|"]
    for label, row in rows.items():
        cells = ["–" if row[name] is None else f"{row[name]:g}" for name in names]
        lines.append(f"| {label.replace('_', ' ')} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
