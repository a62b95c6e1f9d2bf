"""All that weights have to show on bodies they never saw: clips beside themselves, drift, seats,
actions, likelihood.

One dictionary, JSON all through; every figure stands beside the number of clips, takes or episodes
that it is of.
"""

from collections.abc import Callable, Sequence
from typing import Any

from ...core.weights import Weights
from ...data.held_out.captured import ACTIVITIES, HeldClip
from .actions import actions_and_likelihood
from .clips import MeasuredClip, captured_clips, grouped, measure_clips, rows_by_group, rows_by_run
from .rooms import drift, seats_of_three_heights

__all__ = ["report"]

_RUNS_BY_ACTIVITY = ("ground_truth", "free_t0", "ee_t0", "free_t1", "ee_t1")
_LEGS_FIT = (
    "feet_off_floor",
    "toes_under_floor",
    "legs_penetration_mean",
    "foot_sliding_per_frame",
    "sits_within_6cm",
)
"""Whether legs stand on the floor and in nothing."""


def report(
    weights: Weights,
    clips: Sequence[HeldClip],
    progress: Callable[[float], None] = lambda share: None,
    seed: int = 0,
) -> dict[str, Any]:
    """Everything that is measured, by section: ``rows``, ``by_activity``, ``drift``, ``diversity``,
    ``seats``, ``actions``.
    """
    shares = (0.7, 0.1, 0.1, 0.1)

    def part(k: int) -> Callable[[float], None]:
        return lambda share: progress(sum(shares[:k]) + shares[k] * share)

    found = measure_clips(weights, clips, part(0), seed)
    plain = [each for each in found if captured_clips([each.clip])]
    unseen = [each for each in found if each.clip.unseen and not each.clip.composed]
    by_activity = grouped(unseen, lambda clip: clip.activity)

    return {
        "rows": rows_by_group(found),
        "by_activity": {
            name: rows_by_run(by_activity[name], _RUNS_BY_ACTIVITY)
            for name in ACTIVITIES
            if name in by_activity
        },
        "drift": drift(weights, part(1)),
        "diversity": _diversity(plain),
        "seats": seats_of_three_heights(weights, part(2)),
        "actions": actions_and_likelihood(weights, captured_clips(clips), part(3)),
    }


def _diversity(clips: Sequence[MeasuredClip]) -> dict[str, dict[str, Any]]:
    """APD of the upper body by mode; of the legs under one upper body, and whether those stand on
    the floor and in nothing.
    """
    lively = rows_by_run(clips, ["free_t1", "ee_t1", "full_t1"])
    legs = rows_by_run(clips, ["ground_truth", "free_t0", "legs"])

    def kept(values: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
        names = [name for name in names if name in values]
        return {
            "clips": values["clips"],
            "seat_episodes": values["seat_episodes"],
            **{name: values[name] for name in names},
            "intervals": {name: values["intervals"][name] for name in names},
        }

    out = {run: kept(values, ["apd_upper", "apd_legs"]) for run, values in lively.items()}
    free, ee, full = (lively[f"{mode}_t1"]["apd_upper"] for mode in ("free", "ee", "full"))
    out["free_t1"]["over_ee"] = round(free / ee, 3)
    out["ee_t1"]["over_full"] = round(ee / full, 3)

    for run, values in legs.items():
        name = "legs_vary_t1" if run == "legs" else run
        out[name] = kept(values, ["apd_upper", "apd_legs", *_LEGS_FIT])

    return out
