"""Several people of one scene, each with controls of his own, generated side by side."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from .cleanup import CleanUp
from .generate import RAW, Draw, takes_steps
from .progress import stepwise, within
from .solids import Scene
from .take import Controls, Take
from .weights import Weights

__all__ = ["Asked", "generate_crowd"]


@dataclass(frozen=True)
class Asked:
    """What is asked of one person, and what each of his takes is drawn with."""

    controls: Controls
    draws: tuple[Draw, ...]


@stepwise
def generate_crowd(
    scene: Scene,
    people: Sequence[Asked],
    weights: Weights,
    *,
    device: str | None = None,
    clean_up: CleanUp = RAW,
) -> Generator[float, None, list[list[Take]]]:
    """The takes of each of some people in one scene; yields progress in [0, 1].

    Each is as ``generate`` makes it for him alone, but for rounding. Raises as ``takes_steps``
    does.
    """
    found = []
    for k, asked in enumerate(people):
        job = takes_steps(
            scene, asked.controls, weights, asked.draws, device=device, clean_up=clean_up
        )
        found.append((yield from within(job, k / len(people), (k + 1) / len(people))))
    return found
