"""Trains SAMP's networks, with the budget, the learning rates and the resuming of the flows
(``training.steps``).
"""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch
from torch import Tensor

from ..training.checkpoints import Checkpoint, generators, training_tensors, write_checkpoint
from ..training.config import TrainingConfig
from ..training.steps import clock_of, dataset_pool, descend, mean_loss
from .samp import KINDS, MotionNet, SampConfig, SampTraining, network_of

__all__ = ["load_samp", "train_samp"]


def train_samp(
    kind: str,
    config: SampConfig,
    dataset: Path,
    file: Path,
    training: TrainingConfig,
    threads: int = 1,
    progress: Callable[[float, float], None] = lambda share, loss: None,
) -> int:
    """Train "samp" or "samp-ob", or go on with it, until its budget is spent; the number of steps
    that it took.

    ``file`` is saved as it goes; a loss that is not a number stops the run with the last good state
    kept. Raises InputError then, without a dataset, and where ``file`` is another network's.
    """
    torch.set_num_threads(threads)
    torch.manual_seed(training.seed)
    pool = dataset_pool(dataset)
    device = torch.device("cpu")

    run = SampTraining(kind, config, pool.statistics(), device, pool)
    optimiser = torch.optim.Adam(run.network.parameters(), lr=training.peak)
    step, seconds = 0, 0.0
    if file.exists():
        kept = Checkpoint.read(file)
        kept.restore(run.network, optimiser)
        step, seconds = kept.progress()
        kept.set_generators(device)

    clock: Callable[[], float] = clock_of(device)
    losses: list[Tensor] = []
    while (share := training.share(step, seconds)) < 1.0:
        begin = clock()
        loss = run.loss(pool, torch.randint(len(pool), (training.batch,)), share)
        descend(run.network, optimiser, loss, training, step, share)
        losses.append(loss.detach())
        step, seconds = step + 1, seconds + clock() - begin
        if step % training.save_every == 0 or training.share(step, seconds) >= 1.0:
            mean = mean_loss(losses, kind, step, device)
            drawn = {f"generator.{name}": state for name, state in generators(device).items()}
            state = {"kind": kind, "config": asdict(run.config), "step": step, "seconds": seconds}
            write_checkpoint(file, {**training_tensors(run.network, optimiser), **drawn}, state)
            progress(training.share(step, seconds), mean)
            losses.clear()

    return step


def load_samp(file: Path) -> tuple[str, MotionNet]:
    """The kind and the network of a checkpoint. Raises InputError where it is none of SAMP's, or
    damaged.
    """
    kept = Checkpoint.read(file)
    if kept.state.get("kind") not in KINDS:
        raise kept.refused("it holds none of SAMP's networks")

    kind, config = kept.text("kind"), kept.settings(SampConfig, "config")
    with torch.device("meta"):
        kept.fits(network_of(kind, config))

    network = network_of(kind, config)
    kept.restore(network)
    return kind, network
