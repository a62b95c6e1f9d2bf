"""A small training set."""

from pathlib import Path

import numpy as np

from dafnet_addon.data.dataset.prepare import POSE_UNIT
from dafnet_addon.data.furnish import boxes as boxes_module
from dafnet_addon.data.furnish.shapes import ABSENT_SHAPE, SHAPES

__all__ = ["small_dataset"]


def small_dataset(folder: Path) -> Path:
    """Write a training set of swaying bodies, each window at a height of its own that the sensor
    shows; the folder.
    """
    rng, windows = np.random.default_rng(0), 12
    sway = np.sin(np.linspace(0, 6, 80))[None, :, None] * rng.uniform(0.05, 0.2, (windows, 1, 66))
    poses = rng.uniform(-1.0, 1.0, size=66) + sway
    rows = rng.uniform(
        (-1, -1, 0.1, 0.1, 0.1, 0.1, -3),
        (1, 1, 0.6, 0.5, 0.5, 0.5, 3),
        (windows, boxes_module.MOST, 7),
    )
    rows[:, 3:] = boxes_module.ABSENT
    pool = {
        "poses": np.round(poses / POSE_UNIT).astype(np.int16),
        "velocity": rng.normal(scale=0.01, size=(windows, 80, 3)),
        "ahead": rng.normal(size=(windows, 70, 24)),
        "root": rng.normal(scale=0.1, size=(windows, 70, 3)),
        "boxes": rows,
        "shapes": np.tile(ABSENT_SHAPE, (windows, SHAPES, 1)),
    }
    pool = {name: a if a.dtype == np.int16 else a.astype(np.float32) for name, a in pool.items()}
    pool["kinds"] = np.array(["walk"] * windows)
    folder.mkdir()
    np.savez(folder / "pool-0000.npz", **pool)
    np.savez(folder / "held.npz", **{name: value[:4] for name, value in pool.items()})
    return folder
