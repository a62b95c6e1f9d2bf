"""The noise that takes are made of: what lasts all along a take, and what comes and goes in it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .skeleton import LOWER_SIZE, POSE_SIZE, UPPER_SIZE

__all__ = ["TAPS", "TakeNoise"]

TAPS = 49
"""Frames of a filter: what comes and goes within 1.6 s."""


@dataclass(frozen=True)
class TakeNoise:
    """How captured takes differ, in the flow's noise; upper part first.

    The paper draws one vector from N(0, I) and holds it (section 4.3). Along captured motion the
    noise is standard normal as well, but only a part of it lasts; the rest comes and goes within a
    second, and that is what makes a body that sits or stands look alive.

    ``lasting`` (66, 66): what a take holds is this times N(0, I). ``passing`` (66, 66): what comes
    and goes is white noise, this times N(0, I) at each frame, under the filters ``taps`` (66, 49).
    Zeros where the weights do not say: such takes hold their noise.
    """

    lasting: np.ndarray
    passing: np.ndarray
    taps: np.ndarray

    def draw(
        self,
        frames: int,
        seed: int,
        lower_seed: int | None = None,
        temperature: float = 1.0,
        lower_temperature: float | None = None,
        held: bool = False,
    ) -> np.ndarray:
        """The noise of a take's frames (T, 66); of a longer take, the first frames are the same.
        ``held``: only what lasts, so that it is the same in all of them.

        Each part of the body has a seed (0 or more) and, if wished, a temperature of its own, so
        that legs vary under one trunk. At temperature 1 takes differ as captured ones do.
        """
        held_draws, white = [], []
        for rng, size in _sources(seed, lower_seed):
            held_draws.append(rng.standard_normal(size))
            white.append(rng.standard_normal((frames + TAPS - 1, size)))

        heat = np.full(POSE_SIZE, temperature)
        heat[UPPER_SIZE:] = temperature if lower_temperature is None else lower_temperature
        lasting = self.lasting @ np.concatenate(held_draws)
        if held:
            return np.tile(heat * lasting, (frames, 1))

        steps = np.concatenate(white, axis=1) @ self.passing.T
        rows = np.lib.stride_tricks.sliding_window_view(steps, TAPS, axis=0)
        passing = np.einsum("tdk,dk->td", rows, self.taps)

        return heat * (lasting + passing)

    def stream(
        self, seed: int, lower_seed: int | None = None, held: bool = False
    ) -> Iterator[np.ndarray]:
        """The noise of a take's frames (66,) at temperature 1, one after another without end: as
        ``draw`` gives it for as many frames as one likes, but for rounding.
        """
        sources = _sources(seed, lower_seed)
        lasting = self.lasting @ np.concatenate([rng.standard_normal(n) for rng, n in sources])
        while held:
            yield lasting

        white = [rng.standard_normal((TAPS - 1, size)) for rng, size in sources]
        steps = np.concatenate(white, axis=1) @ self.passing.T
        while True:
            row = np.concatenate([rng.standard_normal(size) for rng, size in sources])
            steps = np.concatenate([steps, [self.passing @ row]])
            yield lasting + np.einsum("kd,dk->d", steps, self.taps)
            steps = steps[1:]

    @staticmethod
    def standard_normal() -> "TakeNoise":
        """The paper's: one vector from N(0, I), held."""
        return TakeNoise(np.eye(POSE_SIZE), np.zeros((POSE_SIZE,) * 2), np.zeros((POSE_SIZE, TAPS)))


def _sources(seed: int, lower_seed: int | None) -> list[tuple[np.random.Generator, int]]:
    """What the noise of the upper and of the lower part is drawn from, and how many numbers each
    takes a frame.
    """
    seeds = ((seed, UPPER_SIZE), (seed if lower_seed is None else lower_seed, LOWER_SIZE))
    return [(np.random.default_rng([own, part]), size) for part, (own, size) in enumerate(seeds)]
