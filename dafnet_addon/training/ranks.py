"""Training on several devices: each rank of ``torchrun`` draws its own windows; gradients are
averaged, rank 0 saves.
"""

import os

import torch
import torch.distributed as dist
from torch import Tensor, nn

from ..core.errors import InputError

__all__ = ["is_distributed", "rank", "device_of", "average", "mean", "broadcast_parameters"]


def is_distributed() -> bool:
    """Whether ``torchrun`` started this process with others; joins them at the first call."""
    if int(os.environ.get("WORLD_SIZE", "1")) < 2:
        return False
    if not dist.is_initialized():
        # Tensors on a processor are averaged by Gloo, even where there are GPUs.
        dist.init_process_group("cpu:gloo,cuda:nccl" if torch.cuda.is_available() else "gloo")
    return True


def rank() -> int:
    """This process's number; 0 where it is alone."""
    return dist.get_rank() if is_distributed() else 0


def device_of(device: str) -> str:
    """The device of this rank: the one asked for, where that is 'cuda' the one that ``torchrun``
    gave it.

    Raises InputError where it is not there.
    """
    device = f"cuda:{os.environ['LOCAL_RANK']}" if device == "cuda" and is_distributed() else device
    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:  # torch asserts that it was built for a device
        reason = str(error).split("\n")[0].rstrip(".")
        raise InputError(
            f"The device '{device}' cannot be used ({reason}); name another, 'cpu' for one."
        ) from None

    return device


def average(values: list[Tensor]) -> None:
    """Replace tensors by their means over all ranks."""
    if is_distributed():
        for value in values:
            dist.all_reduce(value)
            value /= dist.get_world_size()


def mean(value: float, device: torch.device) -> float:
    """The mean of a number over all ranks."""
    if not is_distributed():
        return value
    shared = torch.tensor(value, device=device)
    average([shared])
    return float(shared)


def broadcast_parameters(network: nn.Module) -> None:
    """Give every rank rank 0's parameters: the first batch, which sets activation norms, is another
    one on each.
    """
    if is_distributed():
        for parameter in network.parameters():
            dist.broadcast(parameter.data, 0)
