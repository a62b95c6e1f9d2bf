"""The mannequin's body: rounded tubes through elliptic sections, each bound rigidly to one bone.

Lengths in the tables are canonical metres, in the canonical frame (x right, y forward, z up); the
left side is written once. In Blender the character looks along −Y with its left at +X, as Blender's
rigs do.
"""

import bpy
import numpy as np

__all__ = ["FACING", "add_body", "body_material"]

FACING = np.diag([-1.0, -1.0, 1.0])
"""Rotation from the canonical frame to the armature's space, half a circle about z; its own
inverse.
"""

_LIGHT = 0
"""Material of limbs and trunk, an index of ``_MATERIALS``."""
_DARK = 1
"""Material of the joints, likewise."""
_MATERIALS = (("Mannequin", (0.62, 0.56, 0.50, 1.0)), ("Mannequin Joints", (0.16, 0.15, 0.15, 1.0)))
_RINGS = 14
"""Rings of vertices along a part."""
_SEGMENTS = 16
"""Vertices of a ring."""
_ANY_BUILD = ("head", "left_wrist", "left_ankle", "left_foot")
"""Parts that have the same thickness for every build."""

# Bone, material, axis, and sections along that axis: the place on it, the centre's two other
# coordinates, half widths.
_PARTS = (
    (
        "pelvis",
        _LIGHT,
        "z",
        (
            (0.85, 0, -0.01, 0.09, 0.08),
            (0.885, 0, -0.015, 0.15, 0.108),
            (0.94, 0, -0.015, 0.168, 0.116),
            (1, 0, -0.01, 0.155, 0.108),
            (1.05, 0, -0.005, 0.135, 0.095),
            (1.075, 0, 0, 0.12, 0.085),
        ),
    ),
    (
        "spine1",
        _DARK,
        "z",
        (
            (1.02, 0, -0.005, 0.12, 0.085),
            (1.08, 0, -0.002, 0.124, 0.088),
            (1.14, 0, 0, 0.119, 0.087),
            (1.19, 0, 0, 0.11, 0.08),
        ),
    ),
    (
        "spine2",
        _DARK,
        "z",
        (
            (1.11, 0, 0, 0.11, 0.08),
            (1.16, 0, 0, 0.119, 0.088),
            (1.22, 0, 0, 0.124, 0.094),
            (1.28, 0, 0, 0.115, 0.085),
        ),
    ),
    (
        "spine3",
        _LIGHT,
        "z",
        (
            (1.185, 0, 0.004, 0.118, 0.09),
            (1.24, 0, 0.004, 0.136, 0.104),
            (1.31, 0, 0.006, 0.15, 0.116),
            (1.38, 0, 0, 0.16, 0.116),
            (1.44, 0, -0.012, 0.142, 0.096),
            (1.49, 0, -0.024, 0.085, 0.066),
            (1.515, 0, -0.028, 0.055, 0.052),
        ),
    ),
    (
        "neck",
        _DARK,
        "z",
        (
            (1.45, 0, -0.028, 0.052, 0.054),
            (1.51, 0, -0.02, 0.051, 0.053),
            (1.57, 0, -0.006, 0.05, 0.052),
            (1.61, 0, 0, 0.045, 0.045),
        ),
    ),
    (
        "head",
        _LIGHT,
        "z",
        (
            (1.515, 0, 0.058, 0.03, 0.034),
            (1.54, 0, 0.044, 0.052, 0.062),
            (1.58, 0, 0.026, 0.066, 0.084),
            (1.63, 0, 0.014, 0.075, 0.097),
            (1.68, 0, 0.008, 0.077, 0.099),
            (1.72, 0, 0.006, 0.067, 0.086),
            (1.75, 0, 0.004, 0.048, 0.062),
        ),
    ),
    (
        "head",
        _LIGHT,
        "z",
        (
            (1.588, 0, 0.108, 0.012, 0.012),
            (1.604, 0, 0.114, 0.013, 0.016),
            (1.63, 0, 0.108, 0.009, 0.01),
            (1.645, 0, 0.104, 0.006, 0.006),
        ),
    ),
    (
        "left_collar",
        _LIGHT,
        "x",
        (
            (-0.195, -0.03, 1.45, 0.046, 0.046),
            (-0.15, -0.028, 1.452, 0.054, 0.05),
            (-0.09, -0.024, 1.452, 0.064, 0.055),
            (-0.03, -0.022, 1.455, 0.06, 0.05),
        ),
    ),
    (
        "left_shoulder",
        _DARK,
        "x",
        (
            (-0.24, -0.03, 1.45, 0.054, 0.054),
            (-0.18, -0.03, 1.45, 0.057, 0.058),
            (-0.125, -0.03, 1.45, 0.054, 0.054),
        ),
    ),
    (
        "left_shoulder",
        _LIGHT,
        "x",
        (
            (-0.445, -0.03, 1.45, 0.034, 0.034),
            (-0.4, -0.03, 1.45, 0.039, 0.04),
            (-0.32, -0.029, 1.45, 0.045, 0.047),
            (-0.25, -0.029, 1.45, 0.049, 0.052),
            (-0.195, -0.03, 1.45, 0.049, 0.051),
        ),
    ),
    (
        "left_elbow",
        _DARK,
        "x",
        (
            (-0.477, -0.03, 1.45, 0.036, 0.036),
            (-0.44, -0.03, 1.45, 0.037, 0.037),
            (-0.403, -0.03, 1.45, 0.036, 0.036),
        ),
    ),
    (
        "left_elbow",
        _LIGHT,
        "x",
        (
            (-0.695, -0.03, 1.45, 0.024, 0.021),
            (-0.65, -0.03, 1.45, 0.029, 0.024),
            (-0.58, -0.03, 1.45, 0.037, 0.032),
            (-0.51, -0.03, 1.45, 0.042, 0.039),
            (-0.45, -0.03, 1.45, 0.036, 0.036),
        ),
    ),
    (
        "left_wrist",
        _DARK,
        "x",
        (
            (-0.718, -0.03, 1.45, 0.025, 0.02),
            (-0.69, -0.03, 1.45, 0.026, 0.022),
            (-0.665, -0.03, 1.45, 0.025, 0.02),
        ),
    ),
    (
        "left_wrist",
        _LIGHT,
        "x",
        (
            (-0.875, -0.026, 1.442, 0.026, 0.009),
            (-0.83, -0.027, 1.444, 0.037, 0.012),
            (-0.785, -0.028, 1.447, 0.042, 0.015),
            (-0.74, -0.029, 1.449, 0.039, 0.018),
            (-0.7, -0.03, 1.45, 0.028, 0.019),
        ),
    ),
    (
        "left_wrist",
        _LIGHT,
        "x",
        (
            (-0.8, 0.036, 1.44, 0.011, 0.01),
            (-0.77, 0.026, 1.442, 0.013, 0.012),
            (-0.74, 0.01, 1.444, 0.016, 0.014),
            (-0.715, -0.008, 1.446, 0.018, 0.015),
        ),
    ),
    (
        "left_hip",
        _LIGHT,
        "z",
        (
            (0.46, -0.09, 0.002, 0.046, 0.05),
            (0.52, -0.091, 0.006, 0.054, 0.056),
            (0.62, -0.094, 0.01, 0.065, 0.066),
            (0.74, -0.098, 0.014, 0.077, 0.072),
            (0.84, -0.099, 0.018, 0.082, 0.073),
            (0.93, -0.098, 0.012, 0.074, 0.068),
        ),
    ),
    (
        "left_knee",
        _DARK,
        "z",
        (
            (0.435, -0.09, 0.004, 0.046, 0.051),
            (0.49, -0.09, 0.006, 0.049, 0.054),
            (0.545, -0.09, 0.004, 0.046, 0.051),
        ),
    ),
    (
        "left_knee",
        _LIGHT,
        "z",
        (
            (0.07, -0.09, -0.002, 0.03, 0.033),
            (0.14, -0.09, -0.004, 0.033, 0.037),
            (0.24, -0.09, -0.012, 0.042, 0.048),
            (0.34, -0.09, -0.016, 0.051, 0.057),
            (0.42, -0.09, -0.008, 0.048, 0.053),
            (0.475, -0.09, 0, 0.044, 0.048),
        ),
    ),
    (
        "left_ankle",
        _DARK,
        "z",
        (
            (0.045, -0.09, -0.004, 0.036, 0.04),
            (0.085, -0.09, -0.004, 0.037, 0.041),
            (0.125, -0.09, -0.004, 0.034, 0.038),
        ),
    ),
    (
        "left_ankle",
        _LIGHT,
        "y",
        (
            (-0.078, -0.088, 0.036, 0.03, 0.032),
            (-0.045, -0.089, 0.04, 0.036, 0.046),
            (0.01, -0.094, 0.04, 0.039, 0.052),
            (0.07, -0.102, 0.028, 0.044, 0.042),
            (0.12, -0.108, 0.02, 0.047, 0.031),
            (0.155, -0.111, 0.018, 0.045, 0.026),
        ),
    ),
    (
        "left_foot",
        _LIGHT,
        "y",
        (
            (0.095, -0.106, 0.018, 0.043, 0.026),
            (0.13, -0.109, 0.018, 0.047, 0.029),
            (0.175, -0.11, 0.016, 0.045, 0.025),
            (0.212, -0.107, 0.014, 0.034, 0.019),
        ),
    ),
)


def _catmull_rom(rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Smooth curve through ``rows`` (K, D), taken at places in [0, K - 1]."""
    padded = np.concatenate([2 * rows[:1] - rows[1:2], rows, 2 * rows[-1:] - rows[-2:-1]])
    k = np.minimum(at.astype(int), len(rows) - 2)
    t = (at - k)[:, None]
    a, b, c, d = (padded[k + i] for i in range(4))  # the curve runs from b to c
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))


def _part(
    axis: str, sections: tuple[tuple[float, ...], ...], build: float
) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Vertices and faces of a tube with round ends through elliptic sections, ``build`` times as
    thick; a sole is flat on the floor.
    """
    rows = np.asarray(sections, float) * (1.0, 1.0, 1.0, build, build)
    along = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, _RINGS + 2)[1:-1])
    rings = _catmull_rom(rows, along * (len(rows) - 1))
    cap = np.array([rows[1, 0] - rows[0, 0], rows[-1, 0] - rows[-2, 0]])
    near = np.minimum(
        (rings[:, 0] - rows[0, 0]) / cap[0], (rows[-1, 0] - rings[:, 0]) / cap[1]
    ).clip(0.0, 1.0)
    rings[:, 3:] *= np.sqrt(1.0 - (1.0 - near) ** 2)[:, None]

    angle = 2.0 * np.pi * np.arange(_SEGMENTS) / _SEGMENTS
    local = np.empty((_RINGS, _SEGMENTS, 3))
    local[..., 0] = rings[:, :1]
    local[..., 1] = rings[:, 1:2] + rings[:, 3:4] * np.cos(angle)
    local[..., 2] = rings[:, 2:3] + rings[:, 4:5] * np.sin(angle)
    poles = rows[[0, -1], :3]

    order = {"x": (0, 1, 2), "y": (1, 0, 2), "z": (1, 2, 0)}[axis]
    points = np.concatenate([local.reshape(-1, 3), poles])[:, order]
    points[:, 2] = np.maximum(points[:, 2], 0.0)

    faces = _tube_faces()
    if axis == "y":  # its two other axes are exchanged, which turns faces inside out
        faces = [face[::-1] for face in faces]

    return points, faces


def _tube_faces() -> list[tuple[int, ...]]:
    """Faces between the rings' vertices, and from the first and the last ring to its pole: the two
    vertices after the rings'.
    """
    faces: list[tuple[int, ...]] = []
    first_pole, last_pole = _RINGS * _SEGMENTS, _RINGS * _SEGMENTS + 1
    last_ring = (_RINGS - 1) * _SEGMENTS
    for side in range(_SEGMENTS):
        following = (side + 1) % _SEGMENTS
        for ring in range(0, last_ring, _SEGMENTS):
            above = ring + _SEGMENTS
            faces.append((ring + side, ring + following, above + following, above + side))

        faces.append((first_pole, following, side))
        faces.append((last_pole, last_ring + side, last_ring + following))

    return faces


def add_body(
    collection: bpy.types.Collection, armature: bpy.types.Object, scale: float, build: float = 1.0
) -> bpy.types.Object:
    """The mannequin: one mesh, each part bound rigidly to its bone; trunk and limbs ``build`` times
    as thick.
    """
    vertices: list[np.ndarray] = []
    faces: list[tuple[int, ...]] = []
    materials: list[int] = []
    groups: dict[str, list[int]] = {}
    count = 0
    for bone, material, axis, sections in _PARTS:
        points, shape = _part(axis, sections, 1.0 if bone in _ANY_BUILD else build)
        for side in ("left", "right") if bone.startswith("left_") else ("middle",):
            if side == "right":
                points, shape = points * (-1.0, 1.0, 1.0), [face[::-1] for face in shape]
                bone = bone.replace("left_", "right_")
            vertices.append(points)
            faces += [tuple(count + v for v in face) for face in shape]
            materials += [material] * len(shape)
            groups.setdefault(bone, []).extend(range(count, count + len(points)))
            count += len(points)

    mesh = bpy.data.meshes.new(f"{armature.name} Body")
    mesh.from_pydata((scale * np.concatenate(vertices) @ FACING).tolist(), [], faces)
    for name, colour in _MATERIALS:
        mesh.materials.append(body_material(name, colour))

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


def body_material(name: str, colour: tuple[float, float, float, float]) -> bpy.types.Material:
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
