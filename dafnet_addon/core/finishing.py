"""How the model's poses become a take: eased over changes of mode, cleaned up, leant, turned to
what is looked at, and judged.
"""

from collections.abc import Generator, Mapping
from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np

from .beginning import PREROLL
from .cleanup import CleanUp, cleaned, reach_targets
from .conditions import Change, Shot, targets_of, turns_of
from .draws import Draw
from .kinematics import (
    Bent,
    Turn,
    bent,
    come_over,
    global_from_local,
    local_from_global,
    on_joints,
    turned,
)
from .leaning import lean_findings, lean_of, with_lean
from .looking import counting, head_turn, with_chest_turned
from .metrics import motion_metrics
from .occupancy import distance
from .progress import stepwise, within
from .resampling import frame_times, resample_positions, resample_rotations
from .root import RootPath, to_world
from .rotations import continuous_signs, matrix_from_quaternion, quaternion_from_matrix
from .series import MODEL_FPS
from .skeleton import WRISTS
from .softness import Support, support_under
from .take import Controls, Take
from .touching import touches
from .verdict import verdict

__all__ = ["cleaned_up", "finished_steps"]

_LEAD = 30  # frames before a change of mode that tell how straight limbs were twisted


@stepwise
def cleaned_up(
    joints: np.ndarray, shot: Shot, settings: CleanUp, support: Support | None = None
) -> Generator[float, None, np.ndarray]:
    """Joints (N, 22, 3) of a shot, canonical metres, on constant bones, after all that ``settings``
    ask for; ``support``: what carries the body, where that is known already.
    """
    if settings.seat and support is None:
        support = support_under(shot.scene, shot.path)
    floor = shot.path.position[:, 2]
    reach = partial(distance, shot.scene, floor=floor) if shot.scene.solids else None
    yield 0.2
    targets = targets_of(shot.path, shot.request)
    return (
        yield from within(cleaned.steps(joints, targets, settings, floor, support, reach), 0.2, 1.0)
    )


def _model_joints(poses: np.ndarray, path: RootPath) -> np.ndarray:
    """World joints (N, 22, 3) of the model's poses (PREROLL + N, 66)."""
    return to_world(path, poses[PREROLL:].reshape(-1, 22, 3))


def _as_unchanged(poses: np.ndarray, unchanged: np.ndarray, change: Change, path: RootPath) -> Bent:
    """The motion (M, …) over a change of mode as it would have gone on: M poses ``unchanged`` (M,
    66) after the take's.
    """
    begin, frames = max(0, change.start - _LEAD), change.frames
    after = RootPath(path.position[begin : frames.stop], path.yaw[begin : frames.stop])
    whole = np.concatenate([poses[begin : PREROLL + change.start], unchanged])
    local, pelvis = bent(_model_joints(whole, after))
    return Bent(local[change.start - begin :], pelvis[change.start - begin :])


def _eased(motion: Bent, poses: np.ndarray, unchanged: np.ndarray, shot: Shot) -> Bent:
    """The model's motion, coming over at changes of mode from the poses ``unchanged`` (M, 66) to
    its own (PREROLL + N, 66).
    """
    changes, used = [], 0
    for change in shot.request.changes:
        own = unchanged[used : used + len(change.ease)]
        changes.append((change.start, change.ease, _as_unchanged(poses, own, change, shot.path)))
        used += len(change.ease)
    return come_over(motion, changes)


def _frames(motion: Bent) -> np.ndarray:
    """Global joint frames (T, 22, 3, 3)."""
    return global_from_local(matrix_from_quaternion(motion.local))


def _turned(motion: Bent, turns: Mapping[str, Turn]) -> Bent:
    """The motion with head, hands and feet turned."""
    local = local_from_global(turned(_frames(motion), turns))
    return motion._replace(local=continuous_signs(quaternion_from_matrix(local)))


def _looked_at(controls: Controls) -> tuple[np.ndarray, np.ndarray]:
    """What is looked at (T, 3), canonical metres, and how far it counts (T,)."""
    if controls.look_at is None:
        return np.full((len(controls), 3), np.nan), np.zeros(len(controls))
    share = controls.look_at_influence
    given = np.ones(len(controls)) if share is None else np.clip(share, 0.0, 1.0)
    return controls.look_at / controls.scale, counting(controls.look_at, given, controls.fps)


def finished_steps(
    poses: np.ndarray,
    unchanged: np.ndarray,
    action: np.ndarray,
    shot: Shot,
    controls: Controls,
    clean_up: CleanUp,
    log_likelihood: float,
    draw: Draw,
) -> Generator[float, None, Take]:
    """The take of the model's poses (PREROLL + N, 66), with ``action`` (T, K) at the controls'
    rate; yields progress.

    Changes of mode are eased first, so that feet are planted afterwards; what concerns the
    furniture and the floor is cleaned up at the model's rate; targets are reached at the controls'
    own frames, where they are given.
    """
    started = perf_counter()
    source, target = (
        frame_times(len(shot.path), MODEL_FPS),
        frame_times(len(controls), controls.fps),
    )
    same = len(source) == len(target) and np.allclose(source, target)
    floor = shot.own_path.position[:, 2]
    reach = partial(distance, shot.own_scene, floor=floor) if shot.own_scene.solids else None
    targets = targets_of(shot.own_path, shot.own_request)
    support = support_under(shot.own_scene, shot.own_path)
    judged = partial(motion_metrics, fps=controls.fps, floor=floor, targets=targets, distance=reach)

    def at_own_rate(motion: Bent) -> Bent:
        """A motion at the controls' frames."""
        if same:
            return motion
        return Bent(
            resample_rotations(motion.local, source, target),
            resample_positions(motion.pelvis, source, target),
        )

    joints = _model_joints(poses, shot.path)
    motion = _eased(bent(joints), poses, unchanged, shot)
    yield 0.2
    own = at_own_rate(motion)
    before, lean = on_joints(own), None
    metrics = raw = judged(before)
    yield 0.4
    looked_at, counts = _looked_at(controls)
    leans = np.radians(0.0 if controls.lean is None else np.asarray(controls.lean, float))
    if clean_up.asked or counts.any() or leans.any():
        joints = before
        if clean_up.asked:
            joints = yield from within(
                cleaned_up.steps(
                    on_joints(motion), shot, replace(clean_up, reach=0.0), support if same else None
                ),
                0.4,
                0.6,
            )
            if not same:
                joints = on_joints(at_own_rate(bent(joints)))
        yield 0.6
        before = joints
        if leans.any() or counts.any():
            holds = touches(joints, controls.fps, floor, reach, targets)[:, : len(WRISTS)]
        if leans.any():
            lean = lean_of(joints, leans, support, reach, targets, controls.fps)
            joints = with_lean(joints, lean.done, holds, controls.fps)
        if counts.any():
            frames = _frames(bent(joints, controls.fps))
            joints = with_chest_turned(
                joints, frames, looked_at, counts, holds=holds, fps=controls.fps
            )
        if clean_up.reach > 0.0:
            joints = reach_targets(joints, targets, clean_up.reach, controls.fps)

        own = bent(joints, controls.fps)
        yield 0.8
        metrics = judged(on_joints(own))

    yield 1.0

    turns = turns_of(controls, shot.own_path)
    if counts.any():
        look = head_turn(on_joints(own), _frames(own), looked_at, counts, controls.fps)
        own = _turned(own, {"head": look})
    if turns:
        own = _turned(own, turns)

    joints = on_joints(own)
    found = lean_findings(before, joints, lean, shot.own_scene, controls.fps, floor)
    root = RootPath(shot.own_path.position * controls.scale, shot.own_path.yaw)
    return Take(
        fps=controls.fps,
        joints=joints * controls.scale,
        rotations=own.local,
        root=root.matrices(),
        action=action,
        scale=controls.scale,
        poses=poses,
        path=shot.path,
        unchanged=unchanged,
        touches=touches(joints, controls.fps, floor, reach, targets),
        log_likelihood=log_likelihood,
        draw=draw,
        raw_metrics=raw,
        metrics=metrics,
        verdict=verdict(
            joints,
            controls.fps,
            shot.own_path,
            shot.own_scene,
            support,
            targets,
            found,
            controls.scale,
        ),
        seconds={"fitting": perf_counter() - started},
        warnings=shot.warnings,
    )
