"""The upper or the lower body that mode FULL copies: from another character, from any mapped rig,
or from a take.
"""

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.root import (
    POSITION_SIGMA,
    YAW_SIGMA,
    root_from_joints,
    root_from_matrices,
    smoothed,
    to_root,
    to_world,
)
from ...core.rotations import normalised
from ...core.series import MODEL_FPS
from ...core.skeleton import JOINTS, LOWER, OFFSETS, PARENTS, PELVIS, UPPER
from ..character.armature import is_character
from ..character.mannequin import FACING
from ..character.settings import Settings
from ..character.takes import stored_take
from ..rig.maps import RigMap, require_usable
from ..rig.properties import map_of
from ..rig.reading import joints_of, pose_matrices
from .lookup import find_action, find_object

__all__ = [
    "PARTS",
    "Source",
    "rigid_matrices",
    "source_of",
    "upper_body_of_take",
]

_LIMB_TOLERANCE = 8.0
"""Degrees in the mean that limbs of a copied upper body may be off before the user is warned."""


PARTS: dict[str, tuple[int, ...]] = {"upper_body": tuple(UPPER), "lower_body": tuple(LOWER)}
"""The joints that can be copied."""


class Source:
    """An armature of which FULL copies a part, one of ``PARTS``, and what is seen of it frame by
    frame.

    ``seen``: the frames of the scene in which it has to be seen. ``rig_map``: which of its bones
    are which joints, if it is not one of our characters.
    """

    def __init__(
        self,
        settings: Settings,
        part: str,
        armature: bpy.types.Object,
        *,
        rig_map: RigMap | None,
        frames: range,
    ) -> None:
        self.armature = armature
        self.part = part
        self.what = f"{part.replace('_', ' ')}'s source '{armature.name}'"
        self.rig_map = rig_map
        self.seen, self._at = _frames_of_source(settings, self, frames)
        self._places = [rig_map.place(name) if rig_map else name for name in JOINTS]
        self._bodies: list[np.ndarray] = []
        self._bones: list[np.ndarray] = []

    def add(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Note how it is in the frame that the scene shows now."""
        evaluated = self.armature.evaluated_get(depsgraph)
        self._bodies.append(np.array(evaluated.matrix_world, float))
        self._bones.append(pose_matrices(evaluated, self._places))

    def joints(
        self, *, unit: float, root: np.ndarray, size: float, fps: float
    ) -> tuple[np.ndarray, str]:
        """The part's joints (T, J, 3), world metres, on the character's ``root`` (T, 4, 4) and of
        its ``size``; and in words which limbs are off by how much, empty where none is.
        """
        return _joints_of_source(
            self,
            bones=np.array(self._bones),
            bodies=np.array(self._bodies),
            at=self._at,
            unit=unit,
            root=root,
            size=size,
            fps=fps,
        )


def source_of(
    settings: Settings, part: str, armature: bpy.types.Object, frames: range
) -> Source | None:
    """The source of one of ``PARTS``; None where none is set."""
    name = getattr(settings, f"{part}_source")
    if name is None:
        return None

    what = f"{part.replace('_', ' ')}'s source"
    source = find_object(settings, name, what)
    if source.type != "ARMATURE" or source == armature:
        raise InputError(f"'{source.name}' cannot be the {what}; choose another armature.")
    if is_character(source):
        return Source(settings, part, source, rig_map=None, frames=frames)

    rig_map = map_of(source)
    require_usable(source, rig_map)
    return Source(settings, part, source, rig_map=rig_map, frames=frames)


def _frames_of_source(
    settings: Settings, source: Source, frames: range
) -> tuple[range, np.ndarray]:
    """The frames of the scene in which the source has to be seen, and which of them is copied at
    each frame (T,) of the shot, by its offset and loop.

    ``InputError``: it is to loop, and plays no action of two frames or more.
    """
    wanted = np.array(frames) - settings.source_offset
    if settings.source_loops:
        data = source.armature.animation_data
        action = data.action if data else None
        first, last = (round(frame) for frame in action.frame_range) if action else (0, 0)
        if last <= first:
            raise InputError(
                f"The {source.what} plays no action that could loop; give it one, or switch Loop "
                "off."
            )
        wanted = first + (wanted - first) % (last - first)

    span = range(int(wanted.min()), int(wanted.max()) + 1)
    return span, wanted - span[0]


def upper_body_of_take(
    settings: Settings, *, full: np.ndarray, root: np.ndarray, size: float, fps: float
) -> np.ndarray:
    """Upper body (T, 14, 3) of the chosen take, frame by frame of the scene, on this character's
    root and of its ``size``.

    ``InputError``: it is of another frame rate, or does not cover the frames that are ``full``
    (T,).
    """
    action = find_action(settings.upper_body_take or "")
    take, _ = stored_take(action)
    if abs(take.fps - fps) > 1e-3:
        raise InputError(
            f"The take '{action.name}' has {take.fps:g} frames per second, the scene {fps:g}; "
            "generate it again."
        )

    at = np.arange(len(full)) + settings.frame_start - action.dafnet.frame_start
    if ((at < 0) | (at >= len(take)))[full].any():
        raise InputError(
            f"The take '{action.name}' does not cover all frames whose mode is FULL; choose a "
            "longer take."
        )

    at = np.clip(at, 0, len(take) - 1)
    path, _ = root_from_matrices(take.root[at])
    local = size / take.scale * to_root(path, take.joints[at][:, list(UPPER)])
    return _on_own_root(root, fps, local)


def _joints_of_source(
    source: Source,
    *,
    bones: np.ndarray,
    bodies: np.ndarray,
    at: np.ndarray,
    unit: float,
    root: np.ndarray,
    size: float,
    fps: float,
) -> tuple[np.ndarray, str]:
    """``Source.joints``. ``bones`` (N, 22, 4, 4): the source's bones in its own space; ``bodies``
    (N, 4, 4): its object's matrices; both in Blender units, in the frames in which it was seen;
    ``at`` (T,): which of them are copied.
    """
    armature, rig_map, what = source.armature, source.rig_map, source.what
    there = np.array([rig_map is None or rig_map.place(name) is not None for name in JOINTS])
    if not np.isfinite(bones[:, there]).all() or not np.isfinite(bodies).all():
        raise InputError(
            f"The {what} has a transform that is not a number; clear its transform or fix what "
            "drives it."
        )

    off: dict[str, float] = {}
    if rig_map is None:
        joints = unit * (bodies[:, None] @ bones)[..., :3, 3]
    else:
        joints, off = joints_of(armature, rig_map, bodies=bodies, poses=bones, size=size / unit)
        joints = unit * joints

    if rig_map is None and armature.dafnet.root:
        frames = rigid_matrices(bodies, unit, what)
        frames[:, :3, :3] = frames[:, :3, :3] @ FACING
        path, _ = root_from_matrices(frames)
    else:
        path = root_from_joints(joints, floor=float(unit * bodies[0, 2, 3]), fps=fps)

    offsets = joints[:, 1:] - joints[:, list(PARENTS[1:])]
    part = PARTS[source.part]
    bones_of = [j - 1 for j in part if j != PELVIS]
    lengths = np.linalg.norm(offsets[:, bones_of], axis=-1).mean(axis=0).sum()
    ratio = size * np.linalg.norm(OFFSETS[1:][bones_of], axis=-1).sum() / lengths
    far = ", ".join(
        f"the {limb} by {degrees:.0f} degrees"
        for limb, degrees in off.items()
        if degrees > _LIMB_TOLERANCE
    )
    local = ratio * to_root(path, joints[:, list(part)])
    return _on_own_root(root, fps, local[at]), f"{far} off" if far else ""


def _on_own_root(root: np.ndarray, fps: float, local: np.ndarray) -> np.ndarray:
    """Points (T, N, 3), ``local`` to another root, in the world as if that were this character's
    ``root`` (T, 4, 4).
    """
    return to_world(
        smoothed(
            root_from_matrices(root)[0],
            POSITION_SIGMA * fps / MODEL_FPS,
            YAW_SIGMA * fps / MODEL_FPS,
        ),
        local,
    )


def rigid_matrices(matrices: np.ndarray, unit: float, what: str) -> np.ndarray:
    """Matrices (T, 4, 4) in metres, without scale and shear: the y axis stays as it is, z and then
    x are made orthogonal to it.
    """
    if not np.isfinite(matrices).all():
        raise InputError(
            f"The {what} has a transform that is not a number; clear its transform or fix what "
            "drives it."
        )

    length = np.linalg.norm(matrices[:, :3, :3], axis=1, keepdims=True)
    if (length < 1e-9).any():
        raise InputError(f"The {what} is scaled to zero; give it a scale.")

    out = matrices.copy()
    out[:, :3, :3] /= length
    y, z = out[:, :3, 1], out[:, :3, 2]
    out[:, :3, 2] = normalised(z - (y * z).sum(axis=1, keepdims=True) * y)
    out[:, :3, 0] = np.cross(out[:, :3, 1], out[:, :3, 2])
    out[:, :3, 3] *= unit
    return out
