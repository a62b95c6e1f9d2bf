"""Say what somebody who is to help has to know."""

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.report import report_text
from .base import DafnetOperator

__all__ = ["DAFNET_OT_copy_report"]


class DAFNET_OT_copy_report(DafnetOperator, bpy.types.Operator):
    """Copy versions, the selected character's settings, and the figures and warnings of the take
    that plays, to add them to a question or an issue
    """

    bl_idname = "dafnet.copy_report"
    bl_label = "Copy Report"

    def run(self, context: bpy.types.Context) -> None:
        """Put the report onto the clipboard."""
        context.window_manager.clipboard = report_text(context, character_of(context))
        self.report({"INFO"}, "The report is on the clipboard; paste it where you ask.")
