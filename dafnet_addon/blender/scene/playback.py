"""Sets the scene's frames one after the other: simulations run as they do when the shot is played,
and the current frame comes back.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, nullcontext

import bpy

from ...core.errors import InputError
from ..pipeline.running import note_change
from .dependencies import Simulation

__all__ = ["frame_kept", "frames_to_play", "nothing_deleted", "play_steps"]

_BATCH = 16
"""How many frames are set before the job yields, so that the user's input is looked at."""
Look = Callable[[int, bpy.types.Depsgraph, set[bpy.types.Object]], None]


@contextmanager
def nothing_deleted(meanwhile: str, then: str) -> Iterator[None]:
    """A block that looks at objects between the user's events: ``InputError`` where one of them was
    deleted ``meanwhile``, with what to do ``then``.
    """
    try:
        yield
    except ReferenceError as error:
        raise InputError(f"Something was deleted while {meanwhile}; {then}.") from error


@contextmanager
def frame_kept(scene: bpy.types.Scene) -> Iterator[None]:
    """A block after which the scene shows the current frame again, whatever happens."""
    frame, subframe = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=subframe)


def frames_to_play(frames: Sequence[int], simulations: Sequence[Simulation]) -> Sequence[int]:
    """The frames to set, one after the other, to see the ascending ``frames``: those alone, or with
    simulations every frame from their start on.

    A simulation computes each frame from the one before, so frames cannot be skipped, nor visited
    in another order.
    """
    if not simulations:
        return frames
    return range(min(frames[0], *(each.since for each in simulations)), frames[-1] + 1)


def play_steps(
    context: bpy.types.Context,
    frames: Sequence[int],
    simulations: Sequence[Simulation],
    look: Look,
) -> Generator[float, None, None]:
    """Set each of the ascending ``frames`` and ``look`` at it; yields progress in [0, 1), each time
    with the current frame as it was.

    With ``simulations`` the frames run on instead, and the current one comes back at the end or
    when the generator is closed. ``look`` gets the frame, the evaluated scene, and the objects that
    Blender has shaped anew for it. ``InputError``: something else has set a frame while a
    simulation ran.
    """
    scene = context.scene
    played = frames_to_play(frames, simulations)
    last = scene.frame_current
    with frame_kept(scene) if simulations else nullcontext():
        for start in range(0, len(played), _BATCH):
            if simulations and scene.frame_current != last:
                raise InputError(
                    "The current frame was changed while a simulation was read; try again."
                )
            with nullcontext() if simulations else frame_kept(scene), _reshaped(scene) as shaped:
                for frame in played[start : start + _BATCH]:
                    shaped.clear()
                    scene.frame_set(frame)
                    if frame >= frames[0]:
                        look(frame, context.evaluated_depsgraph_get(), shaped)
                last = scene.frame_current
            note_change()
            yield min(start + _BATCH, len(played)) / (len(played) + 1)


@contextmanager
def _reshaped(scene: bpy.types.Scene) -> Iterator[set[bpy.types.Object]]:
    """The objects that Blender shapes anew when a frame is set, added by Blender itself until the
    block ends.
    """
    found: set[bpy.types.Object] = set()

    def note(changed: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        if changed == scene:
            ids = (update.id.original for update in depsgraph.updates if update.is_updated_geometry)
            found.update(each for each in ids if isinstance(each, bpy.types.Object))

    handlers = bpy.app.handlers.frame_change_post
    handlers.append(note)
    try:
        yield found
    finally:
        handlers.remove(note)
