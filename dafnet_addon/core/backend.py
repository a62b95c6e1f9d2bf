"""The array library that a model runs on: NumPy, or torch where it is installed."""

from types import ModuleType
from typing import Any

import numpy as np

__all__ = ["Array", "Backend"]

Array = Any
"""A numpy.ndarray or a torch.Tensor."""


class Backend:
    """One array library, on one device, in one precision.

    ``device`` is None for NumPy, else a torch device ('cpu', 'cuda', …). ``dtype``: 'float32' or
    'float64'. ``xp``: the library's module, whose functions of arrays have NumPy's names.
    """

    def __init__(self, device: str | None = None, dtype: str = "float32") -> None:
        self.device = device
        self.dtype = dtype
        self.xp: ModuleType = np
        if device is not None:
            import torch

            self.xp = torch

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
