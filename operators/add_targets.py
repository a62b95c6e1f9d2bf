"""Add the targets of head and hands, or of the feet, that a character lacks."""

import bpy

from ..dafnet_addon.blender.character.armature import character_and_goal
from ..dafnet_addon.blender.character.targets import (
    FEET,
    HEAD_AND_HANDS,
    add_targets,
    missing_targets,
)
from .base import DafnetOperator
from .follow_path import can_direct

__all__ = ["DAFNET_OT_add_foot_targets", "DAFNET_OT_add_targets"]


class DAFNET_OT_add_targets(DafnetOperator, bpy.types.Operator):
    """Add the missing targets of head and hands, where these are now; in mode EE the character
    follows them
    """

    bl_idname = "dafnet.add_targets"
    bl_label = "Add Targets"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character that lacks one."""
        if not can_direct(cls, context):
            return False
        cls.poll_message_set("The head and hands already have targets")
        return bool(missing_targets(context, character_and_goal(context)[0], HEAD_AND_HANDS))

    def run(self, context: bpy.types.Context) -> None:
        """Add them."""
        added = add_targets(context, character_and_goal(context)[0], HEAD_AND_HANDS)
        self.report({"INFO"}, f"Added {', '.join(each.name for each in added)}.")


class DAFNET_OT_add_foot_targets(DafnetOperator, bpy.types.Operator):
    """Add the missing targets of the feet, where these are now; in the modes EE and FULL the
    character steps onto them
    """

    bl_idname = "dafnet.add_foot_targets"
    bl_label = "Add Foot Targets"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character that lacks one."""
        if not can_direct(cls, context):
            return False
        cls.poll_message_set("The feet already have targets")
        return bool(missing_targets(context, character_and_goal(context)[0], FEET))

    def run(self, context: bpy.types.Context) -> None:
        """Add them."""
        added = add_targets(context, character_and_goal(context)[0], FEET)
        self.report({"INFO"}, f"Added {', '.join(each.name for each in added)}.")
