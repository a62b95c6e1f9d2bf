"""What the flow is given of the past and of the root's way: the actions that a predictor reads out
of them, as DAFNet has it, or the poses and velocities themselves, as MoGlow has it.
"""

from typing import Protocol

import numpy as np

from .backend import Array, Backend
from .network import Network, Predictor

__all__ = ["ActionInputs", "HistoryInputs", "Inputs", "inputs_of", "velocities_up_to"]


def velocities_up_to(velocity: np.ndarray, history: int) -> np.ndarray:
    """The last ``history`` velocities and the present one (T, 3 history + 3) of each frame; before
    the first frame the root is taken to have moved as in it.
    """
    padded = np.concatenate([np.repeat(velocity[:1], history, axis=0), velocity])
    return np.concatenate([padded[k : k + len(velocity)] for k in range(history + 1)], axis=1)


class Inputs(Protocol):
    """Inputs of the couplings' nets beside the observation and the environment; standardised."""

    def in_advance(
        self, velocities: np.ndarray, way: np.ndarray, occupancy: Array
    ) -> tuple[Array, Array]:
        """Of all frames at once: what the nets are given of the root (T, n), and what ``at`` needs
        of the scene (T, m).

        ``velocities`` (T, 33): up to now; ``way`` (T, 3 [+ 24 [+ 1]]): the last of them, the way
        ahead, and whether it is known.
        """
        ...

    def at(self, scene: Array, past: Array) -> Array:
        """What the nets are given at one frame (B, k), by its ``scene`` (m,) and the ``past`` poses
        (B, 66 · history).
        """
        ...


class ActionInputs:
    """Action probabilities π (B, K) of each frame, by the predictor (paper, section 4.2)."""

    def __init__(self, predictor: Predictor, backend: Backend) -> None:
        self.predictor = predictor
        self.backend = backend

    def in_advance(
        self, velocities: np.ndarray, way: np.ndarray, occupancy: Array
    ) -> tuple[Array, Array]:
        code = self.predictor.environment(occupancy)
        seen = self.backend.xp.concatenate([self.backend.array(velocities), code], axis=-1)
        return self.backend.array(way), self.predictor.scene(seen)

    def at(self, scene: Array, past: Array) -> Array:
        x = past @ self.predictor.past + scene
        x = self.predictor.second(x * (x > 0))
        x = self.predictor.out(x * (x > 0)) / self.predictor.temperature
        return self.backend.softmax(x)


class HistoryInputs:
    """The past poses themselves, and all velocities up to now."""

    def __init__(self, backend: Backend) -> None:
        self.backend = backend

    def in_advance(
        self, velocities: np.ndarray, way: np.ndarray, occupancy: Array
    ) -> tuple[Array, Array]:
        return self.backend.array(velocities), self.backend.array(np.zeros((len(velocities), 0)))

    def at(self, scene: Array, past: Array) -> Array:
        return past


def inputs_of(network: Network, backend: Backend) -> Inputs:
    """Those that the network was trained with."""
    if network.predictor is None:
        return HistoryInputs(backend)
    return ActionInputs(network.predictor, backend)
