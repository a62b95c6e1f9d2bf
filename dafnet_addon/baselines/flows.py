"""The flows that the paper compares with (section 6.2, Table 2): one for the whole body, where DAFNet has one a part.

AP-P is told what DAFNet is: action probabilities π, root velocity, environment code, observation c_ob. MoGlow (Henter et al.
2020) has no action predictor; it is told the scene feature s itself, ten past poses and eleven velocities, beside environment
code and c_ob. Poses are in the model's order, the upper body first, so the first half of a step's pose is 33 of its 42 values.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ..core.sampler import Sampler
from ..core.weights import Weights
from ..model.config import POSE_SIZE, VELOCITY_SIZE, ModelConfig
from ..model.flow import PartFlow

__all__ = ["MoGlowSampler", "WholeBodySampler", "WholeFlow", "sampler_of"]


class WholeFlow(nn.Module):
    """One flow of ``steps_whole`` steps for all 66 values of a pose; ``config.system`` is "ap-p" or "moglow"."""

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        self.whole = PartFlow(POSE_SIZE, config.steps_whole, config)

    def parts(self) -> dict[str, PartFlow]:
        """The flows by name, in the order of sampling."""
        return {"whole": self.whole}

    def condition(self, told: Tensor, observation: Tensor, given: Tensor) -> Tensor:
        """What the flow is told beside the environment (B, T, …).

        ``told``: [π, velocity] (B, T, K + 3) of AP-P, the scene feature's [past poses, velocities] (B, T, 693) of MoGlow.
        ``observation`` (B, T, 66), ``given`` (B, T, 22).
        """
        return torch.cat([told, observation, given] if self.config.mask else [told, observation], dim=-1)


class WholeBodySampler(Sampler):
    """Runs AP-P: the core's sampler with the one part."""

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


_SAMPLERS = {"dafnet": Sampler, "ap-p": WholeBodySampler, "moglow": MoGlowSampler}


def sampler_of(weights: Weights, device: str | None = None) -> Sampler:
    """The sampler of the system that the weights are of. Raises WeightsError where the file does not fit it."""
    model = weights.config.get("model")
    system = model.get("system", "dafnet") if isinstance(model, dict) else "dafnet"
    return _SAMPLERS.get(system, Sampler)(weights, device)
