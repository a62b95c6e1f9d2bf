"""Trains the action predictor, then the two-part flow on top of it (paper, section 5.1, figure 7).

A run lives in a folder: ``predictor.checkpoint``, ``upper.checkpoint``, ``lower.checkpoint`` (each
resumes exactly where it was saved), ``log.jsonl``, and ``tensorboard``. Time, not steps, is the
budget: the learning rate stays, and falls as the last of the minutes are spent. A run that gets
more of them goes on from before it fell, so that a training may run for days and give weights at
any time.
"""

import json
import time
from collections.abc import Callable
from concurrent.futures import wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from ..core.errors import InputError
from ..core.threads import cores
from ..core.weights import Weights
from ..model.config import ModelConfig
from ..model.systems import system_named
from . import ranks
from .batches import Pool
from .checkpoints import BEFORE_COOLING, checkpoint_file
from .config import TrainingConfig
from .export import adopted_statistics
from .parts import FlowRun, PredictorRun, load_run, new_run, resumed_run
from .processes import new_processes
from .run import Run
from .steps import clock_of, dataset_pool, descend, held_out_pool, mean_loss

__all__ = ["train", "train_part"]

_LOGGED = ("loss", "held_out", "windows")


def train(
    dataset: Path,
    folder: Path,
    model: ModelConfig,
    config: TrainingConfig,
    progress: Callable[[float], None] = lambda share: None,
    device: str = "cpu",
    begin_with: Weights | None = None,
) -> None:
    """Train the predictor, then the parts of the flow, each in a process of its own; what a folder
    holds is resumed.

    What is new begins with what the weights ``begin_with`` have learnt, where given.

    Under ``torchrun`` all processes train one part after another, together.
    """
    train_one = partial(
        train_part,
        dataset=dataset,
        folder=folder,
        model=model,
        config=config,
        device=device,
        begin_with=begin_with,
    )
    minutes = max(config.minutes_predictor + config.minutes_flow, 1e-9)
    first = config.minutes_predictor / minutes
    if model.predicts:
        train_one("predictor", progress=lambda part, share, loss: progress(first * share))

    parts = tuple(system_named(model.system).partition)
    if ranks.is_distributed():
        for part in parts:
            train_one(part)
        return

    threads = max(1, min(torch.get_num_threads(), cores()) // len(parts))
    with new_processes(len(parts)) as pool:
        begin = time.monotonic()
        jobs = [pool.submit(train_one, part, threads=threads) for part in parts]
        while wait(jobs, timeout=2.0).not_done:
            progress(first + (1.0 - first) * config.share(0, time.monotonic() - begin))

        try:
            for job in jobs:
                job.result()
        except BrokenProcessPool:
            raise InputError(
                "A process of the training was ended from outside, for want of memory perhaps; "
                "give the same command again, and it goes on from its last checkpoint."
            ) from None


def train_part(
    part: str,
    dataset: Path,
    folder: Path,
    model: ModelConfig,
    config: TrainingConfig,
    threads: int | None = None,
    progress: Callable[[str, float, float], None] = lambda part, share, loss: None,
    device: str = "cpu",
    begin_with: Weights | None = None,
) -> Run:
    """Train one part, or go on with it, until its budget is spent.

    Raises InputError without a dataset, for a device that cannot be used, and where a part of other
    sizes was begun there.

    A new run begins with what ``begin_with`` has learnt, where given: weights of the same or
    smaller sizes. A loss that is not a number stops the run with the last good checkpoint kept.
    Shards that 'prepare' is still writing are taken in as they come.
    """
    if threads is not None:
        torch.set_num_threads(threads)

    device = ranks.device_of(device)
    torch.backends.cuda.matmul.allow_tf32 = True
    pool, held = dataset_pool(dataset, device), held_out_pool(dataset, device)

    predictor = None
    if part != "predictor" and model.predicts:
        predictor = load_run("predictor", folder, device=device)

    if checkpoint_file(folder, part).exists():
        run = resumed_run(part, folder, config, device)
        _require_same_model(run, model)
    else:
        # All parts are standardised alike, whatever shards there were when each began.
        statistics = pool.statistics() if predictor is None else predictor.statistics
        if begin_with is not None:
            statistics = adopted_statistics(begin_with, statistics)

        run = new_run(part, folder, model, config, statistics, device)
        if begin_with is not None:
            run.adopt(begin_with)
        if ranks.rank() == 0:
            run.save()

    if ranks.rank():
        torch.manual_seed(hash((config.seed, run.step, ranks.rank())) % 2**31)

    if isinstance(predictor, PredictorRun) and isinstance(run, FlowRun):
        with predictor.with_average():
            run.use_predictor(predictor.network.predictor)

    _spend_budget(run, pool, held, progress)
    return run


def _require_same_model(run: Run, model: ModelConfig) -> None:
    """Raise InputError where a run trains another model than this."""
    own, wanted = run.model.as_dict(), model.as_dict()
    differing = [
        f"{name} {own[name]}, not {value}" for name, value in wanted.items() if own[name] != value
    ]
    if differing:
        raise InputError(
            f"The run '{run.folder}' was begun with other settings ({'; '.join(differing)}); train "
            "in another folder."
        )


def _spend_budget(
    run: Run, pool: Pool, held: Pool, progress: Callable[[str, float, float], None]
) -> None:
    """Train a run until its budget is spent, and save it as it goes."""
    leads = ranks.rank() == 0
    curves = _tensorboard(run.folder / "tensorboard" / run.part) if leads else None
    clock = clock_of(run.device)
    recent: list[Tensor] = []

    while run.share < 1.0:
        begin, was_cooling = clock(), run.is_cooling
        recent.append(_step(run, pool))

        saves = run.step % run.config.save_every == 0
        if saves:
            torch.stack(recent).mean().item()  # what a device still has to do is counted too

        run.seconds = ranks.mean(run.seconds + clock() - begin, run.device)
        if run.is_cooling and not was_cooling and leads:
            run.save(f"{run.part}{BEFORE_COOLING}")

        if saves or run.share >= 1.0:
            loss = mean_loss(recent, run.part, run.step, run.device)
            with run.with_average():
                held_out = run.held_out_loss(held)

            if leads:
                progress(run.part, run.share, loss)
                run.save()
                _log(run, {"loss": loss, "held_out": held_out, "windows": len(pool)}, curves)

            recent.clear()
            pool.refresh()


def _step(run: Run, pool: Pool) -> Tensor:
    """One step on windows drawn at random; its loss."""
    run.prepare(pool)
    rows = torch.randint(len(pool), (run.config.batch,))
    batch = pool.batch(rows, run.statistics, run.model)
    loss = run.loss(batch, initialise=run.step == 0 and not run.adopted)

    descend(run.network, run.optimiser, loss, run.config, run.step, run.share)
    run.step += 1
    run.average()
    return loss.detach()


def _log(run: Run, values: dict[str, float], curves: Any) -> None:
    """Add a line to the run's log, and points to its curves, where TensorBoard is installed.

    To be called after the run was saved: what a killed process had not saved is logged once, by the
    next one.
    """
    place = {"part": run.part, "step": run.step, "minutes": run.seconds / 60}
    with (run.folder / "log.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps({**place, **values}) + "\n")

    if curves is not None:
        for name in _LOGGED:
            curves.add_scalar(name, values[name], run.step)


def _tensorboard(folder: Path) -> Any:
    """What writes a run's curves for TensorBoard; None where that is not installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(str(folder))
