"""All that weights have to show on bodies they never saw: clips beside themselves, drift, seats,
actions, likelihood.

One dictionary, JSON all through; every figure stands beside the number of clips, takes or episodes
that it is of.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..core.conditions import PREROLL, shot_steps
from ..core.files import whole_file
from ..core.metrics import (
    BAD_COLLISION_JOINTS,
    Seat,
    action_information,
    bad_collisions,
    body_points,
    foot_sliding,
    jerk,
    mutual_information,
    penetration,
    seat_report,
    skate,
)
from ..core.occupancy import distance
from ..core.paths import Point, Route, Stop, facing, route
from ..core.progress import run_to_end
from ..core.root import to_root
from ..core.sampler import Sampler
from ..core.series import MODEL_FPS
from ..core.skeleton import POSE_SIZE, SEAT_TO_PELVIS
from ..core.take import Controls
from ..core.weights import Weights
from ..data.dataset.sheet import Row, sheet
from ..data.furnish.boxes import box, placed
from ..data.furnish.flesh import Furnishing
from ..data.held_out.captured import ACTIVITIES, HeldClip
from .batches import NOISE
from .evaluate import (
    SEEDS,
    Figures,
    Measured,
    captured,
    in_processes,
    made,
    measured,
    row,
    rows,
    rows_of,
    shot_of,
    table,
)

__all__ = ["Criterion", "contact_sheets", "criteria", "report", "text"]

_MINUTE, _LOOPS = 1800, 3  # frames of a long take; how often it goes round
_HEIGHTS = {"low": 0.35, "medium": 0.45, "high": 0.60}
_RIGHT_HEIGHT, _SITS_WITHIN, _STANDS_ABOVE = 0.05, 0.06, 0.86  # metres
_AWAY = 0.8  # metres from a seat's middle, beyond which one stands
_LIKELY = 0.02  # share of frames in which an action has to be the likeliest
_SHEETS_OF = {
    "sit down or up": 4,
    "composed": 3,
    "desk or shelf": 3,
    "bed": 2,
    "sit": 2,
    "walk": 3,
    "reach": 1,
    "stand": 2,
}
_A_SHEET, _COLOURS = 4, 48  # clips on a sheet; colours that it is reduced to


@dataclass(frozen=True)
class Room:
    """A root path among seats: ``boxes`` (B, 7); ``heights`` of the seats by the names of the
    route's stops.
    """

    name: str
    boxes: np.ndarray
    walked: Route
    heights: dict[str, float]


def _seat(stop: Stop, height: float, back: bool) -> np.ndarray:
    """A seat of boxes at a stop: a slab on four legs, and a back where asked for."""
    rows = [box((0.0, 0.01, height - 0.025), (0.44, 0.44, 0.05))]
    rows += [
        box((x, 0.01 + y, height / 2 - 0.025), (0.04, 0.04, height - 0.05))
        for x in (-0.2, 0.2)
        for y in (-0.2, 0.2)
    ]
    if back:
        rows.append(box((0.0, -0.23, height + 0.185), (0.44, 0.04, 0.47)))

    return placed(np.array(rows), np.array(stop.position), stop.yaw)


def _round_walk(mirror: float, seconds: float) -> Route:
    """From standing to a chair, to a stool, and back, three times, with ``seconds`` at each."""
    stand = Stop((mirror * 1.2, 3.4), facing((0.0, -1.0)), seconds)
    chair = Stop((0.0, 0.0), 0.0, seconds, seated=True, name="chair")
    stool = Stop((mirror * 3.0, 2.0), facing((-mirror, 0.0)), seconds, seated=True, name="stool")
    once: tuple[Point | Stop, ...] = (
        (mirror * 0.12, 1.5),
        chair,
        (mirror * 1.2, 1.3),
        stool,
        stand,
    )
    return route(stand, *(once * _LOOPS))


def long_rooms() -> list[Room]:
    """Rooms walked round three times in a minute, each round the same: what differs between rounds
    is drift.
    """
    rooms = []
    for mirror, chair, stool in (
        (1.0, 0.45, 0.40),
        (-1.0, 0.50, 0.45),
        (1.0, 0.42, 0.55),
        (-1.0, 0.45, 0.60),
    ):
        # A round is to last 600 frames: what it lacks is shared out among its three rests.
        brief = _round_walk(mirror, 1.0)
        walked = _round_walk(mirror, 1.0 + (_MINUTE / _LOOPS - brief.rests[3].start) / 90.0)
        seats = [
            _seat(walked.rests[k].place, height, back)
            for k, height, back in ((1, chair, True), (2, stool, False))
        ]
        rooms.append(
            Room(
                f"{chair:.2f}, {stool:.2f} m",
                np.concatenate(seats),
                walked,
                {"chair": chair, "stool": stool},
            )
        )

    return rooms


def seat_rooms() -> list[Room]:
    """The same three root paths to a seat, its height low, medium and high."""
    stop = Stop((0.0, 0.0), 0.0, 3.0, seated=True, name="seat")
    ways = {
        "front": route(Stop((-1.6, 3.2), facing((0.5, -1.0)), 0.5), stop),
        "side": route(Stop((3.2, 0.8), facing((-1.0, 0.0)), 0.5), stop),
        "behind": route(Stop((-0.3, -3.2), 0.0, 0.5), (-0.95, -0.6), (-0.85, 0.45), stop),
    }
    return [
        Room(f"{way}, {name}", _seat(stop, height, back=True), walked, {"seat": height})
        for way, walked in ways.items()
        for name, height in _HEIGHTS.items()
    ]


def _walk(sampler: Sampler, room: Room, seeds: int) -> np.ndarray:
    """Takes (1 + seeds, T, 22, 3) in a room: temperature 0 first, then 1."""
    controls = Controls(fps=MODEL_FPS, root=room.walked.path.matrices())
    shot = run_to_end(shot_steps(Furnishing(room.boxes).scene(), controls))
    frames = len(shot.conditions)
    noise = [np.zeros((frames, 1, POSE_SIZE)), *(sampler.noise(frames, s) for s in range(seeds))]
    return made(sampler, shot, np.concatenate(noise, axis=1))


def _round(room: Room, takes: np.ndarray, first: int, last: int) -> Figures:
    """Figures of takes (S, T, 22, 3) in frames ``first`` to ``last``; a seat's right height is that
    of its top plus 0.12 m.
    """
    walked, scene = room.walked, Furnishing(room.boxes).scene()
    cut = takes[:, first:last]
    flat, weight = cut.reshape(-1, 22, 3), float(cut.shape[0] * cut.shape[1])
    reach = partial(distance, scene, floor=0.0)
    places = np.array([rest.place.position for rest in walked.rests if rest.place.seated])
    away = (
        np.linalg.norm(walked.path.position[first:last, None, :2] - places, axis=-1).min(1) > _AWAY
    )
    seats = [
        float(np.median(take[r.start : r.stop, 0, 2]) - room.heights[r.place.name] - SEAT_TO_PELVIS)
        for take in takes
        for r in walked.rests
        if r.place.seated and first <= r.start < last
    ]
    each = [
        (foot_sliding(j, MODEL_FPS).mean(), skate(j, MODEL_FPS), jerk(j, MODEL_FPS)) for j in cut
    ]
    sliding, skating, jerking = (np.array(each).mean(0) * weight).tolist()
    return Figures(
        {
            "foot_sliding_per_frame": (sliding, weight),
            "skate_cm": (skating, weight),
            "jerk": (jerking, weight),
            "bad_collisions_per_frame": (
                float(bad_collisions(reach(flat[:, list(BAD_COLLISION_JOINTS)])).sum()),
                weight,
            ),
            "penetration_mean": (penetration(reach(body_points(flat)))[0] * weight, weight),
            "sits_within_6cm": (
                float(sum(abs(error) <= _SITS_WITHIN for error in seats)),
                float(len(seats)),
            ),
            "stands_when_it_should": (
                float((cut[:, away, 0, 2] > _STANDS_ABOVE).sum()),
                float(cut.shape[0] * away.sum()),
            ),
        },
        seats,
    )


def _rounds(sampler: Sampler, room: Room) -> dict[str, Figures]:
    """Figures of the first and the last round of a long walk."""
    takes = _walk(sampler, room, seeds=3)
    starts = [rest.start for rest in room.walked.rests[::3]]
    rounds = {"first": (starts[0], starts[1]), "last": (starts[_LOOPS - 1], starts[_LOOPS])}
    out = {}
    for name, (first, last) in rounds.items():
        for temperature, chosen in (("t0", takes[:1]), ("t1", takes[1:])):
            out[f"{name}_third_{temperature}"] = _round(room, chosen, first, last)
    return out


def _heights(sampler: Sampler, room: Room) -> list[float]:
    """Height of the pelvis of every take while the root rests on the seat."""
    seat = Seat("seat", np.array([0.0, 0.0, room.heights["seat"]]))
    reports = [
        seat_report(take, room.walked.path, MODEL_FPS, [seat])[0]
        for take in _walk(sampler, room, SEEDS)
    ]
    return [float(report["pelvis_height"] or np.nan) for report in reports]


def _drift(weights: Weights, progress: Callable[[float], None]) -> dict[str, dict[str, Any]]:
    found = list(in_processes(weights, _rounds, long_rooms(), progress))
    return {name: row([rounds[name] for rounds in found]) for name in found[0]}


def _seats(weights: Weights, progress: Callable[[float], None]) -> dict[str, Any]:
    """Pelvis over seats of three heights on the same root path, and how often all three are
    right.
    """
    rooms = seat_rooms()
    found = np.array(list(in_processes(weights, _heights, rooms, progress)))
    found = found.reshape(-1, len(_HEIGHTS), found.shape[1])  # way, height, take
    wanted = np.array(list(_HEIGHTS.values()))[:, None] + SEAT_TO_PELVIS
    right = np.abs(found - wanted) <= _RIGHT_HEIGHT
    out: dict[str, Any] = {}
    for temperature, takes in (("t0", slice(0, 1)), ("t1", slice(1, None))):
        out[temperature] = {
            "paths_and_seeds": int(right[:, 0, takes].size),
            "all_three_right": round(float(right[:, :, takes].all(1).mean()), 4),
            **{
                name: {
                    "seat": _HEIGHTS[name],
                    "wanted": round(float(wanted[k, 0]), 4),
                    "pelvis_median": round(float(np.median(found[:, k, takes])), 4),
                    "right": round(float(right[:, k, takes].mean()), 4),
                }
                for k, name in enumerate(_HEIGHTS)
            },
        }

    return out


@dataclass(frozen=True)
class _Followed:
    """The model led along a real clip: actions (T, K), and nats a frame (T,) of negative
    log-likelihood.
    """

    clip: HeldClip
    actions: np.ndarray
    nats: np.ndarray


def _followed(sampler: Sampler, task: tuple[HeldClip, np.ndarray | None]) -> _Followed:
    """Actions and likelihood of a clip's true poses, FREE, in metres, with the noise of training;
    of other actions if given.
    """
    clip, actions = task
    shot = shot_of(clip, "FREE")
    rng = np.random.default_rng(len(clip.joints))
    poses = to_root(shot.path, clip.joints).reshape(-1, 66)
    poses = np.concatenate([np.repeat(poses[:1], PREROLL, axis=0), poses])
    poses = sampler.standardised(poses + rng.normal(0.0, NOISE, poses.shape)).astype(np.float32)
    sampler.start(shot.conditions)
    seen, nats = [], []
    metres = float(np.log(sampler.network.normalisation.pose_std).sum())
    for t, pose in enumerate(poses[:, None]):
        other = None if actions is None or t < PREROLL else actions[t - PREROLL, None]
        frame = sampler.encode(t, pose, other)
        seen.append(frame.inputs[0, : sampler.actions])
        gaussian = 0.5 * (frame.noise**2 + np.log(2.0 * np.pi)).sum()
        nats.append(float(gaussian - frame.log_det[0]) + metres)

    return _Followed(clip, np.array(seen[PREROLL:]), np.array(nats[PREROLL:]))


def _actions(
    weights: Weights, clips: Sequence[HeldClip], progress: Callable[[float], None]
) -> dict[str, Any]:
    """What the action predictor, if there is one, says along real clips, and what its word is worth
    to the likelihood.
    """
    first: list[_Followed] = list(
        in_processes(weights, _followed, [(c, None) for c in clips], lambda p: progress(p / 2))
    )
    actions = np.concatenate([each.actions for each in first])
    activity = np.repeat([c.activity for c in clips], [len(c.joints) for c in clips])
    present = [name for name in ACTIVITIES if (activity == name).any()]

    def over(
        chosen: Sequence[str], values: Sequence[np.ndarray]
    ) -> tuple[dict[str, Any], list[float]]:
        """Row and clip means of nats (one array for each clip) in clips of these activities."""
        of_them = [n for each, n in zip(first, values, strict=True) if each.clip.activity in chosen]
        return row([Figures({"nats": (float(n.sum()), float(len(n)))}) for n in of_them]), [
            float(n.mean()) for n in of_them
        ]

    def plain(chosen: Sequence[str]) -> dict[str, Any]:
        own, means = over(chosen, [each.nats for each in first])
        return {
            "clips": len(means),
            "nll": own["nats"],
            "nll_interval": own["intervals"]["nats"],
            "nll_median_clip": round(float(np.median(means)), 3),
        }

    groups = {"all": present, **{name: [name] for name in present}}
    counts = {"clips": len(clips), "frames": len(actions)}
    if not actions.shape[1]:
        return {**counts, "likelihood": {label: plain(chosen) for label, chosen in groups.items()}}

    mixed = actions[np.random.default_rng(0).permutation(len(actions))].astype(np.float32)
    cuts = np.cumsum([len(c.joints) for c in clips])[:-1]
    tasks = list(zip(clips, np.split(mixed, cuts), strict=True))
    second: list[_Followed] = list(
        in_processes(weights, _followed, tasks, lambda p: progress(0.5 + p / 2))
    )
    likeliest = actions.argmax(1)
    share = np.bincount(likeliest, minlength=actions.shape[1]) / len(likeliest)

    def nats(chosen: Sequence[str]) -> dict[str, Any]:
        """Of clips of these activities: mean and median clip, and what mixed actions add to the
        mean.
        """
        rise, means = over(chosen, [b.nats - a.nats for a, b in zip(first, second, strict=True)])
        return {
            **plain(chosen),
            "shuffled_adds": rise["nats"],
            "shuffled_adds_interval": rise["intervals"]["nats"],
            "shuffled_adds_median_clip": round(float(np.median(means)), 3),
            "shuffled_worse_in_clips": round(float(np.mean(np.array(means) > 0)), 4),
        }

    return {
        **counts,
        "information_nats": round(action_information(actions), 4),
        "likeliest_in_2_percent": int((share >= _LIKELY).sum()),
        "normalised_mutual_information": round(mutual_information(likeliest, activity), 4),
        "shares": {
            "all": [round(float(s), 3) for s in share],
            **{
                name: [
                    round(float((likeliest[activity == name] == k).mean()), 3)
                    for k in range(len(share))
                ]
                for name in present
            },
        },
        "likelihood": {label: nats(chosen) for label, chosen in groups.items()},
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
        "drift": _drift(weights, part(1)),
        "diversity": _diversity(plain),
        "seats": _seats(weights, part(2)),
        "actions": _actions(weights, captured(clips), part(3)),
    }


@dataclass(frozen=True)
class Criterion:
    """What was asked for and found: ``value`` is to be at least ``must``, better ``goal``; at most,
    where ``most`` is True.
    """

    name: str
    value: float
    must: float
    goal: float
    most: bool
    count: str

    @property
    def met(self) -> str:
        """ "goal", "must" or "no"."""
        sign = -1.0 if self.most else 1.0
        return (
            "goal"
            if sign * self.value >= sign * self.goal
            else "must"
            if sign * self.value >= sign * self.must
            else "no"
        )


def criteria(values: dict[str, Any]) -> list[Criterion]:
    """The figures of a report that weights are judged by, and their bounds: FS within 2, better 1.5
    times the real motion's.
    """
    found: list[Criterion] = []

    def add(
        name: str,
        value: float,
        must: float,
        goal: float | None = None,
        most: bool = False,
        count: str = "",
    ) -> None:
        found.append(Criterion(name, value, must, must if goal is None else goal, most, count))

    rows = values["rows"]

    def against_real(real: dict[str, Any], run: dict[str, Any], label: str) -> None:
        clips = f"{run['clips']} clips"
        slides, collides = (
            real[f"{name}_per_frame"] for name in ("foot_sliding", "bad_collisions")
        )
        add(
            f"{label}: FS",
            run["foot_sliding_per_frame"],
            2.0 * slides,
            1.5 * slides,
            most=True,
            count=clips,
        )
        add(
            f"{label}: BCC",
            run["bad_collisions_per_frame"],
            max(1.2 * collides, collides + 0.02),
            most=True,
            count=clips,
        )

    for suffix in ("", "_at_desks_and_shelves", "_on_beds", "_composed"):
        for run in ("free_t0", "free_t1", "ee_t0", "ee_t1", "full_t0", "full_t1"):
            if run + suffix not in rows:
                continue
            row_, label = rows[run + suffix], (run + suffix).replace("_", " ")
            if "sits_within_6cm" in row_:
                add(
                    f"{label}: sits",
                    row_["sits_within_6cm"],
                    0.85,
                    0.95,
                    count=f"{row_['seat_episodes']} episodes",
                )
            if "stands_when_it_should" in row_:
                add(
                    f"{label}: stands",
                    row_["stands_when_it_should"],
                    0.98,
                    count=f"{row_['clips']} clips",
                )
            if run.startswith("ee"):
                add(
                    f"{label}: EED",
                    row_["end_effector_error"],
                    0.04,
                    0.026,
                    most=True,
                    count=f"{row_['clips']} clips",
                )
            if run.startswith("full"):
                add(
                    f"{label}: upper body error",
                    row_["upper_body_error"],
                    0.02,
                    most=True,
                    count=f"{row_['clips']} clips",
                )
            else:
                against_real(rows["ground_truth" + suffix], row_, label)

    for name, by_run in values["by_activity"].items():
        for run in ("free_t0", "ee_t0"):
            against_real(by_run["ground_truth"], by_run[run], f"{name}, {run.replace('_', ' ')}")

    for temperature in ("t0", "t1"):
        first, last = (
            values["drift"][f"{which}_third_{temperature}"] for which in ("first", "last")
        )
        takes = f"{last['seat_episodes']} episodes"
        slides = last["foot_sliding_per_frame"] / first["foot_sliding_per_frame"]
        add(
            f"drift {temperature}: foot sliding, last over first third",
            slides,
            1.1,
            most=True,
            count=takes,
        )
        lost = first["sits_within_6cm"] - last["sits_within_6cm"]
        add(f"drift {temperature}: sits, first less last third", lost, 0.05, most=True, count=takes)
        seats = values["seats"][temperature]
        right = seats["all_three_right"]
        add(
            f"three seats on one path {temperature}: all right",
            right,
            1.0,
            count=f"{seats['paths_and_seeds']} trios",
        )

    diversity, told = values["diversity"], values["actions"]
    clips = f"{told['clips']} clips"
    add(
        "diversity of the upper body: FREE over EE",
        diversity["free_t1"]["over_ee"],
        2.0,
        count=clips,
    )
    add(
        "diversity of the upper body: EE over FULL",
        diversity["ee_t1"]["over_full"],
        2.0,
        count=clips,
    )
    legs, real = diversity["legs_vary_t1"], diversity["ground_truth"]
    add(
        "legs under one upper body: their diversity over its",
        legs["apd_legs"] / legs["apd_upper"],
        2.0,
        count=clips,
    )
    add(
        "legs under one upper body: sits",
        legs["sits_within_6cm"],
        0.85,
        0.95,
        count=f"{legs['seat_episodes']} episodes",
    )
    for name in ("feet_off_floor", "legs_penetration_mean"):
        label = f"legs under one upper body: {name.replace('_', ' ')}"
        add(label, legs[name], max(2.0 * real[name], real[name] + 0.002), most=True, count=clips)

    if "shares" not in told:
        return found  # a system without an action predictor

    add("actions: information, nats", told["information_nats"], 1.0, count=clips)
    add("actions: likeliest in 2 % of frames", told["likeliest_in_2_percent"], 6.0, count=clips)
    add(
        "actions: mutual information with activities",
        told["normalised_mutual_information"],
        0.3,
        count=clips,
    )
    shuffled = told["likelihood"]["all"]
    add("actions: nats lost by shuffling them", shuffled["shuffled_adds"], 0.0, count=clips)
    add(
        "actions: clips that lose by shuffling them",
        shuffled["shuffled_worse_in_clips"],
        0.5,
        count=clips,
    )
    return found


def text(values: dict[str, Any]) -> str:
    """A report in Markdown."""
    judged = [
        f"| {c.name} | {c.value:.3g} | {'≤' if c.most else '≥'} {c.must:.3g} | {c.goal:.3g} | "
        f"{c.met} | {c.count} |"
        for c in criteria(values)
    ]
    head = "| | found | must | goal | met | of |\n|---|---|---|---|---|---|"
    parts = [
        "## What has to be seen",
        "\n".join([head, *judged]),
        "## Clips",
        table(values["rows"]),
    ]
    for name, found in values["by_activity"].items():
        parts += [f"### {name[0].upper()}{name[1:]}", table(found)]

    parts += ["## Drift: first and last third of a minute", table(values["drift"])]
    parts += ["## Diversity", table(values["diversity"])]
    seats = [
        f"| {name}, {way} | {each['seat']:.2f} | {each['wanted']:.2f} | "
        f"{each['pelvis_median']:.3f} "
        f"| {100 * each['right']:.0f} % | {found['paths_and_seeds']} |"
        for way, found in values["seats"].items()
        for name, each in found.items()
        if isinstance(each, dict)
    ]
    parts += [
        "## Low, medium and high seats on the same root path",
        "\n".join(
            [
                "| | seat, m | pelvis wanted, m | median, m | within 5 cm | takes |",
                "|---|---|---|---|---|---|",
                *seats,
            ]
        ),
        ", ".join(
            f"all three right, {way}: {100 * found['all_three_right']:.0f} %"
            for way, found in values["seats"].items()
        ),
    ]
    told = values["actions"]
    lines = [
        f"- {name.replace('_', ' ')}: {value}"
        for name, value in told.items()
        if not isinstance(value, dict)
    ]
    lines += [
        f"- likeliest action, {name}: {shares}" for name, shares in told.get("shares", {}).items()
    ]
    parts += [
        "## Action predictor and likelihood (nats a frame, poses in metres, 3 mm of noise)",
        "\n".join(lines),
    ]
    names = list(told["likelihood"]["all"])
    head = (
        "| | "
        + " | ".join(name.replace("_", " ") for name in names)
        + " |\n"
        + "|---" * (len(names) + 1)
        + "|"
    )
    body = [
        f"| {label} | " + " | ".join(str(found[name]) for name in names) + " |"
        for label, found in told["likelihood"].items()
    ]
    return "\n\n".join([*parts, "\n".join([head, *body])])


def _kind(clip: HeldClip) -> str:
    if clip.room:
        return "bed" if clip.room == "bed" else "desk or shelf"
    return "composed" if clip.composed else clip.activity


def contact_sheets(weights: Weights, clips: Sequence[HeldClip], folder: Path) -> list[Path]:
    """Twenty held-out clips of unseen bodies, real above FREE at temperature 0, drawn into
    ``folder``; the files.
    """
    from PIL import Image

    chosen: list[HeldClip] = []
    for kind, count in _SHEETS_OF.items():
        of_it = [clip for clip in clips if clip.unseen and _kind(clip) == kind]
        chosen += [
            of_it[i]
            for i in np.unique(np.linspace(0, len(of_it) - 1, min(count, len(of_it))).astype(int))
        ]

    takes = in_processes(weights, _calm, chosen, lambda share: None)
    drawn: list[Row] = [
        (f"{clip.name}, {kind}", joints, clip.furniture)
        for clip, take in zip(chosen, takes, strict=True)
        for kind, joints in (
            ("composed" if clip.composed else "real", clip.joints),
            ("generated", take),
        )
    ]
    files = []
    for k in range(0, len(drawn), 2 * _A_SHEET):
        files.append(folder / f"held_out_{k // (2 * _A_SHEET) + 1}.png")
        sheet(files[-1], drawn[k : k + 2 * _A_SHEET])
        with Image.open(files[-1]) as picture:
            flat = picture.convert("RGB").quantize(
                _COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
            )
        with whole_file(files[-1]) as part:
            flat.save(part, format="PNG", optimize=True)

    return files


def _calm(sampler: Sampler, clip: HeldClip) -> np.ndarray:
    return made(sampler, shot_of(clip, "FREE"), np.zeros((1, POSE_SIZE)))[0]
