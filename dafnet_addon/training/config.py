"""How a training is set: its budgets, learning rates and shares, out of a TOML file."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from ..core.errors import InputError
from ..model.config import PAPER, SMALL, ModelConfig
from .checkpoints import typed

__all__ = ["TrainingConfig", "read_config"]


@dataclass(frozen=True)
class TrainingConfig:
    """``minutes_predictor``, ``minutes_flow``: time budgets; ``steps_flow``, where not 0, is the
    flow's instead. Learning rates rise over ``warmup`` steps to ``peak``, stay there, and fall
    straight to ``final`` over the last ``cool_down`` share of the budget: a run that gets a larger
    budget goes on from before it cooled. ``noam``: from ``peak`` they fall as one over the root of
    the steps instead, to ``final``, as in the paper (Vaswani et al. 2017). What a run is worth are
    its weights averaged over about 1 / (1 - ``average``) steps. ``slot_dropout``: share of past
    poses hidden from the predictor while it learns, number by number, and from MoGlow.
    ``environment_dropout``: share of sensor values hidden from all, in a share ``dropout_windows``
    of the windows (the paper hides them in all; then only whole layers of spheres are told apart,
    and seats are met to 12 cm).
    ``ahead_hidden``: share of windows in which the way ahead is hidden, as it is from a live root.
    ``legs_given``: share in which feet, or the whole lower body, may be given (``batches``).
    ``clip_norm``: largest gradient norm. ``free_run``: weight of the losses of motion that the flow
    makes by itself (see ``free_run``; 0 as in the paper), which begins after ``captured`` frames of
    a window, in a share ``cold`` of the batches after the first, with an empty memory, as a take
    begins; ``calm`` of the windows make it from z = 0, ``lively`` of them from noise that lasts and
    comes and goes as it is found along captured motion while the run goes on (see ``noise``: what
    takes at temperature 1 are drawn from), the others from one vector of N(0, I). ``mixed``: LSTMs
    and environment encoders compute in bfloat16, where the device can.
    """

    minutes_predictor: float = 5.0
    minutes_flow: float = 60.0
    steps_flow: int = 0
    batch: int = 50
    warmup: int = 150
    peak: float = 2e-3
    final: float = 1e-4
    cool_down: float = 0.3
    noam: bool = False
    average: float = 0.99
    slot_dropout: float = 0.95
    environment_dropout: float = 0.5
    dropout_windows: float = 0.5
    ahead_hidden: float = 0.0
    legs_given: float = 0.0
    clip_norm: float = 50.0
    free_run: float = 0.0
    captured: int = 20
    cold: float = 0.25
    calm: float = 0.5
    lively: float = 0.0
    mixed: bool = False
    save_every: int = 100
    seed: int = 0

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

        return typed(ModelConfig, {**presets[preset], **given}), typed(TrainingConfig, training)
    except ValueError as error:
        raise InputError(
            f"The configuration '{file}' cannot be used ({error}); change it there."
        ) from None
