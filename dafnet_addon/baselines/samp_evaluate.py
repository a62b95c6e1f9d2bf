"""Measures SAMP's networks on held-out clips, as ``training.evaluation.clips`` does flows."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import torch

from ..core.threads import one_thread
from ..data.held_out.captured import HeldClip
from ..training.evaluation.clips import SEEDS, Figures, MeasuredClip, measure_takes, shot_of
from ..training.processes import map_in_processes
from .samp import sample_takes
from .train import load_samp

__all__ = ["measure_samp"]


def _measure_clip(file: Path, kind: str, clip: HeldClip) -> MeasuredClip:
    torch.set_num_threads(1)
    _, network = load_samp(file)
    runs: dict[str, Figures] = {"ground_truth": measure_takes(clip, clip.joints[None])}
    with one_thread():
        for mode in ("FREE", "EE") if kind == "samp-ob" else ("FREE",):
            made = sample_takes(network, clip, shot_of(clip, mode), [None, *range(SEEDS)], kind)
            runs[f"{mode.lower()}_t0"] = measure_takes(clip, made[:1], mode)
            runs[f"{mode.lower()}_t1"] = measure_takes(clip, made[1:], mode)

    return MeasuredClip(clip, runs)


def measure_samp(
    file: Path,
    kind: str,
    clips: Sequence[HeldClip],
    progress: Callable[[float], None] = lambda share: None,
) -> list[MeasuredClip]:
    """Every clip beside itself: "samp" and "samp-a" in FREE, which is all that they know, "samp-ob"
    also in EE.

    ``file`` is a checkpoint of ``train_samp``. "t0" is z at its mean, "t1" z drawn anew for each
    frame, with ``SEEDS`` seeds.
    """
    return list(map_in_processes(partial(_measure_clip, file, kind), clips, progress=progress))
