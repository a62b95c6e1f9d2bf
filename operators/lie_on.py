"""Sends a character to lie down on what is selected."""

from collections.abc import Generator

import bpy
from bpy.props import FloatProperty

from ..dafnet_addon.blender.character.armature import character_and_goal
from ..dafnet_addon.blender.character.walk_rows import MANNER
from ..dafnet_addon.blender.directing.lying import lie_on, lying_replaces
from ..dafnet_addon.blender.directing.walking import Walk
from ..dafnet_addon.core.errors import InputError
from .base import asked_to_replace, idle
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

    seconds: FloatProperty(options={"SKIP_SAVE"}, **MANNER["seconds"])

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and none is being generated."""
        if not idle(cls):
            return False
        cls.poll_message_set("Add a character, or select one together with its goal")
        return context.mode == "OBJECT" and character_and_goal(context)[0] is not None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask before edited keys are replaced."""
        character, bed = character_and_goal(context)
        if bed is not None and lying_replaces(context.scene, character):
            return asked_to_replace(self, context, event)
        return super().invoke(context, event)

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way, and key it."""
        character, bed = character_and_goal(context)
        if bed is None:
            raise InputError("Select one object to lie on, and nothing else but the character.")
        self.take_manner(character)
        return lie_on.steps(context, character, bed, self.seconds)
