"""Which character the overlays are for, and the take that it plays."""

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.cleanup import standing_still
from ...core.resampling import frame_times, resample_nearest, resample_positions
from ...core.series import MODEL_FPS
from ...core.take import Controls, Take
from ..character.armature import character_of
from ..character.takes import PACKED, played_take, stored_take
from .cache import cache

__all__ = [
    "PlayedTake",
    "UnpackedTake",
    "forget",
    "played_now",
    "unpacked_take",
    "watched_character",
]

_CAPACITY = 24
"""Takes that stay unpacked, since ghosts are shown together."""

_last_watched: list[object] = [None, ""]
"""The selection that the watched character was found by, and its name."""


def forget() -> None:
    """Drop what was computed, and which character was watched."""
    cache.forget()
    _last_watched[:] = None, ""


def watched_character(context: bpy.types.Context) -> bpy.types.Object | None:
    """The character that overlays are for (``armature.character_of``)."""
    scene, active = context.scene, context.object
    key = cache.edits, scene.session_uid, active.session_uid if active else 0
    last = scene.objects.get(_last_watched[1])
    if last is not None and _last_watched[0] == key:
        return last

    character = character_of(context)
    _last_watched[:] = key, character.name if character else ""
    return character


@dataclass(frozen=True)
class UnpackedTake:
    """A take, the controls it was made from, and ``planted`` (T, 2): whether the left and the right
    foot are planted.
    """

    take: Take
    controls: Controls
    planted: np.ndarray


def unpacked_take(action: bpy.types.Action) -> UnpackedTake | None:
    """The take that an action holds; None where it holds none."""
    if PACKED not in action:
        return None

    def unpack() -> UnpackedTake:
        take, controls = stored_take(action)
        return UnpackedTake(take, controls, _planted(take))

    return cache.recall("takes", action.session_uid, unpack, _CAPACITY)


def _planted(take: Take) -> np.ndarray:
    """Whether feet are planted (T, 2) at the take's own rate."""
    own = frame_times(len(take), take.fps)
    model = frame_times(len(take.path), MODEL_FPS)
    joints = resample_positions(take.joints / take.scale, own, model)

    planted = np.zeros((len(model), 2), bool)
    for foot, start, stop in standing_still(joints, take.path.position[:, 2]):
        planted[start:stop, foot] = True
    return resample_nearest(planted, model, own)


@dataclass(frozen=True)
class PlayedTake:
    """The take that is played, its ``action``, and its ``frame`` that is the scene's current one;
    None outside the take.
    """

    action: bpy.types.Action
    unpacked: UnpackedTake
    frame: int | None

    @property
    def take(self) -> Take:
        return self.unpacked.take


def played_now(context: bpy.types.Context, armature: bpy.types.Object) -> PlayedTake | None:
    """The take that the armature plays; None where it plays none."""
    action = played_take(armature)
    unpacked = unpacked_take(action) if action else None
    if action is None or unpacked is None:
        return None
    frame = context.scene.frame_current - action.dafnet.frame_start
    return PlayedTake(action, unpacked, frame if 0 <= frame < len(unpacked.take) else None)
