"""The two-part normalizing flow (paper, sections 3 and 4.3, Appendix A; flow step after MoGlow and
Glow).

Every transform keeps one small contract. ``forward(x, condition)`` goes from pose to noise and
returns (y, log_det, state), ``inverse(y, condition)`` from noise to pose and returns (x, state).
Sequences are (batch, time, features); log_det is (batch, time); ``state`` is what the recurrent
part must be given to go on with the next frames, None at the start.
"""

import math
from typing import cast

import torch
from torch import Tensor, nn

from ..core.sampler import Sampler
from .config import SENSOR_SIZE, ModelConfig

__all__ = [
    "ActNorm",
    "InvertibleLinear",
    "Coupling",
    "PartFlow",
    "EnvironmentEncoder",
    "BodyFlow",
    "TwoPartFlow",
]

LSTMState = tuple[Tensor, Tensor]


class ActNorm(nn.Module):
    """y = (x + bias) · exp(log_scale), one pair for each feature, set by the first batch to whiten
    it.
    """

    def __init__(self, size: int) -> None:
        super().__init__()
        self.bias = nn.Parameter(torch.zeros(size))
        self.log_scale = nn.Parameter(torch.zeros(size))

    @torch.no_grad()
    def initialise(self, x: Tensor) -> None:
        """Zero mean and unit deviation over batch and time; the deviation is floored, constant
        features must not explode.
        """
        flat = x.reshape(-1, x.shape[-1])
        self.bias.copy_(-flat.mean(0))
        self.log_scale.copy_(-flat.std(0).clamp_min(0.05).log())

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        log_det = self.log_scale.sum().expand(x.shape[:-1])
        return (x + self.bias) * self.log_scale.exp(), log_det

    def inverse(self, y: Tensor) -> Tensor:
        return y * (-self.log_scale).exp() - self.bias


class InvertibleLinear(nn.Module):
    """y = x Wᵀ with W = P L (U + diag(sign · exp(log_s))): Glow's invertible 1×1 convolution by
    LU.
    """

    permutation: Tensor
    sign: Tensor

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("permutation", torch.empty(size, size))
        self.register_buffer("sign", torch.empty(size))
        self.log_s = nn.Parameter(torch.empty(size))
        self.lower, self.upper = (nn.Parameter(torch.empty(size, size)) for _ in range(2))
        self.adopt(torch.linalg.qr(torch.randn(size, size))[0])

    @torch.no_grad()
    def adopt(self, weight: Tensor) -> None:
        """Become ``weight`` (size, size), an invertible matrix."""
        p, lower, upper = torch.linalg.lu(weight)
        self.permutation.copy_(p)
        self.sign.copy_(upper.diagonal().sign())
        self.log_s.copy_(upper.diagonal().abs().log())
        self.lower.copy_(lower.tril(-1))
        self.upper.copy_(upper.triu(1))

    def factors(self) -> tuple[Tensor, Tensor]:
        eye = torch.eye(len(self.log_s), dtype=self.log_s.dtype, device=self.log_s.device)
        return self.lower.tril(-1) + eye, self.upper.triu(1) + torch.diag(
            self.sign * self.log_s.exp()
        )

    def weight(self) -> Tensor:
        lower, upper = self.factors()
        return self.permutation @ lower @ upper

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        return x @ self.weight().T, self.log_s.sum().expand(x.shape[:-1])

    def inverse_weight(self) -> Tensor:
        """W⁻¹ by two triangular solves."""
        lower, upper = self.factors()
        half = torch.linalg.solve_triangular(
            lower, self.permutation.T, upper=False, unitriangular=True
        )
        return torch.linalg.solve_triangular(upper, half, upper=True)

    def inverse(self, y: Tensor) -> Tensor:
        return y @ self.inverse_weight().T


class Coupling(nn.Module):
    """Affine coupling: the first half passes; an LSTM on it and the condition gives shift and scale
    of the second.

    ``mixed``: the LSTM computes in bfloat16. What the flow itself computes, and inverts, stays
    single.
    """

    mixed = False

    def __init__(self, size: int, condition: int, width: int, layers: int) -> None:
        super().__init__()
        self.passes = size // 2
        self.lstm = nn.LSTM(self.passes + condition, width, layers, batch_first=True)
        self.out = nn.Linear(width, 2 * (size - self.passes))
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def _affine(
        self, passed: Tensor, condition: Tensor, state: LSTMState | None
    ) -> tuple[Tensor, Tensor, LSTMState]:
        with torch.autocast(passed.device.type, torch.bfloat16, enabled=self.mixed):
            hidden, state = self.lstm(torch.cat([passed, condition], dim=-1), state)
            hidden = hidden.to(passed.dtype)
        shift, raw = self.out(hidden).chunk(2, dim=-1)
        return shift, torch.sigmoid(raw + 2.0) + 1e-6, state

    def forward(
        self, x: Tensor, condition: Tensor, state: LSTMState | None = None
    ) -> tuple[Tensor, Tensor, LSTMState]:
        passed, changed = x[..., : self.passes], x[..., self.passes :]
        shift, scale, state = self._affine(passed, condition, state)
        return torch.cat([passed, (changed + shift) * scale], dim=-1), scale.log().sum(-1), state

    def inverse(
        self, y: Tensor, condition: Tensor, state: LSTMState | None = None
    ) -> tuple[Tensor, LSTMState]:
        passed, changed = y[..., : self.passes], y[..., self.passes :]
        shift, scale, state = self._affine(passed, condition, state)
        return torch.cat([passed, changed / scale - shift], dim=-1), state


class PartFlow(nn.Module):
    """K flow steps over one part of the body, with what encodes the environment for them.

    ``condition`` (B, T, C): all that is known beside the environment; ``occupancy`` (B, T, 2640).
    """

    def __init__(self, size: int, steps: int, config: ModelConfig) -> None:
        super().__init__()
        self.encoders = nn.ModuleList(
            EnvironmentEncoder(config.code) for _ in range(1 if config.shared_encoder else steps)
        )
        self.norms = nn.ModuleList(ActNorm(size) for _ in range(steps))
        self.linears = nn.ModuleList(InvertibleLinear(size) for _ in range(steps))
        self.couplings = nn.ModuleList(
            Coupling(size, config.condition_size, config.width, config.layers) for _ in range(steps)
        )

    def steps(self) -> list[tuple[ActNorm, InvertibleLinear, Coupling]]:
        """The flow steps in order, pose to noise."""
        return cast(
            "list[tuple[ActNorm, InvertibleLinear, Coupling]]",
            list(zip(self.norms, self.linears, self.couplings, strict=True)),
        )

    def _conditions(self, condition: Tensor, occupancy: Tensor) -> list[Tensor]:
        """One condition for each step: with a shared encoder, the same one."""
        each = [torch.cat([condition, encoder(occupancy)], dim=-1) for encoder in self.encoders]
        return each * (len(self.norms) // len(each))

    def _to_noise(
        self,
        x: Tensor,
        conditions: list[Tensor],
        states: list[LSTMState] | None,
        initialise: bool = False,
    ) -> tuple[Tensor, Tensor, list[LSTMState]]:
        total = x.new_zeros(x.shape[:-1])
        after = []
        for k, (norm, linear, coupling) in enumerate(self.steps()):
            if initialise:
                norm.initialise(x)
            x, a = norm(x)
            x, b = linear(x)
            x, c, state = coupling(x, conditions[k], None if states is None else states[k])
            total = total + a + b + c
            after.append(state)
        return x, total, after

    def _to_pose(
        self, z: Tensor, conditions: list[Tensor], states: list[LSTMState] | None
    ) -> tuple[Tensor, list[LSTMState]]:
        after: list[LSTMState] = []
        for k, (norm, linear, coupling) in reversed(list(enumerate(self.steps()))):
            z, state = coupling.inverse(z, conditions[k], None if states is None else states[k])
            z = norm.inverse(linear.inverse(z))
            after.insert(0, state)
        return z, after

    def forward(
        self,
        x: Tensor,
        condition: Tensor,
        occupancy: Tensor,
        states: list[LSTMState] | None = None,
        initialise: bool = False,
    ) -> tuple[Tensor, Tensor, list[LSTMState]]:
        return self._to_noise(x, self._conditions(condition, occupancy), states, initialise)

    def inverse(
        self, z: Tensor, condition: Tensor, occupancy: Tensor, states: list[LSTMState] | None = None
    ) -> tuple[Tensor, list[LSTMState]]:
        return self._to_pose(z, self._conditions(condition, occupancy), states)

    def log_likelihood(
        self, x: Tensor, condition: Tensor, occupancy: Tensor, initialise: bool = False
    ) -> Tensor:
        """Log density (B, T) in standardised units (equation 2)."""
        z, log_det, _ = self(x, condition, occupancy, initialise=initialise)
        return _log_density(z, log_det)

    def run_on(
        self, x: Tensor, condition: Tensor, occupancy: Tensor, z: Tensor, kept: int
    ) -> tuple[Tensor, Tensor]:
        """Log density (B, T) of ``x``, and what the noise ``z`` (B, size), held constant, makes of
        the frames after the first ``kept`` (B, T − kept, size), with the memory that those have
        left.

        No pose enters the flow but through its memory, so making all frames costs what measuring
        them does.
        """
        conditions = self._conditions(condition, occupancy)
        before, after = [c[:, :kept] for c in conditions], [c[:, kept:] for c in conditions]
        z_before, det_before, states = self._to_noise(x[:, :kept], before, None)
        z_after, det_after, _ = self._to_noise(x[:, kept:], after, states)
        made, _ = self._to_pose(z[:, None].expand(-1, x.shape[1] - kept, -1), after, states)
        return torch.cat(
            [_log_density(z_before, det_before), _log_density(z_after, det_after)], dim=1
        ), made


def _log_density(z: Tensor, log_det: Tensor) -> Tensor:
    return -0.5 * (z.square() + math.log(2.0 * math.pi)).sum(-1) + log_det


class EnvironmentEncoder(nn.Module):
    """Occupancy (…, 2640) to a code: Linear, ReLU, Linear (paper, Table 4). ``mixed``: in
    bfloat16.
    """

    mixed = False

    def __init__(self, code: int) -> None:
        super().__init__()
        self.first = nn.Linear(SENSOR_SIZE, code)
        self.second = nn.Linear(code, code)

    def forward(self, occupancy: Tensor) -> Tensor:
        with torch.autocast(occupancy.device.type, torch.bfloat16, enabled=self.mixed):
            return self.second(torch.relu(self.first(occupancy))).to(occupancy.dtype)


class BodyFlow(nn.Module):
    """One flow for each part of the body, made one after another: a part's observation is updated
    by the parts before it.

    Everything here is standardised. ``pose`` (B, T, 66): the upper body first, in the order of
    ``skeleton.UPPER``; ``base`` (B, T, K + 3): action probabilities and root velocity;
    ``occupancy`` (B, T, 2640); ``observation`` (B, T, 66): in the order of a pose, zero where free;
    ``given`` (B, T, 22): 1 where a joint of that order is given.
    """

    places: dict[str, slice]
    """The parts in the order of sampling, and their places in a pose."""

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        for name, columns in self.places.items():
            steps = getattr(config, f"steps_{name}")
            self.add_module(name, PartFlow(columns.stop - columns.start, steps, config))

    def parts(self) -> dict[str, PartFlow]:
        """The flows by name, in the order of sampling."""
        return {name: getattr(self, name) for name in self.places}

    def condition(
        self, part: str, base: Tensor, observation: Tensor, given: Tensor, pose: Tensor
    ) -> Tensor:
        """What a part is told beside the environment (B, T, K + 3 + 66 [+ 22]): the slots of the
        parts before it are those of ``pose``, which is the true one, or the one being made.
        """
        observation, given = observation.clone(), given.clone()
        for name, columns in self.places.items():
            if name == part:
                break
            observation[..., columns] = pose[..., columns]
            given[..., columns.start // 3 : columns.stop // 3] = 1.0
        return torch.cat(
            [base, observation, given] if self.config.mask else [base, observation], dim=-1
        )


class TwoPartFlow(BodyFlow):
    """The upper body's flow, then the lower's, whose observation is updated by the upper body
    (paper, figure 5).
    """

    places = Sampler.parts
    upper: PartFlow
    lower: PartFlow

    def forward(
        self,
        upper: Tensor,
        lower: Tensor,
        base: Tensor,
        occupancy: Tensor,
        observation: Tensor,
        given: Tensor,
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Noise of both parts (B, T, 42), (B, T, 24) and both log-determinants (B, T)."""
        pose = torch.cat([upper, lower], dim=-1)
        z_upper, det_upper, _ = self.upper(
            upper, self.condition("upper", base, observation, given, pose), occupancy
        )
        z_lower, det_lower, _ = self.lower(
            lower, self.condition("lower", base, observation, given, pose), occupancy
        )
        return z_upper, z_lower, det_upper, det_lower

    def inverse(
        self,
        z_upper: Tensor,
        z_lower: Tensor,
        base: Tensor,
        occupancy: Tensor,
        observation: Tensor,
        given: Tensor,
    ) -> Tensor:
        """Pose (B, T, 66), upper part first, of noise: one part, then the other under or over
        it.
        """
        noise = torch.cat([z_upper, z_lower], dim=-1)
        pose = torch.zeros_like(noise)
        for name, columns in self.places.items():
            told = self.condition(name, base, observation, given, pose)
            pose[..., columns], _ = self.parts()[name].inverse(noise[..., columns], told, occupancy)
        return pose
