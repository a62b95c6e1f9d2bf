"""What each addition to the paper's model gives: narrow models, trained alike but for one thing,
measured on held-out clips.

    dafnet bench ablation DATASET FOLDER -o RUNS --minutes 5 [--from WEIGHTS] [--only VARIANT …]

``DATASET`` is made by ``dafnet prepare``, ``FOLDER`` holds its motion files. Every variant gets the
same minutes, seeds and predictor; what is finished is kept. Writes ``ablation.md`` and
``ablation.json`` into ``RUNS``. Equal minutes, not equal steps: what makes a step dearer has to
earn it. With ``--from`` all begin with what those weights have learnt, and the variants that need
other sizes are left out.

    dafnet bench ablation DATASET FOLDER -o RUNS --from WEIGHTS --furniture LIBRARY

What real pieces of furniture give: ``DATASET`` was made with ``--furniture``; one of as many
windows and the same seed is made of boxes alone. Weights trained on each from ``WEIGHTS`` on, in
equal time, are measured beside those, on the bodies and makers that choose
(``data/held_out/real.py``). Writes ``furniture.md`` and ``furniture.json``; the differences are
paired, clip by clip.
"""

import argparse
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.files import save_text
from dafnet_addon.core.threads import cores
from dafnet_addon.core.weights import Weights, load_weights
from dafnet_addon.data.dataset.prepare import prepare
from dafnet_addon.data.held_out.captured import HeldClip, held_out
from dafnet_addon.data.held_out.real import real_test
from dafnet_addon.model.config import AHEAD_SIZE, SMALL, ModelConfig
from dafnet_addon.training import precision
from dafnet_addon.training.checkpoints import checkpoint_file
from dafnet_addon.training.config import TrainingConfig
from dafnet_addon.training.evaluation.clips import (
    MeasuredClip,
    captured_clips,
    grouped,
    measure_clips,
    pooled_row,
    rows_by_run,
)
from dafnet_addon.training.evaluation.markdown import markdown_table
from dafnet_addon.training.export import export
from dafnet_addon.training.parts import load_run, trained_networks
from dafnet_addon.training.processes import new_processes
from dafnet_addon.training.train import train, train_part
from dafnet_addon.training.validation import held_out_losses

MODEL = replace(SMALL, width=96, code=96, ahead=AHEAD_SIZE)
TRAINING = TrainingConfig(batch=32, free_run=1.0, mixed=True, dropout_windows=0.5)
VARIANTS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "all that ships": ({}, {}),
    "without the way ahead": ({"ahead": 0}, {}),
    "without the free run": ({}, {"free_run": 0.0}),
    "sensor dropout in all windows, as in the paper": ({}, {"dropout_windows": 1.0}),
    "an environment encoder for each step": ({"shared_encoder": False}, {}),
    "without the mask": ({"mask": False}, {}),
    "without either": ({"ahead": 0}, {"free_run": 0.0}),
    "the paper's: none of these": (
        {"ahead": 0, "shared_encoder": False, "mask": False},
        {"free_run": 0.0, "dropout_windows": 1.0},
    ),
    "six coupling layers a part": ({"steps_upper": 6, "steps_lower": 6}, {}),
    "batches of 50": ({}, {"batch": 50}),
    "Noam's schedule": ({}, {"noam": True, "cool_down": 0.0}),
    "lively free runs": ({}, {"lively": 0.5}),
}
FIGURES = (
    "sits_within_6cm",
    "stands_when_it_should",
    "end_effector_error",
    "foot_sliding_per_frame",
    "bad_collisions_per_frame",
    "jerk",
)


def _train(
    part: str,
    dataset: Path,
    folder: Path,
    model: ModelConfig,
    training: TrainingConfig,
    begin_with: Weights | None,
) -> None:
    train_part(part, dataset, folder, model, training, threads=1, begin_with=begin_with)


def measure_variant(
    name: str,
    dataset: Path,
    out: Path,
    minutes: float,
    predictor: Path,
    clips: list[HeldClip],
    begin_with: Weights | None,
) -> dict[str, Any]:
    """Train (or go on with) one variant, and measure it."""
    changed, trained_as = VARIANTS[name]
    base = MODEL
    if begin_with is not None:
        base = ModelConfig(**{**begin_with.config["model"], "ahead": MODEL.ahead})
    model = replace(base, **changed)
    training = replace(TRAINING, minutes_flow=minutes, **trained_as)

    folder = out / name.replace(" ", "_").replace(":", "").replace(",", "")
    folder.mkdir(parents=True, exist_ok=True)
    if not checkpoint_file(folder, "predictor").exists():
        shutil.copy(predictor, folder)

    with new_processes(2) as pool:
        jobs = [
            pool.submit(_train, part, dataset, folder, model, training, begin_with)
            for part in ("upper", "lower")
        ]
        for job in jobs:
            job.result()

    file = folder / "weights.safetensors"
    export(file, *trained_networks(folder), {})
    measured = measure_clips(load_weights(file), clips, seeds=1)
    found = rows_by_run(measured, ["ground_truth", "free_t0", "ee_t0"])
    steps = {part: load_run(part, folder).step for part in ("upper", "lower")}
    return {
        "steps": steps,
        "nll": round(sum(held_out_losses(folder, dataset).values()), 2),
        **found,
    }


def table(results: dict[str, dict[str, Any]]) -> str:
    """The results in Markdown, FREE / EE at temperature 0."""
    head = [
        "",
        "steps",
        "held-out NLL",
        *(f"{name.replace('_', ' ')}, FREE / EE" for name in FIGURES),
    ]
    truth = next(iter(results.values()))["ground_truth"]
    rows = [["**ground truth**", "–", "–", *(f"{truth[name]:.3g}" for name in FIGURES)]]
    for name, found in results.items():
        free, ee = found["free_t0"], found["ee_t0"]
        steps = f"{found['steps']['upper']} + {found['steps']['lower']}"
        cells = [f"{free[figure]:.3g} / {ee[figure]:.3g}" for figure in FIGURES]
        rows.append([name, steps, f"{found['nll']:.1f}", *cells])

    return markdown_table(head, rows)


BEGUN, BOXES, REAL = "the weights begun with", "boxes alone", "with real pieces"
GROUPS: dict[str, Callable[[HeldClip], str]] = {
    "all": lambda clip: "all seats",
    "body": lambda clip: clip.body,
    "maker": lambda clip: clip.maker,
    "kind": lambda clip: clip.kind,
}
DRAWS = 2000


def described_with_pieces(dataset: Path) -> dict[str, Any]:
    """What a dataset says of itself. Raises InputError where it was made without real pieces."""
    described: dict[str, Any] = json.loads((dataset / "dataset.json").read_text(encoding="utf-8"))
    if "furniture" not in described:
        raise InputError(
            f"The dataset '{dataset}' has no real pieces; give one made with 'dafnet prepare "
            "--furniture'."
        )
    return described


def prepare_without_pieces(dataset: Path, folder: Path, out: Path) -> None:
    """Make (or go on making) the dataset ``out``: as ``dataset``, of the same motion files, without
    its real pieces. Raises InputError where that has none.
    """
    described = described_with_pieces(dataset)
    prepare(folder, out, described["windows"], cores(), described["seed"])


def train_on(
    dataset: Path, folder: Path, minutes: float, begin_with: Weights, **changes: Any
) -> Path:
    """Train (or go on with) a run in ``folder`` as ``small.toml`` trains but for ``changes``,
    predictor and flow, for ``minutes`` a part (the predictor for a fifth of that), from these
    weights on: its weights file.
    """
    model = ModelConfig(**begin_with.config["model"])
    budget = {"minutes_predictor": minutes / 5, "minutes_flow": minutes}
    training = replace(TRAINING, **{"batch": 40, "peak": 1e-3, **budget, **changes})
    train(dataset, folder, model, training, begin_with=begin_with)
    file = folder / "weights.safetensors"
    export(file, *trained_networks(folder), {})
    return file


def paired_difference(
    better: Sequence[float], worse: Sequence[float]
) -> tuple[float, float, float]:
    """The mean difference of two figures of the same clips, and 95 % of its bootstrap over
    clips.
    """
    difference = np.subtract(better, worse)
    drawn = np.random.default_rng(0).integers(len(difference), size=(DRAWS, len(difference)))
    low, high = np.quantile(difference[drawn].mean(1), [0.025, 0.975])
    return float(difference.mean()), float(low), float(high)


def pelvis_error(clip: MeasuredClip, run: str) -> float:
    """Centimetres by which a clip's pelvis misses its seats' heights in a run, the mean over
    episodes.
    """
    return 100.0 * float(np.abs(clip.runs[run].seats).mean())


def furniture_table(found: dict[str, list[MeasuredClip]]) -> str:
    """In Markdown: per group of clips and weights, FREE within 4 and 8 cm and how far off; then how
    much closer real pieces bring the pelvis than boxes alone; and EE.
    """
    head = (
        "",
        "clips",
        "weights",
        "FREE, within 4 cm",
        "within 8 cm",
        "pelvis off, cm",
        "real pieces less boxes alone, cm",
        "EE, within 4 cm",
        "EED in EE",
        "skate, cm a frame",
    )
    rows: list[list[str]] = []
    for group, of in GROUPS.items():
        by_weights = {weights: grouped(clips, of) for weights, clips in found.items()}
        for name in by_weights[BEGUN]:
            chosen = {weights: clips[name] for weights, clips in by_weights.items()}
            rows += _furniture_rows(name if group == "all" else f"{group} {name}", chosen)

    return markdown_table(head, rows)


def _furniture_rows(label: str, chosen: dict[str, list[MeasuredClip]]) -> Iterator[list[str]]:
    """The rows of a group's clips, one for each weights."""
    errors = {w: [pelvis_error(each, "free_t0") for each in own] for w, own in chosen.items()}
    for weights, clips in chosen.items():
        free, ee = (pooled_row([each.runs[run] for each in clips]) for run in ("free_t0", "ee_t0"))

        difference = "–"
        if weights == REAL:
            mean, low, high = paired_difference(errors[REAL], errors[BOXES])
            difference = f"{mean:+.1f} ({low:+.1f} to {high:+.1f})"

        low, high = free["intervals"]["sits_within_8cm"]
        yield [
            label,
            str(len(clips)),
            weights,
            f"{100 * free['sits_within_4cm']:.0f} %",
            f"{100 * free['sits_within_8cm']:.0f} % ({100 * low:.0f} to {100 * high:.0f})",
            f"{np.mean(errors[weights]):.1f}",
            difference,
            f"{100 * ee['sits_within_4cm']:.0f} %",
            f"{ee['end_effector_error']:.4f}",
            f"{free['skate_cm']:.2f}",
        ]


def furniture(
    dataset: Path, folder: Path, library: Path, out: Path, minutes: float, begin_with: Weights
) -> str:
    """What real pieces give in equal time, as a table (see ``furniture_table``)."""
    clips = [clip for clip in real_test(folder, library, "choose") if clip.room != "bed"]
    boxes = out / "dataset_of_boxes"
    prepare_without_pieces(dataset, folder, boxes)
    files = {BEGUN: begin_with.path}
    for name, windows in ((BOXES, boxes), (REAL, dataset)):
        files[name] = train_on(windows, out / name.replace(" ", "_"), minutes, begin_with)

    found = {
        name: measure_clips(load_weights(file), clips, seeds=1, modes=("FREE", "EE"), clean=False)
        for name, file in files.items()
    }
    rows = {
        name: rows_by_run(each, ("ground_truth", "free_t0", "ee_t0"))
        for name, each in found.items()
    }
    for name, file in files.items():
        if name != BEGUN:
            rows[name]["steps"] = {p: load_run(p, file.parent).step for p in ("upper", "lower")}

    save_text(out / "furniture.json", json.dumps(rows, indent=1))
    text = furniture_table(found)
    save_text(out / "furniture.md", text)
    return text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "dafnet bench ablation",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("dataset", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument(
        "--every", type=int, default=3, help="measure on every N-th captured clip of an unseen body"
    )
    parser.add_argument("--from", dest="begin_with", type=Path, metavar="WEIGHTS")
    parser.add_argument(
        "--only", nargs="+", choices=tuple(VARIANTS), default=tuple(VARIANTS), metavar="VARIANT"
    )
    parser.add_argument(
        "--furniture", type=Path, metavar="LIBRARY", help="measure what its real pieces give"
    )
    return parser


def main(arguments: Sequence[str]) -> str:
    """Run what the arguments ask for; the table as text."""
    parser = _parser()
    options = parser.parse_args(arguments)
    begin_with = load_weights(options.begin_with) if options.begin_with else None
    precision.warn_if_missing(TRAINING.mixed)

    if options.furniture:
        if begin_with is None:
            parser.error("--furniture needs --from")
        return furniture(
            dataset=options.dataset,
            folder=options.folder,
            library=options.furniture,
            out=options.output,
            minutes=options.minutes,
            begin_with=begin_with,
        )

    clips = captured_clips(held_out(options.folder))[:: options.every]
    first = options.output / "predictor"
    predictor = checkpoint_file(first, "predictor")
    if not predictor.exists():
        training = replace(TRAINING, minutes_predictor=2.0)
        train_part("predictor", options.dataset, first, MODEL, training)

    results: dict[str, dict[str, Any]] = {}
    for name, (changed, _) in VARIANTS.items():
        resized = changed.keys() & {"shared_encoder", "mask", "steps_upper", "steps_lower"}
        if name not in options.only or (begin_with is not None and resized):
            continue

        results[name] = measure_variant(
            name=name,
            dataset=options.dataset,
            out=options.output,
            minutes=options.minutes,
            predictor=predictor,
            clips=clips,
            begin_with=begin_with,
        )
        (options.output / "ablation.json").write_text(
            json.dumps(results, indent=1), encoding="utf-8"
        )
        (options.output / "ablation.md").write_text(table(results) + "\n", encoding="utf-8")

    return table(results)
