"""The networks that are trained, each as a run: the action predictor, and the parts of the flow.

The likelihood is a sum over the flow's parts, and the second is trained under the true first: given
the predictor they have nothing in common, and are trained as two runs, side by side where there are
two cores.
"""

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ..core.skeleton import POSE_SIZE
from ..core.weights import Weights
from ..model.config import AHEAD_SIZE, VELOCITY_SIZE, ModelConfig
from ..model.flow import BodyFlow, Coupling, EnvironmentEncoder
from ..model.predictor import GMVAE, ActionPredictor, gumbel_temperature
from ..model.systems import system_named
from .asked_feet import feet_elsewhere
from .batches import Batch, Pool, Statistics, given_for
from .checkpoints import BEFORE_COOLING, Checkpoint, checkpoint_file
from .config import TrainingConfig
from .export import adopt_part, adopt_predictor
from .free_run import free_run_loss
from .noise import PartNoise, part_noise
from .run import Run, Setup

__all__ = [
    "FlowRun",
    "PredictorRun",
    "load_run",
    "new_run",
    "resumed_run",
    "saved_runs",
    "trained_networks",
    "uncooled_run",
]

_MAX_NUMBERS = 1 << 28
"""Of the networks that a checkpoint's settings describe: a GB; the paper's sizes are a seventh of
it.
"""
_NOISE = "noise"
"""Before the names of the tensors in a checkpoint that lively free runs are drawn from."""
_MEASURED_EVERY = 1000
"""Steps after which that noise is measured anew."""
_MEASURED_WINDOWS = 500
"""Windows that it is measured along, which takes about a hundredth of the time of those steps."""
_STRIDE = 5
"""Frames between two that the predictor learns from: neighbours say nearly the same, and it has no
memory.
"""


class PredictorRun(Run):
    """The action predictor, trained within its GMVAE (paper, section 4.2)."""

    network: GMVAE

    @property
    def share(self) -> float:
        return min(1.0, self.seconds / max(60.0 * self.config.minutes_predictor, 1e-9))

    def prepare(self, pool: Pool) -> None:
        """A predictor needs nothing."""

    def _copy(self, weights: Weights) -> None:
        adopt_predictor(self.network.predictor, weights)

    def loss(self, batch: Batch, initialise: bool = False) -> Tensor:
        past, sight = (a[:, ::_STRIDE].flatten(0, 1) for a in (batch.past, batch.seen))

        poses = self.model.history * POSE_SIZE
        shown = past.clone()
        kept = torch.rand(len(past), poses, device=self.device) >= self.config.slot_dropout
        shown[:, :poses] *= kept

        temperature = gumbel_temperature(self.share)
        return self.network.losses(past, shown, self.dropped_out(sight), temperature).total


class FlowRun(Run):
    """The flow's 'upper' or 'lower' part, or a baseline's 'whole', under a predictor that stays as
    it is.
    """

    def __init__(self, part: str, flow: BodyFlow, predictor: ActionPredictor, setup: Setup) -> None:
        super().__init__(part, flow.parts()[part], setup)
        self.flow, self.predictor = flow.to(self.device), predictor.to(self.device)
        for module in flow.modules():
            if isinstance(module, Coupling | EnvironmentEncoder):
                module.mixed = self.config.mixed

        predictor.mixed = self.config.mixed
        self.noise: PartNoise | None = None
        """What lively free runs are made from; None where there are none, or before it was
        measured.
        """

    @property
    def share(self) -> float:
        return self.config.share(self.step, self.seconds)

    def _copy(self, weights: Weights) -> None:
        adopt_part(self.flow.parts()[self.part], self.part, weights, self.model)

    def prepare(self, pool: Pool) -> None:
        """Measure the noise of lively free runs, at first and then now and again: what it is
        changes as the flow learns.
        """
        if self.config.lively and (self.noise is None or self.step % _MEASURED_EVERY == 0):
            self.noise = part_noise(
                part=self.part,
                flow=self.flow,
                predictor=self.predictor if self.model.predicts else None,
                pool=pool,
                statistics=self.statistics,
                windows=_MEASURED_WINDOWS,
            )

    def _own_tensors(self) -> dict[str, Tensor]:
        if self.noise is None:
            return {}
        return {f"{_NOISE}.{name}": getattr(self.noise, name) for name in PartNoise.__annotations__}

    def restore(self, kept: Checkpoint) -> None:
        super().restore(kept)
        # A run that was begun without lively free runs measures their noise when it has some.
        if self.config.lively and f"{_NOISE}.spread" in kept.tensors:
            size = self.flow.partition[self.part].stop - self.flow.partition[self.part].start
            shapes = PartNoise.shapes(size)
            self.noise = PartNoise(
                **{
                    name: kept.tensor(f"{_NOISE}.{name}", torch.empty(shape)).to(self.device)
                    for name, shape in shapes.items()
                }
            )

    def use_predictor(self, predictor: ActionPredictor) -> None:
        """Take the weights of a trained predictor, and keep them as they are."""
        self.predictor.load_state_dict(predictor.state_dict())
        self.predictor.requires_grad_(False)

    def loss(self, batch: Batch, initialise: bool = False) -> Tensor:
        """Negative log-likelihood a frame, and where it is weighed what the part's free run
        loses.
        """
        wide = torch.bfloat16 if self.config.mixed else torch.float32
        occupancy = self.dropped_out(batch.seen, wide)
        given = given_for(batch.upper, self.config.legs_given)
        base = self._base(batch, occupancy)

        lower = batch.lower
        if self.config.legs_given and self.config.feet_elsewhere:
            share = self.config.feet_elsewhere
            lower = feet_elsewhere(lower, given, batch.step, share, self.statistics)

        pose = torch.cat([batch.upper, lower], dim=-1)
        observation = pose * given.repeat_interleave(3, dim=-1)
        x = pose[..., self.flow.partition[self.part]]
        condition = self.flow.condition(self.part, base, observation, given, pose)

        flow = self.flow.parts()[self.part]
        if initialise or not self.config.free_run:
            return -flow.log_likelihood(x, condition, occupancy, initialise).mean()

        captured = 1 if float(torch.rand(())) < self.config.cold else self.config.captured
        z, calm = self._free_run_noise(x[:, captured:])
        density, made = flow.free_run(x, condition, occupancy, z, captured)

        loss = free_run_loss(
            part=self.part,
            made=made,
            true=x[:, captured:],
            calm=calm,
            given=given[:, captured:],
            pelvis=batch.upper[:, captured:, :3],
            step=batch.step[:, captured:],
            statistics=self.statistics,
        )
        return -density.mean() + self.config.free_run * loss

    def _free_run_noise(self, like: Tensor) -> tuple[Tensor, Tensor]:
        """Noise (B, T, n) that free runs of windows are made from, and where it is zero (B,)."""
        windows, frames, size = like.shape
        drawn = torch.rand(windows, device=self.device)
        calm = drawn < self.config.calm
        held = torch.randn(windows, size, device=self.device) * ~calm[:, None]
        z = held[:, None].expand(-1, frames, -1)
        if self.noise is None:
            return z, calm

        lively = drawn >= 1.0 - self.config.lively
        return torch.where(lively[:, None, None], self.noise.draw(windows, frames), z), calm

    def _base(self, batch: Batch, occupancy: Tensor) -> Tensor:
        """The condition's first part (B, T, …): action probabilities and root; of MoGlow, past
        poses and velocities.
        """
        if self.model.predicts:
            with torch.no_grad():
                actions = self.predictor(batch.past, occupancy)
            return torch.cat([actions, self.root_inputs(batch.root)], dim=-1)

        # MoGlow's data dropout: whole past poses are hidden, so that it heeds its controls.
        base = batch.past.clone()
        poses = base[..., : self.model.history * POSE_SIZE].unflatten(-1, (-1, POSE_SIZE))
        poses *= torch.rand(*poses.shape[:-1], 1, device=self.device) >= self.config.slot_dropout
        return base

    def root_inputs(self, root: Tensor) -> Tensor:
        """The root (B, T, 3 [+ 24 [+ 1]]) with its way ahead hidden in some windows: a root that is
        led live has none yet.
        """
        if not self.model.ahead_mask:
            return root

        known = torch.rand(len(root), 1, 1, device=self.device) >= self.config.ahead_hidden
        velocity, way = root[..., :VELOCITY_SIZE], root[..., VELOCITY_SIZE:]
        return torch.cat([velocity, way * known], dim=-1)


def new_run(
    part: str,
    folder: Path,
    model: ModelConfig,
    config: TrainingConfig,
    statistics: Statistics,
    device: str = "cpu",
) -> Run:
    """A run that begins with random weights: 'predictor', or a part of the flow."""
    torch.manual_seed(config.seed)
    # Both are made whichever is trained, so that all parts of one seed begin and draw alike.
    gmvae, flow = GMVAE(model), BodyFlow(model)

    setup = Setup(folder, model, config, statistics, torch.device(device))
    if part == "predictor":
        return PredictorRun(part, gmvae, setup)
    return FlowRun(part, flow, gmvae.predictor, setup)


def load_run(
    part: str,
    folder: Path,
    config: TrainingConfig | None = None,
    device: str = "cpu",
    name: str = "",
) -> Run:
    """The run saved in ``folder``; ``config`` replaces its settings, a longer budget for example;
    ``name`` as in ``Run.save``.

    Raises InputError where the checkpoint is missing, damaged, of an earlier version, or does not
    fit itself.
    """
    kept = Checkpoint.read(checkpoint_file(folder, name or part))
    model = kept.settings(ModelConfig, "model")
    if part != "predictor" and part not in system_named(model.system).partition:
        raise kept.refused(f"its model has no part '{part}'")

    with torch.device("meta"):
        gmvae, flow = GMVAE(model), BodyFlow(model)
        numbers = sum(p.numel() for network in (gmvae, flow) for p in network.parameters())
        if numbers > _MAX_NUMBERS:
            raise kept.refused("its model is too large")
        kept.fits(gmvae if part == "predictor" else flow.parts()[part])

    settings = config or kept.settings(TrainingConfig, "config")
    run = new_run(part, folder, model, settings, _statistics_of(kept), device)
    run.restore(kept)
    return run


def resumed_run(part: str, folder: Path, config: TrainingConfig, device: str = "cpu") -> Run:
    """The saved run with these settings; where its budget has grown since its rate fell, as it was
    before that.
    """
    name = f"{part}{BEFORE_COOLING}"
    if checkpoint_file(folder, name).exists():
        run = load_run(part, folder, config, device, name)
        # A share of the old budget in which the rate fell is less of a new one.
        if not run.is_cooling:
            return run

    return load_run(part, folder, config, device)


def uncooled_run(part: str, folder: Path) -> Run:
    """The saved run as it is; where its rate has begun to fall, as it was before that."""
    run, name = load_run(part, folder), f"{part}{BEFORE_COOLING}"
    if run.is_cooling and checkpoint_file(folder, name).exists():
        return load_run(part, folder, name=name)
    return run


def saved_runs(folder: Path) -> dict[str, Run]:
    """The latest checkpoints of a run's folder by part, the predictor's first."""
    parts = ("predictor", "upper", "lower", "whole")
    return {
        part: load_run(part, folder) for part in parts if checkpoint_file(folder, part).exists()
    }


def trained_networks(folder: Path) -> tuple[BodyFlow, ActionPredictor | None, Statistics]:
    """The flow, the predictor (of MoGlow none) and the statistics of a run's latest checkpoints,
    their weights averaged.
    """
    runs = saved_runs(folder)
    for run in runs.values():
        run.adopt_average()

    flows = {part: run for part, run in runs.items() if isinstance(run, FlowRun)}
    flow = next(iter(flows.values())).flow
    for part, run in flows.items():
        setattr(flow, part, run.network)

    predictor = runs.get("predictor")
    return (
        flow,
        predictor.network.predictor if isinstance(predictor, PredictorRun) else None,
        next(iter(runs.values())).statistics,
    )


def _statistics_of(kept: Checkpoint) -> Statistics:
    """What a checkpoint's run standardises with. Raises InputError where values cannot be
    standardised with it.
    """
    found = {}
    for what, size in (("pose", POSE_SIZE), ("velocity", VELOCITY_SIZE), ("ahead", AHEAD_SIZE)):
        for name in (f"{what}_mean", f"{what}_std"):
            like = torch.empty(size, dtype=torch.double)
            values = kept.tensor(f"statistics.{name}", like).numpy()
            if not np.isfinite(values).all() or (name.endswith("std") and (values <= 0.0).any()):
                raise kept.refused(f"'statistics.{name}' cannot be divided by or added")
            found[name] = values

    return Statistics(**found)
