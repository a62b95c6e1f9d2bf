"""How real takes differ from one another in the flow's noise: what takes are drawn from.

The flow's noise is standard normal frame by frame, but not from frame to frame: along captured
motion a part of it lasts, and the rest comes and goes within a second or two. A vector of unit
deviation that is held is a body that nobody moves like, and one that holds only what lasts is a
statue. So takes draw both (``core.noise.TakeNoise``), with the autocorrelation found along captured
windows: temperature 1 is then how far, and how, real takes differ. What lasts is what is still
alike over the longest times that a window shows.

What comes and goes has the spectrum that was found, but for two things. No dimension varies more
than the N(0, I) that the flow is trained to be drawn from (``within_normal``). And noise along
captured motion is tied to that motion, and noise that is drawn is not: where it comes and goes
fast, what is made of it trembles more than people do; where it goes slowly, it moves them less. So
each frequency is damped, or raised, until poses of people who stay where they are, which is where
one sees it, move as fast in it as captured ones; the whole stays within N(0, I) (``within_room``).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from ..core.noise import TAPS
from ..core.series import MODEL_FPS
from ..model.flow import BodyFlow
from ..model.predictor import ActionPredictor
from .batches import Batch, Pool, Statistics

__all__ = [
    "PartNoise",
    "gains_of_noise",
    "noise_along",
    "part_noise",
    "process_of",
    "take_noise",
    "within_normal",
    "within_room",
]

_SETTLED = 20
"""Frames in which the flow's memory fills."""
_AT_ONCE = 50
"""Windows."""
_LASTS = 40
"""Frames after which what is still alike is taken to last."""
_RESTS = 0.25
"""Metres a second: a window whose root is slower all along shows somebody who stays there."""
_DAMPED_OVER = 400
"""Windows whose speed is compared with what the noise makes."""
_SMOOTH = np.array([0.25, 0.5, 0.25])
"""Weights by which shares of neighbouring frequencies are averaged."""
_MOST_POWER = 2.0
"""Of what was found, that a frequency is raised to: what moves people no more at twice the power
does not come of the noise.
"""
_JITTER = 1e-6
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
        held, passing = self.draw_apart(windows, frames)
        return held + passing

    def draw_apart(self, windows: int, frames: int) -> tuple[Tensor, Tensor]:
        """The same in two: what lasts (B, 1, n), and what comes and goes (B, T, n)."""
        size, device = len(self.spread), self.spread.device
        held = torch.randn(windows, 1, size, device=device) @ self.spread.T
        white = torch.randn(windows, frames + TAPS - 1, size, device=device) @ self.passing.T

        filters = self.taps[:, None]
        passing = torch.nn.functional.conv1d(white.transpose(1, 2), filters, groups=size)
        return held, passing.transpose(1, 2)


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
    base = _base(predictor, batch)
    pose = torch.cat([batch.upper, batch.lower], dim=-1)
    found = {}
    for name, part in flow.parts().items():
        if parts is None or name in parts:
            condition = _condition(flow, name, base, pose)
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
        for name, tensor in within_normal(process_of(np.concatenate(noises))).items():
            tensors[f"{part}.{name}"] = tensor

    rests = _resting(pool, rows)[:_DAMPED_OVER]
    batches = (
        pool.batch(some, statistics, flow.config, noise=0.0) for some in rests.split(_AT_ONCE)
    )
    drawn = {part: _part_noise(tensors, part, pool.device) for part in found}
    for part, gains in gains_of_noise(flow, predictor, batches, statistics, drawn).items():
        process = {name: tensors[f"{part}.{name}"] for name in PartNoise.__annotations__}
        taps = np.fft.irfft(np.fft.rfft(process["taps"], axis=1) * gains, TAPS, axis=1)
        tensors[f"{part}.taps"] = within_room({**process, "taps": taps})

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
    return _part_noise(found, part, pool.device)


def _part_noise(tensors: Mapping[str, np.ndarray], part: str, device: torch.device) -> PartNoise:
    return PartNoise(
        **{
            name: torch.as_tensor(tensors[f"{part}.{name}"], dtype=torch.float32, device=device)
            for name in PartNoise.__annotations__
        }
    )


@torch.no_grad()
def gains_of_noise(
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    batches: Iterable[Batch],
    statistics: Statistics,
    noise: Mapping[str, PartNoise],
) -> dict[str, np.ndarray]:
    """Of each of these parts' noise, by how much what comes and goes is to be multiplied at each
    frequency of its filters (25,), in amplitude: 0 to the root of ``_MOST_POWER``.

    Poses made of what lasts alone move too little at a frequency, those made of all of it too much
    or too little; power adds, so that the share between them which moves as captured motion does is
    known.
    """
    powers: dict[str, np.ndarray] = {}
    # All devices' generators come back as they were: a run draws on from where it was.
    with torch.random.fork_rng(devices=range(torch.cuda.device_count())):
        torch.manual_seed(0)
        for batch in batches:
            for name, power in _powers(flow, predictor, batch, statistics, noise).items():
                powers[name] = powers.get(name, 0.0) + power

    gains = {}
    for name, (captured, lasting, all_of_it) in powers.items():
        added = np.maximum(all_of_it - lasting, 1e-12)
        share = np.convolve(np.pad((captured - lasting) / added, 1, mode="edge"), _SMOOTH, "valid")
        found_at = np.linspace(0.0, 0.5, len(share))
        wanted = np.interp(np.fft.rfftfreq(TAPS), found_at, share)
        gains[name] = np.sqrt(np.clip(wanted, 0.0, _MOST_POWER))

    return gains


def _powers(
    flow: BodyFlow,
    predictor: ActionPredictor | None,
    batch: Batch,
    statistics: Statistics,
    noise: Mapping[str, PartNoise],
) -> dict[str, np.ndarray]:
    """Power (3, F) of how fast each of these parts moves in some windows: captured, made of the
    noise that lasts, and of all of it. The second part sees what was made of the first, as in a
    take.
    """
    base = _base(predictor, batch)
    captured = torch.cat([batch.upper, batch.lower], dim=-1)
    lasting, passing = captured.clone(), captured.clone()
    powers = {}
    for name, part in flow.parts().items():
        if name not in noise:
            continue

        columns = flow.partition[name]
        held, comes = noise[name].draw_apart(len(captured), captured.shape[1] - _SETTLED)
        for poses, z in ((lasting, held.expand_as(comes)), (passing, held + comes)):
            condition = _condition(flow, name, base, poses)
            poses[:, _SETTLED:, columns] = part.free_run(
                captured[..., columns], condition, batch.occupancy, z, _SETTLED
            )[1]

        metres = statistics.pose_std[columns]
        powers[name] = np.stack(
            [
                _speed_spectrum(poses[:, _SETTLED:, columns].double().cpu().numpy() * metres)
                for poses in (captured, lasting, passing)
            ]
        )

    return powers


def _base(predictor: ActionPredictor | None, batch: Batch) -> Tensor:
    """The first part of every condition along captured windows (B, T, …), as training has it."""
    if predictor is None:
        return batch.past
    return torch.cat([predictor(batch.past, batch.occupancy), batch.root], dim=-1)


def _condition(flow: BodyFlow, part: str, base: Tensor, pose: Tensor) -> Tensor:
    """The condition of a part's flow (B, T, …) in FREE mode, beside ``pose`` (B, T, 66)."""
    nothing = torch.zeros_like(pose)
    return flow.condition(part, base, nothing, nothing[..., :22], pose)


def _speed_spectrum(poses: np.ndarray) -> np.ndarray:
    """Power (F,) of how fast poses (B, T, n) move, from 0 to half the frame rate."""
    speed = np.diff(poses, axis=1)
    taper = np.hanning(speed.shape[1])[:, None]
    return (np.abs(np.fft.rfft(speed * taper, axis=1)) ** 2).sum(axis=(0, 2))


def process_of(noise: np.ndarray) -> dict[str, np.ndarray]:
    """The tensors of ``PartNoise`` with the autocorrelation of noise (N, T, n), of 49 frames or
    more, undamped.
    """
    lasting = _lasting(noise)
    return {
        "spread": _root(lasting),
        "passing": _root(_moment(noise, 0) - lasting),
        "taps": _filters(noise, np.diag(lasting)),
    }


def within_normal(process: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The tensors of ``PartNoise`` with no dimension varying more than N(0, I), from which the flow
    is trained to be drawn (paper, section 4.3).

    Captured noise does in some: free runs hold what is drawn to seats and targets, so a network
    makes noise count for less and needs more of it to say what was captured, above all of people
    who gesture. Drawn as large where nothing asks for it, people stay standing before their seats.
    """
    varies = (process["spread"] ** 2).sum(axis=1) + (process["passing"] ** 2).sum(axis=1)
    shrunk = 1.0 / np.sqrt(np.maximum(varies, 1.0))[:, None]
    return {
        **process,
        "spread": shrunk * process["spread"],
        "passing": shrunk * process["passing"],
    }


def within_room(process: Mapping[str, np.ndarray]) -> np.ndarray:
    """The filters of ``PartNoise``'s tensors, with what comes and goes under them made to vary in
    no dimension more than what lasts leaves of N(0, I).
    """
    lasts = (process["spread"] ** 2).sum(axis=1)
    comes = (process["passing"] ** 2).sum(axis=1) * (process["taps"] ** 2).sum(axis=1)
    room = np.sqrt(np.clip(1.0 - lasts, 0.0, None) / np.maximum(comes, _JITTER))
    return np.minimum(1.0, room)[:, None] * process["taps"]


def _resting(pool: Pool, rows: Tensor) -> Tensor:
    """Those of some windows in which the root stays where it is; all, where it does in none."""
    steps = pool.windows(rows, ["velocity"])["velocity"][..., :2]
    rests = np.linalg.norm(steps, axis=-1).max(axis=1) * MODEL_FPS < _RESTS
    return rows[torch.from_numpy(rests)] if rests.any() else rows


def _moment(noise: np.ndarray, apart: int) -> np.ndarray:
    """How noise (N, T, n) of one frame varies with that of so many frames later: (n, n)."""
    early, late = noise[:, : noise.shape[1] - apart], noise[:, apart:]
    found = np.einsum("ntd,nte->de", early, late) / (early.shape[0] * early.shape[1])
    return (found + found.T) / 2.0


def _lasting(noise: np.ndarray) -> np.ndarray:
    """How what lasts of noise (N, T, n) varies (n, n): as what is still alike after ``_LASTS``
    frames and more.
    """
    frames = noise.shape[1]
    # Weighed by how often a window shows them: the longest time but once.
    shown = {apart: frames - apart for apart in range(_LASTS, frames)}
    moments = [often * _moment(noise, apart) for apart, often in shown.items()]
    return _positive(np.sum(moments, axis=0) / sum(shown.values()))


def _positive(moment: np.ndarray) -> np.ndarray:
    """The nearest symmetric matrix to ``moment`` by which something can vary."""
    values, vectors = np.linalg.eigh(moment)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T


def _root(moment: np.ndarray) -> np.ndarray:
    """Lower triangular L (n, n), of which L e, with e from N(0, I), varies as ``moment`` says."""
    return np.linalg.cholesky(_positive(moment) + _JITTER * np.eye(len(moment)))


def _filters(noise: np.ndarray, lasting: np.ndarray) -> np.ndarray:
    """Filters (n, 49) of unit length, of zero phase, under which white noise follows upon itself as
    series (N, T, n) do beside what lasts of them, a variance of ``lasting`` (n,).
    """
    frames = noise.shape[1]
    alike = [(noise[:, : frames - k] * noise[:, k:]).mean((0, 1)) for k in range(TAPS)]
    # The longest times are seen least, and filters that end abruptly tremble: both ends fade out.
    one_way = (np.stack(alike) - lasting) * _faded(2 * TAPS - 1)[TAPS - 1 :, None]
    spectrum = np.fft.rfft(np.concatenate([one_way, one_way[:0:-1]]), axis=0).real

    impulse = np.fft.irfft(np.sqrt(np.maximum(spectrum, 0.0)), 2 * TAPS - 1, axis=0)
    taps = np.roll(impulse, TAPS // 2, axis=0)[:TAPS].T * _faded(TAPS)
    return taps / np.maximum(np.linalg.norm(taps, axis=1, keepdims=True), 1e-12)


def _faded(frames: int) -> np.ndarray:
    """One in the middle half of so many frames, falling to nothing at the ends."""
    return np.minimum(1.0, 2.0 * np.hanning(frames + 2)[1:-1])
