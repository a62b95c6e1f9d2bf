"""Where a character stands: its root says so, but users take hold of the body as well."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ..compat import action_curves

__all__ = [
    "Displacement",
    "moved_by_hand",
    "note_standing",
    "pose_by_keys",
    "roots_brought_along",
    "standing",
]

_MOVED = 0.01
"""Metres, and radians, by which something has been moved, and not only rounded."""
_HEADS = {"root": 0.0, "armature": np.pi}
"""Radians from the heading to an object's own: roots look along y, armatures along -y."""


@dataclass(frozen=True)
class Displacement:
    """How the user has moved a character by hand: what was at ``before`` is at ``after`` now; (4,):
    a place in Blender units, and a heading.
    """

    before: np.ndarray
    after: np.ndarray

    def applied(self, pose: np.ndarray) -> np.ndarray:
        """Where a place and heading (4,) are now that were moved along."""
        turn = self.after[3] - self.before[3]
        across = pose[:2] - self.before[:2]
        cos, sin = np.cos(turn), np.sin(turn)
        turned = np.array([cos * across[0] - sin * across[1], sin * across[0] + cos * across[1]])
        rise = pose[2] + self.after[2] - self.before[2]
        return np.array([*(self.after[:2] + turned), rise, pose[3] + turn])


def note_standing(armature: bpy.types.Object) -> None:
    """Note that the armature stands where its root is."""
    armature.dafnet.stood = _pose(armature, "armature")


def standing(
    scene: bpy.types.Scene, armature: bpy.types.Object, root: bpy.types.Object, unit: float
) -> np.ndarray:
    """Where a character stands now, whose root has no keys: place and heading (4,), Blender units.
    The root's, unless only the body was moved by hand. ``unit``: metres of a Blender unit.
    """
    here = _pose(root, "root")
    moved = _of_armature(armature, scene.frame_current_final)
    if moved is not None and not _differ(here, moved.before, unit):
        return moved.after
    return here


@contextmanager
def roots_brought_along(
    scene: bpy.types.Scene, armatures: Iterable[bpy.types.Object], unit: float
) -> Iterator[None]:
    """A block before which roots that nothing moves are moved to where their characters stand
    (``standing``); if it fails, or its job is closed, they are where they were.
    """
    before: dict[str, np.ndarray] = {}
    for armature in armatures:
        root = armature.dafnet.root
        if root is None or root.parent or len(root.constraints) or root.animation_data:
            continue
        here, pose = _pose(root, "root"), standing(scene, armature, root, unit)
        if _differ(pose, here, unit):
            before[root.name_full] = here
            root.location, root.rotation_euler[2] = pose[:3], pose[3]
    try:
        yield
    except BaseException:
        for root in [each for each in scene.objects if each.name_full in before]:
            if not root.animation_data:
                pose = before[root.name_full]
                root.location, root.rotation_euler[2] = pose[:3], pose[3]
        raise


def moved_by_hand(
    scene: bpy.types.Scene, armature: bpy.types.Object, root: bpy.types.Object, unit: float
) -> Displacement | None:
    """How the character was moved in the current frame from where its keys put it, by its root or
    by its body; None where it is there.
    """
    frame = scene.frame_current_final
    of_root = None
    if (keyed := _keyed(root, frame)) is not None:
        of_root = Displacement(keyed, _pose(root, "root"))
    for moved in (of_root, _of_armature(armature, frame)):
        if moved is not None and _differ(moved.before, moved.after, unit):
            return moved
    return None


def pose_by_keys(root: bpy.types.Object, frame: float) -> np.ndarray:
    """Place and heading (4,) of a root by its keys in a frame."""
    keyed = _keyed(root, frame)
    return _pose(root, "root") if keyed is None else keyed


def _of_armature(armature: bpy.types.Object, frame: float) -> Displacement | None:
    now = _pose(armature, "armature")
    keyed = _keyed(armature, frame)
    if keyed is not None:
        return Displacement(keyed - (0.0, 0.0, 0.0, _HEADS["armature"]), now)
    own = armature.dafnet
    if not own.is_property_set("stood"):
        return None
    return Displacement(np.array(own.stood, float), now)


def _differ(first: np.ndarray, second: np.ndarray, unit: float) -> bool:
    turn = np.angle(np.exp(1j * (first[3] - second[3])))
    return float(np.linalg.norm(first[:3] - second[:3])) * unit > _MOVED or abs(turn) > _MOVED


def _pose(owner: bpy.types.Object, role: str) -> np.ndarray:
    """Place and heading (4,) of an object by its own properties."""
    return np.array([*owner.location, owner.rotation_euler[2] - _HEADS[role]], float)


def _keyed(owner: bpy.types.Object, frame: float) -> np.ndarray | None:
    """Place and turn (4,) of an object by its keys in a frame; None where its place has none."""
    curves = {(c.data_path, c.array_index): c for c in action_curves(owner) if not c.mute}
    if not any(path == "location" for path, _ in curves):
        return None
    pose = [*owner.location, owner.rotation_euler[2]]
    for k, channel in enumerate([*(("location", i) for i in range(3)), ("rotation_euler", 2)]):
        if channel in curves:
            pose[k] = curves[channel].evaluate(frame)
    return np.array(pose, float)
