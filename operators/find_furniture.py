"""Find the furniture beside the character's path."""

import bpy

from ..dafnet_addon.blender.character.armature import sent
from ..dafnet_addon.blender.directing.surroundings import find_furniture
from .base import DafnetOperator
from .follow_path import may_direct

__all__ = ["DAFNET_OT_find_furniture"]

_NAMED = 6


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
        return may_direct(cls, context)

    def run(self, context: bpy.types.Context) -> None:
        """Find it."""
        found = find_furniture(context, sent(context)[0])
        for warning in found.warnings:
            self.report({"WARNING"}, warning)
        more = f" and {len(found.names) - _NAMED} more" if len(found.names) > _NAMED else ""
        self.report({"INFO"}, f"Furniture: {', '.join(found.names[:_NAMED])}{more}.")
