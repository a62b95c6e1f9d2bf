"""Eyes of a rig, which look at what its character looks at as far as the head does not turn to it.

The bones are found by their names: below the head's, one for each side, and free to be turned.
"""

import re

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.looking import counting, eye_turns
from ...core.rotations import transpose
from ...core.skeleton import HEAD
from ..character.takes import played_take, stored_take
from .controls import Channels, Control
from .keys import Curves, key_control
from .maps import RigMap, without_prefix
from .reading import pose_matrices, rest_matrices

__all__ = ["eyes_of", "key_eyes"]

_SIDE = "(l|r|left|right)"
_EYE = re.compile(
    rf"^(def[-_.]?|j_adj_|cc_base_)?({_SIDE}[-_. ]?)?(face)?eye(ball)?([-_. ]?{_SIDE})?(_smplhf)?$"
)
"""Their names in lower case, without a prefix: LeftEye, eye_L, J_Adj_R_FaceEye, left_eye_smplhf."""


def eyes_of(rig: bpy.types.Object, rig_map: RigMap) -> list[str]:
    """The bones of a rig's two eyes; none where they are not plainly two, or something else moves
    them.
    """
    head = rig.data.bones.get(rig_map.place("head") or "")
    found = [
        bone.name
        for bone in (head.children_recursive if head is not None else ())
        if _EYE.match(without_prefix(bone.name).lower())
    ]
    free = [n for n in found if not any(not c.mute for c in rig.pose.bones[n].constraints)]
    return found if len(found) == len(free) == 2 else []


def key_eyes(
    context: bpy.types.Context,
    rig: bpy.types.Object,
    rig_map: RigMap,
    add_curve: Curves,
    *,
    character: bpy.types.Object,
    axes: np.ndarray,
    frames: np.ndarray,
    unit: float,
) -> None:
    """Key the eyes of a rig whose other keys are there at ``frames`` (T,), where the take that the
    character plays looks at something. ``axes`` (3, 3): those of the rig's body, in its space;
    ``unit``: metres of a Blender unit.
    """
    names, looked_at = eyes_of(rig, rig_map), _looked_at(character, frames)
    if not names or looked_at is None:
        return
    target, counts = looked_at

    bones = [rig.data.bones[name] for name in names]
    head = rig_map.place("head")
    parents = [bone.parent.name for bone in bones]
    rest = rest_matrices(rig, [head, *parents, *names])[:, :3, :3]
    poses, places = [], []
    for frame in frames:
        context.scene.frame_set(int(frame))
        shown = rig.evaluated_get(context.evaluated_depsgraph_get())
        poses.append(pose_matrices(shown, [head, *parents, *names]))
        places.append(np.array(shown.matrix_world.inverted_safe(), float))
    pose, space = np.array(poses), np.array(places)

    rotations = pose[..., :3, :3] / np.linalg.norm(pose[..., :3, :3], axis=-2, keepdims=True)
    face = rotations[:, 0] @ rest[0].T @ axes
    there = np.einsum("tij,tj->ti", space[:, :3, :3], target / unit) + space[:, :3, 3]
    rate = context.scene.render.fps / context.scene.render.fps_base
    turns = np.empty((len(frames), 2, 3, 3))
    for k in range(2):
        turn = eye_turns(face, pose[:, 3 + k, :3, 3], there, counts, rate)
        wanted = face @ turn @ axes.T @ rest[3 + k]
        free = rotations[:, 1 + k] @ rest[1 + k].T @ rest[3 + k]
        turns[:, k] = transpose(free) @ wanted
    channels = Channels(turns, np.zeros((len(frames), 2, 3)), turns)
    for k, name in enumerate(names):
        control = Control(name, HEAD)
        key_control(rig, add_curve, control, channels=channels, index=k, frames=frames)


def _looked_at(
    character: bpy.types.Object, frames: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """What the take that a character plays looks at (T, 3), metres, and how far that counts (T,);
    None where it looks at nothing.
    """
    action = played_take(character)
    if action is None:
        return None
    try:
        controls = stored_take(action)[1]
    except InputError:
        return None
    if controls.look_at is None:
        return None
    share = controls.look_at_influence
    given = np.ones(len(controls)) if share is None else np.clip(share, 0.0, 1.0)
    counts = counting(controls.look_at, given, controls.fps)
    at = np.clip(frames.astype(int) - action.dafnet.frame_start, 0, len(controls) - 1)
    return (controls.look_at[at], counts[at]) if counts.any() else None
