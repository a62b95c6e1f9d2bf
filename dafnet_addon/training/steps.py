"""A step down a loss, timed: what the flows and the baselines are trained by alike."""

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import torch
from torch import Tensor, nn

from ..core.errors import InputError
from ..data.dataset.prepare import bank_in
from . import ranks
from .batches import Pool
from .config import TrainingConfig

__all__ = ["clock_of", "dataset_pool", "descend", "held_out_pool", "mean_loss"]


def dataset_pool(dataset: Path, device: str = "cpu") -> Pool:
    """The training windows of a dataset. Raises InputError where there are none."""
    pool = Pool(
        lambda: sorted(dataset.glob("pool-????.npz")), torch.device(device), bank_in(dataset)
    )
    if not len(pool):
        raise InputError(
            f"The dataset '{dataset}' holds no windows; make it with 'dafnet prepare'."
        )

    return pool


def held_out_pool(dataset: Path, device: str = "cpu") -> Pool:
    """The windows of a dataset that nothing is trained on."""
    return Pool(lambda: [dataset / "held.npz"], torch.device(device), bank_in(dataset))


def clock_of(device: torch.device) -> Callable[[], float]:
    """Gives the seconds that a budget is spent by: a processor's own, so that other work takes
    nothing from the training; of other devices those on the wall.
    """
    if device.type != "cpu":
        return time.monotonic
    return lambda: time.process_time() / torch.get_num_threads()


def descend(
    network: nn.Module,
    optimiser: torch.optim.Optimizer,
    loss: Tensor,
    config: TrainingConfig,
    step: int,
    share: float,
) -> None:
    """One step down a loss, after ``step`` others, ``share`` of the budget being spent; the same on
    all ranks.
    """
    for group in optimiser.param_groups:
        group["lr"] = config.rate(step, share)

    optimiser.zero_grad()
    loss.backward()
    if step == 0:
        ranks.broadcast_parameters(network)

    ranks.average([p.grad for p in network.parameters() if p.grad is not None])
    nn.utils.clip_grad_norm_(network.parameters(), config.clip_norm)
    optimiser.step()


def mean_loss(losses: Sequence[Tensor], part: str, step: int, device: torch.device) -> float:
    """The mean of the last steps' losses, over all ranks. Raises InputError where it is not a
    number.
    """
    mean = ranks.mean(float(torch.stack(list(losses)).mean()), device)
    if not math.isfinite(mean):
        raise InputError(
            f"The loss of '{part}' is not a number by step {step}; resume with a lower peak rate."
        )
    return mean
