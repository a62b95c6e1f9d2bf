"""The first panel of the tab in the 3D view's sidebar: whose it is; and that of the shot: the
character's mode and targets, and Generate.
"""

from typing import Any

import bpy

from ..dafnet_addon.blender.character.armature import character_of, is_character
from ..dafnet_addon.blender.character.targets import (
    FEET,
    HEAD_AND_HANDS,
    lacks_root,
    missing_targets,
)
from ..dafnet_addon.blender.compat import action_curves
from ..dafnet_addon.blender.live.listening import live_state
from ..dafnet_addon.blender.pipeline.running import running_job
from ..dafnet_addon.blender.scene.unit_note import unit_note_lately
from ..dafnet_addon.blender.translations import translated_tip
from ..operators.add_character import DAFNET_OT_add_character
from ..operators.add_root import DAFNET_OT_add_root
from ..operators.add_targets import DAFNET_OT_add_foot_targets, DAFNET_OT_add_targets
from ..operators.find_furniture import DAFNET_OT_find_furniture
from ..operators.generate import DAFNET_OT_cancel, DAFNET_OT_generate
from ..operators.live import DAFNET_OT_live
from .live import draw_live
from .presets import DAFNET_PT_presets
from .sentences import draw_sentence

__all__ = ["CharacterPanel", "DAFNET_PT_character", "DAFNET_PT_shot"]


class CharacterPanel:
    """A panel of the tab that is shown for a character, while no job is running."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "DAFNet"
    bl_parent_id = "DAFNET_PT_character"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character, and nothing is running."""
        return running_job() is None and live_state() is None and character_of(context) is not None


class DAFNET_PT_character(bpy.types.Panel):
    """The character that the panels below are about"""

    bl_label = "DAFNet"
    bl_idname = "DAFNET_PT_character"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "DAFNet"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        """Draw the menu of presets, which go to the active object."""
        if character_of(context) is not None and character_of(context) == context.object:
            DAFNET_PT_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the character's name, or the way to get one; while a job runs, how far it is."""
        layout = self.layout
        if (running := running_job()) is not None:
            layout.progress(
                factor=running.progress,
                text=f"{100 * running.progress:.0f} %, {running.seconds_left:.0f} s left",
            )
            layout.operator(DAFNET_OT_cancel.bl_idname, icon="CANCEL")
            return

        if (live := live_state()) is not None:
            draw_live(layout, live)
            return

        character = character_of(context)
        if character is None:
            several = any(is_character(each) for each in context.scene.objects)
            text = "Select a character" if several else "Add a character first"
            layout.label(text=text, icon="INFO")
            layout.operator(DAFNET_OT_add_character.bl_idname, icon="ARMATURE_DATA")
            return

        row = layout.row()
        row.label(text=character.name, icon="ARMATURE_DATA", translate=False)
        row.operator(DAFNET_OT_add_character.bl_idname, text="", icon="ADD")
        if note := unit_note_lately(context.scene, character):
            draw_sentence(layout.column(align=True), context, note, "ERROR", alert=True)


class DAFNET_PT_shot(CharacterPanel, bpy.types.Panel):
    """What is generated, and from what"""

    bl_label = "Shot"
    bl_idname = "DAFNET_PT_shot"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings of the character, and Generate."""
        layout = self.layout
        character: Any = character_of(context)
        settings = character.dafnet
        layout.row(align=True).prop(settings, "mode", expand=True)
        does = settings.bl_rna.properties["mode"].enum_items[settings.mode].description
        draw_sentence(layout.column(align=True), context, translated_tip(does), "NONE")

        # Here, where it always is: what stands below differs from mode to mode.
        row = layout.row()
        row.scale_y = 1.5
        row.operator(DAFNET_OT_generate.bl_idname, icon="PLAY").task = "NEW"
        layout.operator(DAFNET_OT_live.bl_idname, icon="RESTRICT_SELECT_OFF")

        layout.use_property_split = True
        layout.use_property_decorate = False
        animated = any(curve.data_path == "dafnet.mode" for curve in action_curves(character))

        column = layout.column()
        above = column.row(align=True)
        above.label(text="Furniture")
        above.operator(DAFNET_OT_find_furniture.bl_idname, text="", icon="VIEWZOOM")
        row = column.row(align=True)
        row.use_property_split = False
        row.prop(settings, "furniture", text="")

        row = column.row(align=True)
        row.prop(settings, "root", icon="EMPTY_ARROWS")
        if lacks_root(context, character):
            row.operator(DAFNET_OT_add_root.bl_idname, text="", icon="ADD")

        if settings.mode == "EE" or animated:
            for role in HEAD_AND_HANDS:
                _draw_target(layout, settings, role, "OBJECT_DATA")
            if missing_targets(context, character, HEAD_AND_HANDS):
                layout.operator(DAFNET_OT_add_targets.bl_idname, icon="EMPTY_ARROWS")
        if settings.mode != "FREE" or animated:
            for role in FEET:
                _draw_target(layout, settings, role, "OBJECT_DATA")
            if missing_targets(context, character, FEET):
                layout.operator(DAFNET_OT_add_foot_targets.bl_idname, icon="EMPTY_ARROWS")

        _draw_target(layout, settings, "look_at", "HIDE_OFF")

        if settings.mode == "FULL" or animated:
            layout.prop(settings, "upper_body_source", icon="ARMATURE_DATA")
            if settings.upper_body_source is None:
                layout.prop(settings, "upper_body_take", icon="ACTION")
            layout.prop(settings, "lower_body_source", icon="ARMATURE_DATA")
            if settings.upper_body_source or settings.lower_body_source:
                row = layout.row(align=True)
                row.prop(settings, "source_offset")
                row.prop(settings, "source_loops", toggle=True)
        if animated:
            layout.prop(settings, "blend_frames")

        column = layout.column(align=True)
        column.prop(settings, "use_scene_range")
        if not settings.use_scene_range:
            column.prop(settings, "frame_start")
            column.prop(settings, "frame_end")
        column.prop(settings, "begins")

        column = layout.column()
        column.prop(settings, "temperature", slider=True)
        row = column.row()
        row.active = settings.temperature > 0.0 or settings.take_count > 1
        row.prop(settings, "noise")
        column.prop(settings, "seed")
        column.prop(settings, "take_count")


def _draw_target(
    layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, role: str, icon: str
) -> None:
    """Draw what a target is for and how far it counts, and below, over the whole width, which it
    is.
    """
    column = layout.column(align=True)
    row = column.row(align=True)
    row.use_property_decorate = True
    row.active = getattr(settings, role) is not None
    name = settings.bl_rna.properties[role].name
    row.prop(settings, f"{role}_influence", text=name, slider=True)

    row = column.row(align=True)
    row.use_property_split = False
    row.prop(settings, role, text="", icon=icon)
    if role == "head" and settings.head is not None:
        row = column.row(align=True)
        row.use_property_decorate = True
        row.prop(settings, "head_follows", text="Follows")
