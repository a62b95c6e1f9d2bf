"""Bakes the motion that a DAFNet character plays, hand edits included, onto an armature of the
animator's own, in a new action.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix, Quaternion

from ...core.body import canonical_body
from ...core.errors import InputError
from ...core.limb_errors import limb_errors
from ...core.retargeting import retarget
from ...core.root import root_from_matrices
from ...core.rotations import continuous_signs, normalised, quaternion_from_matrix
from ...core.skeleton import ANKLES, HEAD, HIPS, JOINTS, WRISTS
from ..character.armature import character_scale, metres_per_unit
from ..character.mannequin import FACING
from ..compat import action_curves, assign_action, new_action
from ..pipeline.baker import TRANSFORMS, has_drivers, key_curves
from ..pipeline.rollback import undone_on_failure
from ..scene.playback import frame_kept
from .controls import (
    Channels,
    Control,
    channels_for,
    controls_of,
    evaluated_now,
    find_attachments,
    rotations_without,
)
from .maps import RigMap, in_names_of, required
from .reading import character_motion, pose_matrices, rigid_parts, shape_of

__all__ = ["Baked", "bake_onto_rig", "frames_played"]

_MEASURED_FRAMES = 24
"""How many frames the result is measured in."""
_INTERFERING = 1e-3
"""How far a matrix of a joint's bone changes, at least, when a bone that interferes is moved."""
_BONE_PATH = re.compile(r'^pose\.bones\["(.+?)"\](?:\["(.+)"\])?')
Curves = Callable[[str, int, str], bpy.types.FCurve]


@dataclass(frozen=True)
class Baked:
    """The new ``action``; ``errors``: mean and largest distance (metres) of wrists, ankles, head
    and pelvis (the middle of the hip joints) from where they were to lie. ``angles``: mean and
    largest angle (degrees) between the limbs and trunk and the character's
    (``limb_errors``). Both are measured on the rig as Blender plays it. ``ratio``: the rig's size
    over the character's, by which the motion was scaled. ``overruled``: keyed bones that
    constraints or drivers of their own move, too.
    """

    action: bpy.types.Action
    errors: dict[str, tuple[float, float]]
    angles: dict[str, tuple[float, float]]
    ratio: float
    overruled: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Recording:
    """Matrices of every frame: ``bodies`` (T, 4, 4) and ``poses`` (T, 22, 4, 4) of the character,
    ``above`` (T, 4, 4) of what carries the rig's object.
    """

    bodies: np.ndarray
    poses: np.ndarray
    above: np.ndarray


def frames_played(character: bpy.types.Object, scene: bpy.types.Scene) -> range:
    """The frames of the action that the character plays, or the scene's."""
    action = character.animation_data.action if character.animation_data else None
    if action is None:
        return range(scene.frame_start, scene.frame_end + 1)
    first, last = action.frame_range
    return range(round(first), round(last) + 1)


def bake_onto_rig(
    context: bpy.types.Context,
    character: bpy.types.Object,
    rig: bpy.types.Object,
    rig_map: RigMap,
    root_motion: str = "OBJECT",
    limbs: str = "FK",
    frames: range | None = None,
    name: str | None = None,
) -> Baked:
    """Key on ``rig`` what ``character`` does in ``frames`` (those of its action), in a new action
    that the rig then plays.

    ``root_motion``: OBJECT, BONE or HIPS, what carries the rig over the floor; ``limbs``: FK or IK.
    Earlier actions are kept by a fake user. Controls that are not mapped keep their pose, but those
    above mapped ones and those that the earlier action moves are put at rest. ``InputError``: rig,
    map or character cannot be used; the rig is then as it was.
    """
    frames = frames_played(character, context.scene) if frames is None else frames
    unit = metres_per_unit(context.scene)
    size = character_scale(character, 1.0)

    _require_bakeable(context, rig, root_motion)
    if character.data.pose_position == "REST":
        raise InputError(
            f"The character '{character.name}' shows its rest position; set it to Pose Position."
        )

    rig_map = in_names_of(rig_map, rig.data.bones.keys()) if rig.mode != "EDIT" else rig_map
    required(rig, rig_map)

    controls = controls_of(rig, rig_map, limbs, root_motion == "BONE")
    recording = _record(context, character, rig, frames)
    options = _BakeOptions(
        root_motion=root_motion,
        limbs=limbs,
        frames=np.array(frames, float),
        name=name or f"{character.name} on {rig.name}",
        size=size,
        unit=unit,
    )
    with frame_kept(context.scene), undone_on_failure(rig):
        return _bake(
            context,
            character=character,
            rig=rig,
            rig_map=rig_map,
            controls=controls,
            recording=recording,
            options=options,
        )


@dataclass(frozen=True)
class _BakeOptions:
    """How to bake, see ``bake_onto_rig``; ``frames`` (T,); ``size``: of the character, in Blender
    units for a canonical metre; ``unit``: a Blender unit in metres.
    """

    root_motion: str
    limbs: str
    frames: np.ndarray
    name: str
    size: float
    unit: float


def _bake(
    context: bpy.types.Context,
    *,
    character: bpy.types.Object,
    rig: bpy.types.Object,
    rig_map: RigMap,
    controls: list[Control],
    recording: _Recording,
    options: _BakeOptions,
) -> Baked:
    previous = rig.animation_data.action if rig.animation_data else None
    add_curve = _prepare_rig(context, rig=rig, rig_map=rig_map, controls=controls, options=options)
    action = rig.animation_data.action

    attachments = find_attachments(context, rig, controls)
    evaluated = evaluated_now(context, rig)
    places = [rig_map.place(joint) for joint in JOINTS]
    basis = np.array(rig.matrix_basis, float)
    still = recording.above @ basis
    _, scale = rigid_parts(still, f"armature '{rig.name}'")

    shape = shape_of(rig, rig_map, pose_matrices(evaluated, places), scale)
    path, _ = root_from_matrices(_facing(recording.bodies))
    motion = character_motion(character, recording.bodies, recording.poses)
    retargeted = retarget(motion, canonical_body(options.size), shape.body, path.position)

    carrier = path.matrices()
    carrier[:, :3, :3] = scale * carrier[:, :3, :3] @ shape.axes.T
    objects = carrier if options.root_motion == "OBJECT" else still
    channels = channels_for(
        controls,
        attachments=attachments,
        shape=shape,
        retargeted=retargeted,
        objects=objects,
        carrier=carrier if options.root_motion == "BONE" else objects,
    )

    local = np.linalg.inv(recording.above) @ objects
    _key_object(rig, add_curve, options=options, matrices=local, rest=basis)
    curves = {
        control.bone: _key_control(
            rig, add_curve, control, channels=channels, index=index, frames=options.frames
        )
        for index, control in enumerate(controls)
    }
    if previous:
        previous.use_fake_user = True

    if attachments.loose:
        _correct_loose(
            context,
            rig,
            controls=controls,
            loose=attachments.loose,
            channels=channels,
            curves=curves,
            frames=options.frames,
        )

    errors, angles = _measure(
        context,
        rig,
        rig_map,
        targets=retargeted.targets,
        source=motion.joints,
        options=options,
    )
    return Baked(
        action=action,
        errors=errors,
        angles=angles,
        ratio=retargeted.ratio,
        overruled=_overruled(rig, controls),
    )


def _prepare_rig(
    context: bpy.types.Context,
    *,
    rig: bpy.types.Object,
    rig_map: RigMap,
    controls: list[Control],
    options: _BakeOptions,
) -> Curves:
    """Let the rig play a new action in which its settings are keyed and everything at rest that
    would interfere; returns what adds curves to it.
    """
    moved, switched = _animated(rig)
    action, add_curve = new_action(rig, options.name)
    action.use_fake_user = True
    assign_action(rig, action)
    first = options.frames[0]

    for bone, key, value in (
        *rig_map.settings.get(options.limbs, ()),
        *rig_map.settings.get("BOTH", ()),
    ):
        _key_setting(rig, add_curve, bone=bone, key=key, value=value, frame=first)
        switched.discard((bone, key))

    for bone, key in switched:
        value = rig.pose.bones[bone].get(key)
        _key_setting(rig, add_curve, bone=bone, key=key, value=value, frame=first)

    moved |= {bone.name for bone in rig.pose.bones if bone.matrix_basis != Matrix.Identity(4)}
    unmapped = moved - {control.bone for control in controls}
    for bone in _interfering(context, rig, rig_map, unmapped):
        _key_rest(rig.pose.bones[bone], add_curve, first, ("location", "rotation", "scale"))
    for control in controls:
        if control.bone in moved:
            kinds = ("location", "scale")[control.moves :]
            _key_rest(rig.pose.bones[control.bone], add_curve, first, kinds)

    return add_curve


def _overruled(rig: bpy.types.Object, controls: list[Control]) -> tuple[str, ...]:
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


def _facing(bodies: np.ndarray) -> np.ndarray:
    """Root frames (T, 4, 4) of a character's object matrices."""
    frames = bodies.copy()
    frames[:, :3, :3] = frames[:, :3, :3] @ FACING
    return frames


def _require_bakeable(context: bpy.types.Context, rig: bpy.types.Object, root_motion: str) -> None:
    if rig.type != "ARMATURE":
        raise InputError(f"'{rig.name}' is not an armature; choose the armature of your rig.")

    if rig.library:
        raise InputError(
            f"The armature '{rig.name}' is linked; make a library override of it, or make it "
            "local first."
        )

    if rig.data.pose_position == "REST":
        raise InputError(
            f"The armature '{rig.name}' shows its rest position; set it to Pose Position."
        )

    if rig not in {each.original for each in context.evaluated_depsgraph_get().ids}:
        raise InputError(
            f"'{rig.name}' or its collection is disabled in viewports; enable it, or hide it with "
            "H."
        )

    data = rig.animation_data
    if data and (data.use_tweak_mode or any(track.is_solo for track in data.nla_tracks)):
        raise InputError(
            f"The armature '{rig.name}' plays an NLA strip in tweak or solo mode; leave it first."
        )
    if has_drivers(rig, TRANSFORMS):
        raise InputError(f"The object '{rig.name}' is moved by drivers; mute them and bake again.")

    delta = (*rig.delta_location, *rig.delta_rotation_euler, *(s - 1.0 for s in rig.delta_scale))
    if root_motion == "OBJECT" and (any(not c.mute for c in rig.constraints) or any(delta)):
        raise InputError(
            f"The object '{rig.name}' has constraints or delta transforms; choose Hips as the "
            "root motion."
        )


def _record(
    context: bpy.types.Context, character: bpy.types.Object, rig: bpy.types.Object, frames: range
) -> _Recording:
    """Play the frames and note what is needed; the current frame is as it was afterwards."""
    bodies, poses, above = [], [], []
    with frame_kept(context.scene):
        for frame in frames:
            context.scene.frame_set(frame)
            depsgraph = context.evaluated_depsgraph_get()
            evaluated, own = character.evaluated_get(depsgraph), rig.evaluated_get(depsgraph)
            bodies.append(np.array(evaluated.matrix_world, float))
            poses.append(pose_matrices(evaluated, list(JOINTS)))
            above.append(np.array(own.matrix_world @ own.matrix_basis.inverted_safe(), float))

    recording = _Recording(np.array(bodies), np.array(poses), np.array(above))
    if not all(
        np.isfinite(values).all() for values in (recording.bodies, recording.poses, recording.above)
    ):
        raise InputError(
            f"'{character.name}' or '{rig.name}' has a transform that is not a number; fix what "
            "drives it."
        )

    return recording


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


def _key_rest(
    bone: bpy.types.PoseBone, add_curve: Curves, frame: float, kinds: tuple[str, ...]
) -> None:
    """Put a bone at rest, with one key for each kind of channels."""
    bone.matrix_basis.identity()
    start = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
    path, rotation = _rotation_channels(bone.rotation_mode, np.array([[1.0, 0.0, 0.0, 0.0]]))
    at_rest = {
        "location": ("location", np.zeros((1, 3))),
        "rotation": (path, rotation),
        "scale": ("scale", np.ones((1, 3))),
    }
    for kind in kinds:
        path, values = at_rest[kind]
        key_curves(add_curve, start + path, bone.name, frames=np.array([frame]), values=values)


def _key_setting(
    rig: bpy.types.Object, add_curve: Curves, *, bone: str, key: str, value: Any, frame: float
) -> None:
    """Set and key a custom property of a bone, where the bone has it as a number."""
    owner = rig.pose.bones[bone]
    if isinstance(owner.get(key), int | float):
        owner[key] = type(owner[key])(value)
        names = (bpy.utils.escape_identifier(part) for part in (bone, key))
        path = 'pose.bones["{}"]["{}"]'.format(*names)
        key_curves(add_curve, path, bone, frames=np.array([frame]), values=np.array([[value]]))


def _rotation_channels(mode: str, quaternions: np.ndarray) -> tuple[str, np.ndarray]:
    """Data path and values (T, 3 or 4) of rotations (T, 4) in one of Blender's rotation modes,
    steady in time.
    """
    if mode == "QUATERNION":
        return "rotation_quaternion", quaternions

    if mode == "AXIS_ANGLE":
        axis, length = quaternions[:, 1:], np.linalg.norm(quaternions[:, 1:], axis=1)
        angle = 2.0 * np.arctan2(length, quaternions[:, 0])
        return "rotation_axis_angle", np.concatenate(
            [angle[:, None], normalised(axis, np.array([0.0, 1.0, 0.0]))], axis=1
        )

    angles, before = [], Euler((0.0, 0.0, 0.0), mode)
    for quaternion in quaternions:
        before = Quaternion(quaternion.tolist()).to_euler(mode, before)
        angles.append(tuple(before))

    return "rotation_euler", np.array(angles)


def _quaternions(turns: np.ndarray) -> np.ndarray:
    return continuous_signs(quaternion_from_matrix(turns))


def _key_object(
    rig: bpy.types.Object,
    add_curve: Curves,
    *,
    options: _BakeOptions,
    matrices: np.ndarray,
    rest: np.ndarray,
) -> None:
    """Keys of the object: ``matrices`` (T, 4, 4) that take it over the floor, or ``rest`` (4, 4)
    where it stays in one place.
    """
    frames = options.frames
    if options.root_motion != "OBJECT":
        matrices, frames = rest[None], frames[:1]

    rotations, _ = rigid_parts(matrices, f"armature '{rig.name}'")
    path, values = _rotation_channels(rig.rotation_mode, _quaternions(rotations))
    key_curves(add_curve, "location", "Object", frames=frames, values=matrices[:, :3, 3])
    key_curves(add_curve, path, "Object", frames=frames, values=values)


def _key_control(
    rig: bpy.types.Object,
    add_curve: Curves,
    control: Control,
    *,
    channels: Channels,
    index: int,
    frames: np.ndarray,
) -> dict[str, list[bpy.types.FCurve]]:
    """Keys of one control, the one with this ``index``; returns its curves by channel."""
    bone = rig.pose.bones[control.bone]
    bone.matrix_basis.identity()
    path, values = _rotation_channels(bone.rotation_mode, _quaternions(channels.turns[:, index]))
    start = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
    curves: dict[str, list[bpy.types.FCurve]] = {}

    def adding_to(channel: str) -> Curves:
        def add(path: str, index: int, group: str) -> bpy.types.FCurve:
            curve = add_curve(path, index, group)
            curves.setdefault(channel, []).append(curve)
            return curve

        return add

    if control.moves:
        moves = channels.moves[:, index]
        key_curves(
            adding_to("location"), start + "location", bone.name, frames=frames, values=moves
        )

    if control.pole is None:
        key_curves(adding_to("rotation"), start + path, bone.name, frames=frames, values=values)

    return curves


def _correct_loose(
    context: bpy.types.Context,
    rig: bpy.types.Object,
    *,
    controls: list[Control],
    loose: list[int],
    channels: Channels,
    curves: dict[str, dict[str, list[bpy.types.FCurve]]],
    frames: np.ndarray,
) -> None:
    """Where a control is not turned rigidly by another one, look in each frame how it lies, and
    turn it as wanted.

    Once for every such control, since each of them may hang on the one before.
    """
    for _ in loose:
        bare = np.empty((len(frames), len(loose), 3, 3))
        for t, frame in enumerate(frames):
            context.scene.frame_set(int(frame))
            evaluated = rig.evaluated_get(context.evaluated_depsgraph_get())
            bare[t] = rotations_without(
                evaluated, [controls[i] for i in loose], channels.turns[t, loose]
            )

        for k, i in enumerate(loose):
            channels.turns[:, i] = np.swapaxes(bare[:, k], 1, 2) @ channels.wanted[:, i]
            mode = rig.pose.bones[controls[i].bone].rotation_mode
            _, values = _rotation_channels(mode, _quaternions(channels.turns[:, i]))
            for curve, column in zip(curves[controls[i].bone]["rotation"], values.T, strict=True):
                points = np.stack([frames, column], axis=1).astype(np.float32)
                curve.keyframe_points.foreach_set("co", points.ravel())
                curve.update()


def _measure(
    context: bpy.types.Context,
    rig: bpy.types.Object,
    rig_map: RigMap,
    *,
    targets: np.ndarray,
    source: np.ndarray,
    options: _BakeOptions,
) -> tuple[dict[str, tuple[float, float]], dict[str, tuple[float, float]]]:
    """Errors and angles as in ``Baked``, measured against the joints' targets and the source's
    joints (T, 22, 3).
    """
    count = len(options.frames)
    chosen = np.unique(np.linspace(0, count - 1, _MEASURED_FRAMES).astype(int))
    bones = {j: rig_map.place(name) for j, name in enumerate(JOINTS) if rig_map.place(name)}
    played = np.full((len(chosen), len(JOINTS), 3), np.nan)
    for t, frame in enumerate(options.frames[chosen]):
        context.scene.frame_set(int(frame))
        evaluated = rig.evaluated_get(context.evaluated_depsgraph_get())
        for j, bone in bones.items():
            played[t, j] = evaluated.matrix_world @ evaluated.pose.bones[bone].head

    def mean_and_largest(values: np.ndarray) -> tuple[float, float]:
        return float(np.mean(values)), float(np.max(values))

    off = played - targets[chosen]
    parts = {
        "wrists": off[:, WRISTS],
        "ankles": off[:, ANKLES],
        "head": off[:, [HEAD]],
        "pelvis": off[:, HIPS].mean(axis=1, keepdims=True),
    }
    errors = {
        part: mean_and_largest(options.unit * np.linalg.norm(values, axis=-1))
        for part, values in parts.items()
    }
    angles = {
        limb: mean_and_largest(values)
        for limb, values in limb_errors(played, source[chosen]).items()
    }
    return errors, angles
