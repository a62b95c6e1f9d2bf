"""The character's takes: which there are, how good they are, and what can be made of them."""

from typing import Any

import bpy

from ..dafnet_addon.blender.armature import character_of
from ..dafnet_addon.blender.takes import active_take
from ..operators.generate import DAFNET_OT_generate
from ..operators.takes import (
    DAFNET_OT_clean_again,
    DAFNET_OT_keep_accepted,
    DAFNET_OT_play_take,
    DAFNET_OT_reject_take,
)
from .main import CharacterPanel

__all__ = ["DAFNET_PT_clean_up", "DAFNET_PT_takes", "DAFNET_UL_takes"]


class DAFNET_UL_takes(bpy.types.UIList):
    """Takes of a character"""

    bl_idname = "DAFNET_UL_takes"

    def draw_item(
        self, _context: bpy.types.Context, layout: bpy.types.UILayout, data: Any, item: Any, _icon: int, _active: Any,
        _name: str, index: int = 0, _flag: int = 0,
    ) -> None:
        """A row: play, name, seed, sliding, collisions, ghost, accepted."""
        action = item.action
        if action is None:
            layout.label(text="Deleted", icon="ERROR")
            return
        animation = data.id_data.animation_data
        plays = animation is not None and animation.action == action
        row = layout.row(align=True)
        row.operator(DAFNET_OT_play_take.bl_idname, text="", icon="PAUSE" if plays else "PLAY", emboss=False).index = index
        row.prop(action, "name", text="", emboss=False)
        figures = row.row(align=True)
        figures.alignment = "RIGHT"
        figures.label(text=f"{action.dafnet.seed}")
        figures.label(text=f"{action.dafnet.sliding:.2f}")
        figures.label(text="–" if action.dafnet.collisions < 0 else f"{action.dafnet.collisions:.2f}")
        own = action.dafnet
        row.prop(own, "ghost", text="", icon="GHOST_ENABLED" if own.ghost else "GHOST_DISABLED", emboss=False)
        row.prop(own, "accepted", text="", icon="CHECKBOX_HLT" if own.accepted else "CHECKBOX_DEHLT", emboss=False)


class DAFNET_PT_takes(CharacterPanel, bpy.types.Panel):
    """Takes of the active character"""

    bl_label = "Takes"
    bl_idname = "DAFNET_PT_takes"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, the chosen take's figures, and what can be made of it."""
        layout = self.layout
        character: Any = character_of(context)
        own = character.dafnet
        if not len(own.takes):
            layout.label(text="Generate lists its takes here", icon="INFO")
            return
        head = layout.row()
        head.label(text="Name")
        right = head.row()
        right.alignment = "RIGHT"
        right.label(text="Seed, Sliding, Collisions")
        row = layout.row()
        row.template_list(DAFNET_UL_takes.bl_idname, "", own, "takes", own, "active_take", rows=4)
        column = row.column(align=True)
        column.operator(DAFNET_OT_play_take.bl_idname, text="", icon="TRIA_UP").step = "PREVIOUS"
        column.operator(DAFNET_OT_play_take.bl_idname, text="", icon="TRIA_DOWN").step = "NEXT"
        column.separator()
        column.operator(DAFNET_OT_reject_take.bl_idname, text="", icon="REMOVE")
        column.operator(DAFNET_OT_keep_accepted.bl_idname, text="", icon="CHECKMARK")

        take = active_take(character)
        if take is None:
            return
        figures = take.dafnet
        layout.label(text=f"Likelihood {figures.log_likelihood:.0f} nats a frame, temperature {figures.temperature:.2f}")
        table = layout.column(align=True)
        for name, before, after in (
            ("Sliding feet", figures.raw_sliding, figures.sliding), ("Collisions", figures.raw_collisions, figures.collisions),
            ("Miss, cm", 100 * figures.raw_miss, 100 * figures.miss), ("Jerk, m/s³", figures.raw_jerk, figures.jerk),
        ):
            if after >= 0:
                table.label(text=f"{name}: {before:.2f}, {after:.2f} cleaned")
        row = layout.row(align=True)
        row.operator(DAFNET_OT_generate.bl_idname, text="Vary the Legs", icon="MOD_DYNAMICPAINT").task = "LEGS"
        row.operator(DAFNET_OT_generate.bl_idname, text="From Here On", icon="FRAME_NEXT").task = "ONWARD"


class DAFNET_PT_clean_up(CharacterPanel, bpy.types.Panel):
    """What is done to the motion after the network"""

    bl_label = "Clean-Up"
    bl_idname = "DAFNET_PT_clean_up"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the strengths, and the way to try others on a take."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        own: Any = character_of(context)
        column = layout.column()
        for name in ("plant_feet", "rest_on_seats", "reach_targets", "clear_furniture", "smooth"):
            column.prop(own.dafnet, name, slider=True)
        layout.operator(DAFNET_OT_clean_again.bl_idname, icon="BRUSH_DATA")
