"""Sizes of the model. A configuration travels inside the weights file that was made with it."""

from dataclasses import asdict, dataclass

from ..core.root import AHEAD
from ..core.sensor import SPHERES
from ..core.skeleton import JOINTS, POSE_SIZE
from .systems import SYSTEMS

__all__ = [
    "ModelConfig",
    "PAPER",
    "SMALL",
    "VELOCITY_SIZE",
    "AHEAD_SIZE",
    "SENSOR_SIZE",
]

VELOCITY_SIZE = 3
AHEAD_SIZE = 3 * len(AHEAD)
SENSOR_SIZE = len(SPHERES)

_MAX_SIZES = {
    "steps_upper": 64,
    "steps_lower": 64,
    "steps_whole": 64,
    "layers": 16,
    "history": 70,
    "ahead": AHEAD_SIZE,
}


@dataclass(frozen=True)
class ModelConfig:
    """Sizes and switches.

    ``system``: "dafnet", the two-part flow; or what it is compared with (``model.systems``): "ap-p"
    or "moglow", one flow of ``steps_whole`` steps for the whole body, or "lower-first", the two
    parts in the opposite order. ``actions``: K of the action predictor. ``predictor_code``,
    ``predictor_width``: its environment code and its layers. ``latent``: the GMVAE's.
    ``steps_upper``, ``steps_lower``: flow steps of each part. ``width``, ``layers``: the coupling's
    LSTM. ``code``: the flow's environment code. ``shared_encoder``: one environment encoder for all
    couplings of a part (else one each). ``mask``: 22 values beside the observation say which joints
    are given. ``action_temperature``: softmax temperature after training (paper, section 4.2).
    ``history``: past frames that the predictor (and MoGlow) sees. ``ahead``: numbers that tell the
    flow where the root will be (``core.root.ahead``), or 0 as in the paper. ``ahead_mask``: one
    more says whether that is known: of a root that is led live, it is not.

    Raises ValueError where a size is out of its range.
    """

    system: str = "dafnet"
    actions: int = 10
    predictor_code: int = 512
    predictor_width: int = 512
    latent: int = 66
    steps_upper: int = 3
    steps_lower: int = 3
    steps_whole: int = 6
    width: int = 512
    layers: int = 2
    code: int = 512
    shared_encoder: bool = False
    mask: bool = False
    action_temperature: float = 0.7
    history: int = 10
    ahead: int = 0
    ahead_mask: bool = False

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            low, high = 0 if name == "ahead" else 1, _MAX_SIZES.get(name, 1 << 16)
            if type(value) is int and not low <= value <= high:
                raise ValueError(f"'{name}' must be {low} to {high}")
        if self.ahead_mask and not self.ahead:
            raise ValueError("'ahead_mask' is for models that are given the way ahead ('ahead')")
        if not self.action_temperature > 0.0:
            raise ValueError("'action_temperature' must be above 0")

    @property
    def predicts(self) -> bool:
        """Whether the flow is given actions by the predictor; MoGlow is given past poses
        instead.
        """
        return self.system not in SYSTEMS or SYSTEMS[self.system].predicts

    @property
    def condition_size(self) -> int:
        """Action probabilities and root velocity (and way ahead), or all of s; environment code;
        observation (and its mask).
        """
        way = self.ahead + self.ahead_mask
        inputs = self.actions + VELOCITY_SIZE + way if self.predicts else self.scene_size
        return inputs + self.code + POSE_SIZE + (len(JOINTS) if self.mask else 0)

    @property
    def scene_size(self) -> int:
        """The predictor's input beside the environment: past poses, and velocities up to now (693
        for ten frames).
        """
        return self.history * POSE_SIZE + (self.history + 1) * VELOCITY_SIZE

    def as_dict(self) -> dict[str, int | float | bool]:
        return asdict(self)


PAPER = ModelConfig()
"""Appendix A of the paper, with K = 3 + 3 flow steps as in its section 4.3."""
SMALL = ModelConfig(
    predictor_code=128, predictor_width=256, width=192, code=160, shared_encoder=True, mask=True
)
"""What two CPU cores train in an hour or two."""
