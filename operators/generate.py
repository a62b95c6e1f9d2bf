"""Generate takes and bake them onto the character."""

from collections.abc import Generator
from time import perf_counter
from typing import Any

import bpy
import numpy as np
from bpy.props import EnumProperty

from ..dafnet_addon.blender import job, overlays
from ..dafnet_addon.blender.armature import character_of
from ..dafnet_addon.blender.running import RunningJob, begin_job, end_job, running_job
from ..dafnet_addon.blender.takes import active_take, draw_of, frames_of
from ..dafnet_addon.core.errors import InputError
from .base import DafnetOperator, reported

__all__ = ["DAFNET_OT_cancel", "DAFNET_OT_generate"]

_TICK = 0.02
"""Seconds of work between two looks at the user's input."""
_CALM_LEGS = 1.0
"""Temperature of the legs of a take whose legs are varied though it is calm."""
_LOOKING = {
    "MOUSEMOVE",
    "INBETWEEN_MOUSEMOVE",
    "MIDDLEMOUSE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "NDOF_MOTION",
    "TRACKPADPAN",
    "TRACKPADZOOM",
}
"""Events that cannot change the scene."""


class DAFNET_OT_generate(DafnetOperator, bpy.types.Operator):
    """Generate the character's motion from its root, targets and furniture, and bake it into new
    actions
    """

    bl_idname = "dafnet.generate"
    bl_label = "Generate"
    bl_options = {"UNDO"}

    task: EnumProperty(
        name="Task",
        default="NEW",
        options={"SKIP_SAVE"},
        items=[
            ("NEW", "Generate", "Generate new takes"),
            (
                "LEGS",
                "Vary the Legs",
                "Generate another lower body under the upper body of the chosen take",
            ),
            (
                "ONWARD",
                "From Here On",
                "Keep the chosen take up to the current frame, and generate what follows anew",
            ),
        ],
    )

    _running: RunningJob
    _started: float
    _steps: Generator[float, None, job.Result]
    _timer: bpy.types.Timer

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A character with a root, and no other job."""
        character = character_of(context)
        if running_job() is not None:
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

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: Any) -> str:
        """The task's own tooltip."""
        return (
            ""
            if properties.task == "NEW"
            else cls.bl_rna.properties["task"].enum_items[properties.task].description
        )

    def _settings(self, context: bpy.types.Context) -> job.Settings:
        """The character's settings, and what the task changes in them."""
        character = character_of(context)
        if self.task == "NEW":
            return job.settings_of(character, context.scene)
        take = active_take(character)
        if take is None:
            raise InputError("Choose a take in the list of takes first.")
        first, last = frames_of(take)
        if self.task == "ONWARD":
            return job.settings_of(
                character,
                context.scene,
                kept=take.name_full,
                kept_until=context.scene.frame_current,
                frame_start=first,
            )
        draw = draw_of(take)
        return job.settings_of(
            character,
            context.scene,
            take_count=1,
            seed=draw.seed,
            temperature=draw.temperature,
            frame_start=first,
            frame_end=last,
            lower_seed=(draw.lower_seed or 0) + 1,
            lower_temperature=draw.lower_temperature or _CALM_LEGS,
        )

    def run(self, context: bpy.types.Context) -> None:
        """Generate without showing progress."""
        self._tell(job.run(context, self._settings(context)))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the job; ``modal`` goes on with it."""
        with reported(self):
            self._steps = job.steps(context, self._settings(context), watch=self._watch)
            self._started = perf_counter()
            manager = context.window_manager
            self._timer = manager.event_timer_add(0.01, window=context.window)
            manager.progress_begin(0, 100)
            manager.modal_handler_add(self)
            running = self._running = begin_job()
            overlays.show_live_pose(lambda: running.joints)
            return {"RUNNING_MODAL"}
        return {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Do a tick's work; Esc cancels.

        Until the end only looking around is let through, so the scene stays as it was read.
        """
        if event.type == "ESC" or self._running.cancel_requested:
            self.cancel(context)
            self.report({"INFO"}, "Cancelled; the scene is as it was")
            return {"CANCELLED"}
        if event.type != "TIMER":
            allowed = event.type in _LOOKING or (
                event.type == "LEFTMOUSE" and _over_sidebar(context, event)
            )
            return {"PASS_THROUGH"} if allowed else {"RUNNING_MODAL"}
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
        end_job()
        overlays.hide_live_pose()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace:
            context.workspace.status_text_set(None)
        _redraw(context)

    def _watch(self, _frame: int, joints: np.ndarray) -> None:
        self._running.joints = joints

    def _pump(self, context: bpy.types.Context) -> job.Result | None:
        """Work for a tick; the result once it is there."""
        now = perf_counter()
        until, step = now + _TICK, 0.0
        # after a long step another one is likely, which had better have its own tick
        while now < until and step < _TICK / 2:
            try:
                self._running.progress = next(self._steps)
            except StopIteration as done:
                return done.value
            step, now = perf_counter() - now, perf_counter()
        share, spent = self._running.progress, perf_counter() - self._started
        self._running.seconds_left = spent * (1.0 - share) / max(share, 0.01)
        context.window_manager.progress_update(100 * share)
        context.workspace.status_text_set(
            f"DAFNet: {100 * share:.0f} %, {self._running.seconds_left:.0f} s left. Esc cancels"
        )
        _redraw(context)
        return None

    def _tell(self, result: job.Result) -> None:
        for warning in result.warnings:
            self.report({"WARNING"}, warning)
        seconds = sum(result.seconds.values())
        takes = (
            f"'{result.action.name}'" if len(result.takes) == 1 else f"{len(result.takes)} takes"
        )
        self.report({"INFO"}, f"{len(result.take)} frames in {seconds:.1f} s: {takes}")


class DAFNET_OT_cancel(DafnetOperator, bpy.types.Operator):
    """Stop generating; the scene stays as it was"""

    bl_idname = "dafnet.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Something is being generated."""
        cls.poll_message_set("Nothing is being generated")
        return running_job() is not None

    def run(self, _context: bpy.types.Context) -> None:
        """Let the running job end itself at its next tick."""
        if (running := running_job()) is not None:
            running.cancel_requested = True


def _over_sidebar(context: bpy.types.Context, event: bpy.types.Event) -> bool:
    """Whether the mouse is over a 3D view's sidebar, where Cancel is."""
    return any(
        region.type == "UI"
        and 0 <= event.mouse_x - region.x < region.width
        and 0 <= event.mouse_y - region.y < region.height
        for area in context.screen.areas
        if area.type == "VIEW_3D"
        for region in area.regions
    )


def _redraw(context: bpy.types.Context) -> None:
    for area in context.screen.areas:
        if area.type == "VIEW_3D":
            area.tag_redraw()
