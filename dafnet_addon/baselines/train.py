"""Trains SAMP's networks, with the budget, the learning rates and the resuming of the flows (``training.train``)."""

import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch
from torch import nn

from ..core.errors import InputError
from ..training.train import TrainingConfig, clock_of, dataset_pool
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
        # The checkpoint is the trainer's own file.
        state = torch.load(file, weights_only=False)
        run.network.load_state_dict(state["network"])
        optimiser.load_state_dict(state["optimiser"])
        step, seconds = state["step"], state["seconds"]
        torch.set_rng_state(state["generator"])
    clock, losses = clock_of(torch.device("cpu")), []
    while (share := training.share(step, seconds)) < 1.0:
        begin = clock()
        for group in optimiser.param_groups:
            group["lr"] = training.rate(step, share)
        loss = run.loss(pool, torch.randint(len(pool), (training.batch,)), share)
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(run.network.parameters(), training.clip_norm)
        optimiser.step()
        losses.append(float(loss.detach()))
        step, seconds = step + 1, seconds + clock() - begin
        if step % training.save_every == 0 or training.share(step, seconds) >= 1.0:
            mean = sum(losses) / len(losses)
            if not math.isfinite(mean):
                raise InputError(f"The loss of '{kind}' is no number by step {step}; resume with a lower peak rate.")
            _save(file, kind, config, run.network, optimiser, step, seconds)
            progress(training.share(step, seconds), mean)
            losses.clear()
    return step


def _save(
    file: Path, kind: str, config: SampConfig, network: MotionNet, optimiser: torch.optim.Optimizer, step: int, seconds: float
) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    state = {
        "kind": kind, "config": asdict(config), "network": network.state_dict(), "optimiser": optimiser.state_dict(),
        "step": step, "seconds": seconds, "generator": torch.get_rng_state(),
    }
    part = file.with_suffix(".part")
    torch.save(state, part)
    part.rename(file)


def load_samp(file: Path) -> tuple[str, MotionNet, int]:
    """The kind, the network and the steps of a checkpoint."""
    state = torch.load(file, weights_only=False)
    network = network_of(state["kind"], SampConfig(**state["config"]))
    network.load_state_dict(state["network"])
    return state["kind"], network, state["step"]
