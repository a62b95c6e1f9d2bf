"""Bakes the motion that a DAFNet character plays, hand edits included, onto the animator's rig, in
a new action.
"""

from collections.abc import Generator
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.body import canonical_body
from ...core.errors import InputError
from ...core.limb_errors import limb_errors
from ...core.progress import stepwise, within
from ...core.retargeting import retarget
from ...core.root import root_from_matrices
from ...core.skeleton import ANKLES, HEAD, HIPS, JOINTS, WRISTS
from ...core.touching import touches
from ..character.armature import character_scale, metres_per_unit
from ..character.mannequin import FACING
from ..character.nla_modes import require_not_tweaked_nor_solo
from ..character.takes import played_take, stored_take
from ..pipeline.baker import TRANSFORMS, has_drivers
from ..pipeline.rollback import undone_on_failure
from ..scene.dependencies import Dependencies
from ..scene.playback import frame_kept, nothing_deleted, play_steps
from .controls import (
    Channels,
    Control,
    channels_for,
    controls_of,
    evaluated_now,
    find_attachments,
    rotations_without,
)
from .eyes import key_eyes
from .keys import key_control, key_object, rekey_rotation
from .maps import RigMap, require_usable, with_bone_names_of
from .preparation import overruled, prepare_rig
from .reading import character_motion, pose_matrices, rigid_parts, shape_of
from .sizing import require_rig_of_a_person

__all__ = ["Baked", "bake_onto_rig", "frames_played"]

_RECORDED = 0.9
"""Progress once the motion is read."""
_MEASURED_FRAMES = 24
"""How many frames the result is measured in."""
_HOLDS = 0.99
"""How far a hand holds on to something where it is judged by its place."""


@dataclass(frozen=True)
class Baked:
    """The new ``action``; ``errors``: mean and largest distance (metres) of ankles, head and pelvis
    (the middle of the hip joints) from where they were to lie, and of wrists, in frames in which
    hands hold on to something, from the character's, or from where they lie on the rig's own
    thighs. ``angles``: mean and largest angle (degrees)
    between the limbs and trunk and the character's (``limb_errors``). Both are measured on the rig
    as Blender plays it. ``ratio``: the rig's size over the character's, by which the motion was
    scaled. ``overruled``: keyed bones that constraints or drivers of their own move, too.
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


@stepwise
def bake_onto_rig(
    context: bpy.types.Context,
    character: bpy.types.Object,
    rig: bpy.types.Object,
    rig_map: RigMap,
    root_motion: str = "OBJECT",
    limbs: str = "FK",
    frames: range | None = None,
    name: str | None = None,
) -> Generator[float, None, Baked]:
    """Key on ``rig`` what ``character`` does in ``frames`` (those of its action), in a new action
    that the rig then plays.

    ``root_motion``: OBJECT, BONE or HIPS, what carries the rig over the floor; ``limbs``: FK or IK.
    Earlier actions are kept by a fake user. Controls that are not mapped keep their pose, except
    that those which would interfere, and those that the earlier action moves, are put at rest.
    A job, see ``playback.play_steps``: nothing is changed before its last step. ``InputError``:
    rig, map or character cannot be used; the rig is then as it was.
    """
    frames = frames_played(character, context.scene) if frames is None else frames
    unit = metres_per_unit(context.scene)
    size = character_scale(character, 1.0)

    _usable_map(context, character, rig, rig_map, root_motion)
    with nothing_deleted("the motion was read", "bake again"):
        recording = yield from within(_record(context, character, rig, frames), 0.0, _RECORDED)
        # Once more, since all may have changed while it was read.
        rig_map = _usable_map(context, character, rig, rig_map, root_motion)

    controls = controls_of(rig, rig_map, limbs, root_motion == "BONE")

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
    add_curve = prepare_rig(
        context,
        rig=rig,
        rig_map=rig_map,
        controls=controls,
        limbs=options.limbs,
        name=options.name,
        first=options.frames[0],
    )

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
    held = _held(context.scene, character, motion.joints, path.position, options)
    retargeted = retarget(
        motion,
        canonical_body(options.size),
        shape.body,
        root=path.position,
        held=held,
    )

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

    if options.root_motion == "OBJECT":
        local = np.linalg.inv(recording.above) @ objects
        key_object(rig, add_curve, matrices=local, frames=options.frames)
    else:
        key_object(rig, add_curve, matrices=basis[None], frames=options.frames[:1])

    curves = {
        control.bone: key_control(
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

    key_eyes(
        context,
        rig,
        rig_map,
        add_curve,
        character=character,
        axes=shape.axes,
        frames=options.frames,
        unit=options.unit,
    )
    errors, angles = _measure(
        context,
        rig,
        rig_map,
        targets=retargeted.targets,
        laps=retargeted.laps,
        source=motion.joints,
        held=held,
        options=options,
    )

    return Baked(
        action=action,
        errors=errors,
        angles=angles,
        ratio=retargeted.ratio,
        overruled=overruled(rig, controls),
    )


def _held(
    scene: bpy.types.Scene,
    character: bpy.types.Object,
    joints: np.ndarray,
    floor: np.ndarray,
    options: _BakeOptions,
) -> np.ndarray:
    """How far hands and feet of joints (T, 22, 3), Blender units, hold on to something (T, 4): to
    what the take that the character plays knows of, and to what an edit since has brought them to.

    ``floor`` (T, 3): under the character.
    """
    rate = scene.render.fps / scene.render.fps_base
    now = touches(joints / options.size, rate, floor[:, 2] / options.size)
    action = played_take(character)
    if action is None:
        return now

    try:
        known = stored_take(action)[0].touches
    except InputError:
        return now
    if len(known):
        at = options.frames.astype(int) - action.dafnet.frame_start
        now = np.maximum(now, known[np.clip(at, 0, len(known) - 1)])
    return now


def _facing(bodies: np.ndarray) -> np.ndarray:
    """Root frames (T, 4, 4) of a character's object matrices."""
    frames = bodies.copy()
    frames[:, :3, :3] = frames[:, :3, :3] @ FACING
    return frames


def _usable_map(
    context: bpy.types.Context,
    character: bpy.types.Object,
    rig: bpy.types.Object,
    rig_map: RigMap,
    root_motion: str,
) -> RigMap:
    """The map with the rig's own names of bones. ``InputError``: see ``bake_onto_rig``."""
    _require_bakeable(context, rig, root_motion)
    if character.data.pose_position == "REST":
        raise InputError(
            f"The character '{character.name}' shows its rest position; set it to Pose Position."
        )

    rig_map = with_bone_names_of(rig_map, rig.data.bones.keys()) if rig.mode != "EDIT" else rig_map
    require_usable(rig, rig_map)
    require_rig_of_a_person(context.scene, rig, rig_map)
    return rig_map


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

    require_not_tweaked_nor_solo(rig)
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
) -> Generator[float, None, _Recording]:
    """Play the frames and note what is needed: a job, see ``playback.play_steps``."""
    bodies, poses, above = [], [], []

    def look(_frame: int, depsgraph: bpy.types.Depsgraph, _shaped: set[bpy.types.Object]) -> None:
        evaluated, own = character.evaluated_get(depsgraph), rig.evaluated_get(depsgraph)
        bodies.append(np.array(evaluated.matrix_world, float))
        poses.append(pose_matrices(evaluated, list(JOINTS)))
        above.append(np.array(own.matrix_world @ own.matrix_basis.inverted_safe(), float))

    simulations = Dependencies(context.scene).simulations([character, rig])
    yield from play_steps(context, frames, simulations, look)

    recording = _Recording(np.array(bodies), np.array(poses), np.array(above))
    if not all(
        np.isfinite(values).all() for values in (recording.bodies, recording.poses, recording.above)
    ):
        raise InputError(
            f"'{character.name}' or '{rig.name}' has a transform that is not a number; fix what "
            "drives it."
        )

    return recording


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
    """Turn controls that no other turns rigidly: look in each frame how they lie, and correct them.

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
            bone = rig.pose.bones[controls[i].bone]
            rekey_rotation(
                bone, curves[bone.name]["rotation"], turns=channels.turns[:, i], frames=frames
            )


def _measure(
    context: bpy.types.Context,
    rig: bpy.types.Object,
    rig_map: RigMap,
    *,
    targets: np.ndarray,
    laps: np.ndarray,
    source: np.ndarray,
    held: np.ndarray,
    options: _BakeOptions,
) -> tuple[dict[str, tuple[float, float]], dict[str, tuple[float, float]]]:
    """Errors and angles as in ``Baked``, measured against the joints' targets and the source's
    joints (T, 22, 3); ``held`` (T, 4): see ``touches``; ``laps`` (T, 2): how far hands lie on the
    rig's own thighs, so that it is their targets that count.
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

    off, away = played - targets[chosen], (played - source[chosen])[:, WRISTS]
    away += laps[chosen, :, None] * (off[:, WRISTS] - away)
    parts = {
        "wrists": away[held[chosen, :2] >= _HOLDS],
        "ankles": off[:, ANKLES],
        "head": off[:, [HEAD]],
        "pelvis": off[:, HIPS].mean(axis=1, keepdims=True),
    }

    errors = {
        part: mean_and_largest(options.unit * np.linalg.norm(values, axis=-1))
        for part, values in parts.items()
        if values.size
    }
    angles = {
        limb: mean_and_largest(values)
        for limb, values in limb_errors(played, source[chosen]).items()
    }
    return errors, angles
