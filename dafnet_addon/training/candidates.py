"""Weights out of a run that may still be training: as it stands, or with its rate brought down.

The run itself is only read. Checkpoints are replaced as a whole, so that a copy of one is whole at
any time.
"""

import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..core.errors import InputError
from ..model.config import ModelConfig
from ..model.flow import BodyFlow
from ..model.predictor import ActionPredictor
from ..model.systems import system_named
from .batches import Statistics
from .checkpoints import Checkpoint, checkpoint_file
from .export import export
from .noise import take_noise
from .parts import load_run, saved_runs, trained_networks, uncooled_run
from .steps import dataset_pool
from .train import train

__all__ = ["cool", "has_weights", "provenance", "snapshot", "write_networks", "write_weights"]


@contextmanager
def snapshot(folder: Path) -> Iterator[Path]:
    """A copy of a run's latest checkpoints, a run's folder of its own, there until the block ends.

    Raises InputError where a part of the flow has none yet.
    """
    with TemporaryDirectory(prefix="dafnet-") as name:
        copy = Path(name)
        for part in _parts(folder):
            shutil.copyfile(checkpoint_file(folder, part), checkpoint_file(copy, part))
        yield copy


def has_weights(folder: Path) -> bool:
    """Whether a run has a checkpoint of every part of its flow."""
    return bool(_parts_there(folder))


def _parts(folder: Path) -> tuple[str, ...]:
    """The networks of a run, the predictor first. Raises InputError where one has no checkpoint
    yet.
    """
    parts = _parts_there(folder)
    if not parts:
        raise InputError(
            f"The run '{folder}' has no weights of the whole flow yet; try again when it is "
            "training the flow, or give another folder."
        )
    return parts


def _parts_there(folder: Path) -> tuple[str, ...]:
    for part in ("upper", "lower", "whole"):
        file = checkpoint_file(folder, part)
        if file.exists():
            model = Checkpoint.read(file).settings(ModelConfig, "model")
            flow = system_named(model.system).partition
            parts = (*(("predictor",) if model.predicts else ()), *flow)
            if all(checkpoint_file(folder, each).exists() for each in parts):
                return parts

    return ()


def write_weights(folder: Path, dataset: Path, file: Path, device: str = "cpu") -> None:
    """Write the averaged weights of a run's latest checkpoints, with what ``provenance`` says
    of them. How far takes differ is measured on ``device``.
    """
    write_networks(trained_networks(folder), dataset, file, provenance(folder, dataset), device)


def write_networks(
    trained: tuple[BodyFlow, ActionPredictor | None, Statistics],
    dataset: Path,
    file: Path,
    words: Mapping[str, str],
    device: str = "cpu",
) -> None:
    """Write a flow, its predictor and statistics, with ``words`` about them (see ``export``). How
    far takes differ is measured on ``device``.
    """
    flow, predictor, statistics = trained
    networks = [network for network in (flow, predictor) if network is not None]

    for network in networks:
        network.to(device)
    noise = take_noise(flow, predictor, dataset_pool(dataset, device), statistics)
    for network in networks:
        network.cpu()

    export(file, flow, predictor, statistics, words, noise)


def provenance(folder: Path, dataset: Path) -> dict[str, str]:
    """What a weights file says of its making, as metadata: licence, data, training, and what it was
    ``told`` of the body.
    """
    runs = saved_runs(folder)
    training: dict[str, Any] = {
        part: {"steps": run.step, "minutes": round(run.seconds / 60, 1)}
        for part, run in runs.items()
    }
    last = list(runs.values())[-1]
    if last.adopted:
        training["begun_with"] = last.adopted

    told = ["head", "hands", "upper-body", *(["legs"] if last.config.legs_given else [])]
    return {
        "told": " ".join(told),
        "licence": "CC-BY-4.0; provenance in LICENSE-WEIGHTS.md",
        "data": (dataset / "dataset.json").read_text(encoding="utf-8"),
        "training": json.dumps({**training, "settings": asdict(last.config)}),
    }


def cool(
    folder: Path,
    dataset: Path,
    out: Path,
    minutes: float,
    device: str = "cpu",
) -> Path:
    """Train a copy of a run for ``minutes`` more a part, in which its rate falls from its peak to
    the last: the weights file in the folder ``out``. A copy that was begun there is resumed.

    The copy begins where the run is now; where its own rate has begun to fall, before it did.
    Raises InputError where the run has no weights of the whole flow yet.
    """
    if not checkpoint_file(out, _parts(folder)[-1]).exists():
        _begin_cooling(folder, out, minutes)
    begun = load_run(_parts(out)[-1], out)
    train(dataset, out, begun.model, begun.config, device=device)
    file = out / f"{begun.model.system}.safetensors"
    write_weights(out, dataset, file, device)
    return file


def _begin_cooling(folder: Path, out: Path, minutes: float) -> None:
    """Make the folder ``out``, whole or not at all: a run whose rate falls over ``minutes``."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"'{out}' holds something else than a cooling run; give another folder.")

    # The predictor is done, and the flow has learnt with what it is.
    runs = [
        load_run(part, folder) if part == "predictor" else uncooled_run(part, folder)
        for part in _parts(folder)
    ]
    budget = max(run.seconds for run in runs if run.part != "predictor") / 60.0 + minutes
    beside = out.with_name(f".{out.name}.part")
    shutil.rmtree(beside, ignore_errors=True)
    for run in runs:
        run.config = replace(
            run.config, steps_flow=0, minutes_flow=budget, cool_down=minutes / budget
        )
        run.folder = beside
        run.save()

    beside.replace(out)
