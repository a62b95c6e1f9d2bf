"""How good a run is while it trains: measured now and then among real furniture, drawn as curves,
the best kept.

Who is measured are the bodies and makers that choose weights (``data.splits``), never those that
tell. ``validation.jsonl`` has a row for each time, ``validation.png`` the curves, and
``best.safetensors`` the weights with the least ``score``, their row among their words.
"""

import json
import shutil
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.files import save_text, whole_file
from ..core.liveliness import BANDS
from ..core.skeleton import STATURE
from ..core.text import read_json
from ..core.weights import Weights, load_weights
from ..data.held_out.captured import HeldClip
from .candidates import has_weights, snapshot, write_weights
from .evaluation.clips import MeasuredClip, grouped, measure_clips, pooled_row
from .evaluation.plots import draw_curves
from .export import annotate
from .parts import FlowRun, PredictorRun, saved_runs
from .run import Run
from .steps import held_out_pool

__all__ = [
    "BEST",
    "CURVES",
    "RECORD",
    "describe",
    "held_out_losses",
    "read_record",
    "score",
    "validate_steps",
]

RECORD, BEST, CURVES = "validation.jsonl", "best.safetensors", "validation.png"
SHIPPED = "the weights that ship"
_RUNS = ("ground_truth", "free_t0", "free_t1", "ee_t0", "ee_t1")
_LIFE = tuple(f"speed_{band}" for band in BANDS)
_FIGURES = (
    "sits_within_2cm",
    "sits_within_4cm",
    "sits_within_8cm",
    "end_effector_error",
    "foot_sliding_per_frame",
    "skate_cm",
    "penetrates",
    "jerk",
    "speed_wrists",
    "speed_head",
    "speed_chest",
    *_LIFE,
    "sway",
    "descent_seconds",
    "lean_degrees",
)
_SHARES = ("sits_within_4cm", "sits_within_8cm")
_GROUPS: dict[str, Callable[[HeldClip], str]] = {
    "makers": lambda clip: clip.maker,
    "bodies": lambda clip: clip.body,
    "kinds": lambda clip: clip.kind,
}
_HELD_WINDOWS = 200


def score(clips: Sequence[MeasuredClip]) -> float:
    """Centimetres by which calm takes are off, the less the better: the pelvis over its seats in
    FREE, the mean over makers, so that one counts as much as another; head and hands from their
    targets in EE; and what feet skate in a second in FREE, over what captured ones do.
    """
    makers: dict[str, list[float]] = defaultdict(list)
    for each in clips:
        makers[each.clip.maker] += [abs(error) for error in each.runs["free_t0"].seats]

    seats = 100.0 * float(np.mean([np.mean(errors) for errors in makers.values() if errors]))
    free, ee, truth = (
        pooled_row([each.runs[run] for each in clips])
        for run in ("free_t0", "ee_t0", "ground_truth")
    )
    targets = 100.0 * STATURE * ee["end_effector_error"]
    skates = 30.0 * max(0.0, free["skate_cm"] - truth["skate_cm"])
    return round(seats + targets + skates, 3)


def held_out_losses(folder: Path, dataset: Path) -> dict[str, float]:
    """Negative log-likelihood a frame of held-out windows for each part of a run's flow, its
    weights averaged: nats, in standardised units, with the same draws each time.
    """
    held = held_out_pool(dataset)
    runs = saved_runs(folder)
    for run in runs.values():
        run.adopt_average()

    found = {}
    for part, run in runs.items():
        if isinstance(run, FlowRun):
            if isinstance(predictor := runs.get("predictor"), PredictorRun):
                run.use_predictor(predictor.network.predictor)
            run.config = replace(run.config, free_run=0.0, dropout_windows=0.0)
            found[part] = run.held_out_loss(held, _HELD_WINDOWS)

    return found


def read_record(folder: Path) -> list[dict[str, Any]]:
    """The rows of a run's validation so far. Raises InputError where its file is damaged."""
    file = folder / RECORD
    if not file.exists():
        return []

    try:
        return [read_json(line) for line in file.read_text(encoding="utf-8").splitlines()]
    except ValueError as error:
        raise InputError(
            f"The record '{file}' {error}; restore a backup, or remove it to begin anew."
        ) from None


def validate_steps(
    folder: Path,
    dataset: Path,
    clips: Sequence[HeldClip],
    *,
    every: float | None = None,
    processes: int = 1,
    progress: Callable[[float], None] = lambda share: None,
) -> Iterator[dict[str, Any]]:
    """Measure the run ``folder`` on ``clips`` (``real_test``) as it is now, and again ``every`` so
    many minutes until its budget is spent: the rows, each once its files are written. What was
    measured already is not measured again.

    The run is only read, and may go on meanwhile. Raises InputError where it has no weights of the
    whole flow yet; with ``every`` they are waited for.
    """
    seats = [clip for clip in clips if clip.room != "bed"]

    def measure(weights: Weights) -> dict[str, Any]:
        found = measure_clips(
            weights,
            seats,
            progress,
            seeds=1,
            modes=("FREE", "EE"),
            clean=False,
            processes=processes,
        )
        return {"score": score(found), **_figures(found)}

    rows = read_record(folder)
    spent = False
    while not spent:
        begin = time.monotonic()
        if every is None or has_weights(folder):
            with snapshot(folder) as copy:
                if not any(each["weights"] == SHIPPED for each in rows):
                    rows.append({"weights": SHIPPED, **measure(load_weights(None))})
                    _write_record(folder, rows)

                runs = saved_runs(copy)
                spent = every is None or all(run.share >= 1.0 for run in runs.values())
                place = _place_of(runs)
                if not any(each.get("parts") == place["parts"] for each in rows):
                    file = copy / BEST
                    write_weights(copy, dataset, file)
                    losses = {"held_out": held_out_losses(copy, dataset)}
                    rows.append({**place, **losses, **measure(load_weights(file))})

                    _keep_if_best(folder, file, rows[-1])
                    _write_record(folder, rows)
                    yield rows[-1]

        if not spent and every is not None:
            time.sleep(max(0.0, 60.0 * every - (time.monotonic() - begin)))


def _place_of(runs: Mapping[str, Run]) -> dict[str, Any]:
    """How far a run is: the beginning of its row."""
    parts = {
        part: {"steps": run.step, "minutes": round(run.seconds / 60, 2)}
        for part, run in runs.items()
    }
    minutes = max(place["minutes"] for part, place in parts.items() if part != "predictor")
    return {"weights": "the run", "hours": round(minutes / 60, 3), "parts": parts}


def describe(found: Mapping[str, Any]) -> str:
    """A row in one line: what calm takes do, then what lively ones do beside captured motion."""
    free, ee = (found["figures"][run] for run in ("free_t0", "ee_t0"))
    when = f" after {found['hours']:.2f} h a part" if "hours" in found else ""
    return (
        f"{found['weights']}{when}: score {found['score']:.1f} cm; FREE within 4 / 8 cm "
        f"{100 * free['sits_within_4cm']:.0f} / {100 * free['sits_within_8cm']:.0f} %, "
        f"skate {free['skate_cm']:.2f}; EE {100 * ee['sits_within_4cm']:.0f} / "
        f"{100 * ee['sits_within_8cm']:.0f} %, EED {ee['end_effector_error']:.4f}"
        f"{_lively(found['figures'])}"
    )


def _lively(figures: Mapping[str, Any]) -> str:
    """At temperature 1: what feet skate, life in each band over the captured one, and head and
    hands from their targets; of rows of earlier versions, what they have.
    """
    lively, real, led = figures["free_t1"], figures["ground_truth"], figures.get("ee_t1")
    words = [f"skate {lively['skate_cm']:.2f}"]
    if all(name in lively and real.get(name) for name in _LIFE):
        shares = " / ".join(f"{lively[name] / real[name]:.2f}" for name in _LIFE)
        words.append(f"life {' / '.join(BANDS)} {shares} of real")
    if led is not None:
        words.append(f"EED {led['end_effector_error']:.4f}")

    return f"; temperature 1: {', '.join(words)}"


def _figures(clips: Sequence[MeasuredClip]) -> dict[str, Any]:
    """The figures of all clips, with intervals, and how well those of each maker, body and kind of
    piece are sat on.
    """
    figures = {}
    for run in _RUNS:
        found = pooled_row([each.runs[run] for each in clips])
        figures[run] = {name: found[name] for name in _FIGURES if name in found}
        figures[run]["intervals"] = {
            name: found["intervals"][name] for name in figures[run] if name in found["intervals"]
        }

    groups: dict[str, dict[str, Any]] = {}
    for group, of in _GROUPS.items():
        groups[group] = {
            name: {"clips": len(own)}
            | {
                run: {share: found[share] for share in _SHARES}
                for run in ("free_t0", "ee_t0")
                for found in [pooled_row([each.runs[run] for each in own])]
            }
            for name, own in grouped(clips, of).items()
        }

    return {"clips": len(clips), "figures": figures, **groups}


def _keep_if_best(folder: Path, file: Path, found: dict[str, Any]) -> None:
    """Keep the weights with their row, where none that are kept are as good."""
    best = folder / BEST
    if best.exists():
        kept = load_weights(best).metadata.get("validation", "")
        try:
            if read_json(kept)["score"] <= found["score"]:
                return
        except (ValueError, TypeError, KeyError):
            raise InputError(
                f"'{best}' does not say how good it is; move it away, and validate again."
            ) from None

    annotate(file, {"validation": json.dumps(found)})
    with whole_file(best) as part:
        shutil.copyfile(file, part)


def _write_record(folder: Path, rows: Sequence[dict[str, Any]]) -> None:
    save_text(folder / RECORD, "\n".join(json.dumps(each) for each in rows))
    draw_curves(rows, folder / CURVES)
