"""Measures weights on the little held-out motion that comes with the project, in a minute and
without any other data: some clips of the test that docs/evaluation.md reports on, of one body that
trained nothing.

    dafnet bench sample [--weights FILE]

The motion is of Microsoft Rocketbox's female body (MIT; benchmarks/held_out/LICENSE), fitted to the
canonical skeleton. From all motion files it is packed anew by ``python -m benchmarks.sample
FOLDER``.
"""

import json
import lzma
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dafnet_addon.core.files import whole_file
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.skeleton import POSE_SIZE
from dafnet_addon.core.threads import one_thread
from dafnet_addon.core.weights import load_weights
from dafnet_addon.data.held_out.captured import FROZEN, HeldClip, held_clip, held_out_motions
from dafnet_addon.data.motion.motion import Motion
from dafnet_addon.training.evaluation.clips import (
    Figures,
    MeasuredClip,
    clean_up_takes,
    measure_takes,
    rows_by_run,
    sample_takes,
    shot_of,
    table,
)

__all__ = ["FILE", "RUNS", "measure", "pack", "sample", "sample_page"]

FILE = Path(__file__).with_name("held_out") / "rocketbox.xz"
RUNS = ("ground_truth", "free_t0", "free_t0_clean", "ee_t0", "ee_t0_clean")
COLUMNS = (
    "seat_episodes",
    "sits_within_6cm",
    "stands_when_it_should",
    "end_effector_error",
    "foot_sliding_per_frame",
    "bad_collisions_per_frame",
)

_NAMES = (
    *("f_sit_down_chair_01", "f_sit_down_chair_02", "f_sit_down_chair_left"),
    *("f_sit_down_chair_right", "f_sit_down_table_left", "f_sit_down_table_right"),
    *("f_sit_stand_up_chair_01", "f_sit_stand_up_chair_left", "f_sit_stand_up_chair_right"),
    *("f_sit_stand_up_table_left", "f_sit_stand_up_table_right"),
    *("f_sit_chair_idle_dust", "f_sit_chair_gestic_thoughtful", "f_sit_table_idle_cough"),
    *("f_walk_to_run", "f_cheer_02"),
)
_STEP = 2e-4
"""Metres in which joints are counted."""


def _frozen() -> dict[str, dict[str, Any]]:
    """The sample's clips as the test froze them, by name."""
    clips = json.loads(FROZEN.read_text(encoding="utf-8"))["clips"]
    plain = {
        clip["name"]: clip for clip in clips if not clip.get("composed") and not clip.get("room")
    }
    return {f"rocketbox/{name}": plain[f"rocketbox/{name}"] for name in _NAMES}


def pack(folder: Path, file: Path = FILE) -> None:
    """Write the sample's clips from a folder with all motion files."""
    motions = held_out_motions(folder)
    words, steps = [], []
    for name, frozen in _frozen().items():
        motion, start = motions[name], frozen["start"]
        joints = motion.joints[start : start + frozen["frames"]]
        words.append([name, motion.subject, motion.category, len(joints)])
        counts = np.rint(joints / _STEP).astype(np.int32)
        steps.append(np.diff(np.diff(counts, axis=0, prepend=0), axis=0, prepend=0))

    head = json.dumps(words).encode("utf-8") + b"\n"
    values = np.concatenate(steps).astype("<i2")
    planes = values.reshape(len(values), -1).T.copy().view(np.uint8).reshape(-1, 2).T.tobytes()
    with whole_file(file) as part:
        part.write_bytes(lzma.compress(head + planes, preset=9 | lzma.PRESET_EXTREME))


def sample() -> list[HeldClip]:
    """The clips with their furniture. Raises InputError where one is not the motion that the test
    froze.
    """
    head, _, planes = lzma.decompress(FILE.read_bytes()).partition(b"\n")
    words = json.loads(head)
    total = sum(frames for *_, frames in words)
    pairs = np.frombuffer(planes, np.uint8).reshape(2, -1).T.copy()
    values = pairs.view("<i2").reshape(-1, total).T.reshape(total, 22, 3).astype(np.int64)

    clips, start = [], 0
    for name, subject, category, frames in words:
        joints = _STEP * values[start : start + frames].cumsum(0).cumsum(0)
        start += frames
        motion = Motion(name, "rocketbox", subject, category, joints, np.ones(frames, bool), ())
        clips.append(held_clip({**_frozen()[name], "start": 0}, motion))
    return clips


def measure(
    file: Path | None, progress: Callable[[float], None]
) -> tuple[dict[str, dict[str, Any]], str]:
    """The rows of the weights in ``file`` (None: those that ship) by run, and as a table."""
    sampler = Sampler(load_weights(file))
    clips, measured = sample(), []
    with one_thread():
        for done, clip in enumerate(clips):
            progress(done / len(clips))
            measured.append(MeasuredClip(clip, dict(_calm_takes(sampler, clip))))
    progress(1.0)
    rows = rows_by_run(measured, RUNS)
    return rows, table(rows, COLUMNS)


def sample_page(rows: dict[str, dict[str, Any]]) -> str:
    """The section of docs/data.md about the sample, of the report of ``measure``."""
    return f"""## The motion that comes with the project

`benchmarks/held_out/rocketbox.xz`: sixteen captured clips of the body `rocketbox/f`, which trained
nothing, 0.1 MB, under its MIT licence beside it. They are the frozen test's own, with its
furniture. What the shipped weights do on them, by `dafnet bench sample` (intervals of 95 % in
brackets), which a test does again:

{table(rows, COLUMNS)}"""


def _calm_takes(sampler: Sampler, clip: HeldClip) -> Iterator[tuple[str, Figures]]:
    """The clip and its takes at temperature 0, measured as ``evaluation.clips.measure_clip``
    does.
    """
    yield "ground_truth", measure_takes(clip, clip.joints[None])
    for mode in ("FREE", "EE"):
        shot = shot_of(clip, mode)
        takes = sample_takes(sampler, shot, np.zeros((len(shot.conditions), 1, POSE_SIZE)))
        yield f"{mode.lower()}_t0", measure_takes(clip, takes, mode)
        yield f"{mode.lower()}_t0_clean", measure_takes(clip, clean_up_takes(takes, shot), mode)


if __name__ == "__main__":
    pack(Path(sys.argv[1]))
