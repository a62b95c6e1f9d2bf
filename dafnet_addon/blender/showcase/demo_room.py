"""The demo: a room built from tables of parts, a character with keyed root and hand target, a take,
and its preview.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...core.files import require_writable, save_text
from ...core.paths import Route
from ...core.progress import run_to_end
from ...core.root import smoothed
from ...core.weights import load_weights
from ...demo import FPS, PLACES, Place, demo_report, demo_route, hand_target
from ..character.armature import create_character
from ..character.properties import ensure_registered
from ..compat import assign_action, new_action
from ..pipeline import job
from ..pipeline.batch import save_scene
from ..scene.scene_reader import read_scene
from .preview import look_at, render_film, render_sheet, use_workbench

__all__ = [
    "FURNITURE",
    "Part",
    "Room",
    "Triple",
    "add_piece",
    "build_room",
    "four_legs",
    "key_channels",
    "new_collection",
    "run_demo",
]

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """A box of ``size`` (x, y, z) around ``center``, or an upright cylinder of that size; metres.

    ``tilt``: Euler angles in degrees. ``bevel``: width of the rounded edges. The piece's front is
    +y, its floor z = 0, and a seat's origin is where a pelvis rests.
    """

    material: str
    size: Triple
    center: Triple
    tilt: Triple = (0.0, 0.0, 0.0)
    bevel: float = 0.008
    round: bool = False


def four_legs(
    material: str,
    x: float,
    y: float,
    height: float,
    thickness: float,
    splay: float,
    y0: float = 0.0,
) -> list[Part]:
    """Four round legs, splayed by ``splay`` degrees, that meet a top at ``height`` at (±x, y0 ±
    y).
    """
    size = (thickness, thickness, height / cos(radians(splay)))
    lean = 0.5 * height * sin(radians(splay))
    return [
        Part(
            material,
            size,
            (i * (x + lean), y0 + j * (y + lean), height / 2),
            (j * splay, -i * splay, 0.0),
            0.006,
            True,
        )
        for i in (-1, 1)
        for j in (-1, 1)
    ]


FURNITURE: dict[str, tuple[Part, ...]] = {
    "Chair": (
        Part("Oak", (0.46, 0.45, 0.035), (0, 0.015, 0.4325), bevel=0.014),
        Part("Oak", (0.43, 0.024, 0.20), (0, -0.245, 0.76), (8, 0, 0), 0.010),
        Part("Oak", (0.034, 0.034, 0.46), (-0.185, -0.222, 0.635), (8, 0, 0), 0.008, True),
        Part("Oak", (0.034, 0.034, 0.46), (0.185, -0.222, 0.635), (8, 0, 0), 0.008, True),
        *four_legs("Oak", 0.165, 0.155, 0.425, 0.036, 5.0, 0.015),
    ),
    "Stool": (
        Part("Teal", (0.37, 0.37, 0.050), (0, 0, 0.605), bevel=0.016, round=True),
        *four_legs("Oak", 0.105, 0.105, 0.595, 0.032, 7.0),
        Part("Oak", (0.30, 0.020, 0.020), (0, 0.150, 0.22), bevel=0.005),
        Part("Oak", (0.30, 0.020, 0.020), (0, -0.150, 0.22), bevel=0.005),
        Part("Oak", (0.020, 0.30, 0.020), (0.150, 0, 0.22), bevel=0.005),
        Part("Oak", (0.020, 0.30, 0.020), (-0.150, 0, 0.22), bevel=0.005),
    ),
    "Desk": (
        Part("Oak", (1.40, 0.68, 0.032), (0, 0, 0.724), bevel=0.010),
        *four_legs("Graphite", 0.60, 0.26, 0.71, 0.036, 2.5),
        Part("Paper", (0.42, 0.50, 0.30), (0.40, 0.02, 0.555), bevel=0.010),
        Part("Graphite", (0.12, 0.012, 0.014), (0.40, 0.277, 0.61), bevel=0.003),
        Part("Graphite", (0.12, 0.012, 0.014), (0.40, 0.277, 0.49), bevel=0.003),
        Part("Graphite", (0.34, 0.24, 0.014), (-0.15, 0.05, 0.747), bevel=0.004),
        Part("Graphite", (0.34, 0.012, 0.22), (-0.15, -0.10, 0.855), (14, 0, 0), 0.004),
        Part("Coral", (0.075, 0.075, 0.095), (-0.52, 0.12, 0.7875), bevel=0.006, round=True),
    ),
    "Whiteboard": (
        Part("Paper", (1.50, 0.020, 0.95), (0, 0, 1.38), bevel=0.004),
        Part("Graphite", (1.56, 0.034, 0.035), (0, -0.002, 1.865), bevel=0.008),
        Part("Graphite", (1.56, 0.034, 0.035), (0, -0.002, 0.895), bevel=0.008),
        Part("Graphite", (0.035, 0.034, 1.00), (-0.765, -0.002, 1.38), bevel=0.008),
        Part("Graphite", (0.035, 0.034, 1.00), (0.765, -0.002, 1.38), bevel=0.008),
        Part("Graphite", (0.60, 0.070, 0.016), (0.10, 0.045, 0.918), bevel=0.004),
        Part("Graphite", (0.036, 0.036, 0.90), (-0.70, -0.010, 0.46), bevel=0.006, round=True),
        Part("Graphite", (0.036, 0.036, 0.90), (0.70, -0.010, 0.46), bevel=0.006, round=True),
        Part("Graphite", (0.045, 0.50, 0.030), (-0.70, 0, 0.030), bevel=0.010),
        Part("Graphite", (0.045, 0.50, 0.030), (0.70, 0, 0.030), bevel=0.010),
        Part("Coral", (0.14, 0.016, 0.016), (0.16, 0.055, 0.934), bevel=0.005),
        Part("Teal", (0.14, 0.016, 0.016), (-0.03, 0.055, 0.934), bevel=0.005),
    ),
    "Sofa": (
        Part("Slate", (1.95, 0.80, 0.20), (0, -0.02, 0.18), bevel=0.035),
        Part("Slate", (0.80, 0.62, 0.16), (-0.405, 0.08, 0.345), bevel=0.045),
        Part("Slate", (0.80, 0.62, 0.16), (0.405, 0.08, 0.345), bevel=0.045),
        Part("Slate", (0.80, 0.20, 0.42), (-0.405, -0.27, 0.60), (12, 0, 0), 0.060),
        Part("Slate", (0.80, 0.20, 0.42), (0.405, -0.27, 0.60), (12, 0, 0), 0.060),
        Part("Slate", (1.95, 0.16, 0.62), (0, -0.40, 0.40), bevel=0.050),
        Part("Slate", (0.18, 0.86, 0.50), (-0.895, 0.01, 0.34), bevel=0.055),
        Part("Slate", (0.18, 0.86, 0.50), (0.895, 0.01, 0.34), bevel=0.055),
        *four_legs("Oak", 0.86, 0.32, 0.085, 0.040, 0.0),
        Part("Coral", (0.42, 0.14, 0.40), (-0.58, -0.06, 0.63), (20, 12, 8), 0.060),
    ),
    "Bed": (  # one lies down along it with the head to +x, from where one sat on its edge
        Part("Paper", (2.00, 0.93, 0.22), (-0.02, -0.30, 0.35), bevel=0.045),
        Part("Oak", (2.05, 0.98, 0.13), (-0.02, -0.30, 0.195), bevel=0.010),
        Part("Oak", (0.045, 1.02, 0.92), (1.025, -0.30, 0.46), bevel=0.015),
        Part("Oak", (0.045, 1.02, 0.50), (-1.06, -0.30, 0.25), bevel=0.015),
        Part("Slate", (0.38, 0.66, 0.075), (0.72, -0.30, 0.4875), bevel=0.036),
        Part("Teal", (0.50, 0.945, 0.010), (-0.72, -0.30, 0.461), bevel=0.004),
    ),
}
"""Pieces of furniture, part by part."""

_SHELL = (  # the room itself is not furniture, since nobody sits on a wall
    Part("Floor", (9.6, 8.6, 0.10), (1.45, -1.80, -0.05), bevel=0.0),
    Part("Wall", (7.0, 0.10, 2.45), (0.15, 2.55, 1.175), bevel=0.0),
    Part("Wall", (0.10, 5.6, 2.45), (-3.40, -0.30, 1.175), bevel=0.0),
    Part("Paper", (6.90, 0.015, 0.09), (0.15, 2.493, 0.045), bevel=0.004),
    Part("Paper", (0.015, 5.50, 0.09), (-3.343, -0.30, 0.045), bevel=0.004),
    Part("Rug", (2.70, 1.90, 0.012), (0.45, -0.35, 0.006), bevel=0.004),
    Part("Rug Border", (2.82, 2.02, 0.008), (0.45, -0.35, 0.004), bevel=0.003),
    Part("Oak", (0.72, 0.030, 0.52), (-2.05, 2.485, 1.55), bevel=0.006),
    Part("Coral", (0.64, 0.034, 0.44), (-2.05, 2.483, 1.55), bevel=0.004),
    Part("Teal", (0.64, 0.036, 0.18), (-2.05, 2.482, 1.42), bevel=0.004),
    Part("Oak", (0.030, 0.52, 0.72), (-3.335, -0.55, 1.55), bevel=0.006),
    Part("Teal", (0.034, 0.44, 0.64), (-3.333, -0.55, 1.55), bevel=0.004),
)

_COLOURS = {
    "Oak": (0.58, 0.40, 0.24),
    "Teal": (0.16, 0.42, 0.44),
    "Graphite": (0.12, 0.13, 0.15),
    "Paper": (0.90, 0.90, 0.88),
    "Coral": (0.82, 0.36, 0.26),
    "Slate": (0.30, 0.37, 0.47),
    "Floor": (0.62, 0.52, 0.42),
    "Wall": (0.60, 0.67, 0.69),
    "Rug": (0.74, 0.68, 0.58),
    "Rug Border": (0.30, 0.40, 0.46),
    "Walnut": (0.33, 0.20, 0.12),
    "Brass": (0.78, 0.60, 0.28),
    "Leaf": (0.22, 0.42, 0.22),
    "Concrete": (0.52, 0.53, 0.54),
    "Velvet": (0.55, 0.10, 0.13),
    "Carpet": (0.24, 0.20, 0.26),
    "Night": (0.16, 0.17, 0.24),
}


@dataclass(frozen=True)
class Room:
    """The room once it is built: its ``scene``, the character's ``armature``, with its settings,
    and the ``route`` of its root.
    """

    scene: bpy.types.Scene
    armature: bpy.types.Object
    route: Route


def build_room(context: bpy.types.Context) -> Room:
    """Furnish the context's empty scene, add the character and key its root, its mode and its right
    hand's target.
    """
    scene = context.scene
    walked = demo_route()

    scene.render.fps, scene.render.fps_base = FPS, 1.0
    scene.frame_start, scene.frame_end = 1, len(walked.path)

    shell = new_collection(scene, "Room")
    add_piece(shell, "Room", _SHELL, Place((0.0, 0.0), 0.0))
    furniture = new_collection(scene, "Furniture")
    for name, place in PLACES.items():
        add_piece(furniture, name, FURNITURE[name], place)

    _camera_and_lights(scene, new_collection(scene, "Camera and Lights"), walked)

    scene.cursor.location = (0.0, 0.0, 0.0)
    armature = create_character(context)
    settings = armature.dafnet
    settings.furniture = furniture

    frames = np.arange(1, len(walked.path) + 1)
    turns = np.zeros((len(frames), 3))
    turns[:, 2] = walked.path.yaw
    key_channels(settings.root, frames, location=walked.path.position, rotation_euler=turns)

    board = next(rest for rest in walked.rests if rest.place.name == "Whiteboard")

    hand = settings.hand_right
    key_channels(hand, frames, location=hand_target(board, frames - 1))
    hand.empty_display_size = 0.08

    settings.head = settings.hand_left = None  # the animator asks for the drawing hand only
    for frame, mode in ((1, "FREE"), (board.start + 5, "EE"), (board.stop - 6, "FREE")):
        settings.mode = mode
        armature.keyframe_insert("dafnet.mode", frame=frame)

    scene.frame_set(1)
    return Room(scene, armature, walked)


def run_demo(
    folder: Path,
    *,
    seed: int,
    temperature: float,
    weights: Path | None,
    preview: bool,
    progress: Callable[[float], None],
) -> dict[str, Any]:
    """Build the room in an empty file, generate and bake, and write ``demo.blend``, its preview and
    ``report.json``.

    Returns the report. ``progress`` is called with the part done, in [0, 1]. Raises WeightsError,
    and InputError where the folder cannot be written to.
    """
    require_writable(folder / "demo.blend")
    loaded = load_weights(weights)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    ensure_registered()
    room = build_room(bpy.context)
    use_workbench(room.scene)
    settings = job.settings_of(room.armature, room.scene, seed=seed, temperature=temperature)
    generating = 0.2 if preview else 1.0
    result = run_to_end(
        job.steps(bpy.context, settings, loaded), lambda part: progress(generating * part)
    )

    read = read_scene(bpy.context, settings)
    report = demo_report(
        result.take, read.scene, read.controls, weights=loaded, seconds=result.seconds
    )
    save_text(folder / "report.json", json.dumps(report, indent=2))
    save_scene(folder / "demo.blend", lambda: progress(generating), compress=True)

    if preview:
        frames = np.linspace(room.scene.frame_start, room.scene.frame_end, 16).astype(int).tolist()
        render_sheet(room.scene, folder / "sheet.png", frames)
        render_film(
            room.scene,
            folder / "preview.mp4",
            2,
            lambda part: progress(generating + (1 - generating) * part),
        )

    return report


def new_collection(scene: bpy.types.Scene, name: str) -> bpy.types.Collection:
    """A new collection in the scene."""
    collection = bpy.data.collections.new(name)
    scene.collection.children.link(collection)
    return collection


def add_piece(
    collection: bpy.types.Collection, name: str, parts: Iterable[Part], place: Place
) -> bpy.types.Object:
    """One mesh object of all ``parts``, its origin on the floor at ``place``."""
    names: list[str] = []
    shape = bmesh.new()
    for part in parts:
        if part.material not in names:
            names.append(part.material)
        _add(shape, part, names.index(part.material))

    mesh = bpy.data.meshes.new(name)
    shape.to_mesh(mesh)
    shape.free()
    for material in names:
        mesh.materials.append(_material(material))

    made = bpy.data.objects.new(name, mesh)
    made.location = (*place.position, 0.0)
    made.rotation_euler = (0.0, 0.0, place.yaw)
    collection.objects.link(made)
    return made


def _add(shape: bmesh.types.BMesh, part: Part, material: int) -> None:
    """Add one part to ``shape``; its large faces stay flat and its bevels are shaded smoothly."""
    frame = Matrix.LocRotScale(part.center, Euler([radians(a) for a in part.tilt]), part.size)
    piece = bmesh.new()
    if part.round:
        bmesh.ops.create_cone(
            piece, cap_ends=True, segments=32, radius1=0.5, radius2=0.5, depth=1.0, matrix=frame
        )
    else:
        bmesh.ops.create_cube(piece, size=1.0, matrix=frame)

    sharp = [edge for edge in piece.edges if edge.calc_face_angle(0.0) > radians(60)]
    if part.bevel > 0.0:
        bmesh.ops.bevel(
            piece, geom=sharp, offset=part.bevel, segments=3, profile=0.5, affect="EDGES"
        )

    wide = 4 * part.bevel**2
    flat = {
        face
        for face in piece.faces
        if len(face.verts) > 4 or (not part.round and face.calc_area() > wide)
    }

    vertices = {vertex: shape.verts.new(vertex.co) for vertex in piece.verts}
    for face in piece.faces:
        copy = shape.faces.new([vertices[v] for v in face.verts])
        copy.smooth = face not in flat
        copy.material_index = material

    piece.free()


def _material(name: str) -> bpy.types.Material:
    found = bpy.data.materials.get(name)
    if found is None:
        found = bpy.data.materials.new(name)
        colour = (*_COLOURS[name], 1.0)
        found.diffuse_color = colour
        if found.node_tree is None:  # before 5.0
            found.use_nodes = True

        shader = next(node for node in found.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = colour
        shader.inputs["Roughness"].default_value = 0.6

    return found


def _camera_and_lights(
    scene: bpy.types.Scene, collection: bpy.types.Collection, walked: Route
) -> None:
    """A camera that turns after the character, calmly, and lights for the renderers that use
    them.
    """
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 50.0
    collection.objects.link(camera)
    scene.camera = camera
    followed = smoothed(walked.path, position_sigma=24.0).position
    aims = np.array([0.0, 0.1, 0.80]) + np.array([0.75, 0.45, 0.0]) * followed
    turns = []
    for aim in aims:
        look_at(camera, (4.4, -6.1, 2.70), aim.tolist())
        turns.append(tuple(camera.rotation_euler))

    key_channels(camera, np.arange(1, len(aims) + 1), rotation_euler=np.array(turns))

    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 2.5, radians(8)
    look_at(sun, (2.5, -3.0, 5.0), (0.0, 0.0, 0.0))
    fill = bpy.data.objects.new("Fill", bpy.data.lights.new("Fill", "AREA"))
    fill.data.energy, fill.data.size = 160.0, 3.0
    look_at(fill, (-2.0, -3.5, 3.2), (0.0, 0.3, 0.6))
    for light in (sun, fill):
        collection.objects.link(light)


def key_channels(owner: bpy.types.Object, frames: np.ndarray, **channels: np.ndarray) -> None:
    """Key every channel (T, n) of ``owner`` at ``frames``, with straight lines between the keys."""
    action, add = new_action(owner, f"{owner.name} path")
    linear = bpy.types.Keyframe.bl_rna.properties["interpolation"].enum_items["LINEAR"].value
    for path, values in channels.items():
        for index in range(values.shape[1]):
            curve = add(path, index, path)
            curve.keyframe_points.add(len(frames))
            curve.keyframe_points.foreach_set(
                "co", np.stack([frames, values[:, index]], axis=1).ravel()
            )
            curve.keyframe_points.foreach_set("interpolation", np.full(len(frames), linear))
            curve.update()

    assign_action(owner, action)
