"""Reads armatures as bodies and motions: from the pose matrices of a mapped rig, or of our own
character, to joints and frames.
"""

from dataclasses import dataclass

import bpy
import numpy as np

from ...core.body import Body, canonical_body
from ...core.errors import InputError
from ...core.limb_errors import limb_errors
from ...core.retargeting import Motion, retarget
from ...core.rotations import normalised, rotate, rotation_between, transpose
from ...core.skeleton import ANKLES, COLLARS, HEAD, HIPS, JOINTS, PARENTS, PELVIS, SHOULDERS
from ...core.t_pose import lay_in_t_pose
from ..character.mannequin import FACING
from .maps import RigMap

__all__ = [
    "Shape",
    "character_motion",
    "joints_of",
    "motion_of",
    "pose_matrices",
    "rest_matrices",
    "rigid_parts",
    "shape_of",
]

_SNAP = np.cos(np.radians(20.0))


@dataclass(frozen=True)
class Shape:
    """A rig at rest.

    ``axes`` (3, 3): columns are the canonical frame's axes in the armature's space. ``rest`` (22,
    4, 4): matrices of the joints' bones in that space, NaN where it has none. ``body``: the rig's
    body, in world lengths.
    """

    axes: np.ndarray
    rest: np.ndarray
    body: Body


def pose_matrices(evaluated: bpy.types.Object, bones: list[str | None]) -> np.ndarray:
    """Pose matrices (N, 4, 4) of bones, in the armature's space; NaN for None."""
    # all at once, which takes a tenth of the time of one after another
    pose = evaluated.pose.bones
    columns = np.empty(16 * len(pose), np.float32)
    pose.foreach_get("matrix", columns)
    place = {name: k for k, name in enumerate(pose.keys())}
    matrices = np.full((len(bones), 4, 4), np.nan)
    found = [k for k, name in enumerate(bones) if name is not None]
    of_bones = columns.reshape(-1, 4, 4).swapaxes(1, 2)
    matrices[found] = of_bones[[place[name] for name in bones if name is not None]]
    return matrices


def rest_matrices(armature: bpy.types.Object, bones: list[str | None]) -> np.ndarray:
    """Matrices (N, 4, 4) of bones at rest, in the armature's space; NaN for None."""
    rest = armature.data.bones
    return np.array(
        [
            np.full((4, 4), np.nan) if name is None else np.array(rest[name].matrix_local, float)
            for name in bones
        ]
    )


def rigid_parts(matrices: np.ndarray, what: str) -> tuple[np.ndarray, float]:
    """Rotations (T, 3, 3) of an object's matrices (T, 4, 4), and its one scale.

    ``InputError``: it is mirrored, or scaled unevenly or over time.
    """
    lengths = np.linalg.norm(matrices[:, :3, :3], axis=1)
    if not np.isfinite(matrices).all():
        raise InputError(
            f"The {what} has a transform that is not a number; clear its transform or fix what "
            "drives it."
        )

    scale = float(lengths[0].mean())
    if (
        scale < 1e-9
        or np.abs(lengths - scale).max() > 1e-3 * scale
        or (np.linalg.det(matrices[:, :3, :3]) < 0).any()
    ):
        raise InputError(
            f"The {what} is scaled unevenly or over time; give it the same positive scale on all "
            "three axes throughout."
        )

    return matrices[:, :3, :3] / lengths[:, None], scale


def shape_of(armature: bpy.types.Object, rig_map: RigMap, rest: np.ndarray, scale: float) -> Shape:
    """The rig's shape, from the matrices (22, 4, 4) of its joints' bones at rest; ``scale``: that
    of the object in the world.
    """
    heads = rest[:, :3, 3]
    axes = _axes(heads)
    present = np.array([rig_map.joints.get(name) is not None for name in JOINTS])
    bones = [
        armature.data.bones.get(rig_map.place(name) or "") for name in ("left_wrist", "right_wrist")
    ]
    return Shape(
        axes,
        rest,
        lay_in_t_pose(
            scale * heads @ axes, present, np.array([_hand(bone) @ axes for bone in bones])
        ),
    )


def _hand(hand: bpy.types.Bone | None) -> np.ndarray:
    """Where the fingers point, and the way across them to the thumb's side (2, 3), armature's
    space; NaN where unknown.
    """
    found = np.full((2, 3), np.nan)
    if hand is None:
        return found

    tips = {tip.name.lower(): np.array(tip.head_local - hand.head_local) for tip in hand.children}
    tips = {
        name: tip
        for name, tip in tips.items()
        if "thumb" not in name and np.linalg.norm(tip) > 0.1 * hand.length
    }
    if tips:
        found[0] = np.mean(list(tips.values()), axis=0)

    index, little = (
        next((tip for name, tip in tips.items() if word in name), None)
        for word in ("index", "pinky")
    )
    if index is not None and little is not None:
        found[1] = index - little

    return found


def _axes(heads: np.ndarray) -> np.ndarray:
    """Columns right, forward, up of a body by its joints at rest (22, 3).

    Up is the armature's own axis nearest to the way from the ankles to the head, so that the object
    stands upright; right is one of its axes, too, where one is near.
    """
    up = _nearest_axis(heads[HEAD] - 0.5 * (heads[ANKLES[0]] + heads[ANKLES[1]]))
    hips, shoulders = (
        across - (across @ up) * up
        for across in (normalised(heads[right] - heads[left]) for left, right in (HIPS, SHOULDERS))
    )
    right = normalised(hips + shoulders if hips @ shoulders > 0.0 else hips)
    right = _nearest_axis(right) if np.abs(right).max() > _SNAP else right
    return np.stack([right, np.cross(up, right), up], axis=1)


def _nearest_axis(direction: np.ndarray) -> np.ndarray:
    k = int(np.argmax(np.abs(direction)))
    return np.sign(direction[k]) * np.eye(3)[k]


def _world(bodies: np.ndarray, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (T, N, 3) and rotations (T, N, 3, 3) in the world of bones; object and bones may be
    scaled.
    """
    world = bodies[:, None] @ poses
    axes = world[..., :3, :3] / np.maximum(
        np.linalg.norm(world[..., :3, :3], axis=-2, keepdims=True), 1e-12
    )
    return world[..., :3, 3], axes


def character_motion(armature: bpy.types.Object, bodies: np.ndarray, poses: np.ndarray) -> Motion:
    """The motion of our own character. ``bodies`` (T, 4, 4): its object; ``poses`` (T, 22, 4, 4):
    its bones, in its space.
    """
    joints, turned = _world(bodies, poses)
    rest = np.array([np.array(armature.data.bones[name].matrix_local)[:3, :3] for name in JOINTS])
    return Motion(joints, turned @ transpose(FACING @ rest))


def motion_of(shape: Shape, bodies: np.ndarray, poses: np.ndarray) -> Motion:
    """The motion of any rig, its joints' bones as for ``character_motion``; joints without a bone
    follow their parents.
    """
    joints, turned = _world(bodies, poses)
    frames = turned @ transpose(shape.body.alignment @ shape.axes.T @ shape.rest[:, :3, :3])
    for j, parent in enumerate(PARENTS):
        if not np.isfinite(shape.rest[j]).all():
            frames[:, j] = frames[:, parent]
            joints[:, j] = joints[:, parent] + rotate(
                frames[:, parent], shape.body.rest[j] - shape.body.rest[parent]
            )

    for collar, shoulder in zip(COLLARS, SHOULDERS, strict=True):
        # What moves the shoulder has no bone in the map.
        if not np.isfinite(shape.rest[collar]).all():
            along = rotate(frames[:, collar], shape.body.rest[shoulder] - shape.body.rest[collar])
            frames[:, collar] = (
                rotation_between(along, joints[:, shoulder] - joints[:, collar]) @ frames[:, collar]
            )

    return Motion(joints, frames)


def joints_of(
    armature: bpy.types.Object,
    rig_map: RigMap,
    bodies: np.ndarray,
    poses: np.ndarray,
    size: float,
) -> tuple[np.ndarray, dict[str, float]]:
    """Joints (T, 22, 3) of a DAFNet body of this size (world lengths) that moves as any mapped rig
    does; world.

    And the mean angles, in degrees, between its limbs and trunk and the rig's (``limb_errors``).

    ``bodies`` (T, 4, 4): the rig's object; ``poses`` (T, 22, 4, 4): the bones ``rig_map.place`` of
    the joints, in its space, NaN where there is none.
    """
    _, scale = rigid_parts(bodies, f"armature '{armature.name}'")
    rest = rest_matrices(armature, [rig_map.place(name) for name in JOINTS])
    shape = shape_of(armature, rig_map, rest, scale)
    motion = motion_of(shape, bodies, poses)
    floor = motion.joints[:, PELVIS] * (1.0, 1.0, 0.0) + (0.0, 0.0, bodies[0, 2, 3])
    joints = retarget(motion, shape.body, canonical_body(size), floor, landing=False).motion.joints
    return joints, {
        limb: float(off.mean()) for limb, off in limb_errors(joints, motion.joints).items()
    }
