"""What is to be sampled of a shot, as the weights may be told of it."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .beginning import PREROLL
from .conditions import Change, Shot, rolled, shot_steps
from .draws import Draw
from .sampler import Conditions, Run, Sampler, Unchanged
from .skeleton import UPPER
from .solids import Scene
from .take import Asked
from .weights import Weights

__all__ = ["Wanted", "wanted_steps"]

_LEGS = slice(len(UPPER), None)  # joints in the model's order
_LEGS_UNHEARD = (
    "These weights were not trained with targets for feet and legs; only Reach Targets brings the "
    "feet there, after the motion is made."
)


@dataclass(frozen=True)
class Wanted:
    """A shot that is to be sampled, and what it is to be sampled from: ``conditions``, ``changes``
    of mode with what counts of them for the weights, ``share`` (PREROLL + N, 22) of the joints that
    are given, and the noise ``z`` (PREROLL + N, B, 66) of its takes.
    """

    shot: Shot
    conditions: Conditions
    changes: tuple[Change, ...]
    share: np.ndarray
    z: np.ndarray

    @property
    def in_part(self) -> bool:
        """Whether any target counts in part."""
        shares = (self.share, *(change.share for change in self.changes))
        return any(((each > 0.0) & (each < 1.0)).any() for each in shares)

    def without(self) -> Conditions:
        """Those without the targets that count in part."""
        return replace(self.conditions, given=(self.share >= 1.0).astype(float))

    def led_from(self, free: np.ndarray) -> "Wanted":
        """The same with targets that count in part led from the joints of a calm take (PREROLL + N,
        66), in the model's order.
        """
        changes = tuple(
            replace(
                each,
                observation=_led_over(each.observation, each.share, free[PREROLL:][each.frames]),
            )
            for each in self.changes
        )
        observation = _led_over(self.conditions.observation, self.share, free)
        return replace(
            self, conditions=replace(self.conditions, observation=observation), changes=changes
        )

    def drawn(self, draws: Sequence[Draw], sampler: Sampler) -> "Wanted":
        """The same for other takes, one for each of ``draws``."""
        return replace(self, z=_noise(sampler, len(self.conditions), draws))

    def run(self) -> Run:
        """As the sampler takes it."""
        unchanged = [
            Unchanged(PREROLL + each.start, each.observation, (each.share > 0.0).astype(float))
            for each in self.changes
        ]
        return Run(self.conditions, self.z, unchanged)


def wanted_steps(
    scene: Scene, asked: Asked, weights: Weights, sampler: Sampler
) -> Generator[float, None, Wanted]:
    shot = yield from shot_steps(scene, asked.controls)
    if not weights.heeds_legs and shot.request.share[:, _LEGS].any():
        shot = replace(shot, warnings=(*shot.warnings, _LEGS_UNHEARD))

    share = rolled(_told(shot.request.share, weights)) * shot.conditions.given
    return Wanted(
        shot=shot,
        conditions=replace(shot.conditions, given=(share > 0.0).astype(float)),
        changes=tuple(
            replace(each, share=_told(each.share, weights)) for each in shot.request.changes
        ),
        share=share,
        z=_noise(sampler, len(shot.conditions), asked.draws),
    )


def _noise(sampler: Sampler, frames: int, draws: Sequence[Draw]) -> np.ndarray:
    """That of takes (frames, B, 66), one for each of ``draws``."""
    return np.concatenate(
        [
            sampler.noise(frames, d.seed, d.lower_seed, d.temperature, d.lower_temperature, d.held)
            for d in draws
        ],
        axis=1,
    )


def _told(share: np.ndarray, weights: Weights) -> np.ndarray:
    """How far joints (N, 22) count for these weights: those of the legs not, where training never
    gave any.
    """
    if weights.heeds_legs:
        return share
    told = share.copy()
    told[:, _LEGS] = 0.0
    return told


def _led_over(observation: np.ndarray, share: np.ndarray, free: np.ndarray) -> np.ndarray:
    """An observation (T, 66) whose targets, which count by their ``share`` (T, 22), are led from
    where joints are ``free``.
    """
    way = np.repeat(share, 3, axis=-1)
    return (1.0 - way) * free + way * observation
