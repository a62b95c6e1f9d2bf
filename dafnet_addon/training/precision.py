"""Mixed precision only where a device has it, found by trying: processors differ in which
operations know bfloat16.
"""

import sys
from functools import cache

import torch
from torch import nn

__all__ = ["warn_if_missing", "is_available"]


@cache
def is_available(device: str) -> bool:
    """Whether LSTMs compute in bfloat16 on a device, there and back: one of two layers is run once,
    on a few numbers.

    Without AVX-512 a processor has no such LSTM, and what else of bfloat16 it has is slower there
    than single precision.
    """
    kind = torch.device(device).type
    with torch.random.fork_rng(devices=[]):
        lstm = nn.LSTM(8, 8, 2, batch_first=True).to(device)

    try:
        with torch.autocast(kind, torch.bfloat16):
            hidden, state = lstm(torch.ones(2, 3, 8, device=device))
            again, _ = lstm(torch.ones(2, 3, 8, device=device), state)
        (hidden.float() + again.float()).sum().backward()
    except RuntimeError:
        return False

    return all(bool(p.grad.isfinite().all()) for p in lstm.parameters() if p.grad is not None)


def warn_if_missing(mixed: bool, device: str = "cpu") -> None:
    """Tell the user, in one line on standard error, where the mixed precision that was asked for is
    not to be had.
    """
    if mixed and not is_available(device):
        print(
            "This device has no LSTM in bfloat16: it trains in single precision, in more time a "
            "step.",
            file=sys.stderr,
        )
