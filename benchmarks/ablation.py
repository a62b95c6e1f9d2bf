"""What each addition to the paper's model gives: narrow models, trained alike but for one thing,
measured on held-out clips.

    python benchmarks/ablation.py DATASET FOLDER -o RUNS --minutes 5 [--from WEIGHTS]

``DATASET`` is made by ``dafnet prepare``, ``FOLDER`` holds its motion files. Every variant gets the
same minutes, seeds and predictor; what is finished is kept. Writes ``ablation.md`` and
``ablation.json`` into ``RUNS``. Equal minutes, not equal steps: what makes a step dearer has to
earn it. With ``--from`` all begin with what those weights have learnt, and the variants that need
other sizes are left out.
"""

import argparse
import json
import shutil
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import torch

from dafnet_addon.core.weights import Weights, load_weights
from dafnet_addon.data.held_out import HeldClip, held_out
from dafnet_addon.data.prepare import bank_in
from dafnet_addon.model.config import SMALL, ModelConfig
from dafnet_addon.training import precision
from dafnet_addon.training.batches import Pool
from dafnet_addon.training.checkpoints import checkpoint_file
from dafnet_addon.training.evaluate import captured, measured, rows_of
from dafnet_addon.training.export import export
from dafnet_addon.training.train import Run, TrainingConfig, train_part, trained

MODEL = replace(SMALL, width=96, code=96, ahead=18)
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


def _likelihood(folder: Path, dataset: Path) -> float:
    """Negative log-likelihood a frame of held-out windows, nats, in standardised units; the same
    draws for all variants.
    """
    held = Pool(lambda: [dataset / "held.npz"], torch.device("cpu"), bank_in(dataset))
    predictor = Run.load("predictor", folder)
    total = 0.0
    for part in ("upper", "lower"):
        run = Run.load(part, folder)
        run.gmvae.load_state_dict(predictor.network.state_dict())
        run.config = replace(run.config, free_run=0.0, dropout_windows=0.0)
        total += run.held_loss(held, 200)
    return total


def variant(
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
    base = (
        MODEL
        if begin_with is None
        else ModelConfig(**{**begin_with.config["model"], "ahead": MODEL.ahead})
    )
    model, training = (
        replace(base, **changed),
        replace(TRAINING, minutes_flow=minutes, **trained_as),
    )
    folder = out / name.replace(" ", "_").replace(":", "").replace(",", "")
    folder.mkdir(parents=True, exist_ok=True)
    if not checkpoint_file(folder, "predictor").exists():
        shutil.copy(predictor, folder)
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for job in [
            pool.submit(_train, p, dataset, folder, model, training, begin_with)
            for p in ("upper", "lower")
        ]:
            job.result()
    file = folder / "weights.safetensors"
    export(file, *trained(folder), {})
    found = rows_of(
        measured(load_weights(file), clips, seeds=1), ["ground_truth", "free_t0", "ee_t0"]
    )
    steps = {part: Run.load(part, folder).step for part in ("upper", "lower")}
    return {"steps": steps, "nll": round(_likelihood(folder, dataset), 2), **found}


def table(results: dict[str, dict[str, Any]]) -> str:
    """The results in Markdown, FREE / EE at temperature 0."""
    head = [
        "",
        "steps",
        "held-out NLL",
        *(f"{name.replace('_', ' ')}, FREE / EE" for name in FIGURES),
    ]
    truth = next(iter(results.values()))["ground_truth"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    lines.append(
        "| **ground truth** | – | – | "
        + " | ".join(f"{truth[name]:.3g}" for name in FIGURES)
        + " |"
    )
    for name, found in results.items():
        cells = [
            f"{found['free_t0'][figure]:.3g} / {found['ee_t0'][figure]:.3g}" for figure in FIGURES
        ]
        steps = f"{found['steps']['upper']} + {found['steps']['lower']}"
        lines.append("| " + " | ".join([name, steps, f"{found['nll']:.1f}", *cells]) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("dataset", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument(
        "--every", type=int, default=3, help="measure on every N-th captured clip of an unseen body"
    )
    parser.add_argument("--from", dest="begin_with", type=Path, metavar="WEIGHTS")
    options = parser.parse_args()
    begin_with = load_weights(options.begin_with) if options.begin_with else None
    precision.announce(TRAINING.mixed)
    clips = captured(held_out(options.folder))[:: options.every]
    first = options.output / "predictor"
    if not checkpoint_file(first, "predictor").exists():
        train_part(
            "predictor", options.dataset, first, MODEL, replace(TRAINING, minutes_predictor=2.0)
        )
    results: dict[str, dict[str, Any]] = {}
    for name, (changed, _) in VARIANTS.items():
        if begin_with is not None and changed.keys() & {"shared_encoder", "mask"}:
            continue
        predictor = checkpoint_file(first, "predictor")
        results[name] = variant(
            name, options.dataset, options.output, options.minutes, predictor, clips, begin_with
        )
        (options.output / "ablation.json").write_text(
            json.dumps(results, indent=1), encoding="utf-8"
        )
        (options.output / "ablation.md").write_text(table(results) + "\n", encoding="utf-8")
    print(table(results))


if __name__ == "__main__":
    main()
