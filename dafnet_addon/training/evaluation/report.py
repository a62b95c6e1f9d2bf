"""All that weights have to show on bodies they never saw: clips beside themselves, drift, seats,
actions, likelihood.

One dictionary, JSON all through; every figure stands beside the number of clips, takes or episodes
that it is of.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

from ...core.weights import Weights
from ...data.held_out.captured import ACTIVITIES, HeldClip
from .actions import actions_and_likelihood
from .clips import Measured, captured, measured, rows, rows_of
from .rooms import drift, seats_of_three_heights

__all__ = ["report"]


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

    found = measured(weights, clips, part(0), seed)
    plain = [each for each in found if captured([each.clip])]
    groups: dict[str, list[Measured]] = defaultdict(list)
    for each in found:
        if each.clip.unseen and not each.clip.composed:
            groups[each.clip.activity].append(each)

    return {
        "rows": rows(found),
        "by_activity": {
            name: rows_of(groups[name], ["ground_truth", "free_t0", "ee_t0", "free_t1", "ee_t1"])
            for name in ACTIVITIES
            if name in groups
        },
        "drift": drift(weights, part(1)),
        "diversity": _diversity(plain),
        "seats": seats_of_three_heights(weights, part(2)),
        "actions": actions_and_likelihood(weights, captured(clips), part(3)),
    }


def _diversity(clips: Sequence[Measured]) -> dict[str, dict[str, Any]]:
    """APD of the upper body by mode; of the legs under one upper body, and whether those stand on
    the floor and in nothing.
    """
    lively = rows_of(clips, ["free_t1", "ee_t1", "full_t1"])
    legs = rows_of(clips, ["ground_truth", "free_t0", "legs"])
    fit = (
        "feet_off_floor",
        "toes_under_floor",
        "legs_penetration_mean",
        "foot_sliding_per_frame",
        "sits_within_6cm",
    )

    def kept(values: dict[str, Any], names: Sequence[str]) -> dict[str, Any]:
        names = [name for name in names if name in values]
        return {
            "clips": values["clips"],
            "seat_episodes": values["seat_episodes"],
            **{name: values[name] for name in names},
            "intervals": {name: values["intervals"][name] for name in names},
        }

    out = {run: kept(values, ["apd_upper", "apd_legs"]) for run, values in lively.items()}
    out["free_t1"]["over_ee"] = round(
        lively["free_t1"]["apd_upper"] / lively["ee_t1"]["apd_upper"], 3
    )
    out["ee_t1"]["over_full"] = round(
        lively["ee_t1"]["apd_upper"] / lively["full_t1"]["apd_upper"], 3
    )
    out |= {
        run if run != "legs" else "legs_vary_t1": kept(v, ["apd_upper", "apd_legs", *fit])
        for run, v in legs.items()
    }
    return out
