"""A rig's controls: which are keyed, what each of them moves with, and from the pose wanted to the
channels that give it.

What a control moves with is not always its parent: in control rigs that is a mechanism bone with
constraints. So the rig is asked: all controls are turned at random, and for each one the earlier
control is looked for to which its place and its rotation, without its own channels, are rigidly
attached; the object itself is the first candidate.
"""

from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import InputError
from ...core.retargeting import RetargetedMotion
from ...core.rotations import matrix_from_vector, normalised, rotate, transpose
from ...core.skeleton import JOINTS, LIMBS
from .maps import RigMap
from .reading import Shape, pose_matrices

__all__ = [
    "Attachments",
    "Channels",
    "Control",
    "channels_for",
    "controls_of",
    "evaluated_now",
    "find_attachments",
    "rotations_without",
]

_RANDOM_POSES = 4
"""In how many random poses the rig is asked."""
_RANDOM_ANGLE = 0.7
"""Radians by which controls are turned in them."""
_RIGID = 0.01
"""How far a rotation may vary that is still taken for rigidly attached."""
_ROOT = -1
"""Stands for a joint: the root bone has none."""
_CARRIED = (1, 2, 3, 6, 9)
"""Joints that have to go where the pelvis goes: hips and spine."""


@dataclass(frozen=True)
class Control:
    """A bone to key. ``joint``: index of the joint that it turns with, -1 for the root bone.
    ``moves``: whether its location is keyed. ``pole``: index in ``LIMBS`` of the limb whose plane
    it gives, which is all that it does.
    """

    bone: str
    joint: int
    moves: bool = False
    pole: int | None = None


@dataclass(frozen=True)
class Attachments:
    """``neutral`` (N, 4, 4): poses of the controls with empty channels, in the armature's space.
    ``turned_by``, ``moved_by`` (N,): the control by which each is turned and moved, -1 for the
    object. ``loose``: controls that no other turns rigidly. ``axes`` (N, 3, 3): of each control's
    location channels in the armature's space.
    """

    neutral: np.ndarray
    turned_by: list[int]
    moved_by: list[int]
    loose: list[int]
    axes: np.ndarray


@dataclass(frozen=True)
class Channels:
    """``turns`` (T, N, 3, 3) and ``moves`` (T, N, 3): rotation and location channels. ``wanted``
    (T, N, 3, 3): the rotations in the armature's space that they are to give.
    """

    turns: np.ndarray
    moves: np.ndarray
    wanted: np.ndarray


def controls_of(
    rig: bpy.types.Object, rig_map: RigMap, limbs: str, carried_by_root: bool
) -> list[Control]:
    """The controls to key, parents first; ``limbs`` is FK or IK.

    ``InputError``: the rig knows no IK, or a bone that has to move cannot.
    """
    controls = []
    if rig_map.root and rig_map.root != rig_map.joints["pelvis"]:
        controls.append(Control(rig_map.root, _ROOT, moves=carried_by_root))
    elif carried_by_root:
        raise InputError(
            f"'{rig.name}' has no root bone set; choose it in the Your Rig panel, or another root "
            "motion."
        )

    replaced: set[int] = set()
    ends: list[Control] = []
    if limbs == "IK":
        if rig_map.limbs.keys() != LIMBS.keys():
            raise InputError(
                f"'{rig.name}' has no known IK controls; set Limbs to FK, or detect its bones "
                "again."
            )
        for k, (limb, joints) in enumerate(LIMBS.items()):
            names = rig_map.limbs[limb]
            replaced |= {*joints, *((joints[2] + 3,) if limb.endswith("leg") else ())}
            ends.append(Control(names["end"], joints[2], moves=True))
            if "toe" in names:
                ends.append(Control(names["toe"], joints[2] + 3))
            ends.append(Control(names["pole"], joints[1], moves=True, pole=k))

    for j, joint in enumerate(JOINTS):
        if joint in rig_map.joints and j not in replaced:
            controls.append(
                Control(rig_map.joints[joint], j, moves=j == 0 or _is_detached(rig, rig_map, j))
            )

    controls += sorted(ends, key=lambda control: control.pole is not None)

    for control in controls:
        bone = rig.data.bones[control.bone]
        if control.moves and bone.parent and bone.use_connect:
            raise InputError(
                f"The bone '{bone.name}' is connected to its parent and cannot move; disconnect "
                "it in edit mode."
            )

    return controls


def _is_detached(rig: bpy.types.Object, rig_map: RigMap, joint: int) -> bool:
    """Whether a hand or foot hangs on no bone of the body, as where inverse kinematics was lost on
    the way into Blender.
    """
    if joint not in (limb[2] for limb in LIMBS.values()):
        return False
    bone = rig.data.bones[rig_map.joints[JOINTS[joint]]]
    body = {name for name in rig_map.joints.values() if name != rig_map.root}
    return bone.parent is not None and not any(
        above.name in body for above in bone.parent_recursive
    )


def evaluated_now(context: bpy.types.Context, rig: bpy.types.Object) -> bpy.types.Object:
    """The rig evaluated as its channels now are; twice, for what lags by an update."""
    for _ in range(2):
        rig.update_tag(refresh={"DATA", "OBJECT"})
        context.view_layer.update()
    return rig.evaluated_get(context.evaluated_depsgraph_get())


def find_attachments(
    context: bpy.types.Context, rig: bpy.types.Object, controls: list[Control]
) -> Attachments:
    """Find what the controls move with; all of their channels are empty afterwards.

    ``InputError``: trunk or legs stay behind when the pelvis is moved.
    """
    names: list[str | None] = [control.bone for control in controls]
    rng = np.random.default_rng(0)
    poses, channels = [], []
    for k in range(_RANDOM_POSES + 1):  # the last one is neutral
        turns = matrix_from_vector(
            _RANDOM_ANGLE * normalised(rng.normal(size=(len(controls), 3))) * (k < _RANDOM_POSES)
        )
        for control, turn in zip(controls, turns, strict=True):
            rig.pose.bones[control.bone].matrix_basis = Matrix(turn.tolist()).to_4x4()

        poses.append(pose_matrices(evaluated_now(context, rig), names))
        channels.append(turns)

    neutral, rotation, place = poses[-1], _rotations(np.array(poses)), np.array(poses)[..., :3, 3]
    bare = rotation @ transpose(np.array(channels))  # without the control's own rotation
    size = np.ptp(neutral[:, :3, 3], axis=0).max() or 1.0
    _require_carried(context, rig, controls, start=neutral[:, :3, 3], distance=0.1 * size)

    turned_by, moved_by, loose = [], [], []
    for i in range(len(controls)):
        turned, moved = [_spread(bare[:, i])], [_spread(place[:, i]) / size]
        for c in range(i):
            inverse = transpose(rotation[:, c])
            turned.append(_spread(inverse @ bare[:, i]))
            moved.append(_spread(rotate(inverse, place[:, i] - place[:, c])) / size)

        turned_by.append(int(np.argmin(turned)) - 1)
        moved_by.append(int(np.argmin(moved)) - 1)
        if min(turned) > _RIGID and controls[i].pole is None:
            loose.append(i)

    axes = np.array([_location_axes(rig, control.bone) for control in controls])
    return Attachments(
        neutral=neutral, turned_by=turned_by, moved_by=moved_by, loose=loose, axes=axes
    )


def _require_carried(
    context: bpy.types.Context,
    rig: bpy.types.Object,
    controls: list[Control],
    *,
    start: np.ndarray,
    distance: float,
) -> None:
    """``InputError`` where hips or trunk do not go along when the pelvis is moved by ``distance``;
    ``start`` (N, 3): where all controls are before.
    """
    pelvis = next(k for k, control in enumerate(controls) if control.joint == 0)
    bone = rig.pose.bones[controls[pelvis].bone]
    bone.matrix_basis = Matrix.Translation((0.0, distance, 0.0))
    moved = (
        pose_matrices(evaluated_now(context, rig), [control.bone for control in controls])[:, :3, 3]
        - start
    )
    bone.matrix_basis = Matrix.Identity(4)
    for control, by in zip(controls, moved, strict=True):
        if control.joint in _CARRIED and np.linalg.norm(by - moved[pelvis]) > 0.5 * np.linalg.norm(
            moved[pelvis]
        ):
            raise InputError(
                f"The bone '{bone.name}' does not carry '{control.bone}'; choose the bone above "
                "both as the pelvis."
            )


def _spread(values: np.ndarray) -> float:
    return float(np.abs(values - values[-1]).max())


def _rotations(matrices: np.ndarray) -> np.ndarray:
    axes = matrices[..., :3, :3]
    return axes / np.maximum(np.linalg.norm(axes, axis=-2, keepdims=True), 1e-12)


def _location_axes(rig: bpy.types.Object, name: str) -> np.ndarray:
    """Axes (3, 3) of a control's location channels as columns, in the armature's space, as the rig
    is posed now.
    """
    bone = rig.data.bones[name]
    rest = np.array(bone.matrix_local, float)[:3, :3]
    if bone.parent is None:
        return rest if bone.use_local_location else np.eye(3)
    parent = np.array(rig.pose.bones[bone.parent.name].matrix, float)[:3, :3]
    if not bone.use_local_location:
        return parent
    return parent @ np.array(bone.parent.matrix_local, float)[:3, :3].T @ rest


def channels_for(
    controls: list[Control],
    *,
    attachments: Attachments,
    shape: Shape,
    retargeted: RetargetedMotion,
    objects: np.ndarray,
    carrier: np.ndarray,
) -> Channels:
    """Channels of all controls that give a motion which was retargeted onto the rig.

    ``objects`` (T, 4, 4): the rig's object in the world. ``carrier`` (T, 4, 4): where the root bone
    carries the rig, as a matrix that the object would otherwise have.
    """
    frames, count = len(objects), len(controls)
    scale = np.linalg.norm(objects[0, :3, 0])
    object_turns, object_places = objects[:, :3, :3] / scale, objects[:, :3, 3]
    neutral, start = _rotations(attachments.neutral), attachments.neutral[:, :3, 3]

    # The rotation and the place that each control is to have, in the armature's space.
    wanted, place = np.empty((frames, count, 3, 3)), np.empty((frames, count, 3))
    turns, moves = np.empty((frames, count, 3, 3)), np.zeros((frames, count, 3))

    def to_rig(points: np.ndarray) -> np.ndarray:
        return rotate(transpose(object_turns), points - object_places) / scale

    for i, control in enumerate(controls):
        # Where the controls that it moves with take it, while its own channels are empty.
        turner, mover = attachments.turned_by[i], attachments.moved_by[i]
        free = neutral[i] if turner < 0 else wanted[:, turner] @ neutral[turner].T @ neutral[i]
        free = np.broadcast_to(free, (frames, 3, 3))
        if mover < 0:
            carried = np.broadcast_to(np.eye(3), (frames, 3, 3))
            rest = np.broadcast_to(start[i], (frames, 3))
        else:
            carried = wanted[:, mover] @ neutral[mover].T
            rest = place[:, mover] + rotate(carried, start[i] - start[mover])

        if control.pole is not None:
            _, middle, end = list(LIMBS.values())[control.pole]
            reach = shape.body.length(middle) + shape.body.length(end)
            out = retargeted.bends[:, control.pole] * reach
            wanted[:, i] = free
            place[:, i] = to_rig(retargeted.motion.joints[:, middle] + out)
        elif control.joint == _ROOT:
            motion = transpose(object_turns) @ carrier[:, :3, :3] / scale
            wanted[:, i] = motion @ neutral[i]
            place[:, i] = to_rig(rotate(carrier[:, :3, :3], start[i]) + carrier[:, :3, 3])
        else:
            joint = control.joint
            body = retargeted.turns[:, joint] @ shape.axes.T
            wanted[:, i] = transpose(object_turns) @ body @ neutral[i]
            place[:, i] = rest
            if control.moves:
                offset = np.nan_to_num(scale * (start[i] - shape.rest[joint, :3, 3]))
                place[:, i] = to_rig(retargeted.motion.joints[:, joint] + rotate(body, offset))

        turns[:, i] = transpose(free) @ wanted[:, i]
        if control.moves:
            axes = carried @ attachments.axes[i]
            moves[:, i] = rotate(np.linalg.inv(axes), place[:, i] - rest)

    return Channels(turns, moves, wanted)


def rotations_without(
    rig: bpy.types.Object, controls: list[Control], turns: np.ndarray
) -> np.ndarray:
    """Rotations (N, 3, 3) that the controls of an evaluated rig would have without their own
    ``turns`` (N, 3, 3).
    """
    return _rotations(pose_matrices(rig, [control.bone for control in controls])) @ transpose(turns)
