"""The scene's cameras: where places of the world are in their pictures, and whether they are seen
there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ...core.coco import ESTIMATED
from ...core.skeleton import JOINTS

__all__ = [
    "DEPTHS",
    "HIDDEN",
    "OUTSIDE",
    "SEEN",
    "Sights",
    "View",
    "cameras_of",
    "picture_size",
    "view_of",
]

OUTSIDE, HIDDEN, SEEN = 0, 1, 2
"""Whether a place is in a picture, and seen there, as COCO numbers it."""

_THICK = {
    "pelvis": 0.17,
    "spine1": 0.15,
    "spine2": 0.15,
    "spine3": 0.15,
    "neck": 0.10,
    "head": 0.14,
    "collar": 0.11,
    "shoulder": 0.11,
    "elbow": 0.08,
    "wrist": 0.07,
    "hip": 0.17,
    "knee": 0.10,
    "ankle": 0.09,
    "foot": 0.08,
}
"""Metres of one's own body, at the canonical size, that may lie before a joint that counts as seen:
joints are inside.
"""
_OF_THE_FACE = 0.05
"""The same of nose, eyes and ears, which are on the skin, about."""
_BESIDE = 1e-4
"""Of a Blender unit: how far behind what is looked through the look goes on."""
_TRIES = 16
"""How many things that no render shows a look goes through."""

DEPTHS = np.array(
    [*(_THICK[name.split("_")[-1]] for name in JOINTS), *(_OF_THE_FACE for _ in ESTIMATED)]
)
"""Those of the 22 joints, then those of the face."""


@dataclass(frozen=True)
class View:
    """What a camera sees in one frame, in pictures of ``size`` (width, height) pixels.

    ``to_camera`` (4, 4): from the world to the camera (x right, y down, z ahead), Blender units.
    ``projection`` (4, 4): from there to the picture, whose middle is 0 and whose sides are at -1
    and 1, y up. ``eye`` (3,): where it looks from, None where it looks in parallel; ``ahead`` (3,):
    where to.
    """

    size: tuple[int, int]
    to_camera: np.ndarray
    projection: np.ndarray
    eye: np.ndarray | None
    ahead: np.ndarray

    def intrinsics(self) -> np.ndarray:
        """(3, 3): from the camera's space to homogeneous pixels; NaN where it looks in parallel."""
        if self.eye is None:
            return np.full((3, 3), np.nan)
        (width, height), p = self.size, self.projection
        return np.array(
            [
                [p[0, 0] * width / 2, 0.0, width / 2 * (1.0 - p[0, 2])],
                [0.0, p[1, 1] * height / 2, height / 2 * (1.0 + p[1, 2])],
                [0.0, 0.0, 1.0],
            ]
        )

    def pixels(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where points (N, 3) of the world, Blender units, are in the picture: pixels (N, 2) from
        its upper left corner, x right, y down, NaN behind the camera; and whether within it (N,).
        """
        there = points @ self.to_camera[:3, :3].T + self.to_camera[:3, 3]
        blenders = np.column_stack([there * (1.0, -1.0, -1.0), np.ones(len(there))])
        flat = blenders @ self.projection.T
        before = there[:, 2] > 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            on_picture = flat[:, :2] / flat[:, 3:]
        found = (on_picture * (0.5, -0.5) + 0.5) * self.size
        found[~before] = np.nan
        inside = before & ((found >= 0.0) & (found < self.size)).all(axis=1)
        return found, inside


def cameras_of(scene: bpy.types.Scene) -> tuple[list[bpy.types.Object], tuple[str, ...]]:
    """The scene's cameras by their names, and sentences about those that cannot be used."""
    found = sorted((o for o in scene.objects if o.type == "CAMERA"), key=lambda o: o.name)
    flat = [o for o in found if o.data.type != "PANO"]
    return flat, tuple(
        f"The camera '{o.name}' is panoramic, so nothing is said about its pictures; use one in "
        "perspective."
        for o in found
        if o not in flat
    )


def picture_size(scene: bpy.types.Scene) -> tuple[int, int]:
    """Width and height of the scene's pictures, pixels."""
    render = scene.render
    share = render.resolution_percentage / 100.0
    return max(1, int(render.resolution_x * share)), max(1, int(render.resolution_y * share))


def view_of(
    camera: bpy.types.Object, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph
) -> View:
    """What a camera sees in the frame that the scene shows."""
    evaluated, size, render = camera.evaluated_get(depsgraph), picture_size(scene), scene.render
    place = evaluated.matrix_world.normalized()
    projection = evaluated.calc_matrix_camera(
        depsgraph,
        x=size[0],
        y=size[1],
        scale_x=render.pixel_aspect_x,
        scale_y=render.pixel_aspect_y,
    )
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    return View(
        size=size,
        to_camera=flip @ np.array(place.inverted(), float),
        projection=np.array(projection, float),
        eye=None if camera.data.type == "ORTHO" else np.array(place.translation, float),
        ahead=-np.array(place.col[2][:3], float),
    )


class Sights:
    """Looks into a scene: whether rays from a camera to places of people meet something before.

    ``owners``: whose each object is; those of nobody are the scene's. What no render shows does not
    hide anything.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        owners: Mapping[bpy.types.Object, int],
        unseen: set[bpy.types.Object],
    ) -> None:
        self._scene = scene
        self._owners = owners
        self._unseen = unseen

    def look(
        self,
        depsgraph: bpy.types.Depsgraph,
        view: View,
        points: np.ndarray,
        owner: int,
        depths: Sequence[float] | np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (N, 2) of points (N, 3) of the body of ``owner``, and whether each is ``OUTSIDE``
        the picture, ``HIDDEN`` or ``SEEN`` (N,). ``depths`` (N,): how much of the own body may lie
        before each; Blender units.
        """
        pixels, inside = view.pixels(points)
        seen = np.where(inside, HIDDEN, OUTSIDE).astype(np.uint8)
        for k in np.flatnonzero(inside):
            if self._is_seen(depsgraph, view, points[k], owner, float(depths[k])):
                seen[k] = SEEN
        return pixels, seen

    def _is_seen(
        self,
        depsgraph: bpy.types.Depsgraph,
        view: View,
        point: np.ndarray,
        owner: int,
        depth: float,
    ) -> bool:
        eye = view.eye
        if eye is None:
            there = view.to_camera[:3, :3] @ point + view.to_camera[:3, 3]
            eye = point - there[2] * view.ahead
        origin, end = Vector(eye), Vector(point)
        way = (end - origin).normalized()
        for _ in range(_TRIES):
            left = (end - origin).length
            hit, place, _, _, met, _ = self._scene.ray_cast(depsgraph, origin, way, distance=left)
            if not hit:
                return True
            if met.original not in self._unseen:
                own = self._owners.get(met.original) == owner
                return bool((end - place).length < (depth if own else _BESIDE))
            origin = place + _BESIDE * way
        return True
