"""The way from an empty scene to something to generate: a path for the root, furniture, targets."""

from typing import Any

import bpy

from ..dafnet_addon.blender.character.armature import character_and_goal, character_of
from ..dafnet_addon.blender.character.walk_rows import MANNER, fields_of_walk, title_of_walk
from ..dafnet_addon.blender.directing.path_sources import (
    character_and_source,
    floor_points,
    is_curve,
    may_move,
)
from ..dafnet_addon.blender.showcase.examples import EXAMPLES
from ..operators.add_character import DAFNET_OT_add_character
from ..operators.add_example import DAFNET_OT_add_example
from ..operators.follow_path import (
    DAFNET_OT_root_from_object,
    DAFNET_OT_walk_along_curve,
    DAFNET_OT_walk_through_points,
)
from ..operators.lie_on import DAFNET_OT_lie_on
from ..operators.redo_walk import DAFNET_OT_redo_walk
from ..operators.walk_to import DAFNET_OT_walk_to
from .main import CharacterPanel
from .sitting import DAFNET_MT_sit

__all__ = [
    "DAFNET_MT_add",
    "DAFNET_MT_walk",
    "DAFNET_PT_setup",
    "DAFNET_PT_softness",
    "DAFNET_PT_walks",
    "DAFNET_UL_walks",
    "add_menu",
]


class DAFNET_PT_setup(CharacterPanel, bpy.types.Panel):
    """Send the character somewhere, and tell it what is there"""

    bl_label = "Set Up"
    bl_idname = "DAFNET_PT_setup"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the buttons, with the names of what they would take."""
        _, seat = character_and_goal(context)
        curve, source = (character_and_source(context, fits)[1] for fits in (is_curve, may_move))
        points = floor_points(context)

        column = self.layout.column(align=True)
        row = column.row(align=True)
        row.enabled = seat is not None
        text = f"Sit on {seat.name}" if seat else "Sit on Selected"
        row.operator(DAFNET_OT_walk_to.bl_idname, text=text, icon="TRACKING_FORWARDS").goal = "SEAT"
        row.menu(DAFNET_MT_sit.bl_idname, text="", icon="DOWNARROW_HLT")

        row = column.row(align=True)
        row.enabled = seat is not None
        text = f"Lie on {seat.name}" if seat else DAFNET_OT_lie_on.bl_label
        row.operator(DAFNET_OT_lie_on.bl_idname, text=text, icon="TRACKING_FORWARDS")

        row = column.row(align=True)
        row.operator(
            DAFNET_OT_walk_to.bl_idname, text="Walk to Cursor", icon="PIVOT_CURSOR"
        ).goal = "CURSOR"
        row.menu(DAFNET_MT_walk.bl_idname, text="", icon="DOWNARROW_HLT")

        # These need something that is selected, and are in the menu until it is.
        if curve:
            text = f"Walk along {curve.name}"
            column.operator(DAFNET_OT_walk_along_curve.bl_idname, text=text, icon="CURVE_DATA")
        if len(points) > 1:
            text = f"Walk through {len(points)} Points"
            column.operator(DAFNET_OT_walk_through_points.bl_idname, text=text, icon="EMPTY_AXIS")
        if source:
            text = f"Root from {source.name}"
            column.operator(DAFNET_OT_root_from_object.bl_idname, text=text, icon="CON_FOLLOWPATH")

        own: Any = character_of(context)
        column = self.layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        for name in MANNER:
            column.prop(own.dafnet, name)
        row = column.row()
        row.use_property_decorate = True
        row.prop(own.dafnet, "lean")
        if len(own.dafnet.walks):
            self.layout.operator(DAFNET_OT_redo_walk.bl_idname, icon="FILE_REFRESH")


class DAFNET_MT_walk(bpy.types.Menu):
    """Walk along a curve, through points, or as something else moves"""

    bl_idname = "DAFNET_MT_walk"
    bl_label = "Walk, and …"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw them."""
        layout = self.layout
        layout.operator(DAFNET_OT_walk_along_curve.bl_idname, icon="CURVE_DATA")
        layout.operator(DAFNET_OT_walk_through_points.bl_idname, icon="EMPTY_AXIS")
        layout.operator(DAFNET_OT_root_from_object.bl_idname, icon="CON_FOLLOWPATH")


class DAFNET_PT_softness(CharacterPanel, bpy.types.Panel):
    """How soft the selected piece of furniture is"""

    bl_label = "Softness"
    bl_idname = "DAFNET_PT_softness"
    bl_parent_id = "DAFNET_PT_setup"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A piece is selected."""
        return super().poll(context) and character_and_goal(context)[1] is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw whether it is guessed, and how soft it is."""
        _, seat = character_and_goal(context)
        assert seat is not None
        column = self.layout.column(align=True)
        column.prop(seat.dafnet, "guess_softness", text=f"Guess for {seat.name}")
        row = column.row(align=True)
        row.enabled = not seat.dafnet.guess_softness
        row.prop(seat.dafnet, "softness", text="Softness, cm")


class DAFNET_UL_walks(bpy.types.UIList):
    """Walks that a root was keyed for"""

    bl_idname = "DAFNET_UL_walks"

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: Any,
        item: Any,
        _icon: int,
        _active: Any,
        _name: str,
        _index: int = 0,
        _flag: int = 0,
    ) -> None:
        """A row: where to, and in which frames."""
        row = layout.split(factor=0.68)
        row.label(text=title_of_walk(item), translate=False)
        row.label(text=f"{item.first}\u2013{item.last}", translate=False)


class DAFNET_PT_walks(CharacterPanel, bpy.types.Panel):
    """What the root's keys were made for: choose the one that is made anew, and where to"""

    bl_label = "Walks"
    bl_idname = "DAFNET_PT_walks"
    bl_parent_id = "DAFNET_PT_setup"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """The character was sent somewhere."""
        own = character_of(context)
        return super().poll(context) and own is not None and len(own.dafnet.walks) > 0

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, and where the chosen walk leads."""
        layout = self.layout
        own = character_of(context).dafnet  # type: ignore[union-attr]
        if len(own.walks) > 1:
            layout.template_list(
                DAFNET_UL_walks.bl_idname, "", own, "walks", own, "active_walk", rows=2
            )
        if 0 <= own.active_walk < len(own.walks):
            walk = own.walks[own.active_walk]
            column = layout.column()
            column.use_property_split = True
            column.use_property_decorate = False
            for name in fields_of_walk(walk):
                column.prop(walk, name)


class DAFNET_MT_add(bpy.types.Menu):
    """Characters and example scenes"""

    bl_idname = "DAFNET_MT_add"
    bl_label = "DAFNet"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw what can be added."""
        layout = self.layout
        layout.operator_context = "INVOKE_REGION_WIN"
        layout.operator(DAFNET_OT_add_character.bl_idname, text="Character", icon="ARMATURE_DATA")
        layout.separator()
        for kind, example in EXAMPLES.items():
            layout.operator(DAFNET_OT_add_example.bl_idname, text=example.label).kind = kind


def add_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry in the 3D view's Add menu."""
    menu.layout.menu(DAFNET_MT_add.bl_idname, icon="ARMATURE_DATA")
