"""The normalizing flow over poses (paper, sections 3 and 4.3, Appendix A; flow step after MoGlow
and Glow).

Every transform keeps one contract, for sequences x, y (B, T, features) of one batch:

- ``forward(x, *condition, state)`` goes from pose to noise and returns ``Forward(y, log_det,
  state)``, log_det (B, T) of the Jacobian at each frame;
- ``inverse(y, *condition, state)`` goes from noise to pose and returns ``Inverse(x, state)``.

``condition`` are tensors (B, T, …): one for what makes up a flow step, two for ``PartFlow``, which
encodes the second, the occupancy, and more for ``BodyFlow``. ``state`` is the memory of the frames
before, None at the start of a sequence; what is given back goes in with the next frames. A
transform without a condition or a memory takes them all the same, and gives the state back as it
came.
"""

import math
from typing import Any, NamedTuple, cast

import torch
from torch import Tensor, nn

from .config import SENSOR_SIZE, ModelConfig
from .systems import system_named

__all__ = [
    "ActNorm",
    "BodyFlow",
    "Coupling",
    "EnvironmentEncoder",
    "Forward",
    "InvertibleLinear",
    "Inverse",
    "PartFlow",
]

LSTMState = tuple[Tensor, Tensor]


class Forward(NamedTuple):
    """Noise ``y``, the log-determinant of the way to it, and the state to go on with."""

    y: Tensor
    log_det: Tensor
    state: Any


class Inverse(NamedTuple):
    """A pose ``x``, and the state to go on with."""

    x: Tensor
    state: Any


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

    def forward(
        self, x: Tensor, condition: Tensor | None = None, state: LSTMState | None = None
    ) -> Forward:
        log_det = self.log_scale.sum().expand(x.shape[:-1])
        return Forward((x + self.bias) * self.log_scale.exp(), log_det, state)

    def inverse(
        self, y: Tensor, condition: Tensor | None = None, state: LSTMState | None = None
    ) -> Inverse:
        return Inverse(y * (-self.log_scale).exp() - self.bias, state)


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

    def forward(
        self, x: Tensor, condition: Tensor | None = None, state: LSTMState | None = None
    ) -> Forward:
        return Forward(x @ self.weight().T, self.log_s.sum().expand(x.shape[:-1]), state)

    def inverse_weight(self) -> Tensor:
        """W⁻¹ by two triangular solves."""
        lower, upper = self.factors()
        half = torch.linalg.solve_triangular(
            lower, self.permutation.T, upper=False, unitriangular=True
        )
        return torch.linalg.solve_triangular(upper, half, upper=True)

    def inverse(
        self, y: Tensor, condition: Tensor | None = None, state: LSTMState | None = None
    ) -> Inverse:
        return Inverse(y @ self.inverse_weight().T, state)


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
        self.lstm = nn.LSTM(self.passes + condition, width, layers)
        self.out = nn.Linear(width, 2 * (size - self.passes))
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def _affine(
        self, passed: Tensor, condition: Tensor, state: LSTMState | None
    ) -> tuple[Tensor, Tensor, LSTMState]:
        # An LSTM wants time first: joined in that order, nothing is put in another order again.
        told = torch.cat(
            [passed.transpose(0, 1).to(condition.dtype), condition.transpose(0, 1)], -1
        )
        with torch.autocast(passed.device.type, torch.bfloat16, enabled=self.mixed):
            hidden, state = self.lstm(told, state)
        shift, raw = self.out(hidden.to(passed.dtype)).transpose(0, 1).chunk(2, dim=-1)
        return shift, torch.sigmoid(raw + 2.0) + 1e-6, state

    def forward(self, x: Tensor, condition: Tensor, state: LSTMState | None = None) -> Forward:
        passed, changed = x[..., : self.passes], x[..., self.passes :]
        shift, scale, state = self._affine(passed, condition, state)
        y = torch.cat([passed, (changed + shift) * scale], dim=-1)
        return Forward(y, scale.log().sum(-1), state)

    def inverse(self, y: Tensor, condition: Tensor, state: LSTMState | None = None) -> Inverse:
        passed, changed = y[..., : self.passes], y[..., self.passes :]
        shift, scale, state = self._affine(passed, condition, state)
        return Inverse(torch.cat([passed, changed / scale - shift], dim=-1), state)


class PartFlow(nn.Module):
    """K flow steps over one part of the body, with what encodes the environment for them.

    Its condition is all that is known beside the environment (B, T, C), and the occupancy (B, T,
    2640). Its state is a list of the steps' states.
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

    def forward(
        self,
        x: Tensor,
        condition: Tensor,
        occupancy: Tensor,
        state: list[LSTMState] | None = None,
        initialise: bool = False,
    ) -> Forward:
        """``initialise``: the activation norms are set to whiten this batch, step by step."""
        return self._to_noise(x, self._conditions(condition, occupancy), state, initialise)

    def inverse(
        self, y: Tensor, condition: Tensor, occupancy: Tensor, state: list[LSTMState] | None = None
    ) -> Inverse:
        return self._to_pose(y, self._conditions(condition, occupancy), state)

    def log_likelihood(
        self, x: Tensor, condition: Tensor, occupancy: Tensor, initialise: bool = False
    ) -> Tensor:
        """Log density (B, T) in standardised units (equation 2)."""
        z, log_det, _ = self(x, condition, occupancy, initialise=initialise)
        return _log_density(z, log_det)

    def free_run(
        self, x: Tensor, condition: Tensor, occupancy: Tensor, z: Tensor, kept: int
    ) -> tuple[Tensor, Tensor]:
        """Log density (B, T) of ``x``, and what the noise ``z`` (B, T − kept, size) makes of the
        frames after the first ``kept``, as many poses, with the memory that those have left.

        No pose enters the flow but through its memory, so making all frames costs what measuring
        them does.
        """
        conditions = self._conditions(condition, occupancy)
        before = [each[:, :kept] for each in conditions]
        after = [each[:, kept:] for each in conditions]

        z_before, det_before, state = self._to_noise(x[:, :kept], before, None)
        z_after, det_after, _ = self._to_noise(x[:, kept:], after, state)
        poses, _ = self._to_pose(z, after, state)

        densities = [_log_density(z_before, det_before), _log_density(z_after, det_after)]
        return torch.cat(densities, dim=1), poses

    def _conditions(self, condition: Tensor, occupancy: Tensor) -> list[Tensor]:
        """One condition for each step, with a shared encoder the same one; time first in memory,
        and as wide as the couplings compute.
        """
        wide = torch.bfloat16 if self.couplings[0].mixed else condition.dtype
        known = condition.transpose(0, 1).to(wide)
        each = [
            torch.cat([known, encoder(occupancy).transpose(0, 1).to(wide)], dim=-1).transpose(0, 1)
            for encoder in self.encoders
        ]
        return each * (len(self.norms) // len(each))

    def _to_noise(
        self,
        x: Tensor,
        conditions: list[Tensor],
        states: list[LSTMState] | None,
        initialise: bool = False,
    ) -> Forward:
        total = x.new_zeros(x.shape[:-1])
        after = []
        for k, step in enumerate(self.steps()):
            if initialise:
                step[0].initialise(x)

            state = None if states is None else states[k]
            for transform in step:
                x, log_det, state = transform(x, conditions[k], state)
                total = total + log_det

            after.append(state)

        return Forward(x, total, after)

    def _to_pose(
        self, z: Tensor, conditions: list[Tensor], states: list[LSTMState] | None
    ) -> Inverse:
        after = []
        for k, step in reversed(list(enumerate(self.steps()))):
            state = None if states is None else states[k]
            for transform in reversed(step):
                z, state = transform.inverse(z, conditions[k], state)
            after.append(state)
        return Inverse(z, after[::-1])


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
            return self.second(torch.relu(self.first(occupancy)))


class BodyFlow(nn.Module):
    """One flow for each part of the body, made one after another: a part's observation is updated
    by the parts before it (paper, figure 5). Which parts, ``config.system`` says.

    Everything here is standardised. A pose (B, T, 66) is in the model's order, the upper body
    first. The condition: ``base`` (B, T, K + 3), action probabilities and root velocity, of MoGlow
    (B, T, 693), past poses and velocities; ``occupancy`` (B, T, 2640); ``observation`` (B, T, 66),
    in the order of a pose, zero where free; ``given`` (B, T, 22), 1 where a joint of that order is
    given. The state is a dictionary of the parts' states.

    Raises InputError where the system is unknown.
    """

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        self.partition = system_named(config.system).partition
        for name, columns in self.partition.items():
            steps = getattr(config, f"steps_{name}")
            self.add_module(name, PartFlow(columns.stop - columns.start, steps, config))

    def parts(self) -> dict[str, PartFlow]:
        """The flows by name, in the order of making."""
        return {name: getattr(self, name) for name in self.partition}

    def condition(
        self, part: str, base: Tensor, observation: Tensor, given: Tensor, pose: Tensor
    ) -> Tensor:
        """What a part is given beside the environment (B, T, K + 3 + 66 [+ 22]): the slots of the
        parts before it are those of ``pose``, which is the true one, or the one being made.
        """
        observation, given = observation.clone(), given.clone()
        for name, columns in self.partition.items():
            if name == part:
                break
            observation[..., columns] = pose[..., columns]
            given[..., columns.start // 3 : columns.stop // 3] = 1.0

        return torch.cat(
            [base, observation, given] if self.config.mask else [base, observation], dim=-1
        )

    def forward(
        self,
        x: Tensor,
        base: Tensor,
        occupancy: Tensor,
        observation: Tensor,
        given: Tensor,
        state: dict[str, list[LSTMState]] | None = None,
    ) -> Forward:
        noise, total = torch.zeros_like(x), x.new_zeros(x.shape[:-1])
        after = {}
        for name, part in self.parts().items():
            columns = self.partition[name]
            known = self.condition(name, base, observation, given, x)
            before = None if state is None else state[name]
            noise[..., columns], log_det, after[name] = part(
                x[..., columns], known, occupancy, before
            )
            total = total + log_det

        return Forward(noise, total, after)

    def inverse(
        self,
        y: Tensor,
        base: Tensor,
        occupancy: Tensor,
        observation: Tensor,
        given: Tensor,
        state: dict[str, list[LSTMState]] | None = None,
    ) -> Inverse:
        pose = torch.zeros_like(y)
        after = {}
        for name, part in self.parts().items():
            columns = self.partition[name]
            known = self.condition(name, base, observation, given, pose)
            before = None if state is None else state[name]
            pose[..., columns], after[name] = part.inverse(
                y[..., columns], known, occupancy, before
            )

        return Inverse(pose, after)
