"""Figures of a weights file on held-out clips, beside those of the clips themselves (paper, section
6.2).

Each clip is made again in each mode, all noise vectors of a mode in one run. The true root is given
in all modes, the true head and hands in EE, the true upper body in FULL; nothing is cleaned up
after the model but in runs that say so. A figure is a ratio of sums over clips, its interval (95 %)
a bootstrap over clips.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ...core import liveliness
from ...core.beginning import PREROLL
from ...core.cleanup import CleanUp
from ...core.conditions import Shot, shot_steps
from ...core.finishing import cleaned_up
from ...core.kinematics import on_bones
from ...core.metrics import (
    BAD_COLLISION_JOINTS,
    bad_collisions,
    body_points,
    diversity,
    end_effector_distance,
    foot_sliding,
    jerk,
    penetration,
    skate,
)
from ...core.occupancy import distance
from ...core.progress import run_to_end
from ...core.root import forward_of, to_world
from ...core.sampler import Sampler
from ...core.series import MODEL_FPS
from ...core.skeleton import END_EFFECTORS, FEET, LOWER, PELVIS, POSE_SIZE, STATURE, UPPER
from ...core.solids import Scene
from ...core.take import MODES, Controls
from ...core.threads import one_thread
from ...core.weights import Weights
from ...data.held_out.captured import HeldClip
from ...model.systems import sampler_of
from ..processes import map_in_processes
from .markdown import markdown_table

__all__ = [
    "COLUMNS",
    "SEEDS",
    "Figures",
    "MeasuredClip",
    "measure_clip",
    "captured_clips",
    "clean_up_takes",
    "group_of",
    "grouped",
    "measure_takes",
    "map_clips",
    "sample_takes",
    "measure_clips",
    "pooled_row",
    "rows_by_group",
    "rows_by_run",
    "shot_of",
    "table",
]

SEEDS = 5
"""Takes at temperature 1."""
_RUNS = (
    "ground_truth",
    "free_t0",
    "free_t0_clean",
    "free_t1",
    "ee_t0",
    "ee_t0_clean",
    "ee_t1",
    "full_t0",
    "full_t0_clean",
    "full_t1",
)
_SITS_WITHIN = (2, 4, 6, 8)
"""Centimetres between the made and the real pelvis, the median over an episode."""
_STANDING = 0.90
"""Metres of the captured pelvis of one who stands."""
_STANDS_ABOVE = 0.86
"""Metres of the made pelvis, where it should stand, that count as standing."""
_DEEP = 0.02
"""Metres inside furniture, from where on a body is seen to penetrate it."""
_OFF_FLOOR = 0.07
"""Metres; under it the paper counts a toe base as low."""
_DRAWS = 1000
"""Of the bootstrap."""
_LEGS = [1 + 4 * (j - 1) + k for j in LOWER for k in range(4)]
"""The legs' rows of ``body_points``."""

Sums = dict[str, tuple[float, float]]
"""By the name of a figure: its total and its weight (frames, episodes), so that clips can be
pooled.
"""


@dataclass(frozen=True)
class Figures:
    """Figures of the takes of one clip under one setting; ``seats``: errors of the pelvis' height,
    metres, made minus real.
    """

    sums: Sums
    seats: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class MeasuredClip:
    """One clip measured: the figures of its runs by name."""

    clip: HeldClip
    runs: dict[str, Figures]


def shot_of(clip: HeldClip, mode: str, scene: Scene | None = None) -> Shot:
    """The shot of a clip in a mode; among other furniture where a ``scene`` is given."""
    targets = {effector: clip.joints[:, j] for effector, j in END_EFFECTORS.items()}
    controls = Controls(
        fps=MODEL_FPS,
        root=clip.path.matrices(),
        mode=mode,
        head=targets["head"],
        hand_left=targets["hand_left"],
        hand_right=targets["hand_right"],
        upper_body=clip.joints[:, list(UPPER)],
    )
    return run_to_end(shot_steps(clip.scene if scene is None else scene, controls))


def sample_takes(sampler: Sampler, shot: Shot, noise: np.ndarray) -> np.ndarray:
    """Takes (S, T, 22, 3) of noise (T, S, 66), or (S, 66) where it is held: world joints on
    constant bones, as the model gives them.
    """
    poses = run_to_end(sampler.run(shot.conditions, noise)).poses
    takes = []
    for s in range(poses.shape[1]):
        takes.append(on_bones(to_world(shot.path, poses[PREROLL:, s].reshape(-1, 22, 3))))
    return np.stack(takes)


def clean_up_takes(takes: np.ndarray, shot: Shot) -> np.ndarray:
    """Takes (S, T, 22, 3) after the clean-up at full strength."""
    return np.stack(
        [on_bones(cleaned_up(joints, shot, CleanUp(1.0, 1.0, 1.0))) for joints in takes]
    )


def measure_takes(clip: HeldClip, takes: np.ndarray, mode: str = "FREE") -> Figures:
    """Figures of takes (S, T, 22, 3) of a clip; APD where there are several."""
    count, frames = takes.shape[:2]
    flat = takes.reshape(-1, 22, 3)
    weight = float(count * frames)

    outside = partial(distance, clip.scene, floor=0.0)
    points = outside(body_points(flat))
    collisions = bad_collisions(outside(flat[:, list(BAD_COLLISION_JOINTS)]))
    toes = flat[:, FEET, 2]
    targets = {name: np.tile(clip.joints[:, j], (count, 1)) for name, j in END_EFFECTORS.items()}
    standing = clip.joints[:, PELVIS, 2] > _STANDING

    def each(measure: Callable[[np.ndarray], float]) -> float:
        return float(sum(measure(take) for take in takes)) * frames

    sums = {
        "foot_sliding_per_frame": (
            each(lambda j: float(foot_sliding(j, MODEL_FPS).mean())),
            weight,
        ),
        "foot_sliding_4mm_s": (
            each(lambda j: float(foot_sliding(j, MODEL_FPS, per_frame=False).mean())),
            weight,
        ),
        "skate_cm": (each(lambda j: skate(j, MODEL_FPS)), weight),
        "bad_collisions_per_frame": (
            float(collisions.sum()),
            weight,
        ),
        "penetration_mean": (penetration(points)[0] * weight, weight),
        "penetrates": (float((points < -_DEEP).any(1).sum()), weight),
        "penetration_deepest": (float(np.maximum(-points.min(1), 0.0).sum()), weight),
        "end_effector_error": (end_effector_distance(flat, targets) * weight, weight),
        "jerk": (each(lambda j: jerk(j, MODEL_FPS)), weight),
        "stands_when_it_should": (
            float((takes[:, standing, 0, 2] > _STANDS_ABOVE).sum()),
            float(count * standing.sum()),
        ),
        "feet_off_floor": (float((toes.min(1) > _OFF_FLOOR).sum()), weight),
        "toes_under_floor": (float(np.maximum(-toes, 0.0).mean()) * weight, weight),
        "legs_penetration_mean": (penetration(points[:, _LEGS])[0] * weight, weight),
    }
    if mode == "FULL":
        upper = np.linalg.norm(takes[:, :, UPPER] - clip.joints[:, UPPER], axis=-1)
        sums["upper_body_error"] = (float(upper.mean()) / STATURE * weight, weight)

    if count > 1:
        sums["apd_upper"] = (diversity(takes[:, :, list(UPPER)]) * frames, float(frames))
        sums["apd_legs"] = (diversity(takes[:, :, list(LOWER)]) * frames, float(frames))

    seats = [
        float(np.median(take[seated, 0, 2]) - np.median(clip.joints[seated, PELVIS, 2]))
        for take in takes
        for seated in (slice(rest.start, rest.end) for rest in clip.rests)
    ]
    for within in _SITS_WITHIN:
        sums[f"sits_within_{within}cm"] = (
            float(sum(abs(error) <= within / 100 for error in seats)),
            float(len(seats)),
        )

    return Figures(sums | _liveliness(clip, takes), seats)


def _liveliness(clip: HeldClip, takes: np.ndarray) -> Sums:
    """How lively takes (S, T, 22, 3) are, how they sway, sit down and lean: means over takes and
    episodes that show it.
    """
    ends = liveliness.LIVELY["wrists"] + liveliness.LIVELY["head"]
    forward = forward_of(clip.path.yaw)

    found: dict[str, list[float]] = defaultdict(list)
    for take in takes:
        for name, joints in liveliness.LIVELY.items():
            found[f"speed_{name}"].append(liveliness.speed(take, MODEL_FPS, joints))
        for band, value in liveliness.band_speeds(take, MODEL_FPS, ends).items():
            found[f"speed_{band}"].append(value)

        found["sway"].append(liveliness.sway(take, MODEL_FPS))
        leans = np.degrees(liveliness.lean(take, forward))
        for rest in clip.rests:
            found["descent_seconds"].append(liveliness.descent(take, MODEL_FPS, rest.start))
            found["lean_degrees"].append(float(np.median(leans[rest.start : rest.end])))

    known = {
        name: [value for value in values if np.isfinite(value)] for name, values in found.items()
    }
    return {name: (float(np.sum(values)), float(len(values))) for name, values in known.items()}


def _noise(
    sampler: Sampler, frames: int, seed: int, seeds: int, mode: str
) -> tuple[np.ndarray, dict[str, list[int]]]:
    """Noise of takes (T, S, 66), and which of them each run is of: calm; lively; in FREE one upper
    body over different legs.
    """
    lively = list(range(1, 1 + seeds))
    noise = [np.zeros((frames, 1, POSE_SIZE))]
    noise += [sampler.noise(frames, seed + s) for s in range(seeds)]
    runs = {f"{mode.lower()}_t0": [0], f"{mode.lower()}_t1": lively}
    if mode == "FREE":
        runs["legs"] = [1, *range(1 + seeds, 2 * seeds)]
        noise += [sampler.noise(frames, seed, seed + s) for s in range(1, seeds)]
    return np.concatenate(noise, axis=1), runs


def measure_clip(
    sampler: Sampler,
    clip: HeldClip,
    seed: int = 0,
    seeds: int = SEEDS,
    modes: Sequence[str] = MODES,
    clean: bool = True,
) -> MeasuredClip:
    """One clip made again in these modes, ``seeds`` times at temperature 1, and measured beside
    itself; calm takes also after the clean-up where it is asked for.
    """
    shots = {"EE": shot_of(clip, "EE")}
    known = shots["EE"].conditions
    asked = known.given.any(axis=1, keepdims=True)
    for mode in set(modes) - {"EE"}:
        # What stands around is looked at once; how he came to where he begins goes with it.
        other = shot_of(clip, mode, Scene())
        told = other.conditions
        conditions = replace(known, observation=told.observation, given=told.given * asked)
        shots[mode] = replace(shots["EE"], conditions=conditions, request=other.request)

    runs = {"ground_truth": measure_takes(clip, clip.joints[None])}
    for mode in modes:
        noise, takes_of = _noise(sampler, len(known), seed, seeds, mode)
        takes = sample_takes(sampler, shots[mode], noise)
        runs |= {run: measure_takes(clip, takes[chosen], mode) for run, chosen in takes_of.items()}
        calm = f"{mode.lower()}_t0"
        if clean:
            runs[f"{calm}_clean"] = measure_takes(
                clip, clean_up_takes(takes[takes_of[calm]], shots[mode]), mode
            )

    return MeasuredClip(clip, runs)


_sampler: Sampler | None = None


def _start(weights: Weights) -> None:
    global _sampler
    _sampler = sampler_of(weights)


def _call(task: Callable[..., Any], item: Any) -> Any:
    assert _sampler is not None
    with one_thread():
        return task(_sampler, item)


def map_clips(
    weights: Weights,
    task: Callable[[Sampler, Any], Any],
    items: Sequence[Any],
    progress: Callable[[float], None],
    processes: int | None = None,
) -> Iterator[Any]:
    """``task`` of each item with a sampler of these weights, in ``processes`` (None: one for each
    core); in order.
    """
    start = partial(_start, weights)
    yield from map_in_processes(partial(_call, task), items, processes, progress, start)


def measure_clips(
    weights: Weights,
    clips: Sequence[HeldClip],
    progress: Callable[[float], None] = lambda share: None,
    seed: int = 0,
    seeds: int = SEEDS,
    modes: Sequence[str] = MODES,
    clean: bool = True,
    processes: int | None = None,
) -> list[MeasuredClip]:
    """Every clip measured beside itself, in ``processes`` (None: one for each core)."""
    task = partial(measure_clip, seed=seed, seeds=seeds, modes=modes, clean=clean)
    return list(map_clips(weights, task, clips, progress, processes))


def _interval(totals: np.ndarray, weights: np.ndarray) -> list[float]:
    """95 % of the bootstrap over clips of a ratio of sums."""
    chosen = np.random.default_rng(0).integers(0, len(totals), (_DRAWS, len(totals)))
    weight = weights[chosen].sum(1)
    drawn = totals[chosen].sum(1)[weight > 0] / weight[weight > 0]
    return [float(f"{value:.4g}") for value in np.quantile(drawn, [0.025, 0.975])]


def pooled_row(chosen: Sequence[Figures]) -> dict[str, Any]:
    """One setting over clips: each figure, the 95 % intervals, and how many clips and seat episodes
    they are of.
    """
    seats = [error for each in chosen for error in each.seats]
    out: dict[str, Any] = {"clips": len(chosen), "seat_episodes": len(seats)}
    intervals = {}
    for name in dict.fromkeys(name for each in chosen for name in each.sums):
        total, weight = np.array([each.sums.get(name, (0.0, 0.0)) for each in chosen]).T
        if weight.sum() > 0:
            out[name] = float(f"{total.sum() / weight.sum():.4g}")
            intervals[name] = _interval(total, weight)

    if seats:
        out["seat_error_median"] = round(float(np.median(np.abs(seats))), 4)

    out["intervals"] = intervals
    return out


def rows_by_run(clips: Sequence[MeasuredClip], runs: Sequence[str]) -> dict[str, dict[str, Any]]:
    """A row for each run, over these clips."""
    return {run: pooled_row([clip.runs[run] for clip in clips]) for run in runs} if clips else {}


def grouped(
    clips: Iterable[MeasuredClip], group: Callable[[HeldClip], str]
) -> dict[str, list[MeasuredClip]]:
    """Clips by what ``group`` says of each, in the order of the groups' names."""
    found: dict[str, list[MeasuredClip]] = defaultdict(list)
    for each in clips:
        found[group(each.clip)].append(each)
    return dict(sorted(found.items()))


def captured_clips(clips: Sequence[HeldClip]) -> list[HeldClip]:
    """Those of unseen bodies that were captured as they are, among seats and chance furniture: the
    headline figures' clips.
    """
    return [clip for clip in clips if clip.unseen and not clip.composed and not clip.room]


def group_of(clip: HeldClip) -> str:
    """What the names of a clip's rows end with: nothing for unseen bodies, captured as they are."""
    if not clip.unseen:
        return "_bodies_in_training"
    if clip.room:
        return "_on_beds" if clip.room == "bed" else "_at_desks_and_shelves"
    return "_composed" if clip.composed else ""


def rows_by_group(clips: Sequence[MeasuredClip]) -> dict[str, dict[str, Any]]:
    """Ground truth and all runs on unseen bodies, captured as they are; then at desks and shelves,
    raised onto beds, on composed clips, and on bodies that are also in training.
    """
    groups = grouped(clips, group_of)
    out: dict[str, dict[str, Any]] = {}
    for suffix in ("", "_at_desks_and_shelves", "_on_beds", "_composed", "_bodies_in_training"):
        chosen = groups.get(suffix, [])
        runs = [run for run in _RUNS if chosen and run in chosen[0].runs]
        out |= {run + suffix: values for run, values in rows_by_run(chosen, runs).items()}

    return out


COLUMNS = (
    "clips",
    "seat_episodes",
    "sits_within_6cm",
    "seat_error_median",
    "stands_when_it_should",
    "end_effector_error",
    "upper_body_error",
    "foot_sliding_per_frame",
    "foot_sliding_4mm_s",
    "skate_cm",
    "bad_collisions_per_frame",
    "penetration_mean",
    "jerk",
    "apd_upper",
    "apd_legs",
    "over_ee",
    "over_full",
    "feet_off_floor",
    "toes_under_floor",
    "legs_penetration_mean",
)
"""The figures of a table, in order."""


def table(rows: dict[str, dict[str, Any]], columns: Sequence[str] = COLUMNS) -> str:
    """The rows as a Markdown table, intervals in brackets."""
    names = [
        name for name in columns if any(values.get(name) is not None for values in rows.values())
    ]

    def cell(values: dict[str, Any], name: str) -> str:
        if values.get(name) is None:
            return "–"
        between = values.get("intervals", {}).get(name)
        return f"{values[name]:g}" + (f" ({between[0]:g} to {between[1]:g})" if between else "")

    return markdown_table(
        ("", *(name.replace("_", " ") for name in names)),
        [
            (label.replace("_", " "), *(cell(values, name) for name in names))
            for label, values in rows.items()
        ],
    )
