"""A network in training: its weights, their average, its optimiser and its place in the budget."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import torch
from torch import Tensor, nn

from ..core.weights import Weights
from ..model.config import ModelConfig
from . import precision
from .batches import Batch, Pool, Statistics, chance
from .checkpoints import (
    Checkpoint,
    checkpoint_file,
    generators,
    set_generators,
    training_tensors,
    write_checkpoint,
)
from .config import TrainingConfig

__all__ = ["Run", "Setup"]


@dataclass(frozen=True)
class Setup:
    """What the runs of a folder have in common."""

    folder: Path
    model: ModelConfig
    config: TrainingConfig
    statistics: Statistics
    device: torch.device


class Run(ABC):
    """What the training of every network has in common; ``part`` names it.

    A kind of run says what its loss is, how much of its budget is spent, and how it begins with
    what other weights have learnt.
    """

    def __init__(self, part: str, network: nn.Module, setup: Setup) -> None:
        self.part, self.folder, self.model = part, setup.folder, setup.model
        self.statistics, self.device = setup.statistics, setup.device
        mixed = setup.config.mixed and precision.is_available(str(setup.device))
        self.config = replace(setup.config, mixed=mixed)

        self.network = network.to(self.device)
        self.optimiser = torch.optim.Adam(
            network.parameters(),
            lr=self.config.peak,
            fused=self.device.type in ("cpu", "cuda"),
        )
        self.averaged = self._parameters()
        """The parameters, averaged over the last steps."""

        self.step, self.seconds = 0, 0.0
        self.adopted = ""
        """How the weights that the run began with were trained, in their own words; nothing where
        it began from random ones.
        """

    @property
    @abstractmethod
    def share(self) -> float:
        """Share of the budget that is spent."""

    @abstractmethod
    def loss(self, batch: Batch, initialise: bool = False) -> Tensor:
        """The loss of a batch, a number. ``initialise``: activation norms are set by this batch."""

    @abstractmethod
    def _copy(self, weights: Weights) -> None:
        """Give the network what these weights hold. Raises WeightsError where they do not fit."""

    @abstractmethod
    def prepare(self, pool: Pool) -> None:
        """Measure along the training windows what the next step needs, where that is due."""

    def adopt(self, weights: Weights) -> None:
        """Begin with what these weights have learnt. Raises WeightsError where they do not fit into
        this model.
        """
        self._copy(weights)
        self.adopted = weights.metadata.get("training", "not said")
        self.averaged = self._parameters()

    @property
    def is_cooling(self) -> bool:
        """Whether the learning rate has begun to fall."""
        return self.share > 1.0 - self.config.cool_down

    @torch.no_grad()
    def average(self) -> None:
        """Take the parameters after a step into their average: at first all alike, then the older
        the less.
        """
        keep = min(self.config.average, self.step / (self.step + 10.0))
        parameters = dict(self.network.named_parameters())
        torch._foreach_lerp_(
            list(self.averaged.values()),
            [parameters[name].data for name in self.averaged],
            1.0 - keep,
        )

    @contextmanager
    def with_average(self) -> Iterator[nn.Module]:
        """The network with its averaged parameters, for as long as the context lasts."""
        latest = self._parameters()
        try:
            self._set(self.averaged)
            yield self.network
        finally:
            self._set(latest)

    def adopt_average(self) -> None:
        """Let the network be its average from now on."""
        self._set(self.averaged)

    def _parameters(self) -> dict[str, Tensor]:
        return {name: p.detach().clone() for name, p in self.network.named_parameters()}

    @torch.no_grad()
    def _set(self, values: dict[str, Tensor]) -> None:
        for name, parameter in self.network.named_parameters():
            parameter.copy_(values[name])

    def save(self, name: str = "") -> None:
        """Write the run as it is, to be resumed exactly from here; under another ``name`` than its
        part's, where given.
        """
        statistics = {
            name: torch.from_numpy(value.astype(float))
            for name, value in asdict(self.statistics).items()
        }
        tensors = {
            **training_tensors(self.network, self.optimiser),
            **self._own_tensors(),
            **{f"averaged.{name}": value for name, value in self.averaged.items()},
            **{f"generator.{name}": state for name, state in generators(self.device).items()},
            **{f"statistics.{name}": values for name, values in statistics.items()},
        }
        state = {
            "model": self.model.as_dict(),
            "config": asdict(self.config),
            "step": self.step,
            "seconds": self.seconds,
            "adopted": self.adopted,
        }
        write_checkpoint(checkpoint_file(self.folder, name or self.part), tensors, state)

    def _own_tensors(self) -> dict[str, Tensor]:
        """What this kind of run keeps in a checkpoint besides."""
        return {}

    def restore(self, kept: Checkpoint) -> None:
        """Go on from what a checkpoint holds, random draws included. Raises InputError where it
        does not fit.
        """
        kept.restore(self.network, self.optimiser)
        learnt = "network" if kept.is_slim else "averaged"
        self.averaged = {
            name: kept.tensor(f"{learnt}.{name}", like).to(self.device)
            for name, like in self.averaged.items()
        }

        self.step, self.seconds = kept.progress()
        self.adopted = kept.text("adopted")
        kept.set_generators(self.device)

    def dropped_out(self, seen: Tensor, dtype: torch.dtype = torch.float32) -> Tensor:
        """Occupancy (B, …, 2640) of what is ``seen``, in bytes, with a share of its values hidden
        in a share of the windows (paper, Appendix A); nothing is rescaled.
        """
        spared = (
            torch.rand(len(seen), *[1] * (seen.ndim - 1), device=self.device)
            >= self.config.dropout_windows
        )
        shown = seen * (spared | ~chance(seen.shape, self.config.environment_dropout, self.device))
        return shown.to(dtype).div_(255.0)

    @torch.no_grad()
    def held_out_loss(self, held: Pool, windows: int = 50) -> float:
        """The loss on unseen bodies, with the same draws each time."""
        state = generators(self.device)
        torch.manual_seed(1)
        rows = torch.arange(min(windows, len(held)))
        loss = float(self.loss(held.batch(rows, self.statistics, self.model)))
        set_generators(state, self.device)
        return loss
