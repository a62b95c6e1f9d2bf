"""Add a character to the scene."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ..dafnet_addon.blender.character.armature import create_character
from ..dafnet_addon.core.skeleton import STATURE
from ..dafnet_addon.core.units import require_human_height
from .base import DafnetOperator

__all__ = ["DAFNET_OT_add_character"]


class DAFNET_OT_add_character(DafnetOperator, bpy.types.Operator):
    """Add a character at the 3D cursor: an armature with a body, and the empties that direct it"""

    bl_idname = "dafnet.add_character"
    bl_label = "Add Character"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(
        name="Name", default="Character", description="Name of the character and of its collection"
    )
    height: FloatProperty(
        name="Height",
        default=STATURE,
        min=0.5,
        soft_min=1.4,
        soft_max=2.1,
        max=3000.0,
        description="Crown to sole, in metres",
    )

    build: FloatProperty(
        name="Build",
        default=1.0,
        min=0.5,
        soft_min=0.7,
        soft_max=1.4,
        max=2.0,
        description="How stout the body is; the motion is the same",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A new armature needs object mode."""
        cls.poll_message_set("Switch to object mode first")
        return context.mode == "OBJECT"

    def run(self, context: bpy.types.Context) -> None:
        """Add it."""
        require_human_height(self.height, "A character")
        create_character(context, self.name, self.height, self.build)
