"""Sends a character to lie down on what is selected."""

from collections.abc import Generator

import bpy
from bpy.props import FloatProperty

from ..dafnet_addon.blender.character.armature import character_and_goal
from ..dafnet_addon.blender.directing.lying import lie_on
from ..dafnet_addon.blender.directing.walking import Walk
from ..dafnet_addon.core.errors import InputError
from .base import idle
from .walking import WalkOperator

__all__ = ["DAFNET_OT_lie_on"]


class DAFNET_OT_lie_on(WalkOperator, bpy.types.Operator):
    """Walk to the selected bed or sofa, sit down on its edge and lie down: root, targets and modes
    are keyed from the start of the range on. Keys that you have edited are kept in an action of
    their own
    """

    bl_idname = "dafnet.lie_on"
    bl_label = "Lie on Selected"
    bl_options = {"REGISTER", "UNDO"}

    seconds: FloatProperty(
        name="Stay",
        default=4.0,
        min=0.0,
        max=600.0,
        subtype="TIME_ABSOLUTE",
        description="How long it stays there, in seconds",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and none is being generated."""
        if not idle(cls):
            return False
        cls.poll_message_set("Add a character, or select one together with its goal")
        return context.mode == "OBJECT" and character_and_goal(context)[0] is not None

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way, and key it."""
        character, bed = character_and_goal(context)
        if bed is None:
            raise InputError("Select one object to lie on, and nothing else but the character.")
        return lie_on.steps(context, character, bed, self.seconds)
