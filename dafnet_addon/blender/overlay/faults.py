"""Where takes are at fault, frame by frame, and the bars that mark it in the timeline."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.conditions import foot_targets
from ...core.distance import prepared, scaled
from ...core.metrics import BAD_COLLISION_JOINTS, bad_collisions
from ...core.nearby import REACH_OF_A_BODY, solids_near
from ...core.occupancy import distance
from ...core.progress import stepwise, within
from ...core.sliding import SEEN, slides
from ...core.solids import Scene
from ..character.settings import settings_of
from ..character.takes import frames_of, stored_take
from ..scene.playback import nothing_deleted
from ..scene.scene_reader import read_scene

__all__ = ["FaultBars", "Faults", "fault_bars", "faults_of"]

_SLIDING = (1.0, 0.78, 0.15, 0.45)
"""Colour of a frame in which one foot slides."""
_COLLIDING = (1.0, 0.15, 0.15, 0.45)
"""Colour of a frame in which one joint touches furniture."""
_STRONGER = 0.25
"""Opacity that every further fault of the frame adds."""


@dataclass(frozen=True)
class Faults:
    """Of each frame of a take: ``sliding`` (T,), how many feet slide; ``collisions`` (T,), how many
    joints touch furniture.
    """

    sliding: np.ndarray
    collisions: np.ndarray


@dataclass(frozen=True)
class FaultBars:
    """Bars over time: ``first`` and ``last`` frame (R,), both marked; ``row`` (R,): 0 sliding, 1
    collisions; ``colours`` (R, 4).
    """

    first: np.ndarray
    last: np.ndarray
    row: np.ndarray
    colours: np.ndarray


@stepwise
def faults_of(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    actions: Sequence[bpy.types.Action],
) -> Generator[float, None, dict[int, Faults]]:
    """Faults of takes by their actions' ``session_uid``, among the furniture as the scene has it in
    each frame.

    A job, see ``read_scene``. ``InputError`` as there, where an action holds no take, and where
    something is deleted meanwhile.
    """
    found: dict[int, Faults] = {}
    scenes: dict[tuple[int, int], Scene] = {}
    with nothing_deleted("takes were measured", "try again"):
        for k, action in enumerate(actions):
            one = _faults(context, armature, action, scenes)
            faults = yield from within(one, k / len(actions), (k + 1) / len(actions))
            found[action.session_uid] = faults
    return found


def _faults(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    action: bpy.types.Action,
    scenes: dict[tuple[int, int], Scene],
) -> Generator[float, None, Faults]:
    """Those of one take; ``scenes``: what has been read, by frames, to which this adds."""
    take, controls = stored_take(action)
    first, last = frames = frames_of(action)
    if frames not in scenes:
        settings = settings_of(
            armature, context.scene, frame_start=first, frame_end=last, mode="FREE"
        )
        read = yield from within(read_scene.steps(context, settings), 0.0, 0.5)
        scenes[frames] = read.scene

    floor = take.root[:, 2, 3] / take.scale
    joints = take.joints / take.scale
    near = solids_near(scenes[frames], take.root[:, :3, 3], REACH_OF_A_BODY, take.scale)
    solids, _ = yield from within(
        prepared.steps(scaled(near, 1.0 / take.scale), float(np.median(floor))), 0.5, 1.0
    )
    apart = distance(solids, joints[:, list(BAD_COLLISION_JOINTS)], floor)
    return Faults(
        (slides(joints, take.fps, floor, foot_targets(controls)) > SEEN).sum(axis=1),
        bad_collisions(apart),
    )


def fault_bars(faults: Faults, frame_start: int) -> FaultBars:
    """A bar for each run of frames with the same number of faults, stronger where there are more.

    ``frame_start``: the take's first frame in the scene.
    """
    bars: list[tuple[int, int, int]] = []
    colours = []
    for row, (counts, colour) in enumerate(
        ((faults.sliding, _SLIDING), (faults.collisions, _COLLIDING))
    ):
        edges = np.concatenate([[0], np.flatnonzero(np.diff(counts)) + 1, [len(counts)]])
        for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            if stop > start and counts[start] > 0:
                bars.append((frame_start + start, frame_start + stop - 1, row))
                opacity = colour[3] + _STRONGER * (float(counts[start]) - 1.0)
                colours.append((*colour[:3], min(1.0, opacity)))

    table = np.array(bars, int).reshape(-1, 3)
    return FaultBars(
        first=table[:, 0],
        last=table[:, 1],
        row=table[:, 2],
        colours=np.array(colours).reshape(-1, 4),
    )
