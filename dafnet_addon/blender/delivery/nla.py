"""A take as a strip of the Nonlinear Animation editor."""

import bpy

from ...core.errors import InputError
from ..character.nla_modes import require_no_tweak_mode
from ..compat import add_strip

__all__ = ["put_into_nla"]


def put_into_nla(armature: bpy.types.Object, action: bpy.types.Action) -> bpy.types.NlaStrip:
    """Add a strip that plays a take where its frames are, on a track of its own above the others;
    the action itself is used, and the armature no longer plays it besides.

    ``InputError``: it has a strip with this take already, or is edited in a way that keeps it from
    getting one; nothing is changed then.
    """
    require_no_tweak_mode(armature)
    data = armature.animation_data_create()
    if armature.library or (
        armature.override_library and armature.override_library.is_system_override
    ):
        raise InputError(f"'{armature.name}' is linked; make it local to give it strips.")
    for track in data.nla_tracks:
        if any(strip.action == action for strip in track.strips):
            raise InputError(f"The take '{action.name}' is on the track '{track.name}' already.")

    if data.action == action:
        data.action = None
    action.use_fake_user = True
    track = data.nla_tracks.new()
    track.name = action.name
    strip = add_strip(track, action)
    strip.influence = 1.0
    strip.blend_type, strip.extrapolation = "REPLACE", "HOLD"
    data.use_nla = True
    return strip
