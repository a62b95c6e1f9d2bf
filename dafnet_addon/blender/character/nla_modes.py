"""Modes of the Nonlinear Animation editor in which an armature's action cannot be changed, or is
not what plays.
"""

import bpy

from ...core.errors import InputError

__all__ = ["require_no_tweak_mode", "require_not_tweaked_nor_solo"]


def require_no_tweak_mode(armature: bpy.types.Object) -> None:
    """``InputError`` where a strip is edited: Blender lets no other action be assigned then."""
    data = armature.animation_data
    if data and data.use_tweak_mode:
        raise InputError(f"'{armature.name}' edits a strip in tweak mode; leave it first (Tab).")


def require_not_tweaked_nor_solo(armature: bpy.types.Object) -> None:
    """``InputError`` where a strip is edited, or plays alone."""
    data = armature.animation_data
    if data and (data.use_tweak_mode or any(track.is_solo for track in data.nla_tracks)):
        raise InputError(
            f"The armature '{armature.name}' plays an NLA strip in tweak or solo mode; leave it "
            "first."
        )
