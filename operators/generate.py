"""Generate a take and bake it onto the character."""

from collections.abc import Generator
from time import perf_counter
from typing import ClassVar

import bpy

from ..dafnet_addon.blender import job
from ..dafnet_addon.blender.armature import character_of
from .reporting import reported

__all__ = ["DAFNET_OT_generate"]

_TICK = 0.04
"""Seconds of work between two looks at the user's input."""
_LOOKING = {
    "MOUSEMOVE", "INBETWEEN_MOUSEMOVE", "MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "NDOF_MOTION",
    "TRACKPADPAN", "TRACKPADZOOM",
}
"""Events that cannot change the scene."""


class DAFNET_OT_generate(bpy.types.Operator):
    """Generate the character's motion from its root, targets and furniture, and bake it into a new action"""

    bl_idname = "dafnet.generate"
    bl_label = "Generate"
    bl_options = {"UNDO"}

    progress: ClassVar[float | None] = None
    """How far the running job is, None where none runs; for the panel."""

    _steps: Generator[float, None, job.Result]
    _timer: bpy.types.Timer

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A character with a root, and no other job."""
        character = character_of(context)
        if cls.progress is not None:
            cls.poll_message_set("A take is being generated already")
        elif character is None:
            cls.poll_message_set("Select a character, or add one")
        elif character.dafnet.root is None:
            cls.poll_message_set("Choose the character's root")
        elif context.mode not in {"OBJECT", "POSE"}:
            cls.poll_message_set("Leave the current mode for object or pose mode first")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Generate without showing progress."""
        with reported(self):
            self._tell(job.run(context, job.settings_of(character_of(context), context.scene)))
            return {"FINISHED"}
        return {"CANCELLED"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the job; ``modal`` goes on with it."""
        with reported(self):
            self._steps = job.steps(context, job.settings_of(character_of(context), context.scene))
            manager = context.window_manager
            self._timer = manager.event_timer_add(0.01, window=context.window)
            manager.progress_begin(0, 100)
            manager.modal_handler_add(self)
            type(self).progress = 0.0
            return {"RUNNING_MODAL"}
        return {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Do a tick's work; Esc cancels.

        Until the end only looking around is let through, so the scene stays as it was read.
        """
        if event.type == "ESC":
            self.cancel(context)
            self.report({"INFO"}, "Cancelled; the scene is as it was")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in _LOOKING else {"RUNNING_MODAL"}
        result = None
        running = False
        try:
            with reported(self):
                result = self._pump(context)
                running = result is None
        finally:
            if not running:
                self.cancel(context)
        if running:
            return {"RUNNING_MODAL"}
        if result is None:
            return {"CANCELLED"}
        self._tell(result)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """End the job, which leaves the scene untouched unless it has finished."""
        self._steps.close()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        type(self).progress = None
        _redraw(context)

    def _pump(self, context: bpy.types.Context) -> job.Result | None:
        """Work for a tick; the result once it is there."""
        until = perf_counter() + _TICK
        while perf_counter() < until:
            try:
                type(self).progress = next(self._steps)
            except StopIteration as done:
                return done.value
        context.window_manager.progress_update(100 * (self.progress or 0.0))
        _redraw(context)
        return None

    def _tell(self, result: job.Result) -> None:
        for warning in result.warnings:
            self.report({"WARNING"}, warning)
        seconds = sum(result.seconds.values())
        self.report({"INFO"}, f"{len(result.take)} frames in {seconds:.1f} s: '{result.action.name}'")


def _redraw(context: bpy.types.Context) -> None:
    for area in context.screen.areas:
        if area.type == "VIEW_3D":
            area.tag_redraw()
