"""The figures of the paper (section 6.1), made again with these weights and drawn by Blender.

    dafnet figures -o docs/figures [--weights FILE] [--other MoGlow=FILE …] [--only 10 11]

All motion is the network's own at temperature 0, nothing done to it afterwards (in figure 9, what
training does to what was captured), so there is nothing to choose from. Numbers are those of the
paper's figures; captions are in ``docs/figures/README.md``. Colour says the mode: blue is FREE,
orange EE, green FULL; poses grow darker with time; what was asked of head and hands is red.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from PIL import Image

from dafnet_addon import InputError, load_weights
from dafnet_addon.core.files import whole_file

from .augmented import augmented
from .compared import compared_free, compared_led
from .led import copied, led, through_a_room
from .one_path import actions, by_furniture, by_height
from .studio import Studio

__all__ = ["FIGURES", "draw"]

_COLOURS = 240
"""Of a file."""
_OF_SEVERAL = ("15", "16")
"""Figures that compare systems."""

FIGURES: dict[str, Callable[[Studio], Image.Image]] = {
    "3": actions,
    "9": augmented,
    "10": by_furniture,
    "11": by_height,
    "12": copied,
    "13": led,
    "14": through_a_room,
    "15": compared_free,
    "16": compared_led,
}
"""The figures by their numbers in the paper."""


def draw(
    output: Path,
    weights: Path | None,
    others: dict[str, Path],
    only: Sequence[str] | None,
    progress: Callable[[float], None],
    scale: float = 1.0,
) -> list[Path]:
    """Write the figures ``only`` (None: all) as PNGs into ``output``; returns the files.

    ``weights``: a file, or None for those that ship. ``others``: files of other systems, by their
    names; without any, figures that compare are left out. ``progress`` is called with the part
    done, in [0, 1]. ``scale``: 1 makes pictures about 1600 pixels wide. Raises InputError for an
    unknown figure, WeightsError for a file that cannot be used.
    """
    chosen = list(FIGURES) if only is None else list(only)
    for number in chosen:
        if number not in FIGURES:
            raise InputError(f"There is no figure {number}; choose among {', '.join(FIGURES)}.")

    if not others and any(number in _OF_SEVERAL for number in chosen):
        print(
            "Figures 15 and 16 compare systems and no other system's weights were given: left out.",
            file=sys.stderr,
        )
        chosen = [number for number in chosen if number not in _OF_SEVERAL]

    studio = Studio(
        load_weights(weights), {name: load_weights(file) for name, file in others.items()}, scale
    )
    files = []
    for done, number in enumerate(chosen):
        progress(done / len(chosen))
        picture = FIGURES[number](studio)
        files.append(output / f"figure_{int(number):02d}.png")
        flat = picture.quantize(_COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        with whole_file(files[-1]) as part:
            flat.save(part, format="PNG", optimize=True)

    progress(1.0)
    return files
