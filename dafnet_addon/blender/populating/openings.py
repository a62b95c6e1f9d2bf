"""The room of a shot as the open scene: one of ours, a .blend, a .glb, or a folder of pieces."""

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ...core.errors import InputError
from ...core.text import nearest_known, printable
from ...director.shots import Shot
from ..character.properties import ensure_registered
from ..pipeline.batch import open_file
from ..showcase.rooms import FPS, ROOMS, build
from .importing import READ, added_objects

__all__ = ["empty_scene", "open_room"]

_AISLE = 1.2
"""Metres between pieces that are set side by side."""


def open_room(shot: Shot) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Open the shot's room in place of what is open.

    Returns the files that it came from, and sentences for the user. Raises InputError where there
    is no such room, or it cannot be opened.
    """
    path = shot.path(shot.room)
    if shot.room in ROOMS and not path.is_file():
        empty_scene()
        build(bpy.context.scene, shot.room)
        return (), ()

    if not path.exists():
        raise InputError(
            f"There is no room '{printable(shot.room, 100)}', no file or folder of that path; of "
            f"ours, {nearest_known(shot.room, ROOMS)}"
        )
    if path.is_dir():
        pieces = sorted(each for each in path.iterdir() if each.suffix.lower() in READ)
        if not pieces:
            raise InputError(
                f"The folder '{path}' has no pieces of furniture; put {', '.join(READ)} files "
                "there."
            )
        empty_scene()
        _furnish(pieces)
        return tuple(pieces), ()

    if path.suffix.lower() == ".blend":
        warnings = open_file(path)
        ensure_registered()
        return (path, *_libraries()), warnings

    empty_scene()
    added_objects(bpy.context, path, bpy.context.scene.collection, "the room")
    return (path,), ()


def empty_scene() -> None:
    """Open a scene without anything in it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    ensure_registered()
    render = bpy.context.scene.render
    render.fps, render.fps_base = FPS, 1.0


def _furnish(files: Sequence[Path]) -> None:
    """Add the pieces, each as one named as its file, where it was made; those that would stand in
    one another are set side by side, in rows.
    """
    context = bpy.context
    pieces = []
    for file in files:
        collection = bpy.data.collections.new(file.stem)
        context.scene.collection.children.link(collection)
        added = added_objects(context, file, collection, "the room")
        place = bpy.data.objects.new(f"{file.stem} Place", None)
        collection.objects.link(place)
        for each in added:
            if each.parent is None:
                each.parent = place
        context.view_layer.update()
        meshes = [each for each in added if each.type == "MESH"]
        _as_one(meshes, file.stem)
        context.view_layer.update()
        pieces.append((place, _bounds(meshes)))

    if _overlap([box for _, box in pieces]):
        _set_out(pieces)
    context.view_layer.update()


def _as_one(meshes: Sequence[bpy.types.Object], name: str) -> None:
    """Let the largest mesh have the piece's name, and the others belong to it."""
    if not meshes:
        return
    largest = max(meshes, key=lambda each: float(np.prod(np.maximum(each.dimensions, 1e-3))))
    for each in meshes:
        if each is not largest and largest not in each.children_recursive:
            at = each.matrix_world.copy()
            each.parent = largest
            each.matrix_world = at
    largest.name = name


def _bounds(meshes: Sequence[bpy.types.Object]) -> np.ndarray:
    """The lowest and highest corner (2, 3) of all in the world."""
    corners = [
        np.array([tuple(each.matrix_world @ Vector(corner)) for corner in each.bound_box])
        for each in meshes
    ]
    if not corners:
        return np.zeros((2, 3))
    points = np.concatenate(corners)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _overlap(boxes: Sequence[np.ndarray]) -> bool:
    """Whether any two stand in one another, seen from above."""
    return any(
        (np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]) > 0.02)[:2].all()
        for k, a in enumerate(boxes)
        for b in boxes[:k]
    )


def _set_out(pieces: Sequence[tuple[bpy.types.Object, np.ndarray]]) -> None:
    """In rows along x, all on the floor."""
    columns = int(np.ceil(np.sqrt(len(pieces))))
    y = 0.0
    for first in range(0, len(pieces), columns):
        row = pieces[first : first + columns]
        x = 0.0
        for whole, box in row:
            size, middle = box[1] - box[0], box.mean(axis=0)
            whole.location = (x + size[0] / 2 - middle[0], y - middle[1], -box[0, 2])
            x += size[0] + _AISLE
        y -= max(float((box[1] - box[0])[1]) for _, box in row) + _AISLE


def _libraries() -> list[Path]:
    return [Path(bpy.path.abspath(library.filepath)) for library in bpy.data.libraries]
