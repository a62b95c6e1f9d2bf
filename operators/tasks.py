"""The list of a character's tasks, and what is planned of it."""

from collections.abc import Generator
from typing import Any

import bpy
from bpy.props import EnumProperty

from ..dafnet_addon.blender.character.armature import (
    character_of,
    metres_per_unit,
    selected_characters,
)
from ..dafnet_addon.blender.character.task_rows import TaskRow, add_row, tasks_of
from ..dafnet_addon.blender.directing.plan_keys import plan_edited
from ..dafnet_addon.blender.directing.tasks import Assignment, Directed, direct
from ..dafnet_addon.blender.overlay import display
from ..dafnet_addon.blender.overridable import rows_of_library
from ..dafnet_addon.core.errors import InputError
from .base import DafnetOperator, asked_to_replace, idle
from .long import LongOperator

__all__ = [
    "DAFNET_OT_add_task",
    "DAFNET_OT_move_task",
    "DAFNET_OT_plan_tasks",
    "DAFNET_OT_remove_task",
]


class _ListOperator(DafnetOperator):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A character is active."""
        return character_of(context) is not None


def _require_own(character: bpy.types.Object, index: int) -> None:
    """``InputError`` where a task is one of the library that the character is overridden from."""
    if index < rows_of_library(character, "tasks"):
        raise InputError(
            f"This task is of the library that '{character.name}' comes from, and may only be "
            "changed here; make the character local to remove or move it."
        )


class DAFNET_OT_add_task(_ListOperator, bpy.types.Operator):
    """Add a task after the chosen one"""

    bl_idname = "dafnet.add_task"
    bl_label = "Add Task"
    bl_options = {"REGISTER", "UNDO"}

    verb: EnumProperty(name="Verb", items=TaskRow.__annotations__["verb"].keywords["items"])

    def run(self, context: bpy.types.Context) -> None:
        """Add it."""
        add_row(character_of(context), self.verb)


class DAFNET_OT_remove_task(_ListOperator, bpy.types.Operator):
    """Remove the chosen task"""

    bl_idname = "dafnet.remove_task"
    bl_label = "Remove Task"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Remove it; the next one is chosen."""
        character: Any = character_of(context)
        own = character.dafnet
        _require_own(character, own.active_task)
        own.tasks.remove(own.active_task)
        own.active_task = max(0, min(own.active_task, len(own.tasks) - 1))


class DAFNET_OT_move_task(_ListOperator, bpy.types.Operator):
    """Let the chosen task be done earlier or later"""

    bl_idname = "dafnet.move_task"
    bl_label = "Move Task"
    bl_options = {"REGISTER", "UNDO"}

    direction: EnumProperty(
        name="Direction",
        items=[("UP", "Earlier", "Before the one above"), ("DOWN", "Later", "After the one below")],
    )

    def run(self, context: bpy.types.Context) -> None:
        """Move it by one."""
        character: Any = character_of(context)
        own = character.dafnet
        to = own.active_task + (-1 if self.direction == "UP" else 1)
        if 0 <= to < len(own.tasks):
            _require_own(character, min(to, own.active_task))
            own.tasks.move(own.active_task, to)
            own.active_task = to


class DAFNET_OT_plan_tasks(LongOperator, bpy.types.Operator):
    """Plan the tasks of the selected characters, round each other and all others, and key roots,
    targets, influences and modes. Keys that you have edited are kept in an action of their own
    """

    bl_idname = "dafnet.plan_tasks"
    bl_label = "Plan Tasks"
    bl_options = {"REGISTER", "UNDO"}
    seconds_before_modal = 0.1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A character has tasks, and no job is running."""
        if not idle(cls):
            return False
        cls.poll_message_set("Add tasks to the character's list, in object mode")
        return context.mode == "OBJECT" and any(
            len(o.dafnet.tasks) for o in selected_characters(context)
        )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask before edited keys are replaced."""
        for each in selected_characters(context):
            own = each.dafnet
            first = context.scene.frame_start if own.use_scene_range else own.frame_start
            if len(own.tasks) and plan_edited(each, first):
                return asked_to_replace(self, context, event)
        return super().invoke(context, event)

    def steps(self, context: bpy.types.Context) -> Generator[float, None, tuple[Directed, ...]]:
        """Plan and key them, in the order of their names."""
        unit = metres_per_unit(context.scene)
        chosen = [o for o in selected_characters(context) if len(o.dafnet.tasks)]
        people = [
            Assignment(o, tasks_of(o, unit), o.dafnet.already_there)
            for o in sorted(chosen, key=lambda o: o.name)
        ]
        return direct.steps(context, people)

    def report_result(self, result: tuple[Directed, ...]) -> None:
        """Draw the path, say what was keyed, and pass the warnings on."""
        display.suggest("path")
        for each in result:
            for warning in each.warnings:
                self.report({"WARNING"}, f"{each.name}: {warning}")
            if each.kept:
                kept = ", ".join(f"'{name}'" for name in each.kept)
                self.report({"WARNING"}, f"{each.name}: your keys are kept in {kept}")
        names = ", ".join(each.name for each in result)
        first, last = min(each.first for each in result), max(each.last for each in result)
        self.report({"INFO"}, f"Keyed {names} from frame {first} to {last}")
