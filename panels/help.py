"""Where help is."""

import bpy

from ..dafnet_addon.blender.pipeline.running import running_job
from ..dafnet_addon.blender.preferences import draw_help
from .main import CharacterPanel

__all__ = ["DAFNET_PT_help"]


class DAFNET_PT_help(CharacterPanel, bpy.types.Panel):
    """The guide, and a report of what is wrong"""

    bl_label = "Help"
    bl_idname = "DAFNET_PT_help"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether there is a character or not; no job is running."""
        return running_job() is None

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw both."""
        draw_help(self.layout.column(align=True))
