"""Switches of what is drawn over the view and in the timeline."""

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.takes import played_take
from ..dafnet_addon.blender.overlay import display
from ..dafnet_addon.blender.overlay.contents import KINDS
from ..operators.mark_frames import DAFNET_OT_mark_frames
from .main import CharacterPanel

__all__ = ["DAFNET_PT_overlays"]


class DAFNET_PT_overlays(CharacterPanel, bpy.types.Panel):
    """What the network sees, and how good the take is"""

    bl_label = "Overlays"
    bl_idname = "DAFNET_PT_overlays"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the switches."""
        layout = self.layout
        grid = layout.grid_flow(columns=2, even_columns=True, align=True)
        for kind in KINDS:
            grid.prop(context.window_manager.dafnet_overlays, kind, toggle=True)
        character = character_of(context)
        marked = display.shown_faults(played_take(character) if character else None) is not None
        layout.operator(DAFNET_OT_mark_frames.bl_idname, icon="MARKER_HLT", depress=marked)
