"""Add the root that a character lacks."""

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.targets import add_root, lacks_root
from .base import DafnetOperator, idle

__all__ = ["DAFNET_OT_add_root"]


class DAFNET_OT_add_root(DafnetOperator, bpy.types.Operator):
    """Add the empty that leads the character, where it stands now"""

    bl_idname = "dafnet.add_root"
    bl_label = "Add Root"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character without a root."""
        if not idle(cls):
            return False
        character = character_of(context)
        cls.poll_message_set("Select a character that has no root")
        return context.mode == "OBJECT" and character is not None and lacks_root(context, character)

    def run(self, context: bpy.types.Context) -> None:
        """Add it."""
        add_root(context, character_of(context))
