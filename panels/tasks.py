"""What a character is to do: a list of tasks, and the plan made of it."""

from typing import Any

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.task_rows import fields_of, title_of
from ..operators.tasks import (
    DAFNET_OT_add_task,
    DAFNET_OT_move_task,
    DAFNET_OT_plan_tasks,
    DAFNET_OT_remove_task,
)
from .main import CharacterPanel

__all__ = ["DAFNET_PT_tasks", "DAFNET_UL_tasks"]


class DAFNET_UL_tasks(bpy.types.UIList):
    """Tasks of a character"""

    bl_idname = "DAFNET_UL_tasks"

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
        """A row: what is done, and for how long."""
        row = layout.split(factor=0.75)
        row.label(text=title_of(item))
        if "seconds" in fields_of(item):
            row.prop(item, "seconds", text="", emboss=False)


class DAFNET_PT_tasks(CharacterPanel, bpy.types.Panel):
    """Say what the character is to do, and let its path and targets be planned"""

    bl_label = "Tasks"
    bl_idname = "DAFNET_PT_tasks"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, the chosen task's fields and the button."""
        layout = self.layout
        character: Any = character_of(context)
        own = character.dafnet
        row = layout.row()
        row.template_list(DAFNET_UL_tasks.bl_idname, "", own, "tasks", own, "active_task", rows=4)

        column = row.column(align=True)
        column.operator_menu_enum(DAFNET_OT_add_task.bl_idname, "verb", text="", icon="ADD")
        column.operator(DAFNET_OT_remove_task.bl_idname, text="", icon="REMOVE")
        column.separator()
        column.operator(DAFNET_OT_move_task.bl_idname, text="", icon="TRIA_UP").direction = "UP"
        column.operator(DAFNET_OT_move_task.bl_idname, text="", icon="TRIA_DOWN").direction = "DOWN"

        if 0 <= own.active_task < len(own.tasks):
            task = own.tasks[own.active_task]
            column = layout.column()
            column.use_property_split = True
            column.use_property_decorate = False
            column.prop(task, "verb")
            for name in fields_of(task):
                column.prop(task, name)

        layout.prop(own, "already_there")
        row = layout.row()
        row.scale_y = 1.5
        row.operator(DAFNET_OT_plan_tasks.bl_idname, icon="TRACKING_FORWARDS")
