"""The paper's comparisons on open data: every system trained alike from nothing, then Tables 1 and
2 (docs/experiments.md).

    dafnet bench tables train DATASET -o RUNS --minutes 20
    dafnet bench tables table1 FOLDER -o RUNS
    dafnet bench tables table2 FOLDER -o RUNS
    dafnet bench tables paired FOLDER -o RUNS

``DATASET`` is made by ``dafnet prepare``, ``FOLDER`` holds its motion files. All systems have the
width of the weights that ship, the same windows, batches, learning rates, modes and sensor dropout,
and the likelihood alone (SAMP: its own loss): what this project adds (the way ahead, the free run)
is left out, so that the systems differ by what the paper says they differ by. There are three
budgets: equal processor time for a whole system, as many steps as MoGlow, the dearest, takes in
that time, and three times the time. What is finished is kept; a killed command goes on where it
was. ``paired`` compares AP-P with DAFNet clip by clip, in EE: clips differ more from each other
than the two systems do, so that the tables' intervals cannot tell them apart.
"""

import argparse
import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from dafnet_addon.baselines.samp import SMALL_SAMP, SampConfig
from dafnet_addon.baselines.samp_evaluate import measure_samp
from dafnet_addon.baselines.train import train_samp
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.weights import load_weights
from dafnet_addon.data.held_out.captured import HeldClip, held_out
from dafnet_addon.data.held_out.paper import paper_test
from dafnet_addon.model.config import SMALL, ModelConfig
from dafnet_addon.model.systems import system_named
from dafnet_addon.training import precision
from dafnet_addon.training.checkpoints import Checkpoint, checkpoint_file
from dafnet_addon.training.config import TrainingConfig
from dafnet_addon.training.evaluation.clips import (
    MeasuredClip,
    captured_clips,
    measure_clips,
    pooled_row,
)
from dafnet_addon.training.evaluation.markdown import markdown_table
from dafnet_addon.training.export import export
from dafnet_addon.training.noise import take_noise
from dafnet_addon.training.parts import load_run, trained_networks
from dafnet_addon.training.processes import map_in_processes
from dafnet_addon.training.steps import dataset_pool
from dafnet_addon.training.train import train_part

MODEL = SMALL
TRAINING = TrainingConfig(batch=40, peak=1e-3, mixed=True, minutes_predictor=2.0)
FLOWS: dict[str, dict[str, Any]] = {
    "MoGlow": {"system": "moglow", "steps_whole": 16},
    "AP-P": {"system": "ap-p", "steps_whole": 6},
    "DAFNet": {"system": "dafnet"},
    "Lower body first": {"system": "lower-first"},
}
"""The likelihood models of Table 2, as the paper sizes them, and DAFNet the other way round (the
paper's section 7).
"""
STEPPED = ("AP-P", "DAFNet")
"""Those that get further runs: of as many steps as MoGlow's, and of three times the time."""
SAMP = {
    "SAMP": ("samp", "samp"),
    "SAMP-A": ("samp", "samp-a"),
    "SAMP on our input": ("samp-ob", "samp-ob"),
}
"""By system, the network that it runs, and how (``baselines.samp``)."""
NETWORKS = ("samp", "samp-ob")
BUDGETS = ("equal time", "equal steps", "triple time")
SHIPPED = "the weights that ship"

_FIGURES = {
    "fs": "foot_sliding_per_frame",
    "eed": "end_effector_error",
    "bcc": "bad_collisions_per_frame",
}
_SEATS = {"sits": "sits_within_6cm", "stands": "stands_when_it_should"}
TABLES: dict[str, tuple[tuple[str, ...], dict[str, tuple[float, ...]]]] = {
    "table1": (
        ("fs free", "bcc free"),
        {"SAMP": (5701, 9617), "SAMP-A": (5427, 9846), "DAFNet": (5170, 8129)},
    ),
    "table2": (
        ("fs free", "fs ee", "eed ee", "bcc free", "bcc ee"),
        {
            "MoGlow": (5495, 5361, 0.230, 1328, 609),
            "AP-P": (2623, 2344, 0.106, 561, 289),
            "DAFNet": (2528, 2050, 0.026, 289, 385),
        },
    ),
}
"""The paper's tables: what is measured, and its figures (sums over 5,359 and 4,135 frames)."""


@dataclass(frozen=True)
class Job:
    """One network to train in a folder: a flow's part, or SAMP's."""

    folder: Path
    part: str
    model: ModelConfig
    training: TrainingConfig


def _runs_of(runs: Path, budget: str) -> Path:
    """The folder of the runs of a budget."""
    return runs / budget.replace(" ", "_")


def _train(dataset: Path, samp: SampConfig, job: Job) -> None:
    if job.part in NETWORKS:
        train_samp(
            job.part,
            samp,
            dataset,
            checkpoint_file(job.folder, job.part),
            replace(job.training, batch=32),
        )
    else:
        train_part(job.part, dataset, job.folder, job.model, job.training, threads=1)


def _jobs(runs: Path, budget: str, model: ModelConfig, training: TrainingConfig) -> Iterator[Job]:
    """What has to be trained for a budget, the longest first; a flow's parts share its time."""
    for name, changed in FLOWS.items():
        of_it = replace(model, **changed)
        if budget != BUDGETS[0] and name not in STEPPED:
            continue

        parts = system_named(of_it.system).partition
        for part in parts:
            shared = replace(training, minutes_flow=training.minutes_flow / len(parts))
            yield Job(_runs_of(runs, budget) / of_it.system, part, of_it, shared)

    if budget == BUDGETS[0]:
        for kind in NETWORKS:
            yield Job(_runs_of(runs, budget) / kind, kind, model, training)


def train(
    dataset: Path,
    runs: Path,
    minutes: float,
    processes: int | None = None,
    model: ModelConfig = MODEL,
    training: TrainingConfig = TRAINING,
    samp: SampConfig = SMALL_SAMP,
) -> None:
    """Train every system with its budgets; ``minutes`` of one core for each whole system, the
    shared predictor not counted.
    """
    first = runs / "predictor"
    if not checkpoint_file(first, "predictor").exists():
        train_part("predictor", dataset, first, model, training)

    for budget in BUDGETS:
        spent = replace(training, minutes_flow=minutes)
        if budget == "equal steps":
            spent = replace(
                spent, steps_flow=load_run("whole", _runs_of(runs, BUDGETS[0]) / "moglow").step
            )
        elif budget == "triple time":
            spent = replace(spent, minutes_flow=3.0 * minutes)

        jobs = list(_jobs(runs, budget, model, spent))
        for job in jobs:
            job.folder.mkdir(parents=True, exist_ok=True)
            if job.model.predicts and not checkpoint_file(job.folder, "predictor").exists():
                shutil.copy(checkpoint_file(first, "predictor"), job.folder)

        list(map_in_processes(partial(_train, dataset, samp), jobs, processes))
        for folder in {job.folder for job in jobs if job.part not in NETWORKS}:
            flow, predictor, statistics = trained_networks(folder)
            noise = take_noise(flow, predictor, dataset_pool(dataset), statistics)
            export(folder / "weights.safetensors", flow, predictor, statistics, {}, noise)


def steps_of(folder: Path) -> str:
    """How many steps each network in a run's folder took."""
    parts = ("upper", "lower", "whole", *NETWORKS)
    files = [file for part in parts if (file := checkpoint_file(folder, part)).exists()]
    return " + ".join(str(Checkpoint.read(file).progress()[0]) for file in files) or "–"


Measuring = Callable[[Sequence[HeldClip]], list[MeasuredClip]]


def systems_of(table: str, runs: Path) -> dict[str, tuple[str, Measuring]]:
    """The table's systems by name and budget: the steps that they were trained, and what measures
    them.
    """

    def flow(file: Path | None) -> Measuring:
        if file is not None and not file.exists():
            raise InputError(
                f"'{file}' is not there yet; run 'dafnet bench tables train' to its end first."
            )
        return lambda clips: measure_clips(
            load_weights(file), clips, modes=("FREE", "EE"), clean=False
        )

    out: dict[str, tuple[str, Measuring]] = {}
    compared = {"DAFNet": FLOWS["DAFNet"]} if table == "table1" else FLOWS
    for budget in BUDGETS[:1] if table == "table1" else BUDGETS:
        at = _runs_of(runs, budget)
        for name, (network, kind) in SAMP.items() if table == "table1" else ():
            file = checkpoint_file(at / network, network)
            out[f"{name}, {budget}"] = steps_of(file.parent), partial(measure_samp, file, kind)
        for name, changed in compared.items():
            if budget != BUDGETS[0] and name not in (
                *(("MoGlow",) if budget == BUDGETS[1] else ()),
                *STEPPED,
            ):
                continue
            # MoGlow's run with equal time is that with equal steps too.
            folder = (_runs_of(runs, BUDGETS[0]) if name == "MoGlow" else at) / changed["system"]
            out[f"{name}, {budget}"] = steps_of(folder), flow(folder / "weights.safetensors")

    out[f"DAFNet, {SHIPPED}"] = "–", flow(None)
    return out


def measure(
    table: str, clips: Mapping[str, Sequence[HeldClip]], runs: Path, output: Path
) -> dict[str, Any]:
    """Every system of a table on every group of clips. ``output``/measured.json is written as
    figures come; what is there is kept, for either table.
    """
    file = output / "measured.json"
    known: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    systems = systems_of(table, runs)
    for name, (steps, measuring) in systems.items():
        if name in known:
            continue
        if name == f"MoGlow, {BUDGETS[1]}":
            known[name] = known[f"MoGlow, {BUDGETS[0]}"]  # the same run
            continue

        every = [clip for group in clips.values() for clip in group]
        results, at = measuring(every), 0
        known[name] = {"steps": steps, "groups": {}}
        for group, members in clips.items():
            chosen, at = results[at : at + len(members)], at + len(members)
            settings = [key for key in results[0].runs if key != "legs"]
            known[name]["groups"][group] = {
                key: pooled_row([each.runs[key] for each in chosen]) for key in settings
            }

        output.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(known, indent=1), encoding="utf-8")

    found = {name: known[name] for name in systems}
    (output / f"{table}.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    (output / f"{table}.md").write_text(markdown(table, found), encoding="utf-8")
    return found


def _ratio_of_sums(worse: np.ndarray, better: np.ndarray) -> float:
    """Ratio of two systems' figures over clips, (N, 2) totals and weights; NaN where the second has
    none.
    """
    (a, m), (b, n) = worse.sum(0), better.sum(0)
    return float((a / m) / (b / n)) if b else float("nan")


def compare_pairs(
    clips: Mapping[str, Sequence[HeldClip]], runs: Path, output: Path, draws: int = 4000
) -> str:
    """AP-P's figures over DAFNet's in EE on the same clips, for each budget, with the 95 % interval
    of the ratio over pairs drawn anew, and in how many clips AP-P is the worse; writes
    ``output``/paired.md. What is measured is kept in paired.json.
    """
    known = _measured_pairs([clip for group in clips.values() for clip in group], runs, output)
    rng = np.random.default_rng(0)
    rows = []
    for budget in BUDGETS:
        systems = [known[f"{name}, {budget}"] for name in STEPPED]
        at = 0
        for group, members in clips.items():
            chosen, at = slice(at, at + len(members)), at + len(members)
            cells = []
            for figure, heat in product(("eed", "fs"), ("ee_t0", "ee_t1")):
                worse, better = (
                    np.array([clip[heat][_FIGURES[figure]] for clip in system[chosen]])
                    for system in systems
                )
                cells.append(_pair_cell(worse, better, rng, draws))

            rows.append([budget, group, *cells])

    head = ("budget", "clips", "EED, z = 0", "EED, temperature 1", "FS, z = 0", "FS, temperature 1")
    text = markdown_table(head, rows) + "\n"
    (output / "paired.md").write_text(text, encoding="utf-8")
    return text


def _measured_pairs(clips: Sequence[HeldClip], runs: Path, output: Path) -> dict[str, Any]:
    """Sums of each clip by run, of every compared system and budget; kept in
    ``output``/paired.json.
    """
    file = output / "paired.json"
    known: dict[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for budget, name in product(BUDGETS, STEPPED):
        if f"{name}, {budget}" not in known:
            folder = _runs_of(runs, budget) / FLOWS[name]["system"]
            weights = load_weights(folder / "weights.safetensors")
            measured = measure_clips(weights, clips, modes=("EE",), clean=False)
            known[f"{name}, {budget}"] = [
                {run: each.runs[run].sums for run in ("ee_t0", "ee_t1")} for each in measured
            ]
            file.write_text(json.dumps(known), encoding="utf-8")

    return known


def _pair_cell(worse: np.ndarray, better: np.ndarray, rng: np.random.Generator, draws: int) -> str:
    """The ratio of two systems' figures on the same clips (N, 2), its interval, and in how many
    clips the first is the worse.
    """
    drawn = rng.integers(len(worse), size=(draws, len(worse)))
    ratios = [_ratio_of_sums(worse[chosen], better[chosen]) for chosen in drawn]
    low, high = np.percentile(ratios, [2.5, 97.5])

    larger = worse[:, 0] / worse[:, 1] > better[:, 0] / better[:, 1]
    ratio = _ratio_of_sums(worse, better)
    return f"×{ratio:.2f} ({low:.2f} to {high:.2f}), {int(larger.sum())} of {len(worse)}"


def _cell(
    values: Mapping[str, Any], figure: str, ours: float | None = None, paper: float | None = None
) -> str:
    """A figure and its interval; its ratio to ``ours``, and beside it the paper's."""
    if values.get(figure) is None:
        return "–"
    low, high = values["intervals"][figure]
    ratio = f", ×{values[figure] / ours:.2f}" if ours else ""
    return f"{values[figure]:.3g} ({low:.2g} to {high:.2g}){ratio}" + (
        f" [×{paper:.2f}]" if paper else ""
    )


def _row(
    table: str, system: str, found: Mapping[str, Any], group: str, heat: str, columns: Sequence[str]
) -> list[str]:
    name, budget = system.split(", ", 1)
    printed, paper = TABLES[table]
    cells = []
    for column in columns:
        what, mode = column.split()
        figure = {**_FIGURES, **_SEATS}[what]
        values, ours = (
            found[s]["groups"][group].get(f"{mode}_{heat}", {})
            for s in (system, f"DAFNet, {budget}")
        )
        compared = name != "DAFNet" and what in _FIGURES
        theirs = None
        if name in paper and compared:
            theirs = paper[name][printed.index(column)] / paper["DAFNet"][printed.index(column)]

        cells.append(_cell(values, figure, ours.get(figure) if compared else None, theirs))

    return [system, found[system]["steps"], *cells]


def markdown(table: str, found: Mapping[str, Any]) -> str:
    """The table, a section for each group of clips and temperature: figures (95 % interval over
    clips), then the ratio to the two-part flow's of the same budget, and in brackets the paper's
    ratio.
    """
    modes = ("free",) if table == "table1" else ("free", "ee")
    columns = [*TABLES[table][0], *(f"{what} {mode}" for what in _SEATS for mode in modes)]
    parts = []
    groups = next(iter(found.values()))["groups"]
    for group, heat in product(groups, ("t0", "t1")):
        truth = groups[group]["ground_truth"]
        real = [_cell(truth, {**_FIGURES, **_SEATS}[column.split()[0]]) for column in columns]
        head = f"({truth['clips']} clips, {truth['seat_episodes']} seat episodes)"
        rows = [["**ground truth**", "–", *real]]
        rows += [_row(table, system, found, group, heat, columns) for system in found]
        parts += [
            f"### {group}, temperature {heat[1]} {head}",
            markdown_table(("", "steps", *(column.upper() for column in columns)), rows),
        ]

    return "\n\n".join(parts) + "\n"


def main(arguments: Sequence[str]) -> str:
    """Run what the arguments ask for; the table as text, nothing after a training."""
    parser = argparse.ArgumentParser(
        "dafnet bench tables",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    training = commands.add_parser("train")
    training.add_argument("dataset", type=Path)
    training.add_argument(
        "--minutes", type=float, default=20.0, help="of one core, for each system"
    )
    training.add_argument("--processes", type=int, default=None, help="else one a core")
    for name in (*TABLES, "paired"):
        commands.add_parser(name).add_argument("folder", type=Path)
    for command in commands.choices.values():
        command.add_argument("-o", "--output", type=Path, required=True, metavar="RUNS")

    options = parser.parse_args(arguments)

    if options.command == "train":
        precision.warn_if_missing(TRAINING.mixed)
        train(options.dataset, options.output, options.minutes, options.processes)
        return f"Written to {options.output}"

    clips = {
        "The paper's kinds of furniture (composed)": paper_test(options.folder),
        "Every second captured clip of unseen bodies": captured_clips(held_out(options.folder))[
            ::2
        ],
    }
    if options.command == "paired":
        return compare_pairs(clips, options.output, options.output)

    measure(options.command, clips, options.output, options.output)
    return (options.output / f"{options.command}.md").read_text(encoding="utf-8")
