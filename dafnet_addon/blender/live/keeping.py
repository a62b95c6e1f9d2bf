"""What was recorded live becomes a take, with the root's and the targets' keys that led it, so that
it can be generated again.
"""

from collections.abc import Generator

import bpy
import numpy as np

from ...core.draws import Draw
from ...core.errors import InputError
from ...core.generate import played_take_steps
from ...core.live import controls_of
from ...core.progress import within
from ...core.root import yaw_of
from ...core.skeleton import TARGETS
from ...core.take import Controls
from ..character.settings import HELD
from ..compat import action_curves, assign_action, new_action, remove_curves
from ..directing.root_keys import require_keyable
from ..directing.walking import extend_range
from ..pipeline.baker import key_curves
from ..pipeline.curves import copy_curve
from ..pipeline.job import Result, bake_steps, clean_up_of
from .session import Clip, LiveSession

__all__ = ["keep_clips"]


def keep_clips(session: LiveSession) -> Generator[float, None, tuple[Result, ...]]:
    """A take of each clip of a session that has ended: each is cleaned up as its character's
    settings say. The last one plays, with the root and the targets as they led it.

    What the root and the targets played before stays in the file. Yields progress. ``InputError``:
    the character or its root is gone.
    """
    results = []
    if session.clips and not session.there:
        raise InputError("What was recorded cannot be kept, since its character is gone.")
    for k, clip in enumerate(session.clips):
        job = _keep(session, clip)
        share = k / len(session.clips), (k + 1) / len(session.clips)
        results.append((yield from within(job, *share)))
    return tuple(results)


def _keep(session: LiveSession, clip: Clip) -> Generator[float, None, Result]:
    settings, scene, armature = session.settings, session.scene, session.armature
    fps = scene.render.fps / scene.render.fps_base
    controls = controls_of(clip.played, fps, session.scale)
    own = armature.dafnet
    draw = Draw(settings.seed, temperature=own.temperature, held=settings.noise == HELD)
    job = played_take_steps(
        session.furniture.scene, controls, clip.before, clip.played, clean_up_of(settings), draw
    )
    take = yield from within(job, 0.0, 0.8)
    actions = yield from within(bake_steps(settings, [take], controls, whole=False), 0.8, 1.0)
    start = settings.frame_start
    warnings = tuple(_key_what_led(session, controls, start))
    extend_range(scene, armature, start + len(take) - 1)
    scene.frame_set(scene.frame_current, subframe=scene.frame_subframe)
    return Result(
        actions=tuple(actions),
        takes=(take,),
        warnings=take.warnings + warnings,
        seconds=take.seconds,
    )


def _key_what_led(
    session: LiveSession, controls: Controls, start: int
) -> Generator[str, None, None]:
    """Key the root, and the targets that counted with their influences, from frame ``start`` on;
    yields warnings.
    """
    frames = start + np.arange(len(controls), dtype=float)
    root = controls.root
    heading = np.unwrap(yaw_of(root[:, :2, 1]))
    angles = np.stack([0 * heading, 0 * heading, heading], axis=1)
    places = root[:, :3, 3] / session.unit
    _key(session.root, frames, {"location": places, "rotation_euler": angles})

    # What an earlier action keyed counted for that one.
    armature = session.armature
    for path in ("dafnet.mode", *(f"dafnet.{role}_influence" for role in TARGETS)):
        remove_curves(armature, path)
    armature.dafnet.mode = controls.mode
    armature.keyframe_insert("dafnet.mode", frame=start)
    if controls.mode == "FREE":
        return

    for role in TARGETS:
        path = f"dafnet.{role}_influence"
        if not getattr(armature.dafnet, role):
            continue
        share = getattr(controls, f"{role}_influence")
        share = np.zeros(len(frames)) if share is None else share
        turns = np.diff(share, n=2, prepend=share[0], append=share[-1]) != 0.0
        turns[[0, -1]] = True
        for k in np.flatnonzero(turns):
            setattr(armature.dafnet, f"{role}_influence", float(share[k]))
            armature.keyframe_insert(path, frame=start + int(k))
        for curve in action_curves(armature):
            if curve.data_path == path:
                for point in curve.keyframe_points:
                    point.interpolation = "LINEAR"

        target = session.targets.get(role)
        if target is None or not share.any():
            continue
        try:
            require_keyable(target, "target")
        except InputError as error:
            yield f"{error} Until then it does not lead this take again."
            continue
        place = getattr(controls, role)
        known = np.isfinite(place).all(axis=1)
        _key(target, frames[known], {"location": place[known] / session.unit})


def _key(owner: bpy.types.Object, frames: np.ndarray, channels: dict[str, np.ndarray]) -> None:
    """Let an object play these ``channels`` (T, 3) in a new action, with what else its present one
    has; that is kept.
    """
    data = owner.animation_data
    previous = data.action if data else None
    carried = [curve for curve in action_curves(owner) if curve.data_path not in channels]
    action, add_curve = new_action(owner, f"{owner.name} live")
    action.use_fake_user = True
    for path, values in channels.items():
        key_curves(add_curve, path, "Live", frames=frames, values=values)
    for curve in carried:
        copy_curve(curve, add_curve)
    if previous:
        previous.use_fake_user = True
    assign_action(owner, action)
