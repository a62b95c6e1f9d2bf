"""Milliseconds per pose of every system in one run, at batch 1 and 64, beside what the machine's
memory allows.

    dafnet bench speed

Random weights of the paper's sizes (width 512, environment code 512; MoGlow of 16 steps, AP-P of 6,
DAFNet of 3 + 3; of SAMP's the decoder alone, without the features that it is fed), and the weights
that ship, on one thread. At batch 1 every frame reads all recurrent matrices once, so their bytes
over the bandwidth of a matrix-vector product is the time that no implementation goes under; where
they fit a cache, they may.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import torch

from dafnet_addon.baselines.samp import PAPER_SAMP, SampConfig, network_of
from dafnet_addon.core.sampler import Conditions, Sampler
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import OFFSETS
from dafnet_addon.core.threads import one_thread
from dafnet_addon.core.weights import FORMAT, Weights, load_weights
from dafnet_addon.model.config import AHEAD_SIZE, PAPER, ModelConfig
from dafnet_addon.model.flow import BodyFlow
from dafnet_addon.model.predictor import ActionPredictor
from dafnet_addon.model.systems import sampler_of
from dafnet_addon.training.batches import Statistics
from dafnet_addon.training.evaluation.markdown import markdown_table
from dafnet_addon.training.export import tensors_of

_LARGE = 8192
"""Rows and columns of the matrix that bandwidth is measured with: 256 MB, more than any cache."""
_REPEATS = 3
"""Of which the fastest counts."""
_COLUMNS = {
    "system": "",
    "library": "library",
    "megabytes": "recurrent MB",
    "floor_ms": "floor, ms",
    "ms_1": "batch 1, ms a pose",
    "over_floor": "over the floor",
    "ms_64": "batch 64, ms a pose",
}
"""A row's values by name, and their titles."""


def random_weights(config: ModelConfig) -> Weights:
    """Weights of these sizes that were never trained."""
    torch.manual_seed(0)
    flow = BodyFlow(config)
    unit = Statistics(
        np.zeros(66),
        np.ones(66),
        np.zeros(3),
        np.ones(3),
        np.zeros(AHEAD_SIZE),
        np.ones(AHEAD_SIZE),
    )
    tensors = tensors_of(flow, ActionPredictor(config) if config.predicts else None, unit)
    description = {"model": config.as_dict(), "fps": round(MODEL_FPS), "offsets": OFFSETS.tolist()}
    return Weights(tensors, description, {"format": FORMAT}, Path("random"))


def bandwidth() -> float:
    """Bytes a second that one thread reads in a matrix-vector product out of memory, the best of a
    few.
    """
    matrix, vector = np.ones((_LARGE, _LARGE), np.float32), np.ones(_LARGE, np.float32)
    best = np.inf
    with one_thread():
        for _ in range(_REPEATS):
            begin = perf_counter()
            matrix @ vector
            best = min(best, perf_counter() - begin)
    return matrix.nbytes / best


def recurrent_bytes(sampler: Sampler) -> int:
    """Bytes of the matrices that each frame multiplies with."""
    arrays = [
        m
        for part in sampler.network.parts
        for step in part.steps
        for m in (step.inverse, step.coupling.out.matrix)
    ]
    arrays += [
        layer.matrix
        for part in sampler.network.parts
        for step in part.steps
        for layer in step.coupling.layers
    ]
    if (predictor := sampler.network.predictor) is not None:
        arrays += [predictor.past, predictor.second.matrix, predictor.out.matrix]

    return sum(int(a.nbytes) for a in arrays)


def time_per_pose(sampler: Sampler, batch: int, frames: int) -> float:
    """Milliseconds a pose, frame by frame, what is known in advance not counted; the best of a
    few.
    """
    nothing = {
        "velocity": 3,
        "ahead": AHEAD_SIZE,
        "occupancy": 2640,
        "observation": 66,
        "given": 22,
    }
    conditions = Conditions(**{name: np.zeros((frames, size)) for name, size in nothing.items()})
    noise = sampler.backend.array(np.zeros((batch, 66)))
    best = np.inf
    with one_thread():
        for _ in range(_REPEATS):
            sampler.start(conditions, batch)
            begin = perf_counter()
            for t in range(frames):
                sampler.decode(t, noise)
            best = min(best, perf_counter() - begin)

    return 1000.0 * best / (frames * batch)


def flow_row(sampler: Sampler, frames: int, speed: float) -> dict[str, Any]:
    """A flow's size, times at batch 1 and 64, and the floor under them at a bandwidth."""
    times = {
        1: time_per_pose(sampler, 1, frames),
        64: time_per_pose(sampler, 64, max(frames // 4, 2)),
    }
    return _row(recurrent_bytes(sampler), times, speed)


def _row(size: int, times: dict[int, float], speed: float) -> dict[str, Any]:
    """``size``: bytes that each frame reads; ``times``: milliseconds a pose by batch size."""
    floor = round(1e3 * size / speed, 3)
    shown = {f"ms_{batch}": round(time, 3) for batch, time in times.items()}
    return {
        "megabytes": round(size / 1e6, 2),
        "floor_ms": floor,
        **shown,
        "over_floor": round(shown["ms_1"] / floor, 2),
    }


def samp_row(config: SampConfig, frames: int, speed: float) -> dict[str, Any]:
    """SAMP's next state from its last one, one a frame; the features between are not counted."""
    torch.manual_seed(0)
    network = network_of("samp", config)
    parts = (network.gating, network.interaction, network.first, network.second, network.third)
    size = sum(int(p.nbytes) for part in parts for p in part.parameters())
    times = {}
    for batch in (1, 64):
        state = torch.zeros(batch, len(network.in_mean))
        sensor = torch.zeros(batch, len(network.sensor_mean))
        z, best = torch.zeros(batch, config.latent), np.inf
        with torch.no_grad():
            for _ in range(_REPEATS):
                begin = perf_counter()
                for _ in range(frames):
                    network.decode(z, state, sensor)
                best = min(best, perf_counter() - begin)

        times[batch] = 1000.0 * best / (frames * batch)

    return {"system": "SAMP", "library": "torch", **_row(size, times, speed)}


def measure(
    file: Path | None,
    progress: Callable[[float], None],
    paper: ModelConfig = PAPER,
    frames: int = 60,
    samp: SampConfig = PAPER_SAMP,
) -> tuple[dict[str, Any], str]:
    """Run the benchmark; ``file``: weights to time beside the paper's sizes (None: those that
    ship).
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    speed = bandwidth()

    timed = _timed(paper, load_weights(file))
    rows = []
    for done, (name, library, weights, device) in enumerate(timed):
        progress(done / len(timed))
        row = flow_row(sampler_of(weights, device), frames, speed)
        rows.append({"system": name, "library": library, **row})

    rows.insert(-1, samp_row(samp, frames, speed))
    torch.set_num_threads(threads)
    progress(1.0)

    moglow = [row for row in rows if row["system"] == "MoGlow"]
    report = {
        "gigabytes_a_second": round(speed / 1e9, 2),
        "rows": rows,
        "moglow_over_dafnet": {
            row["library"]: round(row["ms_1"] / rows[0]["ms_1"], 2) for row in moglow
        },
    }
    head = (
        f"One thread; matrix-vector products read {report['gigabytes_a_second']} GB a second from "
        "memory."
    )
    body = [[str(row[name]) for name in _COLUMNS] for row in rows]
    return report, "\n".join([head, "", markdown_table(list(_COLUMNS.values()), body)])


def _timed(paper: ModelConfig, weights: Weights) -> list[tuple[str, str, Weights, str | None]]:
    """What is timed: the system's name, the library, the weights, and torch's device."""
    models = {
        "DAFNet": paper,
        "AP-P": replace(paper, system="ap-p", steps_whole=6),
        "MoGlow": replace(paper, system="moglow", steps_whole=16),
    }
    timed: list[tuple[str, str, Weights, str | None]] = []
    for name, model in models.items():
        untrained = random_weights(model)
        timed += [(name, "NumPy", untrained, None), (name, "torch", untrained, "cpu")]

    return [*timed, ("DAFNet, these weights", "NumPy", weights, None)]
