"""Setting the scene's frames: the current one comes back, and simulations run as they do when the shot is played."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy

from .dependencies import Simulation

__all__ = ["frame_kept", "in_order"]


@contextmanager
def frame_kept(scene: bpy.types.Scene) -> Iterator[None]:
    """Return to the current frame at the end, whatever happens."""
    frame, subframe = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=subframe)


def in_order(frames: Sequence[int], simulations: Sequence[Simulation]) -> Sequence[int]:
    """The frames to set, in this order, to see some rising ``frames``: those, or with simulations all from their start on.

    A simulation makes each frame of the one before, so it knows no jumps: not over frames, and not back and forth either.
    """
    if not simulations:
        return frames
    return range(min(frames[0], *(each.since for each in simulations)), frames[-1] + 1)
