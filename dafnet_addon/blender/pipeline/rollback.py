"""Undoes all that writing a motion changes on an armature, where the writing fails."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy

from ..compat import playback_restorer

__all__ = ["place_restorer", "state_restorer", "undone_on_failure"]

_TRANSFORM = (
    "rotation_mode",
    "location",
    "rotation_euler",
    "rotation_quaternion",
    "rotation_axis_angle",
    "scale",
)
_Channels = dict[str, object]


def _channels(owner: bpy.types.Object | bpy.types.PoseBone) -> _Channels:
    """Its own transform, and the numbers among its custom properties."""
    found: _Channels = {}
    for name in _TRANSFORM:
        value = getattr(owner, name)
        found[name] = value if isinstance(value, str) else tuple(value)
    return found


def _numbers(bone: bpy.types.PoseBone) -> dict[str, int | float]:
    return {key: value for key, value in bone.items() if isinstance(value, int | float)}


def _set(owner: bpy.types.Object | bpy.types.PoseBone, channels: _Channels) -> None:
    for name, value in channels.items():
        setattr(owner, name, value)


def place_restorer(owner: bpy.types.Object) -> Callable[[], None]:
    """A function that puts an object back to where it is now."""
    own = _channels(owner)
    return lambda: _set(owner, own)


def state_restorer(armature: bpy.types.Object) -> Callable[[bpy.types.Object], None]:
    """A function that restores the state that the armature has now; it takes the armature, which
    may have to be found again after an undo.

    The state is what it plays, its own transform and its bones', their custom numbers, and its list
    of takes, to which a bake adds rows at the end.
    """
    restore_playback = playback_restorer(armature)
    own = _channels(armature)
    bones = {bone.name: (_channels(bone), _numbers(bone)) for bone in armature.pose.bones}
    listed, active = len(armature.dafnet.takes), armature.dafnet.active_take

    def restore(found: bpy.types.Object) -> None:
        restore_playback(found)
        _set(found, own)
        for name, (channels, numbers) in bones.items():
            bone = found.pose.bones.get(name)
            if bone is None:  # renamed or removed since
                continue
            _set(bone, channels)
            for key, value in numbers.items():
                bone[key] = value

        rows = found.dafnet.takes
        while len(rows) > listed:
            rows.remove(len(rows) - 1)

        found.dafnet.active_take = active

    return restore


@contextmanager
def undone_on_failure(armature: bpy.types.Object) -> Iterator[None]:
    """A block that writes to an armature: if it fails, for whatever reason, the actions that it
    made are removed and the armature's state is restored.
    """
    restore, before = state_restorer(armature), set(bpy.data.actions)
    try:
        yield
    except BaseException:
        # First of all, since an action that is removed while it plays leaves the number of its slot
        # behind.
        restore(armature)
        for added in set(bpy.data.actions) - before:
            bpy.data.actions.remove(added)
        raise
