"""Held-out clips drawn, real above generated."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.files import whole_file
from ...core.sampler import Sampler
from ...core.skeleton import POSE_SIZE
from ...core.weights import Weights
from ...data.dataset.sheet import Row, sheet
from ...data.held_out.captured import HeldClip
from .clips import map_clips, sample_takes, shot_of

__all__ = ["contact_sheets"]

_SHEETS_OF = {
    "sit down or up": 4,
    "composed": 3,
    "desk or shelf": 3,
    "bed": 2,
    "sit": 2,
    "walk": 3,
    "reach": 1,
    "stand": 2,
}
"""Clips that are drawn of each kind."""
_A_SHEET = 4
"""Clips on a sheet."""
_COLOURS = 48
"""Colours that a sheet is reduced to."""


def _kind(clip: HeldClip) -> str:
    if clip.room:
        return "bed" if clip.room == "bed" else "desk or shelf"
    return "composed" if clip.composed else clip.activity


def contact_sheets(weights: Weights, clips: Sequence[HeldClip], folder: Path) -> list[Path]:
    """Twenty held-out clips of unseen bodies, real above FREE at temperature 0, drawn into
    ``folder``; the files.
    """
    from PIL import Image

    chosen: list[HeldClip] = []
    for kind, count in _SHEETS_OF.items():
        own = [clip for clip in clips if clip.unseen and _kind(clip) == kind]
        spaced = np.linspace(0, len(own) - 1, min(count, len(own))).astype(int)
        chosen += [own[k] for k in np.unique(spaced)]

    takes = map_clips(weights, _calm, chosen, lambda share: None)
    drawn: list[Row] = [
        (f"{clip.name}, {kind}", joints, clip.furniture)
        for clip, take in zip(chosen, takes, strict=True)
        for kind, joints in (
            ("composed" if clip.composed else "real", clip.joints),
            ("generated", take),
        )
    ]

    files = []
    for k in range(0, len(drawn), 2 * _A_SHEET):
        files.append(folder / f"held_out_{k // (2 * _A_SHEET) + 1}.png")
        sheet(files[-1], drawn[k : k + 2 * _A_SHEET])

        with Image.open(files[-1]) as picture:
            flat = picture.convert("RGB").quantize(
                _COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
            )
        with whole_file(files[-1]) as part:
            flat.save(part, format="PNG", optimize=True)

    return files


def _calm(sampler: Sampler, clip: HeldClip) -> np.ndarray:
    return sample_takes(sampler, shot_of(clip, "FREE"), np.zeros((1, POSE_SIZE)))[0]
