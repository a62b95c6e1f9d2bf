"""The session that is running, at most one, and what ends it from outside.

Undoing, opening or saving a file would keep, or lose, what is only shown for the time being: before
any of them the session puts everything back. What was recorded is saved as takes: nothing comes
after a file that is saved as Blender quits. While it runs, Blender's own undo takes no steps, so
that all of it is one.
"""

from collections.abc import Callable
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ...core.errors import DafnetError
from ...core.progress import run_to_end
from ..overlay import display
from ..pipeline.job import Result
from ..pipeline.lent_preference import LentPreference
from .keeping import keep_clips
from .session import LiveSession

__all__ = [
    "LiveState",
    "begin_live",
    "end_live",
    "keep_listening",
    "live_session",
    "live_state",
]


class LiveState:
    """The running ``session``; ``why`` it ended by itself, and whether its objects are ``gone``
    with that; whether it was asked to end (``ending``); ``draws``: whether the mouse draws a way;
    ``kept``: the takes of what was recorded, where they are made already.
    """

    def __init__(self, session: LiveSession) -> None:
        self.session = session
        self.why: str | None = None
        self.gone = False
        self.ending = False
        self.draws = False
        self.kept: tuple[Result, ...] | None = None


_running: list[LiveState] = []  # at most one
_undoes: list[LentPreference] = []  # at most one: whether Blender takes steps of undo


def live_state() -> LiveState | None:
    """The state of the session that is running; None where none is."""
    return _running[0] if _running else None


def live_session() -> LiveSession | None:
    """The session that is running; None where none is."""
    return _running[0].session if _running else None


def begin_live(session: LiveSession) -> LiveState:
    """Let a session run."""
    _running[:] = [LiveState(session)]
    _undoes[:] = [LentPreference("edit", "use_global_undo", False)]
    try:
        session.begin()
        display.show_way(session.way_left)
        for event, function in _LISTENERS.items():
            getattr(bpy.app.handlers, event).append(function)
    except BaseException:
        end_live()
        raise
    return _running[0]


def keep_listening() -> None:
    """Called now and then while a session runs: preferences that are shown have the user's
    values.
    """
    for each in _undoes:
        each.keep()


def end_live() -> None:
    """End the session that runs, if one does: everything is as it was."""
    if not _running:
        return
    session = _running.pop().session
    display.hide_way()
    for event, function in _LISTENERS.items():
        handlers = getattr(bpy.app.handlers, event)
        if function in handlers:
            handlers.remove(function)
    if session.recording:
        session.stop_recording()
    try:
        session.restore()
    finally:
        _undoes.pop().back()


def _ended(why: str, gone: bool) -> None:
    if (state := live_state()) is not None:
        state.why, state.gone = why, gone
        end_live()


@persistent
def _before_loading(*_: Any) -> None:
    _ended("Live ended, since another file is opened.", gone=True)


@persistent
def _before_undoing(*_: Any) -> None:
    _ended("Live ended, since something was undone.", gone=True)


@persistent
def _before_saving(*_: Any) -> None:
    state = live_state()
    if state is None:
        return
    _ended("Live ended, so that the file is saved as it was.", gone=False)
    state.kept = ()  # tried once, whatever comes of it
    try:
        state.kept = run_to_end(keep_clips(state.session))
    except DafnetError as error:
        state.why = f"{state.why} {error}"


@persistent
def _evaluated(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    if depsgraph is not None and (session := live_session()) is not None:
        session.furniture.note(depsgraph)


_LISTENERS: dict[str, Callable[..., None]] = {
    "load_pre": _before_loading,
    "undo_pre": _before_undoing,
    "redo_pre": _before_undoing,
    "save_pre": _before_saving,
    "depsgraph_update_post": _evaluated,
    "frame_change_post": _evaluated,
}
