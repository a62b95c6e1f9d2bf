"""Training windows as standardised tensors: the pool they are drawn from, what the sensor sees, the
modes drawn for each.
"""

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ..core.errors import InputError
from ..core.sensor import RADIUS, REACH, SPHERES
from ..core.skeleton import (
    END_EFFECTORS,
    FEET_ASKED,
    MODEL_ORDER,
    PARENTS,
    UPPER,
    UPPER_SIZE,
    model_order,
)
from ..data.capture.archive import mapped_arrays
from ..data.dataset.prepare import POSE_UNIT, load_pool
from ..data.furnish.flesh import NO_BANK
from ..data.furnish.shapes import ShapeBank
from ..model.config import AHEAD_SIZE, ModelConfig
from .placed_shapes import DeviceBank

__all__ = [
    "Statistics",
    "Pool",
    "Batch",
    "past_of",
    "chance",
    "given_for",
    "occupancy_of",
    "seen",
]

_EFFECTORS = [MODEL_ORDER.index(j) for j in END_EFFECTORS.values()]
_PELVIS = MODEL_ORDER.index(0)
_ANKLES = [MODEL_ORDER.index(j) for j in FEET_ASKED.values()]
_TOES = [MODEL_ORDER.index(PARENTS.index(j)) for j in FEET_ASKED.values()]
NOISE = 0.003
"""Dequantisation (metres): constant bone lengths would else make the likelihood unbounded."""
_SEGMENTS = 4
_ROOM = "boxes", "shapes", "root"  # what the sensor's sight is made of
_AT_ONCE = 2  # windows: what is computed of them stays in a core's cache
_AT_ONCE_ELSEWHERE = 50  # windows: enough to keep another device busy
_FREE, _EE, _FULL = range(3)
_WITH_TOES = 0.75  # share of the windows in which a foot's toe base is given with its ankle
_ALL_OF_LEGS = 0.3  # share of FULL in which the whole lower body is given
_LEGS_ALONE = 0.3  # share of those, in which the upper body is not


@dataclass(frozen=True)
class Statistics:
    """Mean and deviation of poses (66, upper first), velocities (3) and the way ahead (24);
    deviations floored.
    """

    pose_mean: np.ndarray
    pose_std: np.ndarray
    velocity_mean: np.ndarray
    velocity_std: np.ndarray
    ahead_mean: np.ndarray
    ahead_std: np.ndarray

    @staticmethod
    def of(shards: Iterable[Mapping[str, np.ndarray]]) -> "Statistics":
        """Of all windows of some shards, as they are stored; of one shard after another, so that
        no more of them than one is in memory.
        """
        sums: dict[str, np.ndarray] = {}
        for shard in shards:
            for name, unit in (("poses", POSE_UNIT), ("velocity", 1.0), ("ahead", 1.0)):
                values = unit * shard[name].reshape(-1, shard[name].shape[-1]).astype(float)
                powers = np.stack([np.ones(values.shape[1]), values.mean(0), (values**2).mean(0)])
                sums[name] = sums.get(name, 0.0) + len(values) * powers

        found = []
        for name, least in (("poses", 0.01), ("velocity", 1e-3), ("ahead", 1e-2)):
            count, mean, square = sums[name]
            spread = np.sqrt(np.maximum(square / count - (mean / count) ** 2, 0.0))
            for values in (mean / count, np.maximum(spread, least)):
                found.append(model_order(values) if name == "poses" else values)

        return Statistics(*found)


@dataclass(frozen=True)
class Batch:
    """``past`` (B, T, 693); ``upper`` (B, T, 42), ``lower`` (B, T, 24); ``root`` (B, T, 3 [+ 24
    [+ 1]]): velocity, way ahead, and 1, since it is known; all standardised; ``seen``
    (B, T, 2640): what the sensor sees in bytes, 255 of which are 1; ``step`` (B, T, 3): the
    velocity in metres and radians.
    """

    past: Tensor
    upper: Tensor
    lower: Tensor
    root: Tensor
    seen: Tensor
    step: Tensor

    @property
    def occupancy(self) -> Tensor:
        """What the sensor sees (B, T, 2640), from 0 to 1."""
        return self.seen.float() / 255.0


def past_of(poses: Tensor, velocity: Tensor, history: int) -> Tensor:
    """c_history and c_vel (B, T, 693): ``history`` past poses, oldest first, then the velocities up
    to now.

    ``poses`` and ``velocity`` (B, history + T, …) are standardised.
    """
    frames = poses.shape[1] - history
    past = [poses[:, k : k + frames] for k in range(history)]
    return torch.cat(past + [velocity[:, k : k + frames] for k in range(history + 1)], dim=-1)


def seen(file: Path, bank: DeviceBank) -> np.ndarray:
    """Occupancy of a shard's windows (N, 70, 2640) in bytes, 255 of which are 1; made once and kept
    beside the shard.
    """
    kept = file.with_suffix(".occupancy.npy")
    if not kept.exists():
        shard = load_pool([file])
        boxes, shapes, root = (torch.from_numpy(shard[name]) for name in _ROOM)
        part = file.with_suffix(f".{os.getpid()}.npy")
        out = np.lib.format.open_memmap(part, "w+", np.uint8, (*root.shape[:2], len(SPHERES)))
        for k in range(0, len(root), _AT_ONCE):
            some = slice(k, k + _AT_ONCE)
            out[some] = sensed([boxes[some], shapes[some], root[some]], bank).numpy()

        out.flush()
        part.rename(kept)

    return np.load(kept, mmap_mode="r")


def on_disk(device: torch.device) -> bool:
    """Whether what the sensor sees is read from disk."""
    return device.type == "cpu"


def sensed(room: Sequence[Tensor], bank: DeviceBank) -> Tensor:
    """What the sensor sees in bytes (B, T, 2640) of a window's ``_ROOM``."""
    boxes, shapes, root = room
    found = torch.maximum(occupancy_of(boxes, root), bank.occupancy(shapes, root))
    return (255.0 * found).round().to(torch.uint8)


class Pool:
    """Windows of a dataset, sent to a device batch by batch. New shards may be written while
    training goes on: ``refresh`` takes them in. They stay on disk, in the system's cache while it
    has room. What the sensor sees costs as much as a step of training: for a CPU it is made once
    and lies on disk beside them (see ``seen``); other devices make it when they take in a shard
    and keep it (185 kB a window) while half of their memory is free, else at every step.
    """

    def __init__(
        self, files: Callable[[], Sequence[Path]], device: torch.device, bank: ShapeBank = NO_BANK
    ) -> None:
        self.files, self.device, self.bank = files, device, DeviceBank(bank, device)
        self.shards: dict[Path, dict[str, np.ndarray]] = {}
        self.sensed: dict[Path, Tensor] = {}
        self.refresh()

    def __len__(self) -> int:
        return int(self.ends[-1]) if len(self.ends) else 0

    def refresh(self) -> None:
        """Read the shards that were not there before. Raises InputError where one was made for
        networks that look less far ahead.
        """
        for file in self.files():
            if file not in self.shards:
                self.shards[file] = mapped_arrays(file)
                if self.shards[file]["ahead"].shape[-1] != AHEAD_SIZE:
                    raise InputError(
                        f"The windows '{file}' were made by another version, which looked less far "
                        "ahead; make the dataset anew with 'dafnet prepare'."
                    )
                if on_disk(self.device):
                    self.shards[file]["seen"] = seen(file, self.bank)
                elif self._has_room():
                    self.sensed[file] = self._of_shard(self.shards[file])
        self.ends = np.cumsum([len(shard["poses"]) for shard in self.shards.values()])

    def statistics(self, most: int = 20) -> Statistics:
        """Means and deviations over the windows of the first shards."""
        return Statistics.of(list(self.shards.values())[:most])

    def windows(self, rows: Tensor, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Fields of windows ``rows`` (whole numbers, on the CPU) as they are stored (see
        ``data.prepare.load_pool``).
        """
        places = self._places(rows)
        return {
            name: np.stack([self.shards[file][name][row] for file, row in places]) for name in names
        }

    def _places(self, rows: Tensor) -> list[tuple[Path, int]]:
        """The shard of each of these windows, and its row there."""
        files = list(self.shards)
        which = np.searchsorted(self.ends, rows.numpy(), side="right")
        first = np.concatenate([[0], self.ends])[which]
        return [(files[s], int(r)) for s, r in zip(which, rows.numpy() - first, strict=True)]

    def _rows(self, rows: Tensor) -> dict[str, Tensor]:
        names = [name for name in next(iter(self.shards.values())) if name != "kinds"]
        fields = {
            name: torch.from_numpy(a).to(self.device)
            for name, a in self.windows(rows, names).items()
        }
        if "seen" not in fields:
            fields["seen"] = self._seen(rows, fields)
        return fields

    def _seen(self, rows: Tensor, fields: dict[str, Tensor]) -> Tensor:
        """What the sensor sees of windows (B, T, 2640), in bytes: kept on the device, or made."""
        places = self._places(rows)
        kept = {k: self.sensed[f][row] for k, (f, row) in enumerate(places) if f in self.sensed}
        rest = [k for k in range(len(places)) if k not in kept]
        if rest:
            made = sensed([fields[name][rest] for name in _ROOM], self.bank)
            kept.update(zip(rest, made, strict=True))
        return torch.stack([kept[k] for k in range(len(places))])

    def _of_shard(self, shard: dict[str, np.ndarray]) -> Tensor:
        """What the sensor sees of all windows of a shard (N, T, 2640), on the device."""
        room = [torch.from_numpy(np.array(shard[name])).to(self.device) for name in _ROOM]
        pieces = zip(*(values.split(_AT_ONCE_ELSEWHERE) for values in room), strict=True)
        return torch.cat([sensed(some, self.bank) for some in pieces])

    def _has_room(self) -> bool:
        """Whether half of the device's memory is free."""
        if self.device.type != "cuda":
            return False
        free, total = torch.cuda.mem_get_info(self.device)
        return free > total // 2

    def batch(
        self, rows: Tensor, statistics: Statistics, config: ModelConfig, noise: float = NOISE
    ) -> Batch:
        """Windows ``rows`` (whole numbers, on the CPU), poses with dequantisation ``noise``
        (metres).
        """
        mean, std, v_mean, v_std, a_mean, a_std = (
            torch.as_tensor(getattr(statistics, name), dtype=torch.float32, device=self.device)
            for name in (
                "pose_mean",
                "pose_std",
                "velocity_mean",
                "velocity_std",
                "ahead_mean",
                "ahead_std",
            )
        )
        fields, history = self._rows(rows), config.history
        order = torch.as_tensor(model_order(np.arange(66)), device=self.device)
        poses = fields["poses"].float()[..., order] * POSE_UNIT
        poses = (poses + noise * torch.randn_like(poses) - mean) / std
        step = fields["velocity"]
        velocity = (step - v_mean) / v_std
        way = ((fields["ahead"] - a_mean) / a_std)[..., : config.ahead]
        known = torch.ones_like(way[..., : int(config.ahead_mask)])
        now = poses[:, history:]
        return Batch(
            past_of(poses, velocity, history),
            now[..., :UPPER_SIZE],
            now[..., UPPER_SIZE:],
            torch.cat([velocity[:, history:], way, known], dim=-1),
            fields["seen"],
            step[:, history:],
        )


def occupancy_of(boxes: Tensor, root: Tensor) -> Tensor:
    """What the sensor sees of upright ``boxes`` (B, M, 7) from ``root`` (B, T, 3): x, y, yaw.
    Occupancy (B, T, 2640).

    Equal to ``data.boxes.occupancy``. Boxes out of the sensor's reach cost nothing; both boxes and
    sensor being upright, the distance is one in the plane and one in height.
    """
    windows, frames, _ = root.shape
    spheres = torch.as_tensor(SPHERES, dtype=root.dtype, device=root.device)
    layers = len(spheres) // int((spheres[:, 2] == 0).sum())
    disc, heights = spheres[: len(spheres) // layers, :2], spheres[:: len(spheres) // layers, 2]
    between = boxes[:, None, :, :2] - root[:, :, None, :2]
    reach = REACH + RADIUS + boxes[..., 3:5].norm(dim=-1)
    window, frame, which = torch.nonzero(between.norm(dim=-1) < reach[:, None], as_tuple=True)
    seen, yaw = boxes[window, which], root[window, frame, 2]
    # Sensor points in each box's own frame, in the plane.
    turn, own = (seen[:, 6] - yaw)[:, None], seen[:, 6][:, None]
    offset = between[window, frame, which]
    x = (
        turn.cos() * disc[:, 0]
        + turn.sin() * disc[:, 1]
        - (own.cos() * offset[:, :1] + own.sin() * offset[:, 1:])
    )
    y = (
        -turn.sin() * disc[:, 0]
        + turn.cos() * disc[:, 1]
        - (-own.sin() * offset[:, :1] + own.cos() * offset[:, 1:])
    )
    qx, qy = x.abs() - seen[:, 3:4], y.abs() - seen[:, 4:5]
    outside = torch.hypot(qx.clamp_min(0), qy.clamp_min(0))
    row, spot = torch.nonzero(outside < RADIUS, as_tuple=True)
    plane_out, plane_in = (
        outside[row, spot][:, None],
        torch.maximum(qx, qy)[row, spot][:, None].clamp_max(0),
    )
    above = ((heights - seen[:, 2:3]).abs() - seen[:, 5:6])[row]
    distance = torch.hypot(plane_out, above.clamp_min(0))
    distance = torch.where(
        (plane_out == 0) & (above <= 0), torch.maximum(plane_in, above), distance
    )
    value = (1 - distance / RADIUS).clamp(0, 1)
    place = (window * frames + frame)[row][:, None] * len(spheres) + torch.arange(
        layers, device=root.device
    ) * len(disc)
    out = torch.zeros(windows * frames * len(spheres), dtype=root.dtype, device=root.device)
    out.scatter_reduce_(0, (place + spot[:, None]).reshape(-1), value.reshape(-1), "amax")
    return out.reshape(windows, frames, -1)


def _modes(windows: int, device: torch.device) -> Tensor:
    """The mode of each of four segments (B, 4): one throughout in 60 % of the windows, FREE
    foremost, else all of them.
    """
    one = torch.multinomial(
        torch.tensor([0.55, 0.33, 0.12], device=device), windows, replacement=True
    )[:, None]
    order = torch.rand(windows, _SEGMENTS, device=device).argsort(1)
    fourth = torch.randint(_FREE, _FULL, (windows, 1), device=device)
    shuffled = torch.where(order == 3, fourth, order)
    return torch.where(torch.rand(windows, 1, device=device) < 0.6, one, shuffled)


def chance(shape: Sequence[int], share: float, device: torch.device) -> Tensor:
    """True in a ``share`` of an array, to one in 256 (all or nothing where it is 1 or 0): a byte
    is drawn for each, which costs a tenth of what a number does.
    """
    count = math.prod(shape)
    words = torch.empty(count // 8 + 1, dtype=torch.int64, device=device).random_(-(1 << 63), None)
    drawn = words.view(torch.uint8)[:count].view(shape)
    least = round(256.0 * share)
    return drawn <= least - 1 if least else torch.zeros_like(drawn, dtype=torch.bool)


def given_for(like: Tensor, legs: float = 0.0) -> Tensor:
    """Which joints a random observation gives, (B, T, 22) in the model's order, for windows
    ``like`` (B, T, …).

    In EE any subset of head and hands is given, in FULL the upper body with or without the pelvis.
    The mode may change between four segments of a window, as the author's code has it.

    In a share ``legs`` of the windows something may be given of the lower bodies as well: in EE any
    subset of head, hands and feet, in FULL either foot, or all of it, beside the upper body or
    alone. A foot is its ankle, in three of four windows with the toe base.
    """
    windows, frames, device = *like.shape[:2], like.device
    modes = _modes(windows, device)
    chosen = torch.rand(windows, _SEGMENTS, 3, device=device) < 0.6
    chosen |= torch.rand(windows, _SEGMENTS, 3, device=device).argsort(-1) == 0
    with_pelvis = torch.rand(windows, _SEGMENTS, device=device) < 0.5
    # A mode that lasts gives the same joints all along.
    lasts = (modes == modes[:, :1]).all(1)[:, None]
    chosen = torch.where(lasts[..., None], chosen[:, :1], chosen)
    with_pelvis = torch.where(lasts, with_pelvis[:, :1], with_pelvis)
    given = torch.zeros(windows, _SEGMENTS, 22, device=device)
    given[..., _EFFECTORS] = (chosen & (modes == _EE)[..., None]).float()
    full = (modes == _FULL)[..., None]
    body = torch.ones(len(UPPER), device=device).repeat(windows, _SEGMENTS, 1)
    body[..., _PELVIS] = with_pelvis.float()
    given[..., : len(UPPER)] = torch.where(full, body, given[..., : len(UPPER)])
    segment = torch.arange(frames, device=device) * _SEGMENTS // frames
    if not legs:
        return given[:, segment]

    some = torch.rand(windows, 1, 1, device=device) < legs
    return torch.where(some, _with_legs(given, modes, lasts), given)[:, segment]


def _with_legs(given: Tensor, modes: Tensor, lasts: Tensor) -> Tensor:
    """What is ``given`` (B, S, 22) of the upper bodies in segments of these ``modes`` (B, S), with
    something of the legs; where a mode ``lasts`` (B, 1), the same joints all along.
    """
    windows, device = len(given), given.device

    def drawn(count: int, share: float) -> Tensor:
        found = torch.rand(windows, _SEGMENTS, count, device=device) < share
        return torch.where(lasts[..., None], found[:, :1], found)

    ee, full = ((modes == mode)[..., None] for mode in (_EE, _FULL))
    five = drawn(len(_EFFECTORS) + len(_ANKLES), 0.5)
    at_least = torch.rand(windows, _SEGMENTS, five.shape[-1], device=device).argsort(-1) == 0
    five |= torch.where(lasts[..., None], at_least[:, :1], at_least)
    feet = five[..., len(_EFFECTORS) :]
    toes = torch.rand(windows, 1, 1, device=device) < _WITH_TOES

    out = given.clone()
    out[..., _EFFECTORS] = torch.where(
        ee, five[..., : len(_EFFECTORS)].float(), out[..., _EFFECTORS]
    )
    out[..., _ANKLES] = (feet & (ee | full)).float()
    out[..., _TOES] = (feet & toes & (ee | full)).float()

    all_of_them = drawn(1, _ALL_OF_LEGS) & full
    alone = drawn(1, _LEGS_ALONE) & all_of_them
    joints = len(UPPER)
    out[..., joints:] = torch.where(all_of_them, 1.0, out[..., joints:])
    out[..., :joints] = torch.where(alone, 0.0, out[..., :joints])
    return out
