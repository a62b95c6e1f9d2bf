"""How weights do among real furniture: body by body, maker by maker and kind by kind, beside the
captured motion itself.
"""

from collections.abc import Callable, Sequence
from typing import Any

from ..core.weights import Weights
from ..data.held_out import HeldClip
from .evaluate import Measured, measured, rows_of, table

__all__ = ["real_report", "real_text"]

_RUNS = ("ground_truth", "free_t0", "free_t0_clean", "free_t1", "ee_t0", "ee_t0_clean")
_COLUMNS = (
    "clips",
    "seat_episodes",
    "sits_within_2cm",
    "sits_within_4cm",
    "sits_within_8cm",
    "seat_error_median",
    "end_effector_error",
    "foot_sliding_per_frame",
    "skate_cm",
    "bad_collisions_per_frame",
    "penetrates",
    "penetration_deepest",
    "jerk",
    "speed_wrists",
    "speed_head",
    "speed_chest",
    "speed_slow",
    "speed_middle",
    "speed_quick",
    "sway",
    "descent_seconds",
    "lean_degrees",
)
_GROUPS: dict[str, Callable[[HeldClip], str]] = {
    "kind": lambda clip: clip.kind,
    "maker": lambda clip: clip.maker,
    "body": lambda clip: clip.body,
}


def real_report(
    weights: Weights,
    clips: Sequence[HeldClip],
    progress: Callable[[float], None] = lambda share: None,
    seeds: int = 3,
) -> dict[str, Any]:
    """Rows (``evaluate.row``) over all clips of ``real_test``, and over those of each kind of
    piece, maker and body.
    """
    found = measured(weights, clips, progress, seeds=seeds, modes=("FREE", "EE"))
    seated = [each for each in found if each.clip.room != "bed"]
    lying = [each for each in found if each.clip.room == "bed"]
    report: dict[str, Any] = {"all seats": rows_of(seated, _RUNS), "lying": rows_of(lying, _RUNS)}
    for group, of in _GROUPS.items():
        parts: dict[str, list[Measured]] = {}
        for each in seated:
            parts.setdefault(of(each.clip), []).append(each)
        report[f"by {group}"] = {name: rows_of(each, _RUNS) for name, each in sorted(parts.items())}
    return report


def real_text(report: dict[str, Any]) -> str:
    """The report as Markdown."""
    parts = []
    for title, rows in report.items():
        if title.startswith("by "):
            for name, own in rows.items():
                parts.append(f"### {title[3:].capitalize()}: {name}\n\n{table(own, _COLUMNS)}")
        elif rows:
            parts.append(f"## {title.capitalize()}\n\n{table(rows, _COLUMNS)}")
    return "\n\n".join(parts)
