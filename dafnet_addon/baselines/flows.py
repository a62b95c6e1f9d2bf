"""The flows that DAFNet is compared with: one for the whole body (paper, section 6.2, Table 2), or its two in the other order.

AP-P is told what DAFNet is: action probabilities π, root velocity, environment code, observation c_ob. MoGlow (Henter et al.
2020) has no action predictor; it is told the scene feature s itself, ten past poses and eleven velocities, beside environment
code and c_ob. Poses are in the model's order, the upper body first, so the first half of a step's pose is 33 of its 42 values.

The lower body first is the paper's outlook (section 7): both parts are told what DAFNet's are, but the observation's lower
slots, which no user gives, hold the lower body just made when the upper is made.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.sampler import Sampler
from ..core.weights import Weights
from ..model.config import POSE_SIZE, VELOCITY_SIZE, ModelConfig
from ..model.flow import BodyFlow, PartFlow, TwoPartFlow

__all__ = ["LowerFirstFlow", "LowerFirstSampler", "MoGlowSampler", "WholeBodySampler", "WholeFlow", "flow_of", "sampler_of"]


class WholeFlow(BodyFlow):
    """One flow of ``steps_whole`` steps for all 66 values of a pose; ``config.system`` is "ap-p" or "moglow".

    ``base`` is [π, velocity] (B, T, K + 3) of AP-P, the scene feature's [past poses, velocities] (B, T, 693) of MoGlow.
    """

    places = {"whole": slice(0, POSE_SIZE)}
    whole: PartFlow


class WholeBodySampler(Sampler):
    """Runs AP-P: the core's sampler with the one part."""

    systems = ("ap-p",)
    parts = WholeFlow.places


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


class LowerFirstFlow(TwoPartFlow):
    """The lower body's flow, then the upper's, whose observation is updated by the lower body."""

    places = {name: TwoPartFlow.places[name] for name in ("lower", "upper")}


class LowerFirstSampler(Sampler):
    """Runs the lower body's flow, then the upper's."""

    systems = ("lower-first",)
    parts = LowerFirstFlow.places


_FLOWS: dict[str, type[BodyFlow]] = {
    "dafnet": TwoPartFlow, "lower-first": LowerFirstFlow, "ap-p": WholeFlow, "moglow": WholeFlow,
}
_SAMPLERS = {"dafnet": Sampler, "lower-first": LowerFirstSampler, "ap-p": WholeBodySampler, "moglow": MoGlowSampler}


def flow_of(config: ModelConfig) -> BodyFlow:
    """The untrained flow of the configuration's system. Raises InputError where that is unknown."""
    if config.system not in _FLOWS:
        raise InputError(f"The system '{config.system}' is unknown; use one of {', '.join(_FLOWS)}.")
    return _FLOWS[config.system](config)


def sampler_of(weights: Weights, device: str | None = None) -> Sampler:
    """The sampler of the system that the weights are of. Raises WeightsError where the file does not fit it."""
    model = weights.config.get("model")
    system = model.get("system", "dafnet") if isinstance(model, dict) else "dafnet"
    return _SAMPLERS.get(system, Sampler)(weights, device)
