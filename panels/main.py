"""The one tab in the 3D view's sidebar."""

import bpy

from ..dafnet_addon.blender.armature import character_of, sent
from ..dafnet_addon.blender.compat import action_curves
from ..operators.add_character import DAFNET_OT_add_character
from ..operators.generate import DAFNET_OT_generate
from ..operators.walk_to import DAFNET_OT_walk_to

__all__ = ["DAFNET_PT_character"]


class DAFNET_PT_character(bpy.types.Panel):
    """Settings of the active character, and Generate"""

    bl_label = "DAFNet"
    bl_idname = "DAFNET_PT_character"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "DAFNet"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings of the active character, or the way to get one."""
        layout = self.layout
        character = character_of(context)
        if character is None:
            directed, goal = sent(context)
            if directed is not None and goal is not None:
                layout.label(text=f"{directed.name}: {goal.name}", icon="ARMATURE_DATA")
                layout.operator(DAFNET_OT_walk_to.bl_idname, text=f"Sit on {goal.name}", icon="TRACKING_FORWARDS").goal = "SEAT"
                return
            layout.label(text="No character is selected", icon="INFO")
            layout.operator(DAFNET_OT_add_character.bl_idname, icon="ARMATURE_DATA")
            return

        settings = character.dafnet
        layout.label(text=character.name, icon="ARMATURE_DATA")
        layout.row(align=True).prop(settings, "mode", expand=True)
        layout.use_property_split = True
        layout.use_property_decorate = False
        animated = any(curve.data_path == "dafnet.mode" for curve in action_curves(character))

        column = layout.column()
        column.prop(settings, "furniture")
        column.prop(settings, "root", icon="EMPTY_ARROWS")
        row = column.row(align=True)
        row.operator(DAFNET_OT_walk_to.bl_idname, text="Sit on Selected", icon="TRACKING_FORWARDS").goal = "SEAT"
        row.operator(DAFNET_OT_walk_to.bl_idname, text="Walk to Cursor", icon="CURSOR").goal = "CURSOR"
        if settings.mode == "EE" or animated:
            column = layout.column()
            column.prop(settings, "head")
            column.prop(settings, "hand_left")
            column.prop(settings, "hand_right")
        if settings.mode == "FULL" or animated:
            layout.prop(settings, "upper_body_source", icon="ARMATURE_DATA")

        column = layout.column(align=True)
        column.prop(settings, "use_scene_range")
        if not settings.use_scene_range:
            column.prop(settings, "frame_start")
            column.prop(settings, "frame_end")

        column = layout.column()
        column.prop(settings, "temperature", slider=True)
        column.prop(settings, "seed")
        row = column.row(heading="Vary the Legs")
        row.prop(settings, "use_lower_seed", text="")
        legs = row.row()
        legs.active = settings.use_lower_seed
        legs.prop(settings, "lower_seed", text="")

        column = layout.column()
        column.prop(settings, "plant_feet", slider=True)
        column.prop(settings, "rest_on_seats", slider=True)
        if settings.mode == "EE" or animated:
            column.prop(settings, "reach_targets", slider=True)

        if DAFNET_OT_generate.progress is None:
            row = layout.row()
            row.scale_y = 1.5
            row.operator(DAFNET_OT_generate.bl_idname, icon="PLAY")
            layout.operator(DAFNET_OT_add_character.bl_idname, icon="ADD")
        else:
            percent = f"{100 * DAFNET_OT_generate.progress:.0f} %, Esc cancels"
            layout.progress(factor=DAFNET_OT_generate.progress, text=percent)
