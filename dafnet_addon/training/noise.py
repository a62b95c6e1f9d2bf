"""How real takes differ from one another in the flow's noise: what takes are drawn from.

The flow's noise is standard normal frame by frame, but not from frame to frame: along captured
motion a part of it lasts, and the rest comes and goes within a second. A vector of unit deviation
that is held is a body that nobody moves like, and one that holds only what lasts is a statue. So
takes draw both (``core.noise.TakeNoise``), as they are found along captured windows: temperature 1
is then how far, and how, real takes differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..core.noise import TAPS
from ..model.config import POSE_SIZE
from ..model.flow import BodyFlow
from ..model.predictor import ActionPredictor
from .batches import Batch, Pool, Statistics

__all__ = ["PartNoise", "noise_along", "part_noise", "take_noise"]

_SETTLED = 20
"""Frames in which the flow's memory fills."""
_AT_ONCE = 50
"""Windows."""
_HAIR = 1e-6
"""Of variance, for what a few windows leave out of the space."""


@dataclass(frozen=True)
class PartNoise:
    """What ``core.noise.TakeNoise`` holds, of a part of the body with n numbers: ``spread`` (n, n)
    is what lasts, ``passing`` (n, n) and ``taps`` (n, 49) what comes and goes.
    """

    spread: Tensor
    passing: Tensor
    taps: Tensor

    @staticmethod
    def shapes(size: int) -> dict[str, tuple[int, int]]:
        """The shapes of a part with so many numbers, by the names of the fields."""
        return {"spread": (size, size), "passing": (size, size), "taps": (size, TAPS)}

    def draw(self, windows: int, frames: int) -> Tensor:
        """Noise (B, T, n) at temperature 1, as takes draw it, of torch's own generator."""
        size, device = len(self.spread), self.spread.device
        held = torch.randn(windows, 1, size, device=device) @ self.spread.T
        white = torch.randn(windows, frames + TAPS - 1, size, device=device) @ self.passing.T

        filters = self.taps[:, None]
        passing = torch.nn.functional.conv1d(white.transpose(1, 2), filters, groups=size)
        return held + passing.transpose(1, 2)


@torch.no_grad()
def noise_along(
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    batch: Batch,
    parts: Sequence[str] | None = None,
) -> dict[str, Tensor]:
    """Noise of each of these parts (None: all) of the flow (B, T, …) along captured windows in FREE
    mode, each beside the captured parts before it.
    """
    observation = torch.zeros(*batch.upper.shape[:2], POSE_SIZE, device=batch.upper.device)
    given = observation[..., :22]
    base = batch.past
    if predictor is not None:
        base = torch.cat([predictor(batch.past, batch.occupancy), batch.root], dim=-1)

    pose = torch.cat([batch.upper, batch.lower], dim=-1)
    found = {}
    for name, part in flow.parts().items():
        if parts is None or name in parts:
            condition = flow.condition(name, base, observation, given, pose)
            found[name] = part(pose[..., flow.partition[name]], condition, batch.occupancy)[0]

    return found


def take_noise(
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    pool: Pool,
    statistics: Statistics,
    windows: int = 2000,
    parts: Sequence[str] | None = None,
) -> dict[str, np.ndarray]:
    """The tensors of ``TakeNoise``, by the parts' names and theirs, of as many windows: ``spread``
    (n, n), what lasts; ``passing`` (n, n); ``taps`` (n, 49). ``parts``: None for all.

    Poses are taken as they were captured, without the noise of the training: what comes and goes is
    then motion, not jitter.
    """
    rows = torch.randperm(len(pool), generator=torch.Generator().manual_seed(0))[:windows]
    found: dict[str, list[np.ndarray]] = {}
    for some in rows.split(_AT_ONCE):
        batch = pool.batch(some, statistics, flow.config, noise=0.0)
        for part, noise in noise_along(flow, predictor, batch, parts).items():
            found.setdefault(part, []).append(noise[:, _SETTLED:].double().cpu().numpy())

    tensors: dict[str, np.ndarray] = {}
    for part, noises in found.items():
        noise = np.concatenate(noises)
        mean = noise.mean(axis=1)
        passing = noise - mean[:, None]
        tensors[f"{part}.spread"] = _root(mean)
        tensors[f"{part}.passing"] = _root(passing.reshape(-1, passing.shape[-1]))
        tensors[f"{part}.taps"] = _filters(passing)

    return {name: tensor.astype(np.float32) for name, tensor in tensors.items()}


def part_noise(
    part: str,
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    pool: Pool,
    statistics: Statistics,
    windows: int,
) -> PartNoise:
    """What takes of a flow that is still learning would draw for one of its parts, on the pool's
    device.
    """
    found = take_noise(flow, predictor, pool, statistics, windows, [part])
    return PartNoise(
        **{
            name: torch.from_numpy(found[f"{part}.{name}"]).to(pool.device)
            for name in PartNoise.__annotations__
        }
    )


def _root(values: np.ndarray) -> np.ndarray:
    """Lower triangular L (n, n), of which L e, with e from N(0, I), varies as values (N, n) do."""
    moment = values.T @ values / len(values)
    return np.linalg.cholesky(moment + _HAIR * np.eye(len(moment)))


def _filters(passing: np.ndarray) -> np.ndarray:
    """Filters (n, 49) of unit length, of zero phase, under which white noise has the spectrum of
    series (N, T, n), each without its mean.
    """
    tapered = passing * np.hanning(passing.shape[1])[:, None]
    power = (np.abs(np.fft.rfft(tapered, axis=1)) ** 2).mean(axis=0)
    power[0] = 0.0  # is what lasts, which the taper lets through
    impulse = np.fft.irfft(np.sqrt(power), axis=0)
    middle = TAPS // 2
    taps = np.roll(impulse, middle, axis=0)[:TAPS].T
    return taps / np.linalg.norm(taps, axis=1, keepdims=True)
