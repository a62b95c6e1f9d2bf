"""The character in Blender: 22 bones named as the joints, a mannequin's body on them, and the empties that direct it.

In the armature's space the character looks along −Y with its left at +X, as Blender's rigs do: the canonical frame (x right,
y forward) turned by half a circle about z. Lengths in the tables are canonical metres.
"""

import bpy
import numpy as np
from mathutils import Vector

from ..core.errors import InputError
from ..core.skeleton import JOINTS, OFFSETS, PARENTS, REST, STATURE, joint

__all__ = ["FACING", "create_character", "character_of", "character_scale", "metres_per_unit", "missing_bones"]

FACING = np.diag([-1.0, -1.0, 1.0])
"""Rotation from the canonical frame to the armature's space; its own inverse."""

_CHAIN = {  # the joint at which each bone's tail lies
    "pelvis": "spine1", "spine1": "spine2", "spine2": "spine3", "spine3": "neck", "neck": "head",
    "left_collar": "left_shoulder", "left_shoulder": "left_elbow", "left_elbow": "left_wrist",
    "left_hip": "left_knee", "left_knee": "left_ankle", "left_ankle": "left_foot",
}
_LEAVES = {"head": (0, 0, 0.16), "left_wrist": (-0.18, 0, 0), "left_foot": (0, 0.07, 0)}

_LIGHT, _DARK = 0, 1
_MATERIALS = (("Mannequin", (0.62, 0.56, 0.50, 1.0)), ("Mannequin Joints", (0.16, 0.15, 0.15, 1.0)))

# Bone, material, axis, and the sections along that axis: place on it, the centre's two other coordinates, the two half widths.
_PARTS = (
    ("pelvis", _LIGHT, "z", (
        (0.835, 0, -0.010, 0.090, 0.080), (0.88, 0, -0.015, 0.150, 0.108), (0.94, 0, -0.015, 0.168, 0.116),
        (1.00, 0, -0.010, 0.155, 0.108), (1.05, 0, -0.005, 0.135, 0.095), (1.075, 0, 0, 0.120, 0.085))),
    ("spine1", _DARK, "z", (
        (1.02, 0, -0.005, 0.120, 0.085), (1.08, 0, -0.002, 0.124, 0.088), (1.14, 0, 0, 0.119, 0.087), (1.19, 0, 0, 0.110, 0.080))),
    ("spine2", _DARK, "z", (
        (1.11, 0, 0, 0.110, 0.080), (1.16, 0, 0, 0.119, 0.088), (1.22, 0, 0, 0.124, 0.094), (1.28, 0, 0, 0.115, 0.085))),
    ("spine3", _LIGHT, "z", (
        (1.185, 0, 0.004, 0.118, 0.090), (1.24, 0, 0.004, 0.136, 0.104), (1.31, 0, 0.006, 0.150, 0.116),
        (1.38, 0, 0, 0.160, 0.116), (1.44, 0, -0.012, 0.142, 0.096), (1.49, 0, -0.024, 0.085, 0.066),
        (1.515, 0, -0.028, 0.055, 0.052))),
    ("neck", _DARK, "z", (
        (1.45, 0, -0.028, 0.052, 0.054), (1.51, 0, -0.020, 0.051, 0.053), (1.57, 0, -0.006, 0.050, 0.052), (1.61, 0, 0, 0.045, 0.045))),
    ("head", _LIGHT, "z", (
        (1.515, 0, 0.058, 0.030, 0.034), (1.54, 0, 0.044, 0.052, 0.062), (1.58, 0, 0.026, 0.066, 0.084),
        (1.63, 0, 0.014, 0.075, 0.097), (1.68, 0, 0.008, 0.077, 0.099), (1.72, 0, 0.006, 0.067, 0.086), (1.75, 0, 0.004, 0.048, 0.062))),
    ("head", _LIGHT, "z", (
        (1.588, 0, 0.108, 0.012, 0.012), (1.604, 0, 0.114, 0.013, 0.016), (1.63, 0, 0.108, 0.009, 0.010), (1.645, 0, 0.104, 0.006, 0.006))),
    ("left_collar", _LIGHT, "x", (
        (-0.195, -0.030, 1.450, 0.046, 0.046), (-0.15, -0.028, 1.452, 0.054, 0.050),
        (-0.09, -0.024, 1.452, 0.064, 0.055), (-0.03, -0.022, 1.455, 0.060, 0.050))),
    ("left_shoulder", _DARK, "x", (
        (-0.240, -0.030, 1.450, 0.054, 0.054), (-0.18, -0.030, 1.450, 0.057, 0.058), (-0.125, -0.030, 1.450, 0.054, 0.054))),
    ("left_shoulder", _LIGHT, "x", (
        (-0.445, -0.030, 1.450, 0.034, 0.034), (-0.40, -0.030, 1.450, 0.039, 0.040), (-0.32, -0.029, 1.450, 0.045, 0.047),
        (-0.25, -0.029, 1.450, 0.049, 0.052), (-0.195, -0.030, 1.450, 0.049, 0.051))),
    ("left_elbow", _DARK, "x", (
        (-0.477, -0.030, 1.450, 0.036, 0.036), (-0.44, -0.030, 1.450, 0.037, 0.037), (-0.403, -0.030, 1.450, 0.036, 0.036))),
    ("left_elbow", _LIGHT, "x", (
        (-0.695, -0.030, 1.450, 0.024, 0.021), (-0.65, -0.030, 1.450, 0.029, 0.024), (-0.58, -0.030, 1.450, 0.037, 0.032),
        (-0.51, -0.030, 1.450, 0.042, 0.039), (-0.45, -0.030, 1.450, 0.036, 0.036))),
    ("left_wrist", _DARK, "x", (
        (-0.718, -0.030, 1.450, 0.025, 0.020), (-0.69, -0.030, 1.450, 0.026, 0.022), (-0.665, -0.030, 1.450, 0.025, 0.020))),
    ("left_wrist", _LIGHT, "x", (
        (-0.875, -0.026, 1.442, 0.026, 0.009), (-0.83, -0.027, 1.444, 0.037, 0.012), (-0.785, -0.028, 1.447, 0.042, 0.015),
        (-0.74, -0.029, 1.449, 0.039, 0.018), (-0.70, -0.030, 1.450, 0.028, 0.019))),
    ("left_wrist", _LIGHT, "x", (
        (-0.800, 0.036, 1.440, 0.011, 0.010), (-0.77, 0.026, 1.442, 0.013, 0.012), (-0.74, 0.010, 1.444, 0.016, 0.014),
        (-0.715, -0.008, 1.446, 0.018, 0.015))),
    ("left_hip", _LIGHT, "z", (
        (0.46, -0.090, 0.002, 0.046, 0.050), (0.52, -0.091, 0.004, 0.054, 0.058), (0.62, -0.094, 0.005, 0.065, 0.072),
        (0.74, -0.098, 0.004, 0.077, 0.084), (0.84, -0.099, 0, 0.082, 0.089), (0.93, -0.098, -0.003, 0.074, 0.082))),
    ("left_knee", _DARK, "z", (
        (0.435, -0.090, 0.004, 0.046, 0.051), (0.49, -0.090, 0.006, 0.049, 0.054), (0.545, -0.090, 0.004, 0.046, 0.051))),
    ("left_knee", _LIGHT, "z", (
        (0.07, -0.090, -0.002, 0.030, 0.033), (0.14, -0.090, -0.004, 0.033, 0.037), (0.24, -0.090, -0.012, 0.042, 0.048),
        (0.34, -0.090, -0.016, 0.051, 0.057), (0.42, -0.090, -0.008, 0.048, 0.053), (0.475, -0.090, 0, 0.044, 0.048))),
    ("left_ankle", _DARK, "z", (
        (0.045, -0.090, -0.004, 0.036, 0.040), (0.085, -0.090, -0.004, 0.037, 0.041), (0.125, -0.090, -0.004, 0.034, 0.038))),
    ("left_ankle", _LIGHT, "y", (
        (-0.078, -0.088, 0.036, 0.030, 0.032), (-0.045, -0.089, 0.040, 0.036, 0.046), (0.01, -0.094, 0.040, 0.039, 0.052),
        (0.07, -0.102, 0.028, 0.044, 0.042), (0.12, -0.108, 0.020, 0.047, 0.031), (0.155, -0.111, 0.018, 0.045, 0.026))),
    ("left_foot", _LIGHT, "y", (
        (0.095, -0.106, 0.018, 0.043, 0.026), (0.13, -0.109, 0.018, 0.047, 0.029), (0.175, -0.110, 0.016, 0.045, 0.025),
        (0.212, -0.107, 0.014, 0.034, 0.019))),
)
_RINGS, _SEGMENTS = 16, 20


def metres_per_unit(scene: bpy.types.Scene) -> float:
    """Length of a Blender unit in metres: the scene's unit scale, or 1 where the scene has no unit system."""
    units = scene.unit_settings
    return 1.0 if units.system == "NONE" else units.scale_length


def missing_bones(armature: bpy.types.Object) -> list[str]:
    """Names of ``JOINTS`` that are no bones of the armature."""
    return [name for name in JOINTS if name not in armature.data.bones]


def character_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The character that the active object is or belongs to: its armature, its body, its root or one of its targets."""
    active = context.object
    if active is None:
        return None
    if active.type == "ARMATURE":
        return None if missing_bones(active) else active
    if active.parent and active.parent.type == "ARMATURE" and not missing_bones(active.parent):
        return active.parent
    for candidate in context.scene.objects:
        own = candidate.dafnet
        if candidate.type == "ARMATURE" and active in (own.root, own.head, own.hand_left, own.hand_right):
            return candidate
    return None


def character_scale(armature: bpy.types.Object, unit: float = 1.0) -> float:
    """Size of the character over the canonical body; ``unit`` is a Blender unit in metres.

    ``InputError``: bones are missing or their proportions were edited, or the object is scaled unevenly.
    """
    if armature.mode == "EDIT":
        raise InputError(f"The armature '{armature.name}' is in edit mode; leave it and try again.")
    if missing := missing_bones(armature):
        raise InputError(f"The armature '{armature.name}' has no bone '{missing[0]}'; use one that Add Character made.")
    heads = np.array([armature.data.bones[name].head_local for name in JOINTS])
    offsets = heads[1:] - heads[list(PARENTS[1:])]
    canonical = OFFSETS[1:] @ FACING
    scale = float((offsets * canonical).sum() / (canonical**2).sum())
    if scale <= 0.0 or np.abs(offsets - scale * canonical).max() > 0.002 * scale:
        raise InputError(f"The bones of '{armature.name}' were moved in edit mode; add a new character and use that one.")
    size = np.array(armature.scale)
    if not np.isfinite(size).all() or size[0] <= 0.0 or np.ptp(size) > 1e-4 * size[0]:
        raise InputError(f"The armature '{armature.name}' is scaled unevenly; set its three scales to the same positive value.")
    return scale * float(size[0]) * unit


def create_character(context: bpy.types.Context, name: str = "Character", height: float = STATURE) -> bpy.types.Object:
    """A character of this height (metres) at the 3D cursor: armature, body, and root, head and hand empties.

    It stands in a T-pose looking along the world's +y, in a new collection of its own. Returns the armature, whose
    ``dafnet`` settings name the empties. ``InputError``: Blender is not in object mode.
    """
    if context.mode != "OBJECT":
        raise InputError("A character can only be added in object mode; leave the current mode first.")
    scale = height / STATURE / metres_per_unit(context.scene)
    collection = bpy.data.collections.new(name)
    context.scene.collection.children.link(collection)
    place = context.scene.cursor.location

    armature = _armature_object(context, collection, name, scale)
    armature.location = place
    armature.rotation_euler = (0.0, 0.0, np.pi)
    _body_object(collection, armature, scale)

    def empty(role: str, point: tuple[float, float, float], size: float) -> bpy.types.Object:
        made = bpy.data.objects.new(f"{name} {role}", None)
        made.empty_display_type = "ARROWS"
        made.empty_display_size = size * scale
        made.location = place + Vector(point) * scale
        collection.objects.link(made)
        return made

    settings = armature.dafnet
    settings.root = empty("Root", (0.0, 0.0, 0.0), 0.4)
    settings.head = empty("Head", tuple(REST[joint("head")]), 0.2)
    settings.hand_left = empty("Left Hand", (-0.22, 0.08, 0.90), 0.15)
    settings.hand_right = empty("Right Hand", (0.22, 0.08, 0.90), 0.15)
    for each in context.view_layer.objects.selected:
        each.select_set(False)
    settings.root.select_set(True)
    armature.select_set(True)
    context.view_layer.objects.active = armature
    return armature


def _mirrored(name: str) -> str:
    return name.replace("left_", "right_")


def _tail(name: str) -> np.ndarray:
    left = name.replace("right_", "left_")
    side = np.array([-1.0 if left != name else 1.0, 1.0, 1.0])
    if left in _LEAVES:
        return REST[joint(name)] + side * _LEAVES[left]
    return REST[joint(_CHAIN[left] if left == name else _mirrored(_CHAIN[left]))]


def _armature_object(
    context: bpy.types.Context, collection: bpy.types.Collection, name: str, scale: float,
) -> bpy.types.Object:
    """Bones from joint to joint. Arms turn about their vertical axis and legs about the lateral one: z up, or z ahead."""
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    collection.objects.link(armature)
    context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for j, joint_name in enumerate(JOINTS):
        bone = armature.data.edit_bones.new(joint_name)
        bone.head = scale * FACING @ REST[j]
        bone.tail = scale * FACING @ _tail(joint_name)
        if PARENTS[j] >= 0:
            bone.parent = armature.data.edit_bones[JOINTS[PARENTS[j]]]
        across = abs(bone.vector.normalized().x) > 0.7
        ahead = abs(bone.vector.normalized().y) > 0.7
        bone.align_roll(Vector((0, 0, 1)) if across or ahead else Vector((0, -1, 0)))
    bpy.ops.object.mode_set(mode="OBJECT")
    for bone in armature.pose.bones:
        bone.rotation_mode = "QUATERNION"
    armature.data.display_type = "STICK"
    armature.show_in_front = True
    return armature


def _catmull_rom(rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Smooth curve through ``rows`` (K, D), taken at places in [0, K - 1]."""
    padded = np.concatenate([2 * rows[:1] - rows[1:2], rows, 2 * rows[-1:] - rows[-2:-1]])
    k = np.minimum(at.astype(int), len(rows) - 2)
    t = (at - k)[:, None]
    a, b, c, d = (padded[k + i] for i in range(4))
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))


def _part(axis: str, sections: tuple[tuple[float, ...], ...]) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Vertices and faces of a tube with round ends through elliptic sections, flat where it would sink into the floor."""
    rows = np.asarray(sections, float)
    u = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, _RINGS + 2)[1:-1])
    rings = _catmull_rom(rows, u * (len(rows) - 1))
    cap = np.array([rows[1, 0] - rows[0, 0], rows[-1, 0] - rows[-2, 0]])
    near = np.minimum((rings[:, 0] - rows[0, 0]) / cap[0], (rows[-1, 0] - rings[:, 0]) / cap[1]).clip(0.0, 1.0)
    rings[:, 3:] *= np.sqrt(1.0 - (1.0 - near) ** 2)[:, None]

    angle = 2.0 * np.pi * np.arange(_SEGMENTS) / _SEGMENTS
    local = np.empty((_RINGS, _SEGMENTS, 3))
    local[..., 0] = rings[:, :1]
    local[..., 1] = rings[:, 1:2] + rings[:, 3:4] * np.cos(angle)
    local[..., 2] = rings[:, 2:3] + rings[:, 4:5] * np.sin(angle)
    poles = rows[[0, -1], :3]
    points = np.concatenate([local.reshape(-1, 3), poles])
    order = {"x": (0, 1, 2), "y": (1, 0, 2), "z": (1, 2, 0)}[axis]
    points = points[:, order]
    points[:, 2] = np.maximum(points[:, 2], 0.0)

    faces: list[tuple[int, ...]] = []
    last = (_RINGS - 1) * _SEGMENTS
    for s in range(_SEGMENTS):
        n = (s + 1) % _SEGMENTS
        for r in range(0, last, _SEGMENTS):
            faces.append((r + s, r + n, r + _SEGMENTS + n, r + _SEGMENTS + s))
        faces.append((_RINGS * _SEGMENTS, n, s))
        faces.append((_RINGS * _SEGMENTS + 1, last + s, last + n))
    if axis == "y":  # its two other axes are exchanged, which turns faces inside out
        faces = [face[::-1] for face in faces]
    return points, faces


def _body_object(collection: bpy.types.Collection, armature: bpy.types.Object, scale: float) -> bpy.types.Object:
    """The mannequin: one mesh, each part bound rigidly to its bone."""
    vertices: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []
    materials: list[int] = []
    groups: dict[str, list[int]] = {}
    count = 0
    for bone, material, axis, sections in _PARTS:
        points, shape = _part(axis, sections)
        for side in ("left", "right") if bone.startswith("left_") else ("middle",):
            if side == "right":
                points, shape, bone = points * (-1.0, 1.0, 1.0), [face[::-1] for face in shape], _mirrored(bone)
            vertices.append(points)
            faces += [tuple(count + v for v in face) for face in shape]
            materials += [material] * len(shape)
            groups.setdefault(bone, []).extend(range(count, count + len(points)))
            count += len(points)

    mesh = bpy.data.meshes.new(f"{armature.name} Body")
    mesh.from_pydata((scale * np.concatenate(vertices) @ FACING).tolist(), [], faces)
    for name, colour in _MATERIALS:
        mesh.materials.append(_material(name, colour))
    mesh.polygons.foreach_set("material_index", materials)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(faces), bool))
    mesh.update()

    body = bpy.data.objects.new(f"{armature.name} Body", mesh)
    collection.objects.link(body)
    body.parent = armature
    for bone, members in groups.items():
        body.vertex_groups.new(name=bone).add(members, 1.0, "REPLACE")
    body.modifiers.new("Armature", "ARMATURE").object = armature
    body.hide_select = True
    return body


def _material(name: str, colour: tuple[float, float, float, float]) -> bpy.types.Material:
    found = bpy.data.materials.get((name, None))
    if found is None:
        found = bpy.data.materials.new(name)
        found.diffuse_color = colour
        found.roughness = 0.6
        if found.node_tree is None:  # always there from 5.0 on
            found.use_nodes = True
        shader = next(node for node in found.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = colour
        shader.inputs["Roughness"].default_value = 0.6
    return found
