"""Still pictures of many poses at once: a bare floor, furniture, coloured mannequins, lines, and a
camera that holds them all.

Mannequins are plain meshes, posed here and not by an armature, so that dozens of poses of one take
stand in one picture.
"""

from collections.abc import Iterable, Sequence
from math import radians
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...core.kinematics import forward_kinematics
from ...core.rotations import rotate, yaw_matrix
from ...core.skeleton import JOINTS, REST
from ...core.solids import Box
from ...demo import Place
from ..character.mannequin import FACING, add_body
from ..compat import output_image
from .demo_room import Part, add_piece
from .preview import use_workbench

__all__ = ["Colour", "Stage", "mixed", "solids"]

Colour = tuple[float, float, float]
"""Red, green and blue as a screen shows them, in [0, 1]."""

_FLOOR: Colour = (0.86, 0.86, 0.85)
_EXPOSURE = 0.65
"""Stops; with the studio light alone white would be a middle grey."""
_JOINTS_DARKER = 0.45
"""How far a mannequin's joints are mixed with a dark grey."""
_LENS = 70.0
"""Millimetres; the camera's focal length."""
_SENSOR = 36.0
"""Millimetres; the width of its sensor."""


def mixed(a: Colour, b: Colour, share: float) -> Colour:
    """From ``a`` (share 0) to ``b`` (share 1)."""
    red, green, blue = ((1.0 - share) * x + share * y for x, y in zip(a, b, strict=True))
    return red, green, blue


def solids(parts: Iterable[Part], place: Place) -> list[Box]:
    """A piece of furniture as the network knows it: each part a box, for a round one a box of the
    same area.
    """
    turn = yaw_matrix(np.array(place.yaw))
    out = []
    for part in parts:
        half = 0.5 * np.array(part.size)
        half[:2] *= np.sqrt(np.pi / 4.0) if part.round else 1.0
        tilt = np.array(Euler([radians(angle) for angle in part.tilt]).to_matrix())
        out.append(Box(turn @ part.center + (*place.position, 0.0), half, turn @ tilt))
    return out


class Stage:
    """Opens an empty file and sets it up for pictures from one side.

    ``toward``: azimuth from which the camera looks, degrees counter-clockwise from +x seen from
    above; ``above``: its angle over the floor, degrees.
    """

    def __init__(self, toward: float, above: float = 18.0) -> None:
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        self.scene = bpy.context.scene
        self.seen: list[np.ndarray] = []
        """Points (N, 3) that the picture has to hold."""

        self._materials: dict[Colour, bpy.types.Material] = {}

        azimuth, elevation = np.radians([toward, above])
        level = np.array([np.cos(azimuth), np.sin(azimuth)])
        back = np.append(level * np.cos(elevation), np.sin(elevation))
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        self.axes = np.stack([right, np.cross(back, right), back])
        """(3, 3): rows are the camera's right, up and back."""

        self._light_from = azimuth + np.radians(-35.0)

        self._camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        self._camera.data.lens, self._camera.data.sensor_width = _LENS, _SENSOR
        self._camera.data.sensor_fit = "HORIZONTAL"
        self.scene.collection.objects.link(self._camera)
        self.scene.camera = self._camera

        self._place = np.zeros(3)
        self._reach = np.ones(2)
        self._size = (1, 1)

        self._template, self._bones, self._rest = self._mannequin()
        floor = 60.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        self._mesh("Floor", floor, [(0, 1, 2, 3)], _FLOOR)

    def _mannequin(self) -> tuple[bpy.types.Mesh, np.ndarray, np.ndarray]:
        """The mannequin's mesh, the joint (V,) that moves each vertex, and the vertices (V, 3) in
        that joint's rest frame.
        """
        armature = bpy.data.objects.new("Mannequin", bpy.data.armatures.new("Mannequin"))
        collection = bpy.data.collections.new("Template")  # in no scene, so never drawn
        body = add_body(collection, armature, 1.0)

        names = [group.name for group in body.vertex_groups]
        bones = np.array(
            [JOINTS.index(names[vertex.groups[0].group]) for vertex in body.data.vertices]
        )
        flat = np.empty(3 * len(bones))
        body.data.vertices.foreach_get("co", flat)
        return body.data, bones, flat.reshape(-1, 3) @ FACING - REST[bones]

    def _material(self, colour: Colour) -> bpy.types.Material:
        if colour not in self._materials:
            material = bpy.data.materials.new("Colour")
            shown = np.array(colour)
            linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
            material.diffuse_color = (*linear.tolist(), 1.0)
            self._materials[colour] = material
        return self._materials[colour]

    def _mesh(
        self, name: str, vertices: np.ndarray, faces: Sequence[tuple[int, ...]], colour: Colour
    ) -> None:
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(vertices.tolist(), [], faces)
        mesh.materials.append(self._material(colour))
        self.scene.collection.objects.link(bpy.data.objects.new(name, mesh))

    def furnish(self, parts: Iterable[Part], place: Place) -> None:
        """Put a piece of furniture there."""
        piece = add_piece(self.scene.collection, "Furniture", parts, place)
        corners = np.array([tuple(corner) for corner in piece.bound_box])
        self.seen.append(
            rotate(yaw_matrix(np.array(place.yaw)), corners) + np.array([*place.position, 0.0])
        )

    def pose(self, frames: np.ndarray, pelvis: np.ndarray, colour: Colour) -> None:
        """Put a mannequin there: global joint frames (22, 3, 3) and its pelvis (3,), world,
        metres.
        """
        joints = forward_kinematics(frames, pelvis)

        vertices = joints[self._bones] + rotate(frames[self._bones], self._rest)
        mesh = self._template.copy()
        mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
        mesh.update()

        darker = mixed(colour, (0.10, 0.10, 0.12), _JOINTS_DARKER)
        for slot, each in enumerate((colour, darker)):
            mesh.materials[slot] = self._material(each)

        self.scene.collection.objects.link(bpy.data.objects.new("Mannequin", mesh))
        self.seen.append(vertices[::7])

    def line(self, points: np.ndarray, colour: Colour, radius: float = 0.012) -> None:
        """Draw a tube through points (N, 3)."""
        curve = bpy.data.curves.new("Line", "CURVE")
        curve.dimensions, curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = (
            "3D",
            radius,
            2,
            True,
        )

        spline = curve.splines.new("POLY")
        spline.points.add(len(points) - 1)
        spline.points.foreach_set("co", np.c_[points, np.ones(len(points))].ravel())

        curve.materials.append(self._material(colour))
        self.scene.collection.objects.link(bpy.data.objects.new("Line", curve))
        self.seen.append(points)

    def ball(self, center: np.ndarray, colour: Colour, radius: float = 0.035) -> None:
        """Draw a ball."""
        rings = np.linspace(0.0, np.pi, 9)
        turns = np.linspace(0.0, 2.0 * np.pi, 17)[:-1]
        shape = np.array(
            [
                (np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a))
                for a in rings
                for b in turns
            ]
        )
        faces = [
            (16 * r + s, 16 * (r + 1) + s, 16 * (r + 1) + (s + 1) % 16, 16 * r + (s + 1) % 16)
            for r in range(8)
            for s in range(16)
        ]
        self._mesh("Ball", center + radius * shape, faces, colour)

    def look(
        self, width: int, height: int, margin: float = 0.05, seen: np.ndarray | None = None
    ) -> None:
        """Place the camera as near as it can be and still see all points (N, 3) of ``seen``, or
        else all that was put on the stage.

        ``margin``: share of the picture that stays free at each edge.
        """
        points = (np.concatenate(self.seen) if seen is None else seen) @ self.axes.T
        tangent = 0.5 * _SENSOR / _LENS
        self._reach = np.array([tangent, tangent * height / width])
        self._size = width, height
        place = np.zeros(3)
        for axis, reach in enumerate((1.0 - 2.0 * margin) * self._reach):
            high = (points[:, axis] + reach * points[:, 2]).max()
            low = (-points[:, axis] + reach * points[:, 2]).max()
            place[axis] = 0.5 * (high - low)
            place[2] = (
                max(place[2], 0.5 * (high + low) / reach) if axis else 0.5 * (high + low) / reach
            )

        self._place = place
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = self.axes.T, place @ self.axes
        self._camera.matrix_world = Matrix(frame.tolist())
        self._camera.data.clip_start, self._camera.data.clip_end = 0.1, 300.0

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Where the camera sees points (N, 3): (N, 2) pixels, right and down from the picture's
        upper left corner.
        """
        local = points @ self.axes.T - self._place
        shown = local[:, :2] / (-local[:, 2:] * self._reach)
        return 0.5 * (shown * (1.0, -1.0) + 1.0) * self._size

    def render(self, file: Path) -> None:
        """Write the picture that the camera sees as a PNG."""
        use_workbench(self.scene, *self._size)
        self.scene.view_settings.exposure = _EXPOSURE

        display = self.scene.display
        display.render_aa = "8"
        display.shading.show_specular_highlight = False  # or the floor would not be of one tone

        # Blender's studio light lies in a frame whose y is up and whose z comes towards a
        # viewer who looks along +y.
        display.light_direction = (
            0.6 * np.cos(self._light_from),
            0.8,
            -0.6 * np.sin(self._light_from),
        )
        display.shading.shadow_intensity = 0.30

        output_image(self.scene)
        self.scene.render.image_settings.color_mode = "RGB"
        self.scene.render.dither_intensity = 0.0  # noise that no palette would keep small
        self.scene.render.filepath = str(file)
        bpy.ops.render.render(write_still=True, scene=self.scene.name)
