"""Find the furniture along the character's path."""

import bpy

from ..dafnet_addon.blender.character.armature import character_and_goal
from ..dafnet_addon.blender.directing.surroundings import find_furniture
from .base import DafnetOperator
from .follow_path import can_direct

__all__ = ["DAFNET_OT_find_furniture"]

_NAMED = 6
"""How many pieces the report names."""


class DAFNET_OT_find_furniture(DafnetOperator, bpy.types.Operator):
    """Link the visible meshes within 1.5 m of the root's path into a collection of the character's
    own, as its furniture
    """

    bl_idname = "dafnet.find_furniture"
    bl_label = "Find Furniture"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character with a root."""
        return can_direct(cls, context)

    def run(self, context: bpy.types.Context) -> None:
        """Find it."""
        found = find_furniture(context, character_and_goal(context)[0])
        for warning in found.warnings:
            self.report({"WARNING"}, warning)
        more = f" and {len(found.names) - _NAMED} more" if len(found.names) > _NAMED else ""
        self.report({"INFO"}, f"Furniture: {', '.join(found.names[:_NAMED])}{more}.")
