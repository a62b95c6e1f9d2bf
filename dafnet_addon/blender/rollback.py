"""What writing a motion changes on an armature, and how it is all taken back where the writing
fails.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy

from .compat import playing

__all__ = ["state_of", "undone_on_failure"]

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


def state_of(armature: bpy.types.Object) -> Callable[[bpy.types.Object], None]:
    """A function that gives the armature, as it may have to be found again, the state that it has
    now.

    That is what it plays, its own transform and its bones', their custom numbers, and its list of
    takes, to which a bake adds rows at the end.
    """
    again = playing(armature)
    own = _channels(armature)
    bones = {bone.name: (_channels(bone), _numbers(bone)) for bone in armature.pose.bones}
    listed, active = len(armature.dafnet.takes), armature.dafnet.active_take

    def restore(found: bpy.types.Object) -> None:
        again(found)
        _set(found, own)
        for name, (channels, numbers) in bones.items():
            bone = found.pose.bones[name]
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
    """A block that writes to an armature: where it fails, whatever the reason, its actions are gone
    and its state is back.
    """
    restore, before = state_of(armature), set(bpy.data.actions)
    try:
        yield
    except BaseException:
        # first of all, since an action that is removed while it plays leaves its slot's number
        # behind
        restore(armature)
        for made in set(bpy.data.actions) - before:
            bpy.data.actions.remove(made)
        raise
