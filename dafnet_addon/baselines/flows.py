"""The flows that DAFNet is compared with: one for the whole body (paper, section 6.2, Table 2), or
its two in the other order.

AP-P is told what DAFNet is: action probabilities π, root velocity, environment code, observation
c_ob. MoGlow (Henter et al. 2020) has no action predictor; it is told the scene feature s itself,
ten past poses and eleven velocities, beside environment code and c_ob. Poses are in the model's
order, the upper body first, so the first half of a step's pose is 33 of its 42 values.

The lower body first is the paper's outlook (section 7): both parts are told what DAFNet's are, but
the observation's lower slots, which no user gives, hold the lower body just made when the upper is
made.
"""

from ..core.errors import InputError
from ..model.config import ModelConfig
from ..model.flow import BodyFlow, PartFlow, TwoPartFlow
from .samplers import LowerFirstSampler, WholeBodySampler

__all__ = ["LowerFirstFlow", "WholeFlow", "flow_of", "parts_of"]


class WholeFlow(BodyFlow):
    """One flow of ``steps_whole`` steps for all 66 values of a pose; ``config.system`` is "ap-p" or
    "moglow".

    ``base`` is [π, velocity] (B, T, K + 3) of AP-P, the scene feature's [past poses, velocities]
    (B, T, 693) of MoGlow.
    """

    places = WholeBodySampler.parts
    whole: PartFlow


class LowerFirstFlow(TwoPartFlow):
    """The lower body's flow, then the upper's, whose observation is updated by the lower body."""

    places = LowerFirstSampler.parts


_FLOWS: dict[str, type[BodyFlow]] = {
    "dafnet": TwoPartFlow,
    "lower-first": LowerFirstFlow,
    "ap-p": WholeFlow,
    "moglow": WholeFlow,
}


def _kind_of(config: ModelConfig) -> type[BodyFlow]:
    if config.system not in _FLOWS:
        raise InputError(
            f"The system '{config.system}' is unknown; use one of {', '.join(_FLOWS)}."
        )
    return _FLOWS[config.system]


def parts_of(config: ModelConfig) -> tuple[str, ...]:
    """The parts of the configuration's system, in the order of sampling. Raises InputError where it
    is unknown.
    """
    return tuple(_kind_of(config).places)


def flow_of(config: ModelConfig) -> BodyFlow:
    """The untrained flow of the configuration's system. Raises InputError where that is unknown."""
    return _kind_of(config)(config)
