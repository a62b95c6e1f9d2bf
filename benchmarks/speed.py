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
from dafnet_addon.model.config import PAPER, ModelConfig
from dafnet_addon.model.flow import BodyFlow
from dafnet_addon.model.predictor import ActionPredictor
from dafnet_addon.model.systems import sampler_of
from dafnet_addon.training.batches import Statistics
from dafnet_addon.training.export import tensors_of

# rows and columns of the matrix that bandwidth is measured with: 256 MB, more than any cache
_LARGE = 8192
_REPEATS = 3


def random_weights(config: ModelConfig) -> Weights:
    """Weights of these sizes that were never trained."""
    torch.manual_seed(0)
    flow = BodyFlow(config)
    unit = Statistics(np.zeros(66), np.ones(66), np.zeros(3), np.ones(3), np.zeros(18), np.ones(18))
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


def per_pose(sampler: Sampler, batch: int, frames: int) -> float:
    """Milliseconds a pose, frame by frame, what is known in advance not counted; the best of a
    few.
    """
    nothing = {"velocity": 3, "ahead": 18, "occupancy": 2640, "observation": 66, "given": 22}
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


def samp_row(config: SampConfig, frames: int, speed: float) -> dict[str, Any]:
    """SAMP's next state from its last one, one a frame; the features between are not counted."""
    torch.manual_seed(0)
    network = network_of("samp", config)
    parts = (network.gating, network.interaction, network.first, network.second, network.third)
    size = sum(int(p.nbytes) for part in parts for p in part.parameters())
    row: dict[str, Any] = {"system": "SAMP", "library": "torch", "megabytes": round(size / 1e6, 2)}
    row["floor_ms"] = round(1e3 * size / speed, 3)
    for batch in (1, 64):
        state, sensor = (
            torch.zeros(batch, len(network.in_mean)),
            torch.zeros(batch, len(network.sensor_mean)),
        )
        z, best = torch.zeros(batch, config.latent), np.inf
        with torch.no_grad():
            for _ in range(_REPEATS):
                begin = perf_counter()
                for _ in range(frames):
                    network.decode(z, state, sensor)
                best = min(best, perf_counter() - begin)

        row[f"ms_{batch}"] = round(1000.0 * best / (frames * batch), 3)

    row["over_floor"] = round(row["ms_1"] / row["floor_ms"], 2)
    return row


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
    models = {
        "DAFNet": paper,
        "AP-P": replace(paper, system="ap-p", steps_whole=6),
        "MoGlow": replace(paper, system="moglow", steps_whole=16),
    }
    timed: list[tuple[str, str, Weights, str | None]] = []
    for name, model in models.items():
        weights = random_weights(model)
        timed += [(name, "NumPy", weights, None), (name, "torch", weights, "cpu")]

    timed.append(("DAFNet, these weights", "NumPy", load_weights(file), None))
    rows = []
    for done, (name, library, weights, device) in enumerate(timed):
        progress(done / len(timed))
        sampler = sampler_of(weights, device)
        size = recurrent_bytes(sampler)
        row: dict[str, Any] = {
            "system": name,
            "library": library,
            "megabytes": round(size / 1e6, 2),
        }
        row["floor_ms"] = round(1e3 * size / speed, 3)
        for batch in (1, 64):
            row[f"ms_{batch}"] = round(
                per_pose(sampler, batch, frames if batch == 1 else max(frames // 4, 2)), 3
            )

        row["over_floor"] = round(row["ms_1"] / row["floor_ms"], 2)
        rows.append(row)

    rows.insert(-1, samp_row(samp, frames, speed))
    torch.set_num_threads(threads)
    progress(1.0)
    ours = rows[0]["ms_1"]
    report = {
        "gigabytes_a_second": round(speed / 1e9, 2),
        "rows": rows,
        "moglow_over_dafnet": {
            row["library"]: round(row["ms_1"] / ours, 2)
            for row in rows
            if row["system"] == "MoGlow"
        },
    }
    columns = {
        "system": "",
        "library": "library",
        "megabytes": "recurrent MB",
        "floor_ms": "floor, ms",
        "ms_1": "batch 1, ms a pose",
        "over_floor": "over the floor",
        "ms_64": "batch 64, ms a pose",
    }
    lines = ["| " + " | ".join(columns.values()) + " |", "|---" * len(columns) + "|"]
    lines += ["| " + " | ".join(str(row[name]) for name in columns) + " |" for row in rows]
    head = (
        f"One thread; matrix-vector products read {report['gigabytes_a_second']} GB a second from "
        "memory."
    )
    return report, "\n".join([head, "", *lines])
