"""The array library that a model runs on: NumPy, or torch where it is installed."""

from types import ModuleType
from typing import Any

import numpy as np

from .errors import InputError
from .text import printable

__all__ = ["Array", "Backend"]

Array = Any
"""A numpy.ndarray or a torch.Tensor."""


class Backend:
    """One array library, on one device, in one precision.

    ``device`` is None for NumPy, else a torch device ('cpu', 'cuda', …). ``dtype``: 'float32' or
    'float64'. ``xp``: the library's module, whose functions of arrays have NumPy's names.

    Raises InputError where torch, or the device, is missing.
    """

    def __init__(self, device: str | None = None, dtype: str = "float32") -> None:
        self.device = device
        self.dtype = dtype
        self.xp: ModuleType = np
        if device is not None:
            self.xp = _torch_on(device)

    def array(self, values: np.ndarray) -> Array:
        """The values as an array of this library."""
        values = np.ascontiguousarray(values, dtype=self.dtype)
        return values if self.device is None else self.xp.as_tensor(values, device=self.device)

    def numpy(self, array: Array) -> np.ndarray:
        """An array of this library as NumPy's."""
        return array if self.device is None else array.cpu().numpy()

    def sigmoid(self, x: Array) -> Array:
        return 0.5 * self.xp.tanh(0.5 * x) + 0.5

    def softmax(self, x: Array) -> Array:
        """Along the last axis of (B, K)."""
        x = self.xp.exp(x - self.xp.amax(x, -1)[:, None])
        return x / x.sum(-1)[:, None]


def _torch_on(device: str) -> ModuleType:
    """The module torch, if it can use this device."""
    try:
        import torch

        torch.zeros(1, device=device)
    except ImportError:
        raise InputError(
            "PyTorch is not installed in this Python; leave the device out, and NumPy is used."
        ) from None
    except (RuntimeError, AssertionError) as error:  # torch asserts that it was built for a device
        reason = printable(str(error).split("\n")[0].rstrip("."), 200)
        raise InputError(
            f"The device '{printable(device, 40)}' cannot be used ({reason}); name another, or "
            "none for NumPy."
        ) from None

    return torch
