"""Training windows as standardised tensors: statistics, conditions, and the observation modes drawn for each window."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..core.sampler import model_order
from ..core.skeleton import END_EFFECTORS, MODEL_ORDER, UPPER
from ..model.config import UPPER_SIZE

__all__ = ["Statistics", "Batch", "batch_of", "past_of", "observation_for"]

_EFFECTORS = [MODEL_ORDER.index(j) for j in END_EFFECTORS.values()]
_PELVIS = MODEL_ORDER.index(0)
NOISE = 0.003
"""Dequantisation (metres): constant bone lengths would else make the likelihood unbounded."""
_SEGMENTS = 4


@dataclass(frozen=True)
class Statistics:
    """Mean and deviation of poses (66, upper first) and velocities (3); deviations floored."""

    pose_mean: np.ndarray
    pose_std: np.ndarray
    velocity_mean: np.ndarray
    velocity_std: np.ndarray

    @staticmethod
    def of(poses: np.ndarray, velocity: np.ndarray) -> "Statistics":
        flat, speed = model_order(poses.reshape(-1, 66)).astype(float), velocity.reshape(-1, 3).astype(float)
        return Statistics(
            flat.mean(0), np.maximum(flat.std(0), 0.01), speed.mean(0), np.maximum(speed.std(0), 1e-3)
        )

    def poses(self, poses: np.ndarray) -> np.ndarray:
        """Standardised poses, upper first, of poses (…, 66) in SMPL order."""
        return (model_order(poses) - self.pose_mean) / self.pose_std

    def velocities(self, velocity: np.ndarray) -> np.ndarray:
        return (velocity - self.velocity_mean) / self.velocity_std


@dataclass(frozen=True)
class Batch:
    """``past`` (B, T, 693); ``upper`` (B, T, 42), ``lower`` (B, T, 24); ``velocity`` (B, T, 3); ``occupancy`` (B, T, 2640)."""

    past: Tensor
    upper: Tensor
    lower: Tensor
    velocity: Tensor
    occupancy: Tensor


def past_of(poses: Tensor, velocity: Tensor, history: int) -> Tensor:
    """c_history and c_vel (B, T, 693): ``history`` past poses, oldest first, then the velocities up to now.

    ``poses`` and ``velocity`` (B, history + T, …) are standardised.
    """
    frames = poses.shape[1] - history
    past = [poses[:, k : k + frames] for k in range(history)]
    return torch.cat(past + [velocity[:, k : k + frames] for k in range(history + 1)], dim=-1)


def batch_of(pool: dict[str, np.ndarray], rows: np.ndarray, statistics: Statistics, history: int) -> Batch:
    """Windows ``rows`` of a pool, poses with dequantisation noise."""
    poses = torch.from_numpy(statistics.poses(pool["poses"][rows]).astype(np.float32))
    velocity = torch.from_numpy(statistics.velocities(pool["velocity"][rows]).astype(np.float32))
    noise = torch.from_numpy((NOISE / statistics.pose_std).astype(np.float32))
    poses = poses + torch.randn_like(poses) * noise
    occupancy = torch.from_numpy(pool["occupancy"][rows]).float().div_(255.0)
    now = poses[:, history:]
    return Batch(
        past_of(poses, velocity, history), now[..., :UPPER_SIZE], now[..., UPPER_SIZE:], velocity[:, history:], occupancy
    )


def _given(rng: np.random.Generator, mode: str) -> np.ndarray:
    """Which of the 22 joints (upper first) a mode gives. EE: any subset; FULL: with or without the pelvis."""
    given = np.zeros(22, dtype=np.float32)
    if mode == "EE":
        chosen = rng.random(3) < 0.6
        chosen[rng.integers(3)] = True
        given[np.array(_EFFECTORS)[chosen]] = 1.0
    elif mode == "FULL":
        given[: len(UPPER)] = 1.0
        given[_PELVIS] = float(rng.random() < 0.5)
    return given


def observation_for(rng: np.random.Generator, upper: Tensor) -> tuple[Tensor, Tensor]:
    """A random observation (B, T, 66) of the true upper bodies (B, T, 42), and its mask (B, T, 22).

    Half of the windows hold one mode throughout, FREE foremost; the others change mode between four segments.
    """
    windows, frames, _ = upper.shape
    given = np.zeros((windows, frames, 22), dtype=np.float32)
    for w in range(windows):
        if rng.random() < 0.6:
            given[w] = _given(rng, rng.choice(["FREE", "EE", "FULL"], p=[0.55, 0.33, 0.12]))
            continue
        modes = rng.permutation(["FREE", "EE", "FULL", rng.choice(["FREE", "EE"])])
        for mode, part in zip(modes, np.array_split(np.arange(frames), _SEGMENTS), strict=True):
            given[w, part] = _given(rng, mode)
    mask = torch.from_numpy(given)
    whole = torch.cat([upper, torch.zeros(windows, frames, 24)], dim=-1)
    return whole * mask.repeat_interleave(3, dim=-1), mask
