"""Overlays in the viewport and the timeline: their switches, and when Blender draws them.

All are off at first; the root's path is drawn once one was keyed (``suggest``). Blender is asked to
draw only while a switch is on or a job shows its live pose. The switches live here and not in the
file, so opening another file or undoing leaves them as they are. Nothing here holds on to objects
of the file: ``contents`` looks them up at each redraw.
"""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, PointerProperty

from ..character.takes import played_take
from . import contents
from .cache import cache
from .contents import CIRCLE, KINDS
from .drawing import Drawing
from .faults import Faults, fault_bars
from .painting import forget_batches, paint, paint_bars, paint_circle, paint_labels
from .watched import forget, watched_character

__all__ = [
    "Overlays",
    "hide_faults",
    "hide_live_pose",
    "hide_way",
    "register",
    "show_faults",
    "show_live_pose",
    "show_way",
    "shown_faults",
    "suggest",
    "switch",
    "switched_on",
    "unregister",
]

_on: set[str] = set()
_declined: set[str] = set()
"""What was on and was turned off."""
_live_pose: list[Callable[[], np.ndarray | None]] = []
_way: list[Callable[[], np.ndarray]] = []
_faults: dict[int, Faults] = {}
_drawers: dict[str, tuple[Any, Any]] = {}


class Overlays(bpy.types.PropertyGroup):
    """Switches of what is drawn over the view (``WindowManager.dafnet_overlays``); kept for the
    session, in no file.
    """

    spheres: BoolProperty(
        name="Sensor",
        options=set(),
        description=(
            "The spheres around the root that furniture occupies now: all that the network sees of "
            "it"
        ),
        get=lambda _self: "spheres" in _on,
        set=lambda _self, on: switch("spheres", on),
    )
    path: BoolProperty(
        name="Root Path",
        options=set(),
        description="The root's path on the floor and where it faces",
        get=lambda _self: "path" in _on,
        set=lambda _self, on: switch("path", on),
    )
    marks: BoolProperty(
        name="Contacts",
        options=set(),
        description=(
            "Planted feet (green), joints that touch furniture (orange) or are inside it (red)"
        ),
        get=lambda _self: "marks" in _on,
        set=lambda _self, on: switch("marks", on),
    )
    circle: BoolProperty(
        name="Action",
        options=set(),
        description="How likely each of the network's actions is, as the rays of a circle",
        get=lambda _self: CIRCLE in _on,
        set=lambda _self, on: switch(CIRCLE, on),
    )
    reach: BoolProperty(
        name="Head and Hands",
        options=set(),
        description="The paths of the head and hands, and their targets (red)",
        get=lambda _self: "reach" in _on,
        set=lambda _self, on: switch("reach", on),
    )
    ghosts: BoolProperty(
        name="Ghosts",
        options=set(),
        description="The takes whose ghost is ticked in the list, as stick figures",
        get=lambda _self: "ghosts" in _on,
        set=lambda _self, on: switch("ghosts", on),
    )


def switch(kind: str, on: bool) -> None:
    """Turn one of ``contents.KINDS`` on or off."""
    if on:
        _on.add(kind)
        _declined.discard(kind)
    elif kind in _on:
        _on.remove(kind)
        _declined.add(kind)
    _arrange()


def suggest(kind: str) -> None:
    """Turn a kind on, unless it was turned off since Blender was started."""
    if kind not in _declined and kind not in _on:
        switch(kind, True)


def switched_on() -> frozenset[str]:
    """The kinds that are on."""
    return frozenset(_on)


def show_live_pose(joints: Callable[[], np.ndarray | None]) -> None:
    """Draw the joints (22, 3), world metres, that the function gives at each redraw; None draws
    nothing.
    """
    _live_pose[:] = [joints]
    _arrange()


def hide_live_pose() -> None:
    """End ``show_live_pose``."""
    _live_pose.clear()
    _arrange()


def show_way(points: Callable[[], np.ndarray]) -> None:
    """Draw the way (N, 3), world metres, that the function gives at each redraw."""
    _way[:] = [points]
    _arrange()


def hide_way() -> None:
    """End ``show_way``."""
    _way.clear()
    _arrange()


def show_faults(faults: dict[int, Faults]) -> None:
    """Draw these faults (``faults.faults_of``) into the timeline while their takes play."""
    _faults.clear()
    _faults.update(faults)
    _arrange()


def hide_faults() -> None:
    """End ``show_faults``."""
    show_faults({})


def shown_faults(action: bpy.types.Action | None) -> Faults | None:
    """The faults of this action that the timeline shows while it plays."""
    return _faults.get(action.session_uid) if action else None


# Asking Blender to draw, and to report what changes.


def _arrange() -> None:
    """Register what draws and what listens, exactly while there is something to draw."""
    view = bool(_on or _live_pose or _way)
    wanted: dict[str, tuple[Any, Callable[[], None], str]] = {}
    if view:
        wanted |= {"scene": (bpy.types.SpaceView3D, _draw_scene, "POST_VIEW")}
        wanted |= {"corner": (bpy.types.SpaceView3D, _draw_flat, "POST_PIXEL")}
    if _faults:
        wanted |= {"timeline": (bpy.types.SpaceDopeSheetEditor, _draw_timeline, "POST_PIXEL")}

    for name in set(_drawers) - set(wanted):
        space, handle = _drawers.pop(name)
        space.draw_handler_remove(handle, "WINDOW")
    for name in set(wanted) - set(_drawers):
        space, function, moment = wanted[name]
        _drawers[name] = space, space.draw_handler_add(function, (), "WINDOW", moment)

    listening = bool(_on or _faults)
    for event, function in _LISTENERS.items():
        handlers = getattr(bpy.app.handlers, event)
        if listening and function not in handlers:
            handlers.append(function)
        elif not listening and function in handlers:
            handlers.remove(function)

    if not view:
        forget_batches()
    if not listening:
        forget()

    _redraw()


def _redraw() -> None:
    manager = getattr(bpy.context, "window_manager", None)  # none while Blender starts and ends
    for window in manager.windows if manager else ():
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "DOPESHEET_EDITOR"}:
                area.tag_redraw()


@persistent
def _edited(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    cache.note_edit(depsgraph)


@persistent
def _other_frame(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None) -> None:
    cache.note_frame(depsgraph)


@persistent
def _undone(*_: object) -> None:
    forget()
    forget_batches()


@persistent
def _opened(*_: object) -> None:
    _undone()
    _faults.clear()
    _arrange()


_LISTENERS: dict[str, Callable[..., None]] = {
    "depsgraph_update_post": _edited,
    "frame_change_post": _other_frame,
    "undo_post": _undone,
    "redo_post": _undone,
    "load_post": _opened,
}


# Drawing.


def _wanted(context: bpy.types.Context) -> dict[str, tuple[Drawing, ...]]:
    """What there is to draw in the context's view: nothing where its overlays are off."""
    if context.space_data is None or not context.space_data.overlay.show_overlays:
        return {}
    wanted = contents.drawings(context, [kind for kind in KINDS if kind in _on])
    if _live_pose and (joints := _live_pose[0]()) is not None:
        wanted["live pose"] = contents.live_pose(context, joints)
    if _way and len(points := _way[0]()) > 1:
        wanted["way"] = contents.drawn_way(context, points)
    return wanted


def _draw_scene() -> None:
    """Draw what lies in the scene."""
    for kind, drawn in _wanted(bpy.context).items():
        if kind != CIRCLE:
            paint(kind, drawn)


def _draw_flat() -> None:
    """Draw the labels over the scene, and the circle in its corner."""
    context = bpy.context
    wanted = _wanted(context)
    for kind, drawn in wanted.items():
        if kind != CIRCLE:
            paint_labels(context, drawn)

    if wanted.get(CIRCLE):
        paint_circle(context, CIRCLE, wanted[CIRCLE])


def _draw_timeline() -> None:
    """Draw bars at the frames of the playing take in which feet slide (upper row) and joints touch
    furniture.
    """
    context = bpy.context
    armature = watched_character(context) if context.scene else None
    action = played_take(armature) if armature else None
    faults = shown_faults(action)
    if action is None or faults is None:
        return

    bars = fault_bars(faults, action.dafnet.frame_start)
    if len(bars.row):
        paint_bars(context, bars)


def register() -> None:
    """Add the switches, all off."""
    bpy.utils.register_class(Overlays)
    bpy.types.WindowManager.dafnet_overlays = PointerProperty(type=Overlays)


def unregister() -> None:
    """Turn everything off and take the switches away."""
    _on.clear()
    _declined.clear()
    _live_pose.clear()
    _way.clear()
    _faults.clear()
    _arrange()
    del bpy.types.WindowManager.dafnet_overlays
    bpy.utils.unregister_class(Overlays)
