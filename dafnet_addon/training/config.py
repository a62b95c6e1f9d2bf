"""How a training is set: its budgets, learning rates and shares, out of a TOML file."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from ..core.errors import InputError
from ..model.config import PAPER, SMALL, ModelConfig
from .checkpoints import typed_settings

__all__ = ["TrainingConfig", "read_config"]


@dataclass(frozen=True)
class TrainingConfig:
    """How a run is trained. Learning rates rise over ``warmup`` steps to ``peak``, stay there, and
    fall straight to ``final`` at the end of the budget: a run that gets a larger budget goes on
    from before its rate fell.
    """

    minutes_predictor: float = 5.0
    """Budget of the predictor."""
    minutes_flow: float = 60.0
    """Budget of each part of the flow."""
    steps_flow: int = 0
    """Steps of each part of the flow: its budget, where not 0, in place of minutes."""

    batch: int = 50
    """Windows a step."""
    warmup: int = 150
    """Steps in which the learning rate rises."""
    peak: float = 2e-3
    """The highest learning rate."""
    final: float = 1e-4
    """The last learning rate."""
    cool_down: float = 0.3
    """The last share of the budget, in which the learning rate falls."""
    noam: bool = False
    """From ``peak`` on the rate falls as one over the root of the steps instead, to ``final``, as
    in the paper (Vaswani et al. 2017).
    """
    average: float = 0.99
    """A run's weights are averaged over about 1 / (1 - ``average``) steps."""
    clip_norm: float = 50.0
    """The largest norm of a gradient."""

    slot_dropout: float = 0.95
    """Share of past poses hidden from the predictor while it learns, number by number, and from
    MoGlow.
    """
    environment_dropout: float = 0.5
    """Share of sensor values hidden from all networks."""
    dropout_windows: float = 0.5
    """Share of windows in which they are hidden. The paper hides them in all; then only whole
    layers of spheres can be distinguished, and seats are met to 12 cm.
    """
    ahead_hidden: float = 0.0
    """Share of windows in which the way ahead is hidden, as it is from a live root."""
    legs_given: float = 0.0
    """Share of windows in which feet, or the whole lower body, may be given (see ``batches``)."""
    feet_elsewhere: float = 0.0
    """Share of the feet given all along a window that stand elsewhere than they were captured (see
    ``asked_feet``).
    """

    free_run: float = 0.0
    """Weight of the losses of motion that the flow makes by itself (see ``free_run``; 0 as in the
    paper).
    """
    captured: int = 20
    """Frames of a window before its free run begins."""
    cold: float = 0.25
    """Share of batches whose free runs begin after the first frame, with an empty memory, as takes
    begin.
    """
    calm: float = 0.5
    """Share of windows whose free runs are made from z = 0."""
    lively: float = 0.0
    """Share of windows whose free runs are made from noise that lasts, and comes and goes, as it is
    found along captured motion while the run goes on: what takes at temperature 1 are drawn from
    (see ``noise``). The others are made from one vector of N(0, I).
    """

    mixed: bool = False
    """LSTMs and environment encoders compute in bfloat16, where the device can."""
    save_every: int = 100
    """Steps between checkpoints."""
    seed: int = 0
    """Of the first weights, and of all that is drawn."""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            least = 1 if name in ("batch", "warmup", "save_every") else 0
            if not least <= value < math.inf:
                raise ValueError(f"'{name}' must be {least} or more")
        if self.cool_down > 1.0 or self.average >= 1.0:
            raise ValueError("'cool_down' must be 1 at most, and 'average' less than 1")
        if self.calm + self.lively > 1.0:
            raise ValueError("'calm' and 'lively' must be 1 at most together")

    def share(self, step: int, seconds: float) -> float:
        """Share of the flow's budget that is spent."""
        return min(
            1.0,
            step / self.steps_flow
            if self.steps_flow
            else seconds / max(60.0 * self.minutes_flow, 1e-9),
        )

    def rate(self, step: int, share: float) -> float:
        """Learning rate of the step after ``step`` steps, ``share`` of the budget being spent."""
        rising = (step + 1) / self.warmup
        if self.noam:
            return max(self.final, self.peak * min(rising, rising**-0.5))
        left = (1.0 - share) / self.cool_down if self.cool_down else 1.0
        rate = self.final + (self.peak - self.final) * min(1.0, left)
        return rate * min(1.0, rising)


def read_config(file: Path, changes: Sequence[str] = ()) -> tuple[ModelConfig, TrainingConfig]:
    """Model and training configuration of a TOML file: ``preset``, ``[model]`` and ``[training]``
    override the defaults, and ``changes``, as "width=384", what the file says.

    Raises InputError where the file cannot be read, or a setting is unknown, of another type or out
    of range.
    """
    try:
        table = tomllib.loads(Path(file).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(
            f"The configuration '{file}' cannot be read ({error}); check the path and its TOML."
        ) from error

    presets = {"paper": PAPER.as_dict(), "small": SMALL.as_dict()}
    preset, given, training = (
        table.pop("preset", "small"),
        table.pop("model", {}),
        table.pop("training", {}),
    )
    if not isinstance(preset, str) or preset not in presets:
        raise InputError(f"The preset '{preset}' is unknown; use one of {', '.join(presets)}.")

    try:
        if table or not isinstance(given, dict):
            raise ValueError(
                f"unknown setting '{min(table, default='model')}' outside of [model] and [training]"
            )

        sizes = {field.name for field in fields(ModelConfig)}
        for name, value in tomllib.loads("\n".join(changes)).items():
            (given if name in sizes else training)[name] = value

        return typed_settings(ModelConfig, {**presets[preset], **given}), typed_settings(
            TrainingConfig, training
        )
    except ValueError as error:
        raise InputError(
            f"The configuration '{file}' cannot be used ({error}); change it there."
        ) from None
