"""A Blender scene with a character in it, and short ways to fill it, to key it, and to see what it
plays.

The modules of the add-on are those that Blender has loaded, as in every test of the Blender side.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS

__all__ = ["FACES", "Stage", "bone_heads", "box_corners", "key", "keys_of"]

Point = Sequence[float]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
"""Of a box with ``box_corners``, outward."""


def box_corners(low: Point, high: Point) -> list[tuple[float, float, float]]:
    """The eight corners of a box, in the order of which ``FACES`` tell."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]


def key(made: Any, path: str, *values: tuple[int, Any]) -> None:
    """Key a property with these (frame, value)."""
    for frame, value in values:
        setattr(made, path, value)
        made.keyframe_insert(path, frame=frame)


def keys_of(owner: Any) -> dict[tuple[str, int], np.ndarray]:
    """The keys (N, 2), frame and value, of every curve that plays, by path and index."""
    return {
        (curve.data_path, curve.array_index): np.array([p.co for p in curve.keyframe_points])
        for curve in action_curves(owner)
    }


def bone_heads(
    armature: Any, frame: int, names: Iterable[str] = JOINTS, subframe: float = 0.0
) -> np.ndarray:
    """Where Blender shows the heads of these bones at a frame: (N, 3), world, Blender's units."""
    bpy.context.scene.frame_set(frame, subframe=subframe)
    shown = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return np.array([shown.matrix_world @ shown.pose.bones[name].head for name in names])


class Stage:
    """The character Ann (``ann``) at the origin of an empty scene, looking along +y.

    ``height``: hers, metres; ``frames``: the scene's first and last; ``unit``: metres in a Blender
    unit; ``furnished``: whether there is a collection that is her furniture, which new objects go
    into.
    """

    def __init__(
        self,
        *,
        height: float = 1.75,
        fps: int = 24,
        frames: tuple[int, int] = (1, 40),
        unit: float = 1.0,
        furnished: bool = True,
    ) -> None:
        self.scene = bpy.context.scene
        self.scene.unit_settings.scale_length = unit
        self.scene.render.fps = fps
        self.scene.frame_start, self.scene.frame_end = frames
        assert bpy.ops.dafnet.add_character(name="Ann", height=height) == {"FINISHED"}
        self.ann = bpy.context.object
        self.own = self.ann.dafnet
        self.root, self.head = self.own.root, self.own.head
        self.body = next(child for child in self.ann.children if child.type == "MESH")
        self.furniture: Any = None
        if furnished:
            self.furniture = self.collection("Furniture", self.scene.collection)
            self.own.furniture = self.furniture

    # To fill it.

    def collection(self, name: str, parent: Any = None) -> Any:
        """A new collection, linked into its parent if there is one."""
        made = bpy.data.collections.new(name)
        if parent:
            parent.children.link(made)
        return made

    def put(self, made: Any, collection: Any = None, **properties: Any) -> Any:
        """Link an object into a collection, else into the furniture, else into the scene."""
        for name, value in properties.items():
            setattr(made, name, value)
        (collection or self.furniture or self.scene.collection).objects.link(made)
        return made

    def mesh(
        self,
        name: str,
        corners: Sequence[Point],
        faces: Sequence[Sequence[int]],
        edges: Sequence[Sequence[int]] = (),
        collection: Any = None,
        **properties: Any,
    ) -> Any:
        data = bpy.data.meshes.new(name)
        data.from_pydata(corners, edges, faces)
        return self.put(bpy.data.objects.new(name, data), collection, **properties)

    def box(
        self,
        name: str,
        low: Point = (-1, -1, -1),
        high: Point = (1, 1, 1),
        collection: Any = None,
        **properties: Any,
    ) -> Any:
        """A box between two corners of its own space."""
        return self.mesh(name, box_corners(low, high), FACES, (), collection, **properties)

    def seat(self, name: str = "Chair", collection: Any = None, **properties: Any) -> Any:
        """A box that one can sit on: half a metre wide and deep, 45 cm high."""
        return self.box(name, (-0.25, -0.25, 0.0), (0.25, 0.25, 0.45), collection, **properties)

    def empty(self, name: str, location: Point = (0.0, 0.0, 0.0), **properties: Any) -> Any:
        """An empty, which is not furniture."""
        made = bpy.data.objects.new(name, None)
        self.put(made, self.scene.collection, location=location, **properties)
        bpy.context.view_layer.update()
        return made

    def select(self, *objects: Any) -> None:
        """Select these alone; the first one is active."""
        for each in self.scene.objects:
            each.select_set(each in objects)
        bpy.context.view_layer.objects.active = objects[0] if objects else None

    # The way of her root.

    def walk(self, *ahead: tuple[int, float]) -> None:
        """Key the root's place so far ahead (+y) at these frames."""
        key(self.root, "location", *((frame, (0.0, y, 0.0)) for frame, y in ahead))

    def stand(self, frame: int, x: float, y: float, yaw: float = 0.0) -> None:
        """Key the root's place and heading."""
        key(self.root, "location", (frame, (x, y, 0.0)))
        key(self.root, "rotation_euler", (frame, (0.0, 0.0, yaw)))

    def place(self, frame: float) -> np.ndarray:
        """The root's place and heading (4,) at a frame."""
        self.scene.frame_set(int(frame))
        return np.array([*self.root.location, self.root.rotation_euler[2]])

    def path(self, first: int, last: int) -> np.ndarray:
        """Its places and headings (T, 4) in these frames, the last one included."""
        return np.array([self.place(frame) for frame in range(first, last + 1)])

    # What comes of it.

    def settings(self, **overrides: Any) -> Any:
        return settings_of(self.ann, self.scene, **overrides)

    def read(self, **overrides: Any) -> Any:
        """The scene as the core is handed it."""
        return read_scene(bpy.context, self.settings(**overrides))

    def cannot_be_read(self, words: str, **overrides: Any) -> None:
        """Reading is refused with a sentence of these words, and stays at its frame."""
        frame = self.scene.frame_current
        with pytest.raises(InputError, match=words):
            self.read(**overrides)
        assert self.scene.frame_current == frame

    def played(self) -> np.ndarray:
        """Her joints (T, 22, 3) in all frames of the scene, world, Blender's units."""
        first, last = self.scene.frame_start, self.scene.frame_end
        return np.array([bone_heads(self.ann, frame) for frame in range(first, last + 1)])

    def state(self) -> dict[str, object]:
        """What must not change when something fails."""
        data, layer = bpy.data, bpy.context.view_layer
        layer.update()
        return {
            "data": [
                sorted(each.name for each in kind)
                for kind in (data.actions, data.objects, data.meshes, data.curves)
            ],
            "playing": [
                o.name for o in data.objects if o.animation_data and o.animation_data.action
            ],
            "keys": {
                o.name: [len(c.keyframe_points) for c in action_curves(o)] for o in data.objects
            },
            "frame": (
                self.scene.frame_current,
                self.scene.frame_subframe,
                self.scene.render.fps,
            ),
            "selected": (
                sorted(o.name for o in layer.objects.selected),
                layer.objects.active,
                bpy.context.mode,
            ),
            "places": repr([[tuple(row) for row in o.matrix_world] for o in data.objects]),
            "pose": repr([[tuple(row) for row in b.matrix_basis] for b in self.ann.pose.bones]),
        }
