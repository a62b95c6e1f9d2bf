"""Live: the character follows while its root and targets are dragged."""

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import ClassVar

import bpy
import numpy as np
from bpy_extras import view3d_utils

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.live.keeping import keep_clips
from ..dafnet_addon.blender.live.listening import (
    LiveState,
    begin_live,
    end_live,
    keep_listening,
    live_session,
    live_state,
)
from ..dafnet_addon.blender.live.session import LiveSession, Over
from ..dafnet_addon.core.errors import DafnetError, InputError
from ..dafnet_addon.core.progress import run_to_end
from ..dafnet_addon.core.series import MODEL_FPS
from .base import DafnetOperator, may_be_led, reported

__all__ = ["DAFNET_OT_live", "DAFNET_OT_live_draw", "DAFNET_OT_live_record", "met_floor"]

_TOLD = 0.5
"""Seconds between two redraws of the sidebar, which tells how long a step takes."""
_LEVEL = 1e-3
"""How far a ray of length 1 has to fall to meet a floor at all."""


class DAFNET_OT_live(DafnetOperator, bpy.types.Operator):
    """Let the character follow while you drag its root and its targets; again, or Esc, puts
    everything back, but for what was recorded
    """

    bl_idname = "dafnet.live"
    bl_label = "Live"
    bl_options: ClassVar = {"UNDO"}

    _timer: bpy.types.Timer
    _session: LiveSession
    _state: LiveState
    _told: float
    _pressed: bool

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Live runs, or there is a character with a root, and no job."""
        return live_state() is not None or may_be_led(cls, context)

    def run(self, _context: bpy.types.Context) -> None:
        """Nothing can be dragged without a window."""
        raise InputError("Live needs a window, in which something can be dragged.")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Begin, or let the session that runs end."""
        if (state := live_state()) is not None:
            state.ending = True
            return {"CANCELLED"}
        with reported(self):
            with _waiting(context):
                self._session = LiveSession(context, character_of(context))
            self._state = begin_live(self._session)
            self._told, self._pressed = 0.0, False
            manager = context.window_manager
            self._timer = manager.event_timer_add(1.0 / MODEL_FPS, window=context.window)
            manager.modal_handler_add(self)
            _redraw(context, "UI")
            return {"RUNNING_MODAL"}
        return {"CANCELLED"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Step the network up to now; everything that the user does goes on as ever, but for Esc,
        undoing, and drawing a way.
        """
        if self._state.why is not None:
            return self._finish(context, self._state.why)
        undoes = event.type == "Z" and (event.ctrl or event.oskey)
        if self._state.ending or (event.value == "PRESS" and (event.type == "ESC" or undoes)):
            return self._finish(context)

        if event.type == "TIMER":
            failed = True
            try:
                self._tick(context)
                failed = False
            except (Over, DafnetError) as error:
                failed = False
                return self._finish(context, str(error))
            finally:
                if failed:
                    self.cancel(context)
        elif self._state.draws and self._drawn(context, event):
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends it, as it closes: everything is put back."""
        try:
            end_live()
        finally:
            self._stop_listening(context)

    def _tick(self, context: bpy.types.Context) -> None:
        keep_listening()
        now = perf_counter()
        if self._session.tick(context, now):
            _redraw(context, "WINDOW")
        if now - self._told > _TOLD:
            self._told = now
            _redraw(context, "UI")

    def _finish(self, context: bpy.types.Context, why: str | None = None) -> set[str]:
        """Put everything back, and keep what was recorded."""
        self.cancel(context)
        if why is not None:
            self.report({"WARNING"}, why)
        if self._state.gone:
            return {"CANCELLED"}  # undone, or another file: nothing may be added now

        with reported(self), _waiting(context):
            results = self._state.kept
            if results is None:
                results = run_to_end(keep_clips(self._session))
            for warning in dict.fromkeys(each for one in results for each in one.warnings):
                self.report({"WARNING"}, warning)
            if results:
                names = ", ".join(f"'{one.action.name}'" for one in results)
                self.report({"INFO"}, f"Recorded: {names}")
            elif why is None:
                self.report({"INFO"}, "Live ended; the character is as it was")
        return {"FINISHED"}

    def _stop_listening(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        if context.workspace:
            context.workspace.status_text_set(None)
        _redraw(context, "UI")
        _redraw(context, "WINDOW")

    # Drawing a way over the floor.

    def _drawn(self, context: bpy.types.Context, event: bpy.types.Event) -> bool:
        """Whether the event drew a way, in which case nobody else is told of it."""
        if event.type == "LEFTMOUSE" and event.value == "PRESS":
            place = _on_the_floor(context, event, self._session)
            if place is None:
                return False
            self._pressed = True
            self._session.way.clear()
            self._session.way.add(place)
            return True
        if not self._pressed:
            return False
        if event.type == "MOUSEMOVE":
            place = _on_the_floor(context, event, self._session)
            if place is not None:
                self._session.way.add(place)
            return True
        if event.type == "LEFTMOUSE":
            self._pressed = False
            return True
        return False


class DAFNET_OT_live_record(DafnetOperator, bpy.types.Operator):
    """Keep what is played from now on as a take; again to stop. Takes are made when Live ends"""

    bl_idname = "dafnet.live_record"
    bl_label = "Record"
    bl_options: ClassVar = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Live runs."""
        cls.poll_message_set("Start Live first")
        return live_session() is not None

    def run(self, _context: bpy.types.Context) -> None:
        """Begin to record, or stop."""
        session = live_session()
        if session is None:
            return
        if session.recording:
            session.stop_recording()
        else:
            session.record()


class DAFNET_OT_live_draw(DafnetOperator, bpy.types.Operator):
    """Draw a way on the floor with the left mouse button, which the root is led along; again to
    drag and select as ever
    """

    bl_idname = "dafnet.live_draw"
    bl_label = "Draw a Way"
    bl_options: ClassVar = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Live runs."""
        cls.poll_message_set("Start Live first")
        return live_session() is not None

    def run(self, _context: bpy.types.Context) -> None:
        """Let the mouse draw, or no longer."""
        if (state := live_state()) is not None:
            state.draws = not state.draws


@contextmanager
def _waiting(context: bpy.types.Context) -> Iterator[None]:
    """A block during which the mouse says that Blender works."""
    window = context.window
    if window:
        window.cursor_set("WAIT")
    try:
        yield
    finally:
        if window:
            window.cursor_set("DEFAULT")


def _on_the_floor(
    context: bpy.types.Context, event: bpy.types.Event, session: LiveSession
) -> np.ndarray | None:
    """The place (2,) on the root's floor under the mouse, metres; None where it is over something
    else than a 3D view.
    """
    for area in context.screen.areas:
        if area.type != "VIEW_3D":
            continue
        over = [r for r in area.regions if _is_over(r, event)]
        if len(over) != 1 or over[0].type != "WINDOW":
            continue
        region, view = over[0], over[0].data  # of a quad view, the one that it is
        at = (event.mouse_x - region.x, event.mouse_y - region.y)
        eye = np.array(view3d_utils.region_2d_to_origin_3d(region, view, at)) * session.unit
        ray = np.array(view3d_utils.region_2d_to_vector_3d(region, view, at))
        return met_floor(eye, ray, session.floor, in_perspective=view.is_perspective)
    return None


def met_floor(
    eye: np.ndarray, ray: np.ndarray, floor: float, *, in_perspective: bool
) -> np.ndarray | None:
    """Where the ``ray`` (3,) from an ``eye`` (3,) meets a floor of this height: (2,); None where it
    does not. Without perspective what is behind the eye counts as well: it has no place along its
    rays there.
    """
    if abs(ray[2]) < _LEVEL:
        return None
    down = (floor - eye[2]) / ray[2]
    return (eye + down * ray)[:2] if down > 0.0 or not in_perspective else None


def _is_over(region: bpy.types.Region, event: bpy.types.Event) -> bool:
    return (
        0 <= event.mouse_x - region.x < region.width
        and 0 <= event.mouse_y - region.y < region.height
        and region.width > 1
    )


def _redraw(context: bpy.types.Context, kind: str) -> None:
    """Have the 3D views' regions of a kind drawn again, in all windows."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == kind:
                        region.tag_redraw()
