"""A chair on a floor: as little as it takes to measure batches with."""

from pathlib import Path

import bpy

from ...demo import Place
from ..pipeline.batch import save_scene
from .demo_room import FURNITURE, Part, add_piece, new_collection

__all__ = ["save_small_room"]

_FLOOR = Part("Floor", (6.0, 6.0, 0.02), (0.0, 0.0, -0.01))


def save_small_room(file: Path) -> None:
    """Write it, in place of what is open. Raises InputError where it cannot be written."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = 30, 1.0
    room = new_collection(scene, "Room")
    add_piece(room, "Floor", [_FLOOR], Place((0.0, 0.0), 0.0))
    furniture = new_collection(scene, "Furniture")
    add_piece(furniture, "Chair", FURNITURE["Chair"], Place((0.0, 0.0), 0.0))
    save_scene(file)
