"""Trains SAMP's networks, with the budget, the learning rates and the resuming of the flows (``training.train``)."""

import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch

from ..core.errors import InputError
from ..training.train import TrainingConfig, checkpoint, clock_of, dataset_pool, descend
from .samp import MotionNet, SampConfig, SampTraining, network_of

__all__ = ["load_samp", "train_samp"]


def train_samp(
    kind: str, config: SampConfig, dataset: Path, file: Path, training: TrainingConfig, threads: int = 1,
    progress: Callable[[float, float], None] = lambda share, loss: None,
) -> int:
    """Train "samp" or "samp-ob", or go on with it, until its budget is spent; the number of steps that it took.

    ``file`` is saved as it goes; a loss that is no number stops the run with the last good state kept. Raises InputError then,
    and without a dataset.
    """
    torch.set_num_threads(threads)
    torch.manual_seed(training.seed)
    pool = dataset_pool(dataset)
    run = SampTraining(kind, config, pool.statistics(), "cpu", pool)
    optimiser = torch.optim.Adam(run.network.parameters(), lr=training.peak)
    step, seconds = 0, 0.0
    if file.exists():
        state = torch.load(file, weights_only=True)
        run.network.load_state_dict(state["network"])
        optimiser.load_state_dict(state["optimiser"])
        step, seconds = state["step"], state["seconds"]
        torch.set_rng_state(state["generator"])
    clock, losses = clock_of(torch.device("cpu")), []
    while (share := training.share(step, seconds)) < 1.0:
        begin = clock()
        loss = run.loss(pool, torch.randint(len(pool), (training.batch,)), share)
        descend(run.network, optimiser, loss, training, step, share)
        losses.append(float(loss.detach()))
        step, seconds = step + 1, seconds + clock() - begin
        if step % training.save_every == 0 or training.share(step, seconds) >= 1.0:
            mean = sum(losses) / len(losses)
            if not math.isfinite(mean):
                raise InputError(f"The loss of '{kind}' is no number by step {step}; resume with a lower peak rate.")
            checkpoint(file, {
                "kind": kind, "config": asdict(config), "network": run.network.state_dict(),
                "optimiser": optimiser.state_dict(), "step": step, "seconds": seconds, "generator": torch.get_rng_state(),
            })
            progress(training.share(step, seconds), mean)
            losses.clear()
    return step


def load_samp(file: Path) -> tuple[str, MotionNet]:
    """The kind and the network of a checkpoint."""
    state = torch.load(file, weights_only=True)
    network = network_of(state["kind"], SampConfig(**state["config"]))
    network.load_state_dict(state["network"])
    return state["kind"], network
