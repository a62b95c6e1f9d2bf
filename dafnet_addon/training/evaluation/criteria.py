"""What is asked of weights, and whether a report's figures meet it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

__all__ = ["Criterion", "criteria"]

_SUFFIXES = ("", "_at_desks_and_shelves", "_on_beds", "_composed")
_RUNS = ("free_t0", "free_t1", "ee_t0", "ee_t1", "full_t0", "full_t1")


@dataclass(frozen=True)
class Criterion:
    """What was asked for and found: ``value`` is to be at least ``must``, better ``goal``; at most,
    where ``at_most`` is True. ``count``: what the value is of, in words.
    """

    name: str
    value: float
    must: float
    goal: float
    at_most: bool
    count: str

    @property
    def met(self) -> str:
        """ "goal", "must" or "no"."""
        sign = -1.0 if self.at_most else 1.0
        if sign * self.value >= sign * self.goal:
            return "goal"
        return "must" if sign * self.value >= sign * self.must else "no"


def criteria(values: dict[str, Any]) -> list[Criterion]:
    """The figures of a report that weights are judged by, and their bounds."""
    return [
        *_of_clips(values["rows"]),
        *_of_activities(values["by_activity"]),
        *_of_rooms(values["drift"], values["seats"]),
        *_of_diversity(values["diversity"], _clips(values["actions"])),
        *_of_actions(values["actions"]),
    ]


def _at_least(
    name: str, value: float, must: float, goal: float | None = None, *, count: str
) -> Criterion:
    return Criterion(name, value, must, must if goal is None else goal, False, count)


def _at_most(
    name: str, value: float, must: float, goal: float | None = None, *, count: str
) -> Criterion:
    return Criterion(name, value, must, must if goal is None else goal, True, count)


def _clips(row: dict[str, Any]) -> str:
    return f"{row['clips']} clips"


def _episodes(row: dict[str, Any]) -> str:
    return f"{row['seat_episodes']} episodes"


def _of_clips(rows: dict[str, Any]) -> Iterator[Criterion]:
    """Every run on every group of clips: seats, targets, feet and collisions."""
    for suffix in _SUFFIXES:
        for run in _RUNS:
            if run + suffix not in rows:
                continue

            row, label = rows[run + suffix], (run + suffix).replace("_", " ")
            if "sits_within_6cm" in row:
                sits = row["sits_within_6cm"]
                yield _at_least(f"{label}: sits", sits, 0.85, 0.95, count=_episodes(row))
            if "stands_when_it_should" in row:
                stands = row["stands_when_it_should"]
                yield _at_least(f"{label}: stands", stands, 0.98, count=_clips(row))

            if run.startswith("ee"):
                error = row["end_effector_error"]
                yield _at_most(f"{label}: EED", error, 0.04, 0.026, count=_clips(row))
            if run.startswith("full"):
                error = row["upper_body_error"]
                yield _at_most(f"{label}: upper body error", error, 0.02, count=_clips(row))
            else:
                yield from _against_real(rows["ground_truth" + suffix], row, label)


def _of_activities(by_activity: dict[str, Any]) -> Iterator[Criterion]:
    """Feet and collisions of calm takes in the clips of each activity."""
    for name, rows in by_activity.items():
        for run in ("free_t0", "ee_t0"):
            label = f"{name}, {run.replace('_', ' ')}"
            yield from _against_real(rows["ground_truth"], rows[run], label)


def _against_real(real: dict[str, Any], row: dict[str, Any], label: str) -> Iterator[Criterion]:
    """FS within 2, better 1.5 times the real motion's, and about as many collisions."""
    slides, collides = (real[f"{name}_per_frame"] for name in ("foot_sliding", "bad_collisions"))
    yield _at_most(
        f"{label}: FS",
        row["foot_sliding_per_frame"],
        2.0 * slides,
        1.5 * slides,
        count=_clips(row),
    )
    yield _at_most(
        f"{label}: BCC",
        row["bad_collisions_per_frame"],
        max(1.2 * collides, collides + 0.02),
        count=_clips(row),
    )


def _of_rooms(drift: dict[str, Any], seats: dict[str, Any]) -> Iterator[Criterion]:
    """Nothing grows worse in a minute, and a seat's height decides how high one sits."""
    for heat in ("t0", "t1"):
        first, last = (drift[f"{which}_third_{heat}"] for which in ("first", "last"))
        slides = last["foot_sliding_per_frame"] / first["foot_sliding_per_frame"]
        lost = first["sits_within_6cm"] - last["sits_within_6cm"]
        yield _at_most(
            f"drift {heat}: foot sliding, last over first third", slides, 1.1, count=_episodes(last)
        )
        yield _at_most(
            f"drift {heat}: sits, first less last third", lost, 0.05, count=_episodes(last)
        )

        trios = f"{seats[heat]['paths_and_seeds']} trios"
        right = seats[heat]["all_three_right"]
        yield _at_least(f"three seats on one path {heat}: all right", right, 1.0, count=trios)


def _of_diversity(diversity: dict[str, Any], clips: str) -> Iterator[Criterion]:
    """The less is given, the more takes differ; legs differ under one upper body, and stand."""
    for above, below in (("free", "ee"), ("ee", "full")):
        ratio = diversity[f"{above}_t1"][f"over_{below}"]
        name = f"diversity of the upper body: {above.upper()} over {below.upper()}"
        yield _at_least(name, ratio, 2.0, count=clips)

    legs, real = diversity["legs_vary_t1"], diversity["ground_truth"]
    under = "legs under one upper body"
    ratio = legs["apd_legs"] / legs["apd_upper"]
    yield _at_least(f"{under}: their diversity over its", ratio, 2.0, count=clips)
    yield _at_least(f"{under}: sits", legs["sits_within_6cm"], 0.85, 0.95, count=_episodes(legs))
    for name in ("feet_off_floor", "legs_penetration_mean"):
        bound = max(2.0 * real[name], real[name] + 0.002)
        yield _at_most(f"{under}: {name.replace('_', ' ')}", legs[name], bound, count=clips)


def _of_actions(actions: dict[str, Any]) -> Iterator[Criterion]:
    """The predictor tells actions apart, and the flow heeds them; of a system without one,
    nothing.
    """
    if "shares" not in actions:
        return

    shuffled = actions["likelihood"]["all"]
    for name, value, must in (
        ("information, nats", actions["information_nats"], 1.0),
        ("likeliest in 2 % of frames", actions["likeliest_in_2_percent"], 6.0),
        ("mutual information with activities", actions["normalised_mutual_information"], 0.3),
        ("nats lost by shuffling them", shuffled["shuffled_adds"], 0.0),
        ("clips that lose by shuffling them", shuffled["shuffled_worse_in_clips"], 0.5),
    ):
        yield _at_least(f"actions: {name}", value, must, count=_clips(actions))
