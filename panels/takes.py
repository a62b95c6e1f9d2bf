"""The character's takes: which there are, how good they are, and what can be done with them."""

from typing import Any

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.settings import CLEAN_UP
from ..dafnet_addon.blender.character.takes import active_take
from ..operators.generate import DAFNET_OT_generate
from ..operators.takes import (
    DAFNET_OT_clean_again,
    DAFNET_OT_export_take,
    DAFNET_OT_keep_accepted,
    DAFNET_OT_mark_take,
    DAFNET_OT_play_take,
    DAFNET_OT_reject_take,
    DAFNET_OT_take_to_nla,
)
from .main import CharacterPanel
from .sentences import draw_sentence

__all__ = ["DAFNET_PT_clean_up", "DAFNET_PT_takes", "DAFNET_UL_takes"]


_NAME_WIDTH = 0.45
"""Share of a row that the name of a figure takes."""


_NONE = "\u2013"
"""What stands for a figure that there is none of."""
_FIGURES = {"slide_cm": "Feet slide, cm", "touching": "Touches, s", "miss_cm": "Misses, cm"}
"""What the table says of each figure."""


def _draw_names(layout: bpy.types.UILayout, name: str, *values: str) -> None:
    """Draw the head of the table."""
    split = layout.split(factor=_NAME_WIDTH, align=True)
    split.label(text=name)
    row = split.row(align=True)
    for value in values:
        row.label(text=value)


def _draw_figure(layout: bpy.types.UILayout, figures: Any, name: str, words: str) -> None:
    """Draw a row of the table, before and after the clean-up. The figures
    are properties, since these have tooltips.
    """
    split = layout.split(factor=_NAME_WIDTH, align=True)
    split.label(text=words)
    row = split.row(align=True)
    for each in (f"raw_{name}", name):
        if getattr(figures, each) < 0.0:
            row.label(text=_NONE, translate=False)
        else:
            row.prop(figures, each, text="", emboss=False)


class DAFNET_UL_takes(bpy.types.UIList):
    """Takes of a character"""

    bl_idname = "DAFNET_UL_takes"

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: Any,
        item: Any,
        _icon: int,
        _active: Any,
        _name: str,
        index: int = 0,
        _flag: int = 0,
    ) -> None:
        """A row: play, name, what is most to be said of it, ghost, accepted."""
        action = item.action
        if action is None:
            layout.label(text="Deleted", icon="ERROR")
            return

        animation = data.id_data.animation_data
        plays = animation is not None and animation.action == action
        row = layout.row(align=True)
        row.operator(
            DAFNET_OT_play_take.bl_idname, text="", icon="PAUSE" if plays else "PLAY", emboss=False
        ).index = index

        own = action.dafnet
        split = row.split(factor=0.42, align=True)
        name = action.name.removeprefix(data.id_data.name).strip() or action.name
        split.label(text=name, translate=False)
        said = split.row(align=True)
        if len(own.verdict):
            worst = own.verdict[0]
            said.alert = not worst.good
            said.label(text=worst.word, translate=False)

        ghost = "GHOST_ENABLED" if own.ghost else "GHOST_DISABLED"
        row.prop(own, "ghost", text="", icon=ghost, emboss=False)
        accepted = "CHECKBOX_HLT" if own.accepted else "CHECKBOX_DEHLT"
        row.prop(own, "accepted", text="", icon=accepted, emboss=False)


class DAFNET_PT_takes(CharacterPanel, bpy.types.Panel):
    """Takes of the active character"""

    bl_label = "Takes"
    bl_idname = "DAFNET_PT_takes"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, the chosen take's figures, and what can be done with it."""
        layout = self.layout
        character: Any = character_of(context)
        own = character.dafnet
        if not len(own.takes):
            layout.label(text="Generated takes are listed here", icon="INFO")
            return

        layout.template_list(
            DAFNET_UL_takes.bl_idname, "", own, "takes", own, "active_take", rows=4
        )

        row = layout.row(align=True)
        row.operator(DAFNET_OT_play_take.bl_idname, text="", icon="TRIA_UP").step = "PREVIOUS"
        row.operator(DAFNET_OT_play_take.bl_idname, text="", icon="TRIA_DOWN").step = "NEXT"
        row.operator(DAFNET_OT_reject_take.bl_idname, text="", icon="REMOVE")
        row.operator(DAFNET_OT_keep_accepted.bl_idname, text="", icon="CHECKMARK")
        take = active_take(character)
        if take is None:
            return

        layout.prop(take, "name", text="", icon="ACTION")
        figures = take.dafnet
        column = layout.column(align=True)
        for finding in figures.verdict:
            icon = "CHECKMARK" if finding.good else "ERROR"
            draw_sentence(column, context, finding.text, icon, alert=not finding.good)

        layout.label(
            text=(
                f"Seed {figures.seed}, legs {figures.lower_seed}, temperature "
                f"{figures.temperature:.2f}"
            )
        )
        table = layout.column(align=True)
        _draw_names(table, "", "Raw", "Cleaned")
        for name, words in _FIGURES.items():
            _draw_figure(table, figures, name, words)

        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator(
            DAFNET_OT_generate.bl_idname, text="Vary the Legs", icon="MOD_DYNAMICPAINT"
        ).task = "LEGS"
        row.operator(
            DAFNET_OT_generate.bl_idname, text="From Here On", icon="FRAME_NEXT"
        ).task = "ONWARD"
        row = column.row(align=True)
        scene = context.scene
        row.active = scene.use_preview_range
        row.operator(
            DAFNET_OT_generate.bl_idname,
            text=f"Frames {scene.frame_preview_start} to {scene.frame_preview_end} Anew"
            if scene.use_preview_range
            else "From Here to There",
            icon="PREVIEW_RANGE",
        ).task = "BETWEEN"

        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator(DAFNET_OT_take_to_nla.bl_idname, icon="NLA_PUSHDOWN")
        row.operator(DAFNET_OT_export_take.bl_idname, icon="EXPORT")
        column.operator(DAFNET_OT_mark_take.bl_idname, icon="ASSET_MANAGER")


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
        for name in CLEAN_UP:
            column.prop(own.dafnet, name, slider=True)
        layout.operator(DAFNET_OT_clean_again.bl_idname, icon="BRUSH_DATA")
