"""What takes are drawn with: seeds and temperatures, and the others tried in their place."""

from dataclasses import dataclass, replace
from functools import partial

from .checks import MAX_SEED, number, whole

__all__ = ["Draw"]

_HOTTEST = 10.0
_STRIDE = 7919  # from the seed of one try to the next one's


@dataclass(frozen=True)
class Draw:
    """What one take is drawn with: ``seed`` and ``temperature``; the legs may have their own, None
    goes with the body's. ``held``: only the noise that lasts all along a take, as in the paper;
    else what comes and goes in real motion as well, where the weights know it.

    Seeds are whole numbers from 0 to ``MAX_SEED``, temperatures from 0 to 10. Raises InputError
    for others.
    """

    seed: int = 0
    lower_seed: int | None = None
    temperature: float = 0.0
    lower_temperature: float | None = None
    held: bool = False

    def __post_init__(self) -> None:
        hold = partial(object.__setattr__, self)
        hold("seed", whole(self.seed, "The seed", 0, MAX_SEED))
        hold("temperature", number(self.temperature, "The temperature", 0.0, _HOTTEST))
        if self.lower_seed is not None:
            hold("lower_seed", whole(self.lower_seed, "The seed of the legs", 0, MAX_SEED))

        if self.lower_temperature is not None:
            hold(
                "lower_temperature",
                number(self.lower_temperature, "The temperature of the legs", 0.0, _HOTTEST),
            )

    def other(self, k: int) -> "Draw":
        """The ``k``-th to try in its place: the same with other seeds."""

        def from_there(seed: int) -> int:
            return (seed + k * _STRIDE) % (MAX_SEED + 1)

        lower = None if self.lower_seed is None else from_there(self.lower_seed)
        return replace(self, seed=from_there(self.seed), lower_seed=lower)
