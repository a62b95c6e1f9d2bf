"""Paints drawings into the view, and bars into the timeline.

``gpu`` is imported only when something is painted.
"""

from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np

from .drawing import Colour, Drawing
from .faults import FaultBars

__all__ = [
    "beads_of",
    "corner_of",
    "forget_batches",
    "paint",
    "paint_bars",
    "paint_circle",
    "paint_labels",
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

_batches: dict[tuple[str, int], tuple[Drawing, list[tuple[str, Any]]]] = {}
"""Shaders and batches of the drawings painted last, by kind and number."""


def forget_batches() -> None:
    """Drop what was prepared for painting."""
    _batches.clear()


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


def paint(kind: str, drawings: Iterable[Drawing]) -> None:
    """Paint beads and lines with the matrices as they are, in front of everything."""
    import gpu

    depth = gpu.state.depth_test_get()
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE")

    scale = bpy.context.preferences.system.ui_scale
    for number, drawing in enumerate(drawings):
        for name, batch in _batches_of(kind, number, drawing):
            shader = gpu.shader.from_builtin(name)
            shader.bind()
            if name.startswith("POLYLINE"):
                shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
                shader.uniform_float("lineWidth", drawing.width * scale)
            batch.draw(shader)

    gpu.state.blend_set("NONE")
    gpu.state.depth_test_set(depth)


def paint_labels(context: bpy.types.Context, drawings: Iterable[Drawing]) -> None:
    """Write the labels of drawings next to their places in the scene."""
    from bpy_extras.view3d_utils import location_3d_to_region_2d

    for drawing in drawings:
        for place, text, colour in drawing.labels:
            at = location_3d_to_region_2d(context.region, context.region_data, place)
            if at is not None:
                _write(text, at[0], at[1] + 10.0, colour)


def paint_circle(context: bpy.types.Context, kind: str, drawings: Iterable[Drawing]) -> None:
    """Paint drawings of radius 1 around the origin, and their labels, in the corner of the view."""
    import gpu

    scale = context.preferences.system.ui_scale
    inset = (1.4 * _CIRCLE_RADIUS + _CIRCLE_MARGIN) * scale
    middle = corner_of(context.area, context.region, inset)
    radius = _CIRCLE_RADIUS * scale
    with gpu.matrix.push_pop():
        gpu.matrix.translate((*middle, 0.0))
        gpu.matrix.scale((radius, radius, 1.0))
        _fill_disc(1.4)
        paint(kind, drawings)

    for drawing in drawings:
        for place, text, colour in drawing.labels:
            _write(
                text,
                middle[0] + radius * place[0],
                middle[1] + radius * place[1],
                colour,
                centred=True,
            )


def paint_bars(context: bpy.types.Context, bars: FaultBars) -> None:
    """Paint bars into the timeline, in two rows."""
    import gpu
    from gpu_extras.batch import batch_for_shader

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


def corner_of(area: bpy.types.Area, region: bpy.types.Region, inset: float) -> tuple[float, float]:
    """The place ``inset`` pixels from the region's lower right corner, or from the sidebar where it
    covers that; in the region.
    """
    covered = (
        each for each in area.regions if each.type == "UI" and each.width > 1 and each.x > region.x
    )
    right = min([region.x + region.width, *(each.x for each in covered)]) - region.x
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


def _write(text: str, x: float, y: float, colour: Colour, centred: bool = False) -> None:
    """Write with the middle of the text's lower edge at (x, y) of the region, or its very middle if
    ``centred``.
    """
    import blf

    blf.size(0, _FONT_SIZE * bpy.context.preferences.system.ui_scale)
    width, height = blf.dimensions(0, text)
    blf.color(0, *colour)
    blf.position(0, x - width / 2, y - (height / 2 if centred else 0.0), 0.0)
    blf.draw(0, text)
