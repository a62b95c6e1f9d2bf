"""How real takes differ from one another in the flow's noise: what takes are drawn from.

The flow's noise is standard normal frame by frame, but not from frame to frame: along captured
motion a part of it lasts, and the rest comes and goes within a second. A vector of unit deviation
that is held is a body that nobody moves like, and one that holds only what lasts is a statue. So
takes draw both (``core.noise.TakeNoise``), as they are found along captured windows: temperature 1
is then how far, and how, real takes differ.
"""

import numpy as np
import torch

from ..core.noise import TAPS
from ..model.config import POSE_SIZE
from ..model.flow import BodyFlow
from ..model.predictor import ActionPredictor
from .batches import Batch, Pool, Statistics

__all__ = ["noise_along", "take_noise"]

_SETTLED = 20  # frames in which the memory fills
_AT_ONCE = 50  # windows
_HAIR = 1e-6  # of variance, for what a few windows leave out of the space


@torch.no_grad()
def noise_along(
    flow: BodyFlow, predictor: ActionPredictor | None, batch: Batch
) -> dict[str, torch.Tensor]:
    """Noise of each part (B, T, …) along captured windows in FREE mode, each beside the captured
    parts before it.
    """
    observation = torch.zeros(*batch.upper.shape[:2], POSE_SIZE, device=batch.upper.device)
    given = observation[..., :22]
    told = batch.past
    if predictor is not None:
        told = torch.cat([predictor(batch.past, batch.occupancy), batch.root], dim=-1)

    pose = torch.cat([batch.upper, batch.lower], dim=-1)
    conditions = {
        name: flow.condition(name, told, observation, given, pose) for name in flow.partition
    }
    return {
        name: part(pose[..., flow.partition[name]], conditions[name], batch.occupancy)[0]
        for name, part in flow.parts().items()
    }


def take_noise(
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    pool: Pool,
    statistics: Statistics,
    windows: int = 2000,
) -> dict[str, np.ndarray]:
    """The tensors of ``TakeNoise``, by the parts' names and theirs, of as many windows: ``spread``
    (n, n), what lasts; ``passing`` (n, n); ``taps`` (n, 49).

    Poses are taken as they were captured, without the noise of the training: what comes and goes is
    then motion, not jitter.
    """
    rows = torch.randperm(len(pool), generator=torch.Generator().manual_seed(0))[:windows]
    found: dict[str, list[np.ndarray]] = {}
    for some in rows.split(_AT_ONCE):
        batch = pool.batch(some, statistics, flow.config, noise=0.0)
        for part, noise in noise_along(flow, predictor, batch).items():
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
