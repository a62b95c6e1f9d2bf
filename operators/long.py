"""Operators whose work takes long: it is done between the user's events, and Esc cancels it."""

from collections.abc import Callable, Generator
from time import perf_counter
from typing import Any, ClassVar

import bpy

from ..dafnet_addon.blender.pipeline.pace import Pace
from ..dafnet_addon.blender.pipeline.running import RunningJob, begin_job, end_job, running_job
from ..dafnet_addon.blender.pipeline.view import DrawnOnce
from ..dafnet_addon.core.progress import run_to_end
from .base import DafnetOperator, remember_character, reported

__all__ = ["LongOperator"]

_FIRST_WORK = 0.05
_FIRST_READING = 0.6
"""Seconds of work before the window is drawn for the first time, and where that reads the scene,
since Blender draws it for each of its frames that is set.
"""
_SOON = 0.001
"""Seconds from one tick to the next where nothing happens in between."""
_VIEW_EVENTS = {
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


class LongOperator(DafnetOperator):
    """An operator that runs a job step by step (``core.progress``) and reports its result.

    Mixed into ``bpy.types.Operator``, before it.
    """

    seconds_before_modal: ClassVar[float] = 0.0
    """Seconds of work before the operator becomes modal: what takes no longer is done as by any
    other operator, without a flicker.
    """

    report: Callable[[set[str], str], None]

    _pace: Pace
    _running: RunningJob
    _share: float
    _started: float
    _steps: Generator[float, None, Any]
    _timer: bpy.types.Timer
    _view: DrawnOnce

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Any]:
        """The job, which leaves the scene as it was if it is closed. Its result is never None."""
        raise NotImplementedError

    def report_result(self, result: Any) -> None:
        """Tell the user what was done."""
        raise NotImplementedError

    def run(self, context: bpy.types.Context) -> None:
        """Do the whole job without showing progress."""
        self.report_result(run_to_end(self.steps(context)))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the job; ``modal`` continues it."""
        remember_character(context)
        with reported(self):
            self._steps, self._started, self._share = self.steps(context), perf_counter(), 0.0
            self._running, listens = begin_job(), False
            try:
                seconds = max(self.seconds_before_modal, _FIRST_WORK)
                result = self._advance(seconds, max(seconds, _FIRST_READING))
                if result is None:
                    self._listen(context)
                    self._running.stop = lambda: self.cancel(bpy.context)
                    listens = True
            finally:
                if not listens:
                    end_job()
            if result is not None:
                self.report_result(result)
                return {"FINISHED"}

            self._pace = Pace()
            return {"RUNNING_MODAL"}
        return {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Work for one tick; Esc cancels.

        Until the end only moving the view is let through, so that the scene stays as it was read.
        """
        if running_job() is not self._running:  # ended from outside
            return {"CANCELLED"}
        if event.type == "ESC" or self._running.cancel_requested:
            self.cancel(context)
            self.report({"INFO"}, "Cancelled; the scene is as it was")
            return {"CANCELLED"}

        if event.type != "TIMER":
            allowed = event.type in _VIEW_EVENTS or (
                event.type == "LEFTMOUSE" and _over_sidebar(context, event)
            )
            return {"PASS_THROUGH"} if allowed else {"RUNNING_MODAL"}

        self._view.keep()
        result = None
        running = False
        try:
            with reported(self):
                result = self._advance(self._pace.resume(), self._pace.longest)
                running = result is None
        finally:
            if not running:
                self.cancel(context)

        if running:
            self._note_progress()
            if self._pace.pause():
                self._show(context)
            return {"RUNNING_MODAL"}
        if result is None:
            return {"CANCELLED"}

        self.report_result(result)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """End the job, which leaves the scene untouched unless it has finished.

        Whatever goes wrong with that, no job is running afterwards.
        """
        try:
            self._steps.close()
        finally:
            end_job()
            self._view.end()
            context.window_manager.event_timer_remove(self._timer)
            context.window_manager.progress_end()
            if context.workspace:
                context.workspace.status_text_set(None)
            _redraw(context)

    def _listen(self, context: bpy.types.Context) -> None:
        """Let ``modal`` have the user's events from now on, and a tick whenever there are none."""
        manager = context.window_manager
        self._timer = manager.event_timer_add(_SOON, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self._view = DrawnOnce()

    def _advance(self, seconds: float, longest: float) -> Any:
        """Work for some ``seconds``, and up to ``longest`` while the scene is changed by it; the
        result once it is there, else None.
        """
        started = now = perf_counter()
        while True:
            try:
                self._share = next(self._steps)
            except StopIteration as done:
                return done.value
            step, now = perf_counter() - now, perf_counter()

            changed, job = False, running_job()
            if job is not None:
                changed, job.changed = job.changed, False
            # After a long step another one is likely, which had better have a tick of its own.
            over = now - started >= (longest if changed else seconds)
            if over or (step >= seconds / 2 and not changed):
                return None

    def _note_progress(self) -> None:
        share, spent = self._share, perf_counter() - self._started
        self._running.progress = share
        self._running.seconds_left = spent * (1.0 - share) / max(share, 0.01)

    def _show(self, context: bpy.types.Context) -> None:
        """Say how far the job is, which has Blender draw the window."""
        share, left = self._running.progress, self._running.seconds_left
        context.window_manager.progress_update(100 * share)
        context.workspace.status_text_set(
            f"DAFNet: {100 * share:.0f} %, {left:.0f} s left. Esc cancels"
        )
        _redraw(context)


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
    """Have the 3D views drawn again, in all windows: the context's may be the preferences'."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
