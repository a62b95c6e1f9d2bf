"""Add an example scene."""

from typing import Any

import bpy
from bpy.props import EnumProperty

from ..dafnet_addon.blender.overlay import display
from ..dafnet_addon.blender.showcase.examples import EXAMPLES, add_example
from ..dafnet_addon.blender.translations import translated_tip
from .base import DafnetOperator, idle

__all__ = ["DAFNET_OT_add_example"]


class DAFNET_OT_add_example(DafnetOperator, bpy.types.Operator):
    """Add furniture at the 3D cursor and a character that uses it, keyed and ready to generate"""

    bl_idname = "dafnet.add_example"
    bl_label = "Add DAFNet Example"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(
        name="Example",
        items=[(kind, example.label, example.description) for kind, example in EXAMPLES.items()],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """The example's own tooltip."""
        does = translated_tip(EXAMPLES[properties.kind].description)
        gives = translated_tip("furniture at the 3D cursor and a character, ready to generate")
        return f"{does}: {gives}"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A new armature needs object mode."""
        if not idle(cls):
            return False
        cls.poll_message_set("Switch to object mode first")
        return context.mode == "OBJECT"

    def run(self, context: bpy.types.Context) -> None:
        """Add it, and draw its path."""
        armature = add_example(context, self.kind)
        display.suggest("path")
        self.report(
            {"INFO"}, f"'{armature.name}' is ready: press Generate in the sidebar's tab DAFNet."
        )
