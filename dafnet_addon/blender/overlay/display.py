"""Overlays in the viewport and the timeline: switches, what draws them, and when.

All are off at first. Blender is asked to draw only while a switch is on or a job shows its live
pose, and ``gpu`` is imported only when something is drawn. The switches live here and not in the
file, so opening another file or undoing leaves them as they are. Nothing here holds on to objects
of the file: ``contents`` looks them up at each redraw.
"""

from collections.abc import Callable, Iterable
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
from .watched import forget, watched_character

__all__ = [
    "Overlays",
    "beads_of",
    "corner_of",
    "hide_faults",
    "hide_live_pose",
    "register",
    "show_faults",
    "show_live_pose",
    "shown_faults",
    "switch",
    "switched_on",
    "unregister",
]

_CIRCLE_RADIUS = 52.0
"""Pixels."""
_CIRCLE_MARGIN = 26.0
"""Pixels from the circle's labels to the view's edges."""
_DISC = (0.10, 0.11, 0.12, 0.72)
"""Colour behind the circle, red, green, blue and opacity."""
_BAR_HEIGHT = 4.5
"""Pixels; of a bar in the timeline."""
_BAR_MARGIN = 7.0
"""Pixels from the timeline's lower edge to the first bar."""
_FONT_SIZE = 12.0
"""Points."""
_LIGHT = np.array((0.3, -0.45, 0.84))
"""The direction from which beads look lit."""

_on: set[str] = set()
_live_pose: list[Callable[[], np.ndarray | None]] = []
_faults: dict[int, Faults] = {}
_drawers: dict[str, tuple[Any, Any]] = {}
_batches: dict[tuple[str, int], tuple[Drawing, list[tuple[str, Any]]]] = {}


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
    else:
        _on.discard(kind)
    _arrange()


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
    view = bool(_on or _live_pose)
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
        _batches.clear()
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
    _batches.clear()


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


def beads_of(drawing: Drawing) -> tuple[np.ndarray, np.ndarray]:
    """The beads as octahedra: corners of their triangles (24 B, 3), and their colours (24 B, 4),
    lighter on the lit side.
    """
    axes = np.eye(3)
    corners = np.array(
        [
            (x * axes[0], y * axes[1], z * axes[2])
            if x * y * z > 0
            else (y * axes[1], x * axes[0], z * axes[2])
            for x in (-1, 1)
            for y in (-1, 1)
            for z in (-1, 1)
        ]
    )

    lit = 0.68 + 0.32 * np.clip(corners.sum(axis=1) @ _LIGHT / np.sqrt(3.0), -1.0, 1.0)
    places = drawing.beads[:, None, None] + drawing.radii[:, None, None, None] * corners
    colours = np.repeat(drawing.bead_colours[:, None], 8, axis=1)
    colours[..., :3] *= lit[:, None]
    return places.reshape(-1, 3), np.repeat(colours[:, :, None], 3, axis=2).reshape(-1, 4)


def _batches_of(kind: str, number: int, drawing: Drawing) -> list[tuple[str, Any]]:
    """Shader and batch of the drawing's beads and lines, made once for each drawing."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    known = _batches.get((kind, number))
    if known is not None and known[0] is drawing:
        return known[1]

    batches = []

    def add(shader: str, primitive: str, places: np.ndarray, colours: np.ndarray) -> None:
        content = {"pos": places.astype(np.float32), "color": colours.astype(np.float32)}
        builtin = gpu.shader.from_builtin(shader)
        batches.append((shader, batch_for_shader(builtin, primitive, content)))

    if len(drawing.beads):
        add("SMOOTH_COLOR", "TRIS", *beads_of(drawing))
    if len(drawing.lines):
        ends = drawing.lines.reshape(-1, 3)
        add("POLYLINE_SMOOTH_COLOR", "LINES", ends, np.repeat(drawing.line_colours, 2, axis=0))

    _batches[kind, number] = drawing, batches
    return batches


def _draw(kind: str, drawn: Iterable[Drawing]) -> None:
    """Draw beads and lines with the matrices as they are, in front of everything."""
    import gpu

    depth = gpu.state.depth_test_get()
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE")

    scale = bpy.context.preferences.system.ui_scale
    for number, drawing in enumerate(drawn):
        for name, batch in _batches_of(kind, number, drawing):
            shader = gpu.shader.from_builtin(name)
            shader.bind()
            if name.startswith("POLYLINE"):
                shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
                shader.uniform_float("lineWidth", drawing.width * scale)
            batch.draw(shader)

    gpu.state.blend_set("NONE")
    gpu.state.depth_test_set(depth)


def _wanted(context: bpy.types.Context) -> dict[str, tuple[Drawing, ...]]:
    """What there is to draw in the context's view: nothing where its overlays are off."""
    if context.space_data is None or not context.space_data.overlay.show_overlays:
        return {}
    wanted = contents.drawings(context, [kind for kind in KINDS if kind in _on])
    if _live_pose and (joints := _live_pose[0]()) is not None:
        wanted["live pose"] = contents.live_pose(context, joints)
    return wanted


def _draw_scene() -> None:
    """Draw what lies in the scene."""
    for kind, drawn in _wanted(bpy.context).items():
        if kind != CIRCLE:
            _draw(kind, drawn)


def _draw_flat() -> None:
    """Draw the labels over the scene, and the circle in its corner."""
    import gpu
    from bpy_extras.view3d_utils import location_3d_to_region_2d

    context = bpy.context
    wanted = _wanted(context)
    for kind, drawn in wanted.items():
        if kind == CIRCLE:
            continue
        for drawing in drawn:
            for place, text, colour in drawing.labels:
                at = location_3d_to_region_2d(context.region, context.region_data, place)
                if at is not None:
                    _write(text, at[0], at[1] + 10.0, colour)

    if not wanted.get(CIRCLE):
        return

    scale = context.preferences.system.ui_scale
    inset = (1.4 * _CIRCLE_RADIUS + _CIRCLE_MARGIN) * scale
    middle = corner_of(context.area, context.region, inset)
    radius = _CIRCLE_RADIUS * scale
    with gpu.matrix.push_pop():
        gpu.matrix.translate((*middle, 0.0))
        gpu.matrix.scale((radius, radius, 1.0))
        _fill_disc(1.4)
        _draw(CIRCLE, wanted[CIRCLE])

    for drawing in wanted[CIRCLE]:
        for place, text, colour in drawing.labels:
            _write(
                text,
                middle[0] + radius * place[0],
                middle[1] + radius * place[1],
                colour,
                centred=True,
            )


def corner_of(area: bpy.types.Area, region: bpy.types.Region, inset: float) -> tuple[float, float]:
    """The place ``inset`` pixels from the region's lower right corner, or from the sidebar where it
    covers that; in the region.
    """
    covered = (r for r in area.regions if r.type == "UI" and r.width > 1 and r.x > region.x)
    right = min([region.x + region.width, *(r.x for r in covered)]) - region.x
    return right - inset, inset


def _fill_disc(radius: float) -> None:
    import gpu
    from gpu_extras.batch import batch_for_shader

    angle = np.linspace(0.0, 2.0 * np.pi, 49)
    rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = (
        np.stack([np.zeros_like(rim[1:]), rim[:-1], rim[1:]], axis=1)
        .reshape(-1, 2)
        .astype(np.float32)
    )
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.blend_set("ALPHA")
    shader.bind()
    shader.uniform_float("color", _DISC)
    batch_for_shader(shader, "TRIS", {"pos": corners}).draw(shader)


def _write(
    text: str, x: float, y: float, colour: tuple[float, float, float, float], centred: bool = False
) -> None:
    """Write with the middle of the text's lower edge at (x, y) of the region, or its very middle if
    ``centred``.
    """
    import blf

    blf.size(0, _FONT_SIZE * bpy.context.preferences.system.ui_scale)
    width, height = blf.dimensions(0, text)
    blf.color(0, *colour)
    blf.position(0, x - width / 2, y - (height / 2 if centred else 0.0), 0.0)
    blf.draw(0, text)


def _draw_timeline() -> None:
    """Bars at the frames of the playing take in which feet slide (upper row) and joints touch
    furniture.
    """
    import gpu
    from gpu_extras.batch import batch_for_shader

    context = bpy.context
    armature = watched_character(context) if context.scene else None
    action = played_take(armature) if armature else None
    faults = shown_faults(action)
    if action is None or faults is None:
        return

    bars = fault_bars(faults, action.dafnet.frame_start)
    if not len(bars.row):
        return

    view, scale = context.region.view2d, context.preferences.system.ui_scale
    origin, step = (view.view_to_region(frame, 0.0, clip=False)[0] for frame in (0.0, 1000.0))
    left, right = (
        origin + (step - origin) * (edge / 1000.0) for edge in (bars.first - 0.5, bars.last + 0.5)
    )
    low = (_BAR_MARGIN + (1.0 - bars.row) * (_BAR_HEIGHT + 1.0)) * scale
    high = low + _BAR_HEIGHT * scale
    right = np.maximum(right, left + 1.0)

    corners = np.stack(
        [left, low, right, low, right, high, left, low, right, high, left, high], axis=1
    ).reshape(-1, 2)
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    content = {
        "pos": np.c_[corners, np.zeros(len(corners))].astype(np.float32),
        "color": np.repeat(bars.colours, 6, axis=0).astype(np.float32),
    }
    gpu.state.blend_set("ALPHA")
    shader.bind()
    batch_for_shader(shader, "TRIS", content).draw(shader)
    gpu.state.blend_set("NONE")


def register() -> None:
    """Add the switches, all off."""
    bpy.utils.register_class(Overlays)
    bpy.types.WindowManager.dafnet_overlays = PointerProperty(type=Overlays)


def unregister() -> None:
    """Turn everything off and take the switches away."""
    _on.clear()
    _live_pose.clear()
    _faults.clear()
    _arrange()
    del bpy.types.WindowManager.dafnet_overlays
    bpy.utils.unregister_class(Overlays)
