"""SAMP, the paper's first comparison (section 6, Table 1): its MotionNet, how it is trained, and
how it walks on by itself.

Hassan et al. 2021, *Stochastic Scene-Aware Motion Prediction*: a conditional VAE whose decoder is a
mixture of experts makes the next state of the last one. Three systems: "samp" goes where its own
trajectory leads; "samp-a" is the same network, of which only the pose is fed back, all else being
the truth's; "samp-ob" has the same architecture but DAFNet's input, and makes poses alone (section
6.1: it "failed to generate plausible motions").
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor, nn

from ..core.beginning import PREROLL
from ..core.conditions import Shot
from ..core.inputs import velocities_up_to
from ..core.kinematics import on_bones
from ..core.root import RootPath, to_world
from ..core.sampler import Conditions
from ..core.skeleton import POSE_SIZE, smpl_order
from ..data.held_out.captured import HeldClip
from ..model.config import SENSOR_SIZE, ModelConfig
from ..training import precision
from ..training.batches import Pool, Statistics, given_for
from .samp_features import FIELDS, clip_track, goals_seen, states_at, window_tracks
from .samp_state import (
    LAST,
    NOW,
    OFFSETS,
    SENSOR,
    STATE,
    Parts,
    clean_place,
    goal_place,
    led_to_goal,
    network_input,
    next_input,
    placed_back,
    points_back,
    read_pose,
    seen_from,
    sensor_of,
    split_state,
    state_of,
)

__all__ = [
    "KINDS",
    "PAPER_SAMP",
    "SMALL_SAMP",
    "Blended",
    "MotionNet",
    "SampConfig",
    "SampTraining",
    "network_of",
    "roll_out_poses",
    "sample_takes",
]

KINDS = ("samp", "samp-a", "samp-ob")
# of samp-ob: the observation and its mask; then come past poses and velocities
_OBSERVED = POSE_SIZE + 22
_LIKE = ModelConfig(mask=True)
_PAST = _LIKE.history * POSE_SIZE
_KL = 0.1
"""Weight of z's divergence in the loss."""
_FORCED = 0.3
"""Share of the training until which the truth is fed."""
_FREE = 0.6
"""Share of it from which on what was made is fed."""
_LEAST = 2e-3
"""Smallest deviation of states (metres, metres a second, …)."""
_LEAST_SEEN = 0.05
"""Smallest deviation of voxels."""
_MEASURED = 256
"""Windows whose states are measured for their mean and deviation."""
_WIDE = 20.0
"""Deviations; what is fed back from farther off would soon not be a number."""
_PHASES = 50
"""Frames between way points, by which windows may be shifted."""


@dataclass(frozen=True)
class SampConfig:
    """``width``: of experts, and of the first layers of encoder and gating. ``code``: of the
    encoders' later layers. ``frames``: longest training sequence. ``mixed``: the loss is computed
    in bfloat16 where the device can, which halves its cost on a CPU.
    """

    width: int = 512
    code: int = 256
    experts: int = 12
    latent: int = 64
    frames: int = 60
    mixed: bool = False

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if name != "mixed" and not 1 <= value <= 1 << 16:
                raise ValueError(f"'{name}' must be 1 to {1 << 16}")


PAPER_SAMP = SampConfig()
SMALL_SAMP = SampConfig(width=192, code=128, mixed=True)
"""As wide as the flow that two CPU cores train."""


class Blended(nn.Module):
    """A linear layer of each expert, their outputs (which is the same as their weights) blended by
    ``shares`` (N, experts).
    """

    def __init__(self, inputs: int, outputs: int, experts: int) -> None:
        super().__init__()
        self.experts = experts
        self.linear = nn.Linear(inputs, experts * outputs)

    def forward(self, x: Tensor, shares: Tensor) -> Tensor:
        each = self.linear(x).unflatten(-1, (self.experts, -1))
        return torch.bmm(shares[:, None], each)[:, 0]


def _layers(*sizes: int) -> nn.Sequential:
    """Linear layers with an ELU after each."""
    return nn.Sequential(
        *(layer for a, b in pairwise(sizes) for layer in (nn.Linear(a, b), nn.ELU()))
    )


class MotionNet(nn.Module):
    """The last state (N, inputs) and the interaction sensor (N, sensor) to the next state (N,
    outputs), all standardised.

    The means and deviations that standardise are kept here, so that a state dict says all.
    """

    in_mean: Tensor
    in_std: Tensor
    out_mean: Tensor
    out_std: Tensor
    sensor_mean: Tensor
    sensor_std: Tensor

    def __init__(self, inputs: int, outputs: int, sensor: int, config: SampConfig) -> None:
        super().__init__()
        c = self.config = config
        self.state_encoder = _layers(inputs + outputs, c.width, c.code, c.code)
        self.sensor_encoder, self.interaction = (
            _layers(sensor, c.code, c.code, c.code) for _ in range(2)
        )
        self.posterior = nn.Linear(2 * c.code, 2 * c.latent)
        self.gating = nn.Sequential(
            _layers(c.latent + inputs, c.width, c.width // 2), nn.Linear(c.width // 2, c.experts)
        )
        self.first = Blended(c.latent + inputs + c.code, c.width, c.experts)
        self.second = Blended(c.latent + c.width, c.width, c.experts)
        self.third = Blended(c.latent + c.width, outputs, c.experts)
        for name, size in (("in", inputs), ("out", outputs), ("sensor", sensor)):
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_std", torch.ones(size))

    def encode(self, before: Tensor, after: Tensor, sensor: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and log variance (N, latent) of z, given the next state."""
        hidden = torch.cat(
            [self.state_encoder(torch.cat([before, after], -1)), self.sensor_encoder(sensor)], -1
        )
        mean, log_variance = self.posterior(hidden).chunk(2, dim=-1)
        return mean, log_variance

    def shares(self, z: Tensor, before: Tensor) -> Tensor:
        """How much of each expert (N, experts) is asked."""
        return torch.softmax(self.gating(torch.cat([z, before], dim=-1)), dim=-1)

    def decode(self, z: Tensor, before: Tensor, sensor: Tensor) -> Tensor:
        """The next state, given z (N, latent), which every layer takes as an input."""
        shares = self.shares(z, before)
        hidden = F.elu(self.first(torch.cat([z, before, self.interaction(sensor)], dim=-1), shares))
        hidden = F.elu(self.second(torch.cat([z, hidden], dim=-1), shares))
        return self.third(torch.cat([z, hidden], dim=-1), shares)

    def forward(
        self, before: Tensor, after: Tensor, sensor: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """The next state made with a z that knows it, and the mean and log variance of that."""
        mean, log_variance = self.encode(before, after, sensor)
        z = mean + (0.5 * log_variance).exp() * torch.randn_like(mean)
        return self.decode(z, before, sensor), mean, log_variance

    @torch.no_grad()
    def measure(self, name: str, values: Tensor, least: float) -> None:
        """Take mean and deviation of 'in', 'out' or 'sensor' from values (…, size)."""
        flat = values.flatten(0, -2)
        getattr(self, f"{name}_mean").copy_(flat.mean(0))
        getattr(self, f"{name}_std").copy_(flat.std(0).clamp_min(least))


def network_of(kind: str, config: SampConfig) -> MotionNet:
    """A new network of one of ``KINDS``."""
    if kind == "samp-ob":
        return MotionNet(_OBSERVED + _LIKE.scene_size, POSE_SIZE, SENSOR_SIZE, config)
    return MotionNet(STATE, STATE, SENSOR, config)


class SampTraining:
    """Gives the loss of a batch of windows. Predictions are fed back as in scheduled sampling,
    without their gradients, and the goal is always the true one, as the authors have it.
    """

    def __init__(
        self,
        kind: str,
        config: SampConfig,
        statistics: Statistics,
        device: torch.device | str,
        pool: Pool,
    ) -> None:
        self.kind, self.statistics, self.device = kind, statistics, torch.device(device)
        self.config = replace(config, mixed=config.mixed and precision.is_available(str(device)))
        self.network: MotionNet = network_of(kind, config)
        if kind == "samp-ob":
            _take_statistics(self.network, statistics)
        else:
            before, after, sensor = self._states(pool, torch.arange(min(_MEASURED, len(pool))))[:3]
            self.network.measure("in", before, _LEAST)
            self.network.measure("out", after, _LEAST)
            self.network.measure("sensor", sensor, _LEAST_SEEN)

        self.network.to(self.device)

    def _states(self, pool: Pool, rows: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """States (B, F, 647), the next ones, sensors (B, F, 2048) and goals (B, F, 13, 11) of
        windows.
        """
        phases = torch.randint(_PHASES, (len(rows),)).numpy()
        track, at = window_tracks(pool.windows(rows, FIELDS), phases)
        first = int(torch.randint(max(1, len(at) - self.config.frames + 1), ()))
        at = at[first : first + self.config.frames]
        now, then = states_at(track, at, at), states_at(track, at + 1, at)
        aim = now.goal[:, :, NOW]
        after = state_of(then, now.trajectory[:, :, LAST, :4], goal_place(aim))
        return network_input(now), after, sensor_of(track.solid[track.which[:, at]], aim), now.goal

    def loss(self, pool: Pool, rows: Tensor, share: float) -> Tensor:
        """Squared error, summed over a state, and 0.1 of z's KL divergence, means over the frames
        of windows ``rows``.

        ``share`` of the training is done.
        """
        net = self.network
        if self.kind == "samp-ob":
            batch = pool.batch(rows, self.statistics, _LIKE)
            given, pose = given_for(batch.upper), torch.cat([batch.upper, batch.lower], dim=-1)
            observation = pose * given.repeat_interleave(3, dim=-1)
            frames = slice(0, self.config.frames)
            before = torch.cat([observation, given, batch.past], dim=-1)[:, frames]
            after = pose[:, frames]
            sensor = batch.occupancy[:, frames]
            known = before

            def fed(t: int, last: Tensor, made: Tensor) -> Tensor:
                return _with_own_past(known[:, t], last, made)

        else:
            before, after, sensor, goals = (a.to(self.device) for a in self._states(pool, rows))
            before = (before - net.in_mean) / net.in_std
            after = (after - net.out_mean) / net.out_std
            sensor = (sensor - net.sensor_mean) / net.sensor_std

            def fed(t: int, last: Tensor, made: Tensor) -> Tensor:
                parts, _ = split_state(made * net.out_std + net.out_mean)
                return (network_input(next_input(parts, goals[:, t])) - net.in_mean) / net.in_std

        before = self._scheduled(before, after, sensor, share, fed)
        before, after, sensor = (a.flatten(0, 1) for a in (before, after, sensor))
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.config.mixed):
            made, mean, log_variance = (a.float() for a in net(before, after, sensor))

        kl = 0.5 * (mean.square() + log_variance.exp() - 1.0 - log_variance).sum(-1).mean()
        return (made - after).square().sum(-1).mean() + _KL * kl

    @torch.no_grad()
    def _scheduled(
        self,
        before: Tensor,
        after: Tensor,
        sensor: Tensor,
        share: float,
        fed: Callable[[int, Tensor, Tensor], Tensor],
    ) -> Tensor:
        """Scheduled sampling: ``before`` (B, F, …), in which ever more frames are what the network
        itself makes of the frames before.

        ``fed``: a frame's number, what was fed before it and what was made of that, to what is fed.
        """
        truth = min(1.0, max(0.0, (_FREE - share) / (_FREE - _FORCED)))
        out = [before[:, 0]]
        for t, drawn in enumerate(torch.rand(before.shape[1] - 1).tolist()):
            if drawn < truth:
                out.append(before[:, t + 1])
            else:
                made, _, _ = self.network(out[t], after[:, t], sensor[:, t])
                out.append(fed(t + 1, out[t], made.clamp(-_WIDE, _WIDE)))

        return torch.stack(out, dim=1)


def _take_statistics(network: MotionNet, statistics: Statistics) -> None:
    """What standardises samp-ob's input and pose: the flow's own means and deviations."""
    for name, constant in (("mean", 0.0), ("std", 1.0)):
        pose, velocity = (getattr(statistics, f"{what}_{name}") for what in ("pose", "velocity"))
        past = [pose] * _LIKE.history + [velocity] * (_LIKE.history + 1)
        inputs = np.concatenate([pose, np.full(22, constant), *past])
        getattr(network, f"in_{name}").copy_(torch.from_numpy(inputs))
        getattr(network, f"out_{name}").copy_(torch.from_numpy(pose))


def _with_own_past(known: Tensor, last: Tensor, made: Tensor) -> Tensor:
    """What samp-ob is fed (B, 781): what is ``known`` but for past poses, which are its ``last``
    ones and the one made.
    """
    poses = torch.cat([last[:, _OBSERVED + POSE_SIZE : _OBSERVED + _PAST], made], dim=-1)
    return torch.cat([known[:, :_OBSERVED], poses, known[:, _OBSERVED + _PAST :]], dim=-1)


@torch.no_grad()
def _roll_out(
    network: MotionNet, clip: HeldClip, path: RootPath, noise: Tensor, own_root: bool
) -> np.ndarray:
    """World joints (S, T, 22, 3) that follow from a clip's first pose, of ``noise`` (S, T, latent).

    With its ``own_root``, the character goes where its trajectory leads, and is given the clip's
    goals one after another; else root, trajectory, contacts and goals are the clip's along
    ``path``, and its own pose alone is fed back.
    """
    one, at = clip_track(clip, path)
    track = one.repeated(len(noise))
    truth, start = states_at(track, at, at), int(at[0])

    parts = Parts(truth.pose[:, 0], truth.trajectory[:, 0], truth.contacts[:, 0], truth.goal[:, 0])
    past = [torch.cat([track.root[:, f], track.action[:, f]], dim=-1) for f in range(start + 1)]
    root = track.root[:, start]
    joints = [points_back(parts.pose[..., :3], root[:, None])]

    for t, frame in enumerate(at[1:].tolist(), 1):
        seen = sensor_of(track.solid[track.which[:, frame - 1]], parts.goal[:, NOW])
        sensor = (seen - network.sensor_mean) / network.sensor_std
        before = (network_input(parts) - network.in_mean) / network.in_std
        state = network.decode(noise[:, t], before, sensor).clamp(-_WIDE, _WIDE)
        made, from_goal = split_state(state * network.out_std + network.out_mean)
        made = read_pose(made, parts.pose)

        if own_root:
            made = led_to_goal(made, from_goal, parts.goal)
            root = placed_back(clean_place(made.trajectory[:, NOW, :4]), root)
            parts = next_input(made, goals_seen(track, at[t : t + 1], root[:, None])[:, 0])
            past.append(torch.cat([root, parts.trajectory[:, NOW, 4:]], dim=-1))

            walked = torch.stack([past[frame + k] for k in OFFSETS[:NOW].tolist()], dim=1)
            walked = torch.cat([seen_from(walked[..., :4], root[:, None]), walked[..., 4:]], dim=-1)
            parts = replace(parts, trajectory=torch.cat([walked, parts.trajectory[:, NOW:]], dim=1))
        else:
            pose = next_input(made, parts.goal, seen_from(track.root[:, frame], root)).pose
            root = track.root[:, frame]
            parts = Parts(pose, truth.trajectory[:, t], truth.contacts[:, t], truth.goal[:, t])

        joints.append(points_back(parts.pose[..., :3], root[:, None]))

    return torch.stack(joints, dim=1).double().numpy()


@torch.no_grad()
def roll_out_poses(network: MotionNet, conditions: Conditions, z: np.ndarray) -> np.ndarray:
    """Poses (T, B, 66), SMPL order, metres, of samp-ob, each fed back: of ``z`` (B, latent) held,
    or (T, B, latent).

    The past is the mean pose at first.
    """
    frames = len(conditions)
    noise = torch.from_numpy(np.broadcast_to(z, (frames, *z.shape[-2:])).copy()).float()

    given = np.repeat(conditions.given, 3, axis=-1)
    free = np.where(given > 0, conditions.observation, network.out_mean.numpy())
    velocity = velocities_up_to(conditions.velocity, _LIKE.history)
    poses = np.tile(network.out_mean.numpy(), (frames, _LIKE.history))
    inputs = np.concatenate([free, conditions.given, poses, velocity], axis=1)
    known = (torch.from_numpy(inputs).float() - network.in_mean) / network.in_std
    seen = torch.from_numpy(conditions.occupancy).float()

    last = known[0].repeat(noise.shape[1], 1)
    out = []
    for t in range(frames):
        made = network.decode(noise[t], last, seen[t].expand(len(last), -1)).clamp(-_WIDE, _WIDE)
        out.append(made * network.out_std + network.out_mean)
        last = _with_own_past(known[min(t + 1, frames - 1)].expand(len(last), -1), last, made)

    return smpl_order(torch.stack(out).double().numpy())


def sample_takes(
    network: MotionNet, clip: HeldClip, shot: Shot, seeds: Sequence[int | None], kind: str
) -> np.ndarray:
    """Takes (S, T, 22, 3) of a clip, world joints on constant bones, one for each seed; None is z =
    0, its mean.

    As in SAMP, z is drawn anew for each frame. ``shot`` is what DAFNet is given of the clip.
    """
    frames = len(shot.conditions)
    noise = np.zeros((len(seeds), frames, network.config.latent))
    for s, seed in enumerate(seeds):
        if seed is not None:
            rng = np.random.default_rng([abs(seed), int(seed < 0)])
            noise[s] = rng.standard_normal(noise[s].shape)

    if kind == "samp-ob":
        poses = roll_out_poses(network, shot.conditions, noise.swapaxes(0, 1))
        joints = [
            to_world(shot.path, poses[PREROLL:, s].reshape(-1, 22, 3)) for s in range(len(seeds))
        ]
    else:
        drawn = torch.from_numpy(noise).float()
        joints = list(_roll_out(network, clip, shot.path, drawn, own_root=kind == "samp"))

    return np.stack([on_bones(take) for take in joints])
