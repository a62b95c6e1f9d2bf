"""Make the character as large as the animator's own rig."""

from typing import Any

import bpy

from ..dafnet_addon.blender.rig.properties import character_for, map_of, rig_of
from ..dafnet_addon.blender.rig.sizing import size_as_rig
from .base import RigOperator

__all__ = ["DAFNET_OT_size_as_rig"]


class DAFNET_OT_size_as_rig(RigOperator, bpy.types.Operator):
    """Scale the character until its legs are as long as those of this armature, so that what you
    generate next has its stride, and hands, seats and feet stay where they are
    """

    bl_idname = "dafnet.size_as_rig"
    bl_label = "Size Character as Rig"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Scale it, and say how tall it is."""
        rig: Any = rig_of(context)
        character = character_for(context, rig)
        height = size_as_rig(context, character, rig, map_of(rig))
        self.report(
            {"INFO"}, f"'{character.name}' is {height:.2f} m tall now; generate its motion again"
        )
