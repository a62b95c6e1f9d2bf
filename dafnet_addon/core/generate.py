"""Scene and controls in, a take out: the one code path under the operator, the command line and the Python API."""

from collections.abc import Generator
from time import perf_counter

import numpy as np

from .cleanup import CleanUp, cleaned
from .conditions import PREROLL, Shot, shot_steps
from .errors import InputError, WeightsError
from .kinematics import blend_switches, fit, forward_kinematics, global_from_local, local_from_global
from .occupancy import tops_under
from .progress import drained, within
from .resampling import (
    MODEL_FPS,
    covering_frames,
    frame_times,
    resample_path,
    resample_positions,
    resample_rotations,
)
from .root import RootPath, to_root, to_world
from .rotations import continuous_signs, matrix_from_quaternion, quaternion_from_matrix
from .sampler import Sampler
from .skeleton import END_EFFECTORS, MODEL_ORDER
from .solids import Scene
from .take import Controls, Take
from .weights import Weights

__all__ = ["RAW", "cleaned_up", "generate", "generate_steps", "targets_of"]

RAW = CleanUp()
"""The model's own motion."""
_HOTTEST = 10.0
_CONDITIONED, _SAMPLED = 0.1, 0.97
"""Progress when the conditions are known and when the poses are made."""


def _kept(resume: Take, frame: int, path: RootPath) -> np.ndarray:
    """The resumed take's poses (PREROLL + N, 66) before a frame of the shot, in the new path's frames."""
    count = min(covering_frames(frame, resume.fps), len(resume.path), len(path))
    old = RootPath(resume.path.position[:count], resume.path.yaw[:count])
    new = RootPath(path.position[:count], path.yaw[:count])
    shot = resume.poses[PREROLL : PREROLL + count].reshape(count, 22, 3)
    return np.concatenate([resume.poses[:PREROLL], to_root(new, to_world(old, shot)).reshape(count, 66)])


def _rotation(controls: Controls, name: str, target: np.ndarray) -> np.ndarray | None:
    """A head's or hand's rotations (N, 3, 3) at the model's frames, NaN where free."""
    value = getattr(controls, name)
    if value is None:
        return None
    times = frame_times(len(controls), controls.fps)
    free = ~np.isfinite(value).all(axis=(1, 2))
    quaternions = quaternion_from_matrix(np.where(free[:, None, None], np.eye(3), value))
    quaternions[free] = np.nan
    return matrix_from_quaternion(resample_rotations(quaternions, times, target))


def targets_of(shot: Shot) -> dict[str, np.ndarray]:
    """What the model was told of head and wrists: world positions (N, 3), canonical metres, NaN where free."""
    places = to_world(shot.path, shot.conditions.observation[PREROLL:].reshape(-1, 22, 3))
    given = shot.conditions.given[PREROLL:]
    slots = {name: MODEL_ORDER.index(j) for name, j in END_EFFECTORS.items()}
    return {name: np.where(given[:, slot, None] > 0, places[:, slot], np.nan) for name, slot in slots.items()}


def cleaned_up(joints: np.ndarray, shot: Shot, settings: CleanUp) -> np.ndarray:
    """Joints (N, 22, 3) of a shot, canonical metres, on constant bones, after all that ``settings`` ask for."""
    tops = tops_under(shot.scene, shot.path) if settings.seat else None
    return cleaned(joints, targets_of(shot), settings, shot.path.position[:, 2], tops)


def _onto_bones(
    poses: np.ndarray, shot: Shot, controls: Controls, switches: np.ndarray, clean_up: CleanUp
) -> tuple[np.ndarray, np.ndarray]:
    """Local quaternions (N, 22, 4) and pelvis (N, 3), canonical metres, of poses (N, 66): cleaned, eased over mode switches."""
    joints = to_world(shot.path, poses.reshape(-1, 22, 3))
    target = frame_times(len(joints), MODEL_FPS)
    names = ("head_rotation", "hand_left_rotation", "hand_right_rotation")
    turned = [_rotation(controls, name, target) for name in names]
    pelvis, frames = fit(joints, 1.0, *turned)
    if clean_up.asked:
        joints = cleaned_up(forward_kinematics(frames, pelvis), shot, clean_up)
        pelvis, frames = fit(joints, 1.0, *turned)
    local = continuous_signs(quaternion_from_matrix(local_from_global(frames)))
    return blend_switches(local, pelvis, shot.path, switches) if len(switches) else (local, pelvis)


def generate_steps(
    scene: Scene, controls: Controls, weights: Weights, *, seed: int = 0, lower_seed: int | None = None,
    temperature: float = 0.0, resume: Take | None = None, resume_frame: int = 0, device: str | None = None,
    clean_up: CleanUp = RAW,
) -> Generator[float, None, Take]:
    """Generate one take; yields progress in [0, 1] and returns the ``Take``.

    ``temperature`` scales the take's noise; 0 is the pose at z = 0, 1 the spread of captured takes. ``lower_seed``: another
    seed for the legs. ``resume``: a take whose motion before ``resume_frame`` (a frame of the controls) is kept, and gone on
    from. ``device``: None runs on NumPy, else on that torch device. ``clean_up``: what is done to the joints after the model;
    nothing by default. Raises InputError for what cannot be used, WeightsError for weights that do not fit.
    """
    if not 0 <= temperature <= _HOTTEST:
        raise InputError(f"The temperature is {temperature}; give 0 or a small positive number such as 1.")
    started = perf_counter()
    yield 0.0
    shot = yield from within(shot_steps(scene, controls), 0.0, _CONDITIONED)
    conditioned = perf_counter()
    sampler = Sampler(weights, device)
    z = sampler.noise(seed, lower_seed, temperature)
    kept = None
    if resume is not None and resume_frame > 0:
        kept = _kept(resume, resume_frame, shot.path)[:, None]
    made, actions = yield from within(sampler.run(shot.conditions, z, kept), _CONDITIONED, _SAMPLED)
    if not np.isfinite(made).all():
        raise WeightsError(f"The weights '{weights.path}' give poses that are no numbers; choose another file.")
    sampled = perf_counter()

    poses, actions = made[:, 0], actions[PREROLL:, 0]
    switches = np.flatnonzero(shot.modes[1:] != shot.modes[:-1]) + 1
    local, pelvis = _onto_bones(poses[PREROLL:], shot, controls, switches, clean_up)
    # From 30 frames a second to the controls' own rate, and to the character's own size.
    source, target = frame_times(len(shot.path), MODEL_FPS), frame_times(len(controls), controls.fps)
    rotations = resample_rotations(local, source, target)
    pelvis = resample_positions(pelvis, source, target)
    root = resample_path(shot.path, MODEL_FPS, controls.fps, len(controls))
    joints = forward_kinematics(global_from_local(matrix_from_quaternion(rotations)), pelvis) * controls.scale
    matrices = RootPath(root.position * controls.scale, root.yaw).matrices()
    seconds = {
        "conditions": conditioned - started, "sampling": sampled - conditioned, "fitting": perf_counter() - sampled,
    }
    yield 1.0
    return Take(
        controls.fps, joints, rotations, matrices, resample_positions(actions, source, target), controls.scale, poses,
        shot.path, seconds, shot.warnings,
    )


def generate(
    scene: Scene, controls: Controls, weights: Weights, *, seed: int = 0, lower_seed: int | None = None,
    temperature: float = 0.0, resume: Take | None = None, resume_frame: int = 0, device: str | None = None,
    clean_up: CleanUp = RAW,
) -> Take:
    """Drain ``generate_steps``, whose arguments these are, and return its take."""
    return drained(generate_steps(
        scene, controls, weights, seed=seed, lower_seed=lower_seed, temperature=temperature, resume=resume,
        resume_frame=resume_frame, device=device, clean_up=clean_up,
    ))
