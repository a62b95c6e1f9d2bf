"""Furniture as the core sees it: boxes, triangle meshes, and the scene that holds them.

Each checks what it is made of (``InputError``), takes lists for arrays, and holds arrays from then
on.
"""

from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from .checks import FARTHEST, array, corners, inside, number, rotations, shaped
from .errors import InputError
from .grid import DistanceGrid
from .text import printable

__all__ = ["BOX_CORNERS", "BOX_TRIANGLES", "SOFTEST", "Box", "Mesh", "Scene", "box_distance"]

BOX_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""(8, 3) of a box whose half sizes are 1."""
BOX_TRIANGLES = np.array(
    [
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
        (1, 5, 7),
        (1, 7, 3),
    ]
)
"""(12, 3): the numbers of the corners, seen from outside counter-clockwise."""
SOFTEST = 0.3
"""Metres by which furniture gives way at most."""

_UNTRUE = 1e-3  # of an affine matrix: how far its last row may be from 0 0 0 1


def _checked_softness(softness: float | None, whose: str) -> float | None:
    if softness is None:
        return None
    return number(softness, f"The softness of {whose}", 0.0, SOFTEST, "metres")


@dataclass(frozen=True)
class Box:
    """A solid box: ``center`` (3,), ``half_size`` (3,), ``rotation`` (3, 3) whose columns are the
    box's axes; world, metres.

    A moving box has ``center`` (T, 3) and ``rotation`` (T, 3, 3), one for each frame of the
    controls. ``softness``: metres by which it carries a pelvis lower than a hard and level top,
    None where its name and shape are to tell (``softness.guessed``).
    """

    center: np.ndarray
    half_size: np.ndarray
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    name: str = "box"
    softness: float | None = None

    def __post_init__(self) -> None:
        hold = partial(object.__setattr__, self)
        hold("name", printable(self.name))
        hold("softness", _checked_softness(self.softness, f"the box '{self.name}'"))
        whose = f"of the box '{self.name}'"
        center = shaped(self.center, f"The center {whose}", (3,), (-1, 3))
        half_size = shaped(self.half_size, f"The half_size {whose}", (3,))
        rotation = shaped(self.rotation, f"The rotation {whose}", (3, 3), (-1, 3, 3))
        hold("center", inside(center, f"The center {whose}", FARTHEST))
        hold("half_size", inside(half_size, f"The half_size {whose}", FARTHEST))
        hold(
            "rotation",
            rotations(inside(rotation, f"The rotation {whose}", FARTHEST), f"The rotation {whose}"),
        )
        if (half_size < 0).any():
            raise InputError(
                f"The half_size {whose} is negative; give half its length, width and height in "
                "metres."
            )

        frames = [
            len(center) if center.ndim == 2 else 1,
            len(rotation) if rotation.ndim == 3 else 1,
        ]
        if 0 in frames or len({*frames} - {1}) > 1:
            raise InputError(
                f"The center and rotation {whose} have {frames[0]} and {frames[1]} frames; give "
                "one of each, or one a frame."
            )

    def matrices(self) -> np.ndarray:
        """(4, 4) or (T, 4, 4) rigid frames of the box."""
        center, rotation = np.asarray(self.center, float), np.asarray(self.rotation, float)
        shape = np.broadcast_shapes(center.shape[:-1], rotation.shape[:-2])
        m = np.zeros((*shape, 4, 4))
        m[..., :3, :3], m[..., :3, 3], m[..., 3, 3] = rotation, center, 1.0
        return m


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh: ``vertices`` (V, 3), ``triangles`` (F, 3), ``matrix`` (4, 4) or (T, 4, 4)
    from its space to the world.

    The mesh may be open, thin, in several parts, mirrored or scaled without uniformity. ``grid`` is
    its distance field where the caller has one already, in the space that ``distance.rigid_split``
    describes; else it is built when first needed. ``softness``: as a box's.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    name: str = "mesh"
    grid: DistanceGrid | None = None
    softness: float | None = None

    def __post_init__(self) -> None:
        hold = partial(object.__setattr__, self)
        hold("name", printable(self.name))
        hold("softness", _checked_softness(self.softness, f"the mesh '{self.name}'"))
        whose = f"of the mesh '{self.name}'"
        vertices = array(self.vertices, f"The vertices {whose}")
        vertices = (
            vertices.reshape(0, 3)
            if vertices.size == 0
            else shaped(vertices, f"The vertices {whose}", (-1, 3))
        )
        matrix = shaped(self.matrix, f"The matrix {whose}", (4, 4), (-1, 4, 4))
        if 0 in matrix.shape:
            raise InputError(f"The matrix {whose} has no frames; give one matrix, or one a frame.")

        if not np.isfinite(vertices).all() or not np.isfinite(matrix).all():
            part = "vertices" if not np.isfinite(vertices).all() else "matrix"
            raise InputError(
                f"The {part} {whose} have a coordinate that is not a number; fix its geometry or "
                "transform."
            )

        if np.abs(matrix[..., 3, :] - (0.0, 0.0, 0.0, 1.0)).max() > _UNTRUE:
            raise InputError(
                f"The matrix {whose} is of no scale, rotation and place; its last row has to be 0 "
                "0 0 1."
            )

        far = float(np.abs(vertices).max(initial=0.0)), float(np.abs(matrix[..., :3, :3]).max())
        if max(*far, far[0] * far[1], float(np.abs(matrix[..., :3, 3]).max())) > FARTHEST:
            raise InputError(
                f"The mesh '{self.name}' reaches out millions of metres; fix its vertices or its "
                "matrix."
            )

        hold("vertices", vertices)
        hold("triangles", corners(self.triangles, f"The triangles {whose}", len(vertices)))
        hold("matrix", matrix)

    @cached_property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the highest corner (3,) of the vertices, in the mesh's own space."""
        # by columns, which takes a fraction of the time
        columns = [np.ascontiguousarray(self.vertices[:, axis], float) for axis in range(3)]
        return np.array([x.min() for x in columns]), np.array([x.max() for x in columns])


@dataclass(frozen=True)
class Scene:
    """Everything that the character may touch or must avoid. An empty scene is a bare floor."""

    solids: "tuple[Box | Mesh, ...] | list[Box | Mesh]" = ()

    def __post_init__(self) -> None:
        if not isinstance(self.solids, tuple | list) or not all(
            isinstance(each, Box | Mesh) for each in self.solids
        ):
            raise InputError(
                "The solids of a scene are something other than boxes and meshes; give a list of "
                "Box and Mesh."
            )
        object.__setattr__(self, "solids", tuple(self.solids))


def box_distance(points: np.ndarray, half_size: np.ndarray) -> np.ndarray:
    """Exact signed distance (negative inside) of local ``points`` (…, 3) to the box of
    ``half_size`` (3,) at the origin.
    """
    q = np.abs(points) - half_size
    outside = np.sqrt((np.maximum(q, 0.0) ** 2).sum(-1))
    return outside + np.minimum(q.max(-1), 0.0)
