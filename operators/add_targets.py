"""Add the targets of head and hands that a character lacks."""

import bpy

from ..dafnet_addon.blender.character.armature import sent
from ..dafnet_addon.blender.character.targets import add_targets, missing_targets
from .base import DafnetOperator
from .follow_path import may_direct

__all__ = ["DAFNET_OT_add_targets"]


class DAFNET_OT_add_targets(DafnetOperator, bpy.types.Operator):
    """Add empties for head and hands where the character has none, where they are now; mode EE
    follows them
    """

    bl_idname = "dafnet.add_targets"
    bl_label = "Add Targets"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character that lacks one."""
        if not may_direct(cls, context):
            return False
        cls.poll_message_set("Head and hands have their targets already")
        return bool(missing_targets(context, sent(context)[0]))

    def run(self, context: bpy.types.Context) -> None:
        """Add them."""
        made = add_targets(context, sent(context)[0])
        self.report({"INFO"}, f"Added {', '.join(each.name for each in made)}.")
