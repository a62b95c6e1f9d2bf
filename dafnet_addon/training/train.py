"""Trains the action predictor, then the two-part flow on top of it (paper, section 5.1, figure 7).

A run lives in a folder: ``predictor.checkpoint``, ``upper.checkpoint``, ``lower.checkpoint`` (each
resumes exactly where it was saved), ``log.jsonl``, and ``tensorboard``. Time, not steps, is the
budget: the learning rate stays, and falls as the last of the minutes are spent. A run that gets
more of them goes on from before it fell, so that a training may run for days and give weights at
any time.
"""

import json
import math
import multiprocessing
import time
import tomllib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from ..core.errors import InputError
from ..core.skeleton import LOWER_SIZE, POSE_SIZE, UPPER_SIZE
from ..core.threads import cores
from ..core.weights import Weights
from ..data.dataset.prepare import bank_in
from ..model.config import (
    AHEAD_SIZE,
    PAPER,
    SMALL,
    VELOCITY_SIZE,
    ModelConfig,
)
from ..model.flow import BodyFlow, Coupling, EnvironmentEncoder
from ..model.predictor import GMVAE, ActionPredictor, gumbel_temperature
from ..model.systems import system_named
from . import precision, ranks
from .batches import Batch, Pool, Statistics, chance, observation_for
from .checkpoints import (
    HELD,
    Checkpoint,
    checkpoint_file,
    generators,
    of_training,
    set_generators,
    typed,
    write_checkpoint,
)
from .export import adopt_part, adopt_predictor, adopted_statistics
from .free_run import lower_loss, upper_loss

__all__ = [
    "TrainingConfig",
    "read_config",
    "Run",
    "account",
    "before_it_cooled",
    "checkpoints",
    "clock_of",
    "dataset_pool",
    "descend",
    "train",
    "train_part",
    "trained",
]

_MAX_NUMBERS = 1 << 28
"""Of the networks that a checkpoint's settings describe: a GB; the paper's sizes are a seventh of
it.
"""


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
    ``clip_norm``: largest gradient norm. ``free_run``: weight of the losses of motion that the flow
    makes by itself (see ``free_run``; 0 as in the paper), which begins after ``captured`` frames of
    a window, in a share ``cold`` of the batches after the first, with an empty memory, as a take
    begins; ``calm`` of the windows make it from z = 0. ``mixed``: LSTMs and environment encoders
    compute in bfloat16, where the device can.
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
    clip_norm: float = 50.0
    free_run: float = 0.0
    captured: int = 20
    cold: float = 0.25
    calm: float = 0.5
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


class Run:
    """One network in training: 'predictor' (within its GMVAE), the flow's 'upper' or 'lower' part,
    or a baseline's 'whole'.

    The likelihood is a sum of the two parts', and the second is trained under the true first: given
    the predictor they have nothing in common, and are trained as two runs, side by side where there
    are two cores.
    """

    def __init__(
        self,
        part: str,
        folder: Path,
        model: ModelConfig,
        config: TrainingConfig,
        statistics: Statistics,
        device: str = "cpu",
    ) -> None:
        torch.manual_seed(config.seed)
        self.part, self.folder, self.model, self.statistics = part, folder, model, statistics
        self.device = torch.device(device)
        self.config = replace(config, mixed=config.mixed and precision.mixes(device))
        self.gmvae = GMVAE(model).to(self.device)
        self.flow = BodyFlow(model).to(self.device)
        for module in self.flow.modules():
            if isinstance(module, Coupling | EnvironmentEncoder):
                module.mixed = self.config.mixed

        self.gmvae.predictor.mixed = self.config.mixed and part != "predictor"
        self.network: nn.Module = self.gmvae if part == "predictor" else self.flow.parts()[part]
        self.optimiser = torch.optim.Adam(
            self.network.parameters(), lr=config.peak, fused=self.device.type in ("cpu", "cuda")
        )
        self.averaged = {name: p.detach().clone() for name, p in self.network.named_parameters()}
        """The parameters, averaged over the last steps."""
        self.step, self.seconds = 0, 0.0
        self.adopted = ""
        """How the weights that the run began with were trained, in their own words; nothing where
        it began anew.
        """

    def adopt(self, weights: Weights) -> None:
        """Begin with what these weights have learnt. Raises WeightsError where they do not fit into
        this model.
        """
        if self.part == "predictor":
            adopt_predictor(self.gmvae.predictor, weights)
        else:
            adopt_part(self.flow.parts()[self.part], self.part, weights, self.model)
        self.adopted = weights.metadata.get("training", "not said")
        self.averaged = {name: p.detach().clone() for name, p in self.network.named_parameters()}

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
        parameters = dict(self.network.named_parameters())
        latest = {name: p.detach().clone() for name, p in parameters.items()}
        try:
            self._set(self.averaged)
            yield self.network
        finally:
            self._set(latest)

    def adopt_average(self) -> None:
        """Let the network be its average from now on."""
        self._set(self.averaged)

    @torch.no_grad()
    def _set(self, values: dict[str, torch.Tensor]) -> None:
        for name, parameter in self.network.named_parameters():
            parameter.copy_(values[name])

    @property
    def cools(self) -> bool:
        """Whether the rate has begun to fall."""
        return self.share > 1.0 - self.config.cool_down

    @property
    def share(self) -> float:
        """Share of the budget that is spent."""
        if self.part == "predictor":
            return min(1.0, self.seconds / max(60.0 * self.config.minutes_predictor, 1e-9))
        return self.config.share(self.step, self.seconds)

    def save(self, name: str = "") -> None:
        """Keep the run as it is, to be gone on with exactly from here; under another ``name`` than
        its part's, where given.
        """
        statistics = {
            name: torch.from_numpy(value.astype(float))
            for name, value in asdict(self.statistics).items()
        }
        tensors = {
            **of_training(self.network, self.optimiser),
            **{f"averaged.{name}": value for name, value in self.averaged.items()},
            **{f"generator.{name}": state for name, state in generators(self.device).items()},
            **{f"statistics.{name}": values for name, values in statistics.items()},
        }
        write_checkpoint(
            checkpoint_file(self.folder, name or self.part),
            tensors,
            {
                "model": self.model.as_dict(),
                "config": asdict(self.config),
                "step": self.step,
                "seconds": self.seconds,
                "adopted": self.adopted,
            },
        )

    @staticmethod
    def load(
        part: str,
        folder: Path,
        config: TrainingConfig | None = None,
        device: str = "cpu",
        name: str = "",
    ) -> "Run":
        """The run saved in ``folder``; ``config`` replaces its settings, a longer budget for
        example; ``name`` as in ``save``.

        Raises InputError where the checkpoint is missing, damaged, of an earlier version, or does
        not fit itself.
        """
        kept = Checkpoint.read(checkpoint_file(folder, name or part))
        model = kept.settings(ModelConfig, "model")
        if part != "predictor" and part not in system_named(model.system).partition:
            raise kept.refused(f"its model has no part '{part}'")

        with torch.device("meta"):
            gmvae, flow = GMVAE(model), BodyFlow(model)
            if (
                sum(p.numel() for network in (gmvae, flow) for p in network.parameters())
                > _MAX_NUMBERS
            ):
                raise kept.refused("its model is too large")
            kept.fits(gmvae if part == "predictor" else flow.parts()[part])

        settings = config or kept.settings(TrainingConfig, "config")
        run = Run(part, folder, model, settings, _statistics_of(kept), device)
        kept.restore(run.network, run.optimiser)
        learnt = "network" if kept.is_slim else "averaged"
        run.averaged = {
            key: kept.tensor(f"{learnt}.{key}", like).to(run.device)
            for key, like in run.averaged.items()
        }
        run.step, run.seconds = kept.progress()
        run.adopted = kept.text("adopted")
        kept.set_generators(run.device)
        return run

    def hidden(self, seen: torch.Tensor) -> torch.Tensor:
        """Occupancy (B, …, 2640) of what is ``seen``, in bytes, with a share of its values dropped
        (paper, Appendix A); nothing is rescaled. As wide as what reads it computes.
        """
        spared = (
            torch.rand(len(seen), *[1] * (seen.ndim - 1), device=self.device)
            >= self.config.dropout_windows
        )
        shown = seen * (spared | ~chance(seen.shape, self.config.environment_dropout, self.device))
        wide = self.config.mixed and self.part != "predictor"
        return shown.to(torch.bfloat16 if wide else torch.float32).div_(255.0)

    def loss(self, batch: Batch, initialise: bool = False) -> torch.Tensor:
        """The GMVAE's loss, or the part's negative log-likelihood a frame with the predictor
        frozen, and its free run's.
        """
        if self.part == "predictor":
            # Neighbouring frames say nearly the same: every fifth is plenty for a network without
            # memory.
            past, sight = (a[:, ::5].flatten(0, 1) for a in (batch.past, batch.seen))
            poses = self.model.history * POSE_SIZE
            seen = past.clone()
            seen[:, :poses] *= (
                torch.rand(len(past), poses, device=self.device) >= self.config.slot_dropout
            )
            return self.gmvae.losses(
                past, seen, self.hidden(sight), gumbel_temperature(self.share)
            ).total

        occupancy = self.hidden(batch.seen)
        observation, given = observation_for(batch.upper)
        x, condition = self._told(batch, occupancy, observation, given)
        part = self.flow.parts()[self.part]
        if initialise or not self.config.free_run:
            return -part.log_likelihood(x, condition, occupancy, initialise).mean()

        kept = 1 if float(torch.rand(())) < self.config.cold else self.config.captured
        calm = torch.rand(len(x), device=self.device) < self.config.calm
        z = torch.randn(len(x), x.shape[-1], device=self.device) * ~calm[:, None]
        density, made = part.free_run(x, condition, occupancy, z, kept)
        led = self._free_run(made, x[:, kept:], calm, batch, given, kept)
        return -density.mean() + self.config.free_run * led

    def _told(
        self, batch: Batch, occupancy: torch.Tensor, observation: torch.Tensor, given: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The part's poses (B, T, …), and what its flow is told of them beside the environment."""
        if self.model.predicts:
            with torch.no_grad():
                actions = self.gmvae.predictor(batch.past, occupancy)
            base = torch.cat([actions, self._foreseen(batch.root)], dim=-1)
        else:
            # MoGlow's data dropout: whole past poses are hidden, so that it heeds what it is told.
            base = batch.past.clone()
            poses = base[..., : self.model.history * POSE_SIZE].unflatten(-1, (-1, POSE_SIZE))
            poses *= (
                torch.rand(*poses.shape[:-1], 1, device=self.device) >= self.config.slot_dropout
            )

        pose = torch.cat([batch.upper, batch.lower], dim=-1)
        return pose[..., self.flow.partition[self.part]], self.flow.condition(
            self.part, base, observation, given, pose
        )

    def _foreseen(self, root: torch.Tensor) -> torch.Tensor:
        """What is told of the root (B, T, 3 [+ 18 [+ 1]]), its way ahead hidden in some windows: a
        root that is led live has none yet.
        """
        if not self.model.ahead_mask:
            return root
        foreseen = torch.rand(len(root), 1, 1, device=self.device) >= self.config.ahead_hidden
        velocity, way = root[..., :VELOCITY_SIZE], root[..., VELOCITY_SIZE:]
        return torch.cat([velocity, way * foreseen], dim=-1)

    def _free_run(
        self,
        made: torch.Tensor,
        true: torch.Tensor,
        calm: torch.Tensor,
        batch: Batch,
        given: torch.Tensor,
        kept: int,
    ) -> torch.Tensor:
        joints = UPPER_SIZE // 3
        statistics = self.statistics.pose_mean, self.statistics.pose_std
        mean, std = (torch.as_tensor(a, dtype=made.dtype, device=made.device) for a in statistics)

        def metres(values: torch.Tensor, which: slice) -> torch.Tensor:
            # An unlearnt flow's inverse may be anywhere; such poses teach nothing.
            return (values.clamp(-20.0, 20.0) * std[which] + mean[which]).unflatten(-1, (-1, 3))

        loss = made.new_zeros(())
        upper, lower = slice(0, UPPER_SIZE), slice(UPPER_SIZE, UPPER_SIZE + LOWER_SIZE)
        if self.part != "lower":
            own = metres(made[..., upper], upper), metres(true[..., upper], upper)
            loss = loss + upper_loss(*own, calm, given[:, kept:, :joints])

        if self.part != "upper":
            legs = (..., slice(-LOWER_SIZE, None))
            pelvis = metres(batch.upper[:, kept:, :3], slice(0, 3))[..., 0, :]
            loss = loss + lower_loss(
                metres(made[legs], lower),
                metres(true[legs], lower),
                calm,
                pelvis,
                batch.step[:, kept:],
            )

        return loss

    @torch.no_grad()
    def held_loss(self, held: Pool, windows: int = 50) -> float:
        """The loss on unseen bodies, with the same draws each time."""
        state = generators(self.device)
        torch.manual_seed(1)
        rows = torch.arange(min(windows, len(held)))
        loss = float(self.loss(held.batch(rows, self.statistics, self.model)))
        set_generators(state, self.device)
        return loss


def _statistics_of(kept: Checkpoint) -> Statistics:
    """What a checkpoint's run standardises with. Raises InputError where it is nothing to
    standardise with.
    """
    found = {}
    for what, size in (("pose", POSE_SIZE), ("velocity", VELOCITY_SIZE), ("ahead", AHEAD_SIZE)):
        for name in (f"{what}_mean", f"{what}_std"):
            values = kept.tensor(
                f"statistics.{name}", torch.empty(size, dtype=torch.double)
            ).numpy()
            if not np.isfinite(values).all() or (name.endswith("std") and (values <= 0.0).any()):
                raise kept.refused(f"'statistics.{name}' cannot be divided by or added")
            found[name] = values

    return Statistics(**found)


def dataset_pool(dataset: Path, device: str = "cpu") -> Pool:
    """The training windows of a dataset. Raises InputError where there are none."""
    pool = Pool(
        lambda: sorted(Path(dataset).glob("pool-????.npz")),
        torch.device(device),
        bank_in(Path(dataset)),
    )
    if not len(pool):
        raise InputError(
            f"The dataset '{dataset}' holds no windows; make it with 'dafnet prepare'."
        )

    return pool


def clock_of(device: torch.device) -> Callable[[], float]:
    """Seconds that count: a processor's own, so that other work takes nothing from the training;
    else the clock's.
    """
    return (
        time.monotonic
        if device.type != "cpu"
        else lambda: time.process_time() / torch.get_num_threads()
    )


def descend(
    network: nn.Module,
    optimiser: torch.optim.Optimizer,
    loss: torch.Tensor,
    config: TrainingConfig,
    step: int,
    share: float,
) -> None:
    """One step down a loss, after ``step`` others, ``share`` of the budget being spent; the same on
    all ranks.
    """
    for group in optimiser.param_groups:
        group["lr"] = config.rate(step, share)

    optimiser.zero_grad()
    loss.backward()
    if step == 0:
        ranks.from_first(network)

    ranks.average([p.grad for p in network.parameters() if p.grad is not None])
    nn.utils.clip_grad_norm_(network.parameters(), config.clip_norm)
    optimiser.step()


def train_part(
    part: str,
    dataset: Path,
    folder: Path,
    model: ModelConfig,
    config: TrainingConfig,
    threads: int | None = None,
    progress: Callable[[str, float, float], None] = lambda part, share, loss: None,
    device: str = "cpu",
    begin_with: Weights | None = None,
) -> Run:
    """Train one part, or go on with it, until its budget is spent.

    Raises InputError without a dataset, for a device that is not there, and where a part of other
    sizes was begun there.

    A new run begins with what ``begin_with`` has learnt, where given: weights of the same or
    smaller sizes. A loss that is not a number stops the run with the last good checkpoint kept.
    Shards that 'prepare' is still writing are taken in as they come.
    """
    if threads is not None:
        torch.set_num_threads(threads)

    device = ranks.device_of(device)
    torch.backends.cuda.matmul.allow_tf32 = True
    pool = dataset_pool(dataset, device)
    held = Pool(lambda: [Path(dataset) / "held.npz"], torch.device(device), bank_in(Path(dataset)))
    predictor = (
        None
        if part == "predictor" or not model.predicts
        else Run.load("predictor", folder, device=device)
    )
    if checkpoint_file(folder, part).exists():
        run = _resumed(part, folder, config, device)
        if run.model != model:
            own = run.model.as_dict()
            other = [
                f"{name} {own[name]}, not {value}"
                for name, value in model.as_dict().items()
                if own[name] != value
            ]
            raise InputError(
                f"The run '{folder}' was begun with other settings ({'; '.join(other)}); train in "
                "another folder."
            )
    else:
        # All parts are standardised alike, whatever shards there were when each began.
        statistics = predictor.statistics if predictor is not None else pool.statistics()
        if begin_with is not None:
            statistics = adopted_statistics(begin_with, statistics)

        run = Run(part, folder, model, config, statistics, device)
        if begin_with is not None:
            run.adopt(begin_with)
        if ranks.rank() == 0:
            run.save()

    if ranks.rank():
        torch.manual_seed(hash((config.seed, run.step, ranks.rank())) % 2**31)
    if predictor is not None:
        with predictor.with_average() as network:
            run.gmvae.load_state_dict(network.state_dict())
        run.gmvae.requires_grad_(False)

    recent: list[torch.Tensor] = []
    leads = ranks.rank() == 0
    curves = _curves(folder / "tensorboard" / part) if leads else None
    clock = clock_of(run.device)
    while run.share < 1.0:
        begin, held_its_rate = clock(), not run.cools
        rows = torch.randint(len(pool), (config.batch,))
        loss = run.loss(
            pool.batch(rows, run.statistics, run.model),
            initialise=run.step == 0 and not run.adopted,
        )
        descend(run.network, run.optimiser, loss, run.config, run.step, run.share)
        recent.append(loss.detach())
        run.step += 1
        run.average()
        if run.step % config.save_every == 0:
            torch.stack(recent).mean().item()  # what a device still has to do is counted too

        run.seconds = ranks.mean(run.seconds + clock() - begin, run.device)
        if held_its_rate and run.cools and leads:
            run.save(f"{part}{HELD}")

        if run.step % config.save_every == 0 or run.share >= 1.0:
            mean = ranks.mean(float(torch.stack(recent).mean()), run.device)
            if not math.isfinite(mean):
                raise InputError(
                    f"The loss of '{part}' is not a number by step {run.step}; resume with a lower "
                    "peak rate."
                )

            with run.with_average():
                held_out = run.held_loss(held)

            if leads:
                values = {
                    "part": part,
                    "step": run.step,
                    "minutes": run.seconds / 60,
                    "loss": mean,
                    "held_out": held_out,
                    "windows": len(pool),
                }
                progress(part, run.share, mean)
                run.save()
                # The log comes after what it tells of: what a killed process had not saved is told
                # once, by the next one.
                with (folder / "log.jsonl").open("a", encoding="utf-8") as f:
                    f.write(json.dumps(values) + "\n")

                if curves is not None:
                    for name in ("loss", "held_out", "windows"):
                        curves.add_scalar(name, values[name], run.step)

            recent.clear()
            pool.refresh()

    return run


def before_it_cooled(part: str, folder: Path) -> Run:
    """The saved run as it is; where its rate has begun to fall, as it was before that."""
    run, name = Run.load(part, folder), f"{part}{HELD}"
    if run.cools and checkpoint_file(folder, name).exists():
        return Run.load(part, folder, name=name)
    return run


def _curves(folder: Path) -> Any:
    """What writes a run's curves for TensorBoard; None where that is not installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        return None
    return SummaryWriter(str(folder))


def _resumed(part: str, folder: Path, config: TrainingConfig, device: str) -> Run:
    """The saved run; where its budget has grown since its rate fell, as it was before that."""
    name = f"{part}{HELD}"
    if checkpoint_file(folder, name).exists():
        run = Run.load(part, folder, config, device, name)
        # A share of the old budget in which the rate fell is less of a new one.
        if not run.cools:
            return run
    return Run.load(part, folder, config, device)


def train(
    dataset: Path,
    folder: Path,
    model: ModelConfig,
    config: TrainingConfig,
    progress: Callable[[float], None] = lambda share: None,
    device: str = "cpu",
    begin_with: Weights | None = None,
) -> None:
    """Train the predictor, then both parts of the flow in two processes; what a folder holds is
    gone on with.

    What is new begins with what the weights ``begin_with`` have learnt, where given.

    Under ``torchrun`` all processes train one part after another, together.
    """
    whole = max(config.minutes_predictor + config.minutes_flow, 1e-9)
    first = config.minutes_predictor / whole
    report = lambda part, share, loss: progress(first * share)  # noqa: E731
    names = tuple(system_named(model.system).partition)
    if model.predicts:
        train_part(
            "predictor",
            dataset,
            folder,
            model,
            config,
            progress=report,
            device=device,
            begin_with=begin_with,
        )

    if ranks.joined():
        for part in names:
            train_part(part, dataset, folder, model, config, device=device, begin_with=begin_with)
        return

    threads = max(1, min(torch.get_num_threads(), cores()) // len(names))
    with ProcessPoolExecutor(len(names), mp_context=multiprocessing.get_context("spawn")) as pool:
        begin = time.monotonic()
        parts = [
            pool.submit(
                train_part,
                part,
                dataset,
                folder,
                model,
                config,
                threads,
                device=device,
                begin_with=begin_with,
            )
            for part in names
        ]
        while wait(parts, timeout=2.0).not_done:
            spent = (
                0.0
                if config.steps_flow
                else (time.monotonic() - begin) / max(60.0 * config.minutes_flow, 1e-9)
            )
            progress(first + (1.0 - first) * min(1.0, spent))

        try:
            for done in parts:
                done.result()
        except BrokenProcessPool:
            raise InputError(
                "A process of the training was ended from outside, for want of memory perhaps; "
                "give the same command again, "
                "and it goes on from its last checkpoint."
            ) from None


def trained(folder: Path) -> tuple[BodyFlow, ActionPredictor | None, Statistics]:
    """The flow, the predictor (of MoGlow none) and the statistics of a run's latest checkpoints,
    their weights averaged.
    """
    runs = checkpoints(folder)
    flow = next(run.flow for part, run in runs.items() if part != "predictor")
    for part, run in runs.items():
        run.adopt_average()
        if part != "predictor":
            setattr(flow, part, run.network)
    predictor = runs["predictor"].gmvae.predictor if "predictor" in runs else None
    return flow, predictor, next(iter(runs.values())).statistics


def checkpoints(folder: Path) -> dict[str, Run]:
    """The latest checkpoints of a run's folder, the predictor's first."""
    parts = ("predictor", "upper", "lower", "whole")
    return {
        part: Run.load(part, folder) for part in parts if checkpoint_file(folder, part).exists()
    }


def account(folder: Path, dataset: Path) -> dict[str, str]:
    """What a weights file says of its making, as metadata: licence, data, and training."""
    runs = checkpoints(folder)
    training: dict[str, Any] = {
        part: {"steps": run.step, "minutes": round(run.seconds / 60, 1)}
        for part, run in runs.items()
    }
    last = list(runs.values())[-1]
    if last.adopted:
        training["begun_with"] = last.adopted

    return {
        "licence": "CC-BY-4.0; provenance in LICENSE-WEIGHTS.md",
        "data": (dataset / "dataset.json").read_text(encoding="utf-8"),
        "training": json.dumps({**training, "settings": asdict(last.config)}),
    }
