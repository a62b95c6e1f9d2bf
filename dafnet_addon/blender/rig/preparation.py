"""Makes a rig ready to be keyed: a new action, its settings for the bake, and at rest what would
interfere.
"""

import re

import bpy
import numpy as np
from mathutils import Matrix

from ...core.skeleton import JOINTS
from ..compat import action_curves, assign_action, new_action
from ..pipeline.baker import TRANSFORMS, has_drivers
from .controls import Control, evaluated_now
from .keys import Curves, key_rest, key_setting
from .maps import RigMap
from .reading import pose_matrices

__all__ = ["overruled", "prepare_rig"]

_INTERFERING = 1e-3
"""How far a matrix of a joint's bone changes, at least, when a bone that interferes is moved."""
_BONE_PATH = re.compile(r'^pose\.bones\["(.+?)"\](?:\["(.+)"\])?')
"""Data paths of a bone's channels, and of its custom properties."""


def prepare_rig(
    context: bpy.types.Context,
    *,
    rig: bpy.types.Object,
    rig_map: RigMap,
    controls: list[Control],
    limbs: str,
    name: str,
    first: float,
) -> Curves:
    """Let the rig play a new action, called ``name``, in which its settings for these ``limbs`` (FK
    or IK) are keyed in the ``first`` frame, and everything at rest that would interfere; returns
    what adds curves to it.
    """
    moved, switched = _animated(rig)
    action, add_curve = new_action(rig, name)
    action.use_fake_user = True
    assign_action(rig, action)

    for bone, key, value in (
        *rig_map.settings.get(limbs, ()),
        *rig_map.settings.get("BOTH", ()),
    ):
        key_setting(rig, add_curve, bone=bone, key=key, value=value, frame=first)
        switched.discard((bone, key))

    for bone, key in switched:
        value = rig.pose.bones[bone].get(key)
        key_setting(rig, add_curve, bone=bone, key=key, value=value, frame=first)

    moved |= {bone.name for bone in rig.pose.bones if bone.matrix_basis != Matrix.Identity(4)}
    unmapped = moved - {control.bone for control in controls}
    for bone in _interfering(context, rig, rig_map, unmapped):
        key_rest(rig.pose.bones[bone], add_curve, first, ("location", "rotation", "scale"))
    for control in controls:
        if control.bone in moved:
            kinds = ("location", "scale")[control.moves :]
            key_rest(rig.pose.bones[control.bone], add_curve, first, kinds)

    return add_curve


def _animated(rig: bpy.types.Object) -> tuple[set[str], set[tuple[str, str]]]:
    """Bones, and custom properties of bones, that the action moves which the rig plays."""
    moved, switched = set(), set()
    for curve in action_curves(rig):
        found = _BONE_PATH.match(curve.data_path)
        bone, key = (
            (bpy.utils.unescape_identifier(part or "") for part in found.groups())
            if found
            else ("", "")
        )
        if key and bone in rig.pose.bones:
            switched.add((bone, key))
        elif bone in rig.pose.bones:
            moved.add(bone)

    return moved, switched


def _interfering(
    context: bpy.types.Context, rig: bpy.types.Object, rig_map: RigMap, suspects: set[str]
) -> list[str]:
    """Those among some bones that move joints when they are moved; they are left at rest, while the
    others keep their pose.

    In control rigs they need not be parents of what they move, so each of them is tried.
    """
    poses = {name: rig.pose.bones[name].matrix_basis.copy() for name in suspects}
    places = [rig_map.place(joint) for joint in JOINTS]
    for name in suspects:
        rig.pose.bones[name].matrix_basis.identity()

    rest = pose_matrices(evaluated_now(context, rig), places) if suspects else np.empty(0)

    found = []
    for name in sorted(suspects):
        bone = rig.pose.bones[name]
        bone.matrix_basis = Matrix.Rotation(0.3, 4, "X") @ Matrix.Rotation(0.3, 4, "Z")
        bone.location = (0.1 * bone.length,) * 3
        change = np.abs(pose_matrices(evaluated_now(context, rig), places) - rest)
        if np.nanmax(change) > _INTERFERING:
            found.append(name)

        bone.matrix_basis.identity()

    for name in suspects - set(found):
        rig.pose.bones[name].matrix_basis = poses[name]

    return found


def overruled(rig: bpy.types.Object, controls: list[Control]) -> tuple[str, ...]:
    """Controls that constraints or drivers of their own move, in addition to their keys."""

    def moved(name: str) -> bool:
        own = any(
            not constraint.mute and constraint.influence > 0.0
            for constraint in rig.pose.bones[name].constraints
        )
        return own or has_drivers(
            rig,
            tuple(
                f'pose.bones["{bpy.utils.escape_identifier(name)}"].{part}' for part in TRANSFORMS
            ),
        )

    return tuple(control.bone for control in controls if moved(control.bone))
