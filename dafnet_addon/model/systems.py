"""The flows that a configuration may name: DAFNet's, and those that it is compared with (paper,
section 6.2, Table 2).

AP-P has one flow for the whole body, given what DAFNet's are: action probabilities π, root
velocity, environment code, observation c_ob. MoGlow (Henter et al. 2020) has no action predictor;
it is given the scene feature s itself, ten past poses and eleven velocities, beside environment
code and c_ob. Poses are in the model's order, the upper body first, so the first half of a step's
pose is 33 of its 42 values.

The lower body first is a baseline for one half of the paper's outlook (section 7): both parts are
given what DAFNet's are, but when the upper body is made the observation's lower slots hold the
lower one just made. Feet and legs that are asked for do not need it: each part of DAFNet is given
the observation of the whole body.
"""

from ..core.errors import InputError
from ..core.network import DAFNET, System
from ..core.sampler import Sampler
from ..core.skeleton import LOWER_THEN_UPPER, WHOLE_BODY
from ..core.weights import Weights

__all__ = ["SYSTEMS", "sampler_of", "system_named"]

SYSTEMS = {
    system.name: system
    for system in (
        DAFNET,
        System("lower-first", LOWER_THEN_UPPER, predicts=True),
        System("ap-p", WHOLE_BODY, predicts=True),
        System("moglow", WHOLE_BODY, predicts=False),
    )
}


def system_named(name: str) -> System:
    """Raises InputError where there is none of this name."""
    if name not in SYSTEMS:
        raise InputError(f"The system '{name}' is unknown; use one of {', '.join(SYSTEMS)}.")
    return SYSTEMS[name]


def sampler_of(weights: Weights, device: str | None = None, dtype: str = "float32") -> Sampler:
    """The sampler of the system that the weights are of. Raises WeightsError where the file does
    not fit it.
    """
    model = weights.config.get("model")
    name = model.get("system") if isinstance(model, dict) else None
    system = SYSTEMS.get(name, DAFNET) if isinstance(name, str) else DAFNET
    return Sampler(weights, device, dtype, system)
