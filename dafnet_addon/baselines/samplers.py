"""Runs the flows that DAFNet is compared with (``flows``), by the core's sampler with other parts
or told of other things.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.sampler import Sampler
from ..core.weights import Weights
from ..model.config import POSE_SIZE, VELOCITY_SIZE

__all__ = ["LowerFirstSampler", "MoGlowSampler", "WholeBodySampler", "sampler_of"]


class WholeBodySampler(Sampler):
    """Runs AP-P: one part for the whole body."""

    systems = ("ap-p",)
    parts = {"whole": slice(0, POSE_SIZE)}


class MoGlowSampler(WholeBodySampler):
    """Runs MoGlow, which is told its own past poses at each frame, and no actions."""

    systems = ("moglow",)

    def _read_told(self, array: Callable[..., np.ndarray], c: dict[str, int]) -> None:
        self.actions = 0
        self.fresh, self.moving = self.history * POSE_SIZE, (self.history + 1) * VELOCITY_SIZE

    def _told_ahead(self, window: np.ndarray, moving: np.ndarray, occupancy: Any) -> Any:
        return self._to(window)

    def _told(self, frame: int) -> Any:
        return self._past


class LowerFirstSampler(Sampler):
    """Runs the lower body's flow, then the upper's."""

    systems = ("lower-first",)
    parts = {name: Sampler.parts[name] for name in ("lower", "upper")}


_SAMPLERS = {
    "dafnet": Sampler,
    "lower-first": LowerFirstSampler,
    "ap-p": WholeBodySampler,
    "moglow": MoGlowSampler,
}


def sampler_of(weights: Weights, device: str | None = None) -> Sampler:
    """The sampler of the system that the weights are of. Raises WeightsError where the file does
    not fit it.
    """
    model = weights.config.get("model")
    system = model.get("system", "dafnet") if isinstance(model, dict) else "dafnet"
    known = isinstance(system, str) and system in _SAMPLERS
    return (_SAMPLERS[system] if known else Sampler)(weights, device)
