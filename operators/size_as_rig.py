"""Make the character as large as the animator's own rig."""

from typing import Any

import bpy

from ..dafnet_addon.blender.rig.properties import character_for, map_of, rig_of
from ..dafnet_addon.blender.rig.sizing import size_as_rig
from .base import DafnetOperator, idle

__all__ = ["DAFNET_OT_size_as_rig"]


class DAFNET_OT_size_as_rig(DafnetOperator, bpy.types.Operator):
    """Scale the character until its legs are as long as those of this armature, so that what you
    generate next has its stride, and hands, seats and feet stay where they are
    """

    bl_idname = "dafnet.size_as_rig"
    bl_label = "Size Character as Rig"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A rig of the animator's own is active, and no job is running."""
        if not idle(cls):
            return False
        cls.poll_message_set("Select the armature of your rig, in object or pose mode")
        return rig_of(context) is not None and context.mode in {"OBJECT", "POSE"}

    def run(self, context: bpy.types.Context) -> None:
        """Scale it, and say how tall it is."""
        rig: Any = rig_of(context)
        character = character_for(context, rig)
        height = size_as_rig(context, character, rig, map_of(rig))
        self.report(
            {"INFO"}, f"'{character.name}' is {height:.2f} m tall now; generate its motion again"
        )
