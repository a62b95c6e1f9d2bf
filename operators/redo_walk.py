"""Make the walks of a character anew."""

from collections.abc import Generator
from typing import Any

import bpy
from bpy.props import BoolProperty

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.directing.made_walks import edited_from
from ..dafnet_addon.blender.directing.redo import redo_walks
from ..dafnet_addon.blender.directing.walking import Walk
from .base import asked_to_replace, idle
from .walking import WalkOperator

__all__ = ["DAFNET_OT_redo_walk"]


class DAFNET_OT_redo_walk(WalkOperator, bpy.types.Operator):
    """Make the chosen walk anew, and those after it: to where its seat is now, from where you have
    moved the character to, with the speed and seconds above. Keys that you have edited are asked
    about
    """

    bl_idname = "dafnet.redo_walk"
    bl_label = "Redo Walk"
    bl_options = {"REGISTER", "UNDO"}

    replace_edited: BoolProperty(
        name="Replace Edited Keys",
        options={"SKIP_SAVE"},
        description="Replace keys that you have edited as well; a copy of their action is kept",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A character was sent somewhere, in object mode, and no job is running."""
        if not idle(cls):
            return False
        cls.poll_message_set("Send the character somewhere first, in object mode")
        character = character_of(context)
        return (
            context.mode == "OBJECT" and character is not None and len(character.dafnet.walks) > 0
        )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask before edited keys are replaced."""
        character: Any = character_of(context)
        if not self.replace_edited and edited_from(character, character.dafnet.active_walk):
            self.replace_edited = True
            return asked_to_replace(self, context, event)
        return super().invoke(context, event)

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the ways, and key the walks."""
        character: Any = character_of(context)
        return redo_walks.steps(
            context, character, character.dafnet.active_walk, self.replace_edited
        )
