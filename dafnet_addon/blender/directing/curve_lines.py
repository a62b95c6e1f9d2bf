"""Reads the line that a curve object is drawn with."""

import bpy
import numpy as np

from ...core.errors import InputError

__all__ = ["line_of"]


def line_of(context: bpy.types.Context, curve: bpy.types.Object) -> np.ndarray:
    """The longest line (N, 3) of a curve as the scene evaluates it, world, Blender units."""
    if curve.type != "CURVE":
        raise InputError(f"'{curve.name}' is not a curve; select a Bezier, poly or NURBS curve.")

    evaluated = curve.evaluated_get(context.evaluated_depsgraph_get())
    lines = _lines(evaluated)
    if not lines:
        # It has a bevel or another surface: take the bare line, without its modifiers.
        bare = bpy.data.objects.new(curve.name, curve.data.copy())
        data = bare.data
        try:
            data.bevel_mode, data.bevel_depth, data.extrude, data.bevel_object, data.dimensions = (
                "ROUND",
                0.0,
                0.0,
                None,
                "3D",
            )
            lines = _lines(bare)
        finally:
            bpy.data.objects.remove(bare)
            bpy.data.curves.remove(data)

    matrix = np.array(evaluated.matrix_world, float)
    world = [line @ matrix[:3, :3].T + matrix[:3, 3] for line in lines]
    if not world:
        raise InputError(f"The curve '{curve.name}' has no line; draw one on the floor.")

    return max(world, key=lambda line: float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()))


def _lines(owner: bpy.types.Object) -> list[np.ndarray]:
    """The chains of edges (N, 3) that a curve is drawn with, in its own space; none where it has
    faces.
    """
    mesh = owner.to_mesh()
    try:
        if mesh is None or len(mesh.polygons) or not len(mesh.edges):
            return []

        flat, edges = np.empty(3 * len(mesh.vertices)), np.empty(2 * len(mesh.edges), int)
        mesh.vertices.foreach_get("co", flat)
        mesh.edges.foreach_get("vertices", edges)
    finally:
        owner.to_mesh_clear()

    points, pairs = (
        flat.reshape(-1, 3),
        {tuple(sorted(pair)) for pair in edges.reshape(-1, 2).tolist()},
    )
    lines, start = [], 0
    for k in range(1, len(points) + 1):
        if k == len(points) or (k - 1, k) not in pairs:
            closed = (start, k - 1) in pairs and k - start > 2
            lines.append(points[[*range(start, k), *([start] if closed else [])]])
            start = k

    return [line for line in lines if len(line) > 1]
