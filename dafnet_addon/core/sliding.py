"""How far feet slide, as an eye sees it: not while they land or roll off, which the paper's count
(``metrics.foot_sliding``) takes for sliding as well.
"""

from collections.abc import Mapping

import numpy as np

from .cleanup import standing_still
from .series import runs
from .skeleton import FEET, FEET_ASKED, TOE_HEIGHT

__all__ = ["SEEN", "led", "slides"]

SEEN = 0.02
"""Metres of a slide that an eye sees."""

# Canonical metres, seconds.
_LANDS = 0.1  # in which a foot lands, and in which it rolls off
_LED = 0.35  # in which a foot is led to a target, and from it
_GLIDES = 0.2  # of the shortest slide of a foot that never stands
_FLAT = 0.008  # of a toe base over its height when planted, up to which it is on the floor
_MOVES = 0.12  # a second, above which it moves


def slides(
    joints: np.ndarray,
    fps: float,
    floor: np.ndarray | float = 0.0,
    targets: Mapping[str, np.ndarray | None] | None = None,
) -> np.ndarray:
    """How far a foot moves over the floor (T, 2), canonical metres, in the slide that a frame is
    in; 0 where it swings, stands, lands or rolls off, or goes to a target or from one.

    ``joints`` (T, 22, 3): world, canonical metres; ``floor``: a height or one for each frame;
    ``targets``: (T, 3) by the names of ``skeleton.TARGETS``, None or NaN where free. A slide is
    what a standing foot moves, or the way of one that glides flat over the floor.
    """
    found = np.zeros((len(joints), 2))
    by_itself = ~led(targets or {}, len(joints), fps)
    for foot, toe in enumerate(FEET):
        place = joints[:, toe]
        flat = (place[:, 2] - floor < TOE_HEIGHT + _FLAT) & by_itself[:, foot]
        moves = np.zeros(len(joints), bool)
        if len(joints) > 1:
            moves = np.linalg.norm(np.gradient(place[:, :2], axis=0), axis=-1) * fps > _MOVES
        for start, stop in runs(flat & moves, at_least=max(2, round(_GLIDES * fps) + 1)):
            way = np.linalg.norm(np.diff(place[start:stop, :2], axis=0), axis=1).sum()
            found[start:stop, foot] = way

    lands = round(_LANDS * fps)
    for foot, first, last in standing_still(joints, floor, fps):
        for begin, end in runs(by_itself[first:last, foot]):
            start, stop = first + begin + lands, first + end - lands
            if stop - start > 1:
                moved = np.linalg.norm(np.ptp(joints[start:stop, FEET[foot], :2], axis=0))
                found[start:stop, foot] = np.maximum(found[start:stop, foot], moved)
    return found


def led(targets: Mapping[str, np.ndarray | None], frames: int, fps: float) -> np.ndarray:
    """Whether (T, 2) feet are at a target, on the way there or back."""
    out, way = np.zeros((frames, 2), bool), round(_LED * fps)
    for foot, name in enumerate(FEET_ASKED):
        if (target := targets.get(name)) is not None:
            for start, stop in runs(np.isfinite(target).all(axis=-1)):
                out[max(0, start - way) : stop + way, foot] = True
    return out
