"""Say what somebody who is to help has to know."""

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.report import write_report
from .base import DafnetOperator

__all__ = ["DAFNET_OT_copy_report"]


class DAFNET_OT_copy_report(DafnetOperator, bpy.types.Operator):
    """Write versions, the character's settings, and the figures and warnings of the take that plays
    into a text of this file and onto the clipboard, to add them to a question or an issue. It holds
    no names and no paths
    """

    bl_idname = "dafnet.copy_report"
    bl_label = "Report a Problem"

    def run(self, context: bpy.types.Context) -> None:
        """Write the report into a text, and copy it."""
        text = write_report(context, character_of(context))
        context.window_manager.clipboard = text.as_string()
        self.report(
            {"INFO"},
            f"The report is in the text '{text.name}' and on the clipboard; read it, and paste it "
            "where you ask.",
        )
