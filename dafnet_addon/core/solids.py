"""Furniture as the core sees it: boxes, triangle meshes, and the scene that holds them."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from .errors import InputError

if TYPE_CHECKING:
    from .distance import DistanceGrid

__all__ = ["Box", "Mesh", "Scene", "box_distance"]

_FARTHEST = 1e9  # vertex times matrix; grids of single-precision numbers mean nothing long before


@dataclass(frozen=True)
class Box:
    """A solid box: ``center`` (3,), ``half_size`` (3,), ``rotation`` (3, 3) whose columns are the box's axes; world, metres.

    A moving box has ``center`` (T, 3) and ``rotation`` (T, 3, 3), one for each frame of the controls.
    """

    center: np.ndarray
    half_size: np.ndarray
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    name: str = "box"

    def matrices(self) -> np.ndarray:
        """(4, 4) or (T, 4, 4) rigid frames of the box."""
        center, rotation = np.asarray(self.center, float), np.asarray(self.rotation, float)
        shape = np.broadcast_shapes(center.shape[:-1], rotation.shape[:-2])
        m = np.zeros((*shape, 4, 4))
        m[..., :3, :3], m[..., :3, 3], m[..., 3, 3] = rotation, center, 1.0
        return m


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh: ``vertices`` (V, 3), ``triangles`` (F, 3), ``matrix`` (4, 4) or (T, 4, 4) from its space to the world.

    The mesh may be open, thin, in several parts, mirrored or scaled without uniformity. ``grid`` is its distance field where
    the caller has one already, in the space that ``distance.rigid_split`` describes; else it is built when first needed.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    name: str = "mesh"
    grid: "DistanceGrid | None" = None

    def __post_init__(self) -> None:
        if len(self.triangles) and int(np.max(self.triangles)) >= len(self.vertices):
            raise InputError(f"The mesh '{self.name}' has triangles that name missing vertices; clean it up and try again.")
        if not np.isfinite(self.vertices).all() or not np.isfinite(self.matrix).all():
            raise InputError(f"The mesh '{self.name}' has a coordinate that is not a number; fix its geometry or transform.")
        if len(self.vertices) and float(np.abs(self.vertices).max()) * float(np.abs(self.matrix).max()) > _FARTHEST:
            raise InputError(f"The mesh '{self.name}' reaches out millions of metres; fix its geometry or transform.")


@dataclass(frozen=True)
class Scene:
    """Everything that the character may touch or must avoid. An empty scene is a bare floor."""

    solids: "tuple[Box | Mesh, ...] | list[Box | Mesh]" = ()


def box_distance(points: np.ndarray, half_size: np.ndarray) -> np.ndarray:
    """Exact signed distance (negative inside) of local ``points`` (…, 3) to the box of ``half_size`` (3,) at the origin."""
    q = np.abs(points) - half_size
    outside = np.sqrt((np.maximum(q, 0.0) ** 2).sum(-1))
    return outside + np.minimum(q.max(-1), 0.0)
