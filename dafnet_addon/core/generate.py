"""Scene and controls in, a take out: the one code path under the operator, the command line and the Python API."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from .checks import MOST_SEED, number, whole
from .cleanup import CleanUp, cleaning_steps
from .conditions import PREROLL, Shot, shot_steps
from .errors import InputError
from .kinematics import blend_switches, fit, forward_kinematics, global_from_local, local_from_global
from .metrics import summary
from .occupancy import distance, tops_under
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
from .sampler import Conditions, Sampler, model_order
from .skeleton import END_EFFECTORS, MODEL_ORDER
from .solids import Scene
from .take import Controls, Take
from .weights import Weights

__all__ = ["RAW", "Draw", "clean_again_steps", "cleaned_up", "generate", "generate_steps", "takes_steps", "targets_of"]

RAW = CleanUp()
"""The model's own motion."""
_HOTTEST = 10.0
_CONDITIONED, _SAMPLED = 0.15, 0.85
"""Progress when the conditions are known and when the poses are made."""


@dataclass(frozen=True)
class Draw:
    """What one take is drawn with: ``seed`` and ``temperature``; the legs may have their own, None goes with the body's.

    Seeds are whole numbers from 0 to ``MOST_SEED``, temperatures from 0 to 10. Raises InputError for others.
    """

    seed: int = 0
    lower_seed: int | None = None
    temperature: float = 0.0
    lower_temperature: float | None = None

    def __post_init__(self) -> None:
        hold = partial(object.__setattr__, self)
        hold("seed", whole(self.seed, "The seed", 0, MOST_SEED))
        hold("temperature", number(self.temperature, "The temperature", 0.0, _HOTTEST))
        if self.lower_seed is not None:
            hold("lower_seed", whole(self.lower_seed, "The seed of the legs", 0, MOST_SEED))
        if self.lower_temperature is not None:
            hold("lower_temperature", number(self.lower_temperature, "The temperature of the legs", 0.0, _HOTTEST))


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
    """Where head and wrists have to be: world positions (N, 3), canonical metres, NaN where they are free, even in part."""
    places = to_world(shot.path, shot.conditions.observation[PREROLL:].reshape(-1, 22, 3))
    given = (shot.conditions.given[PREROLL:] > 0) & (shot.share[PREROLL:] >= 1.0)
    slots = {name: MODEL_ORDER.index(j) for name, j in END_EFFECTORS.items()}
    return {name: np.where(given[:, slot, None], places[:, slot], np.nan) for name, slot in slots.items()}


def cleaned_up(joints: np.ndarray, shot: Shot, settings: CleanUp) -> np.ndarray:
    """``_clean_up_steps`` drained."""
    return drained(_clean_up_steps(joints, shot, settings))


def _clean_up_steps(joints: np.ndarray, shot: Shot, settings: CleanUp) -> Generator[float, None, np.ndarray]:
    """Joints (N, 22, 3) of a shot, canonical metres, on constant bones, after all that ``settings`` ask for."""
    tops = tops_under(shot.scene, shot.path) if settings.seat else None
    floor = shot.path.position[:, 2]
    reach = partial(distance, shot.scene, floor=floor) if shot.scene.solids else None
    yield 0.2
    return (yield from within(cleaning_steps(joints, targets_of(shot), settings, floor, tops, reach), 0.2, 1.0))


def _led_over(conditions: Conditions, share: np.ndarray, free: np.ndarray) -> Conditions:
    """The conditions with targets that count in part moved towards where the joints are when they are ``free`` (T, 66)."""
    way = np.repeat(share, 3, axis=-1)
    return replace(conditions, observation=(1.0 - way) * free + way * conditions.observation)


def _joints(rotations: np.ndarray, pelvis: np.ndarray) -> np.ndarray:
    return forward_kinematics(global_from_local(matrix_from_quaternion(rotations)), pelvis)


def _finished_steps(
    poses: np.ndarray, action: np.ndarray, shot: Shot, controls: Controls, clean_up: CleanUp, log_likelihood: float
) -> Generator[float, None, Take]:
    """The take of the model's poses (PREROLL + N, 66), with ``action`` (T, K) at the controls' rate; yields progress."""
    started = perf_counter()
    source, target = frame_times(len(shot.path), MODEL_FPS), frame_times(len(controls), controls.fps)
    turned = [_rotation(controls, name, source) for name in ("head_rotation", "hand_left_rotation", "hand_right_rotation")]
    switches = np.flatnonzero(shot.modes[1:] != shot.modes[:-1]) + 1
    length = round(controls.blend * MODEL_FPS)
    floor = shot.path.position[:, 2]
    reach = partial(distance, shot.scene, floor=floor) if shot.scene.solids else None
    judged = partial(summary, fps=MODEL_FPS, floor=floor, targets=targets_of(shot), distance=reach)

    def eased(pelvis: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Local quaternions and pelvis, eased over mode switches."""
        local = continuous_signs(quaternion_from_matrix(local_from_global(frames)))
        return blend_switches(local, pelvis, shot.path, switches, length) if len(switches) and length else (local, pelvis)

    pelvis, frames = fit(to_world(shot.path, poses[PREROLL:].reshape(-1, 22, 3)), 1.0, *turned)
    yield 0.2
    joints = forward_kinematics(frames, pelvis)
    local, pelvis = eased(pelvis, frames)
    metrics = raw = judged(_joints(local, pelvis))
    yield 0.4
    if clean_up.asked:
        joints = yield from within(_clean_up_steps(joints, shot, clean_up), 0.4, 0.6)
        yield 0.6
        local, pelvis = eased(*fit(joints, 1.0, *turned))
        yield 0.8
        metrics = judged(_joints(local, pelvis))
    yield 1.0

    # From 30 frames a second to the controls' own rate, and to the character's own size.
    rotations = resample_rotations(local, source, target)
    pelvis = resample_positions(pelvis, source, target)
    root = resample_path(shot.path, MODEL_FPS, controls.fps, len(controls))
    return Take(
        controls.fps, _joints(rotations, pelvis) * controls.scale, rotations,
        RootPath(root.position * controls.scale, root.yaw).matrices(), action, controls.scale, poses, shot.path,
        log_likelihood, raw, metrics, {"fitting": perf_counter() - started}, shot.warnings,
    )


def takes_steps(
    scene: Scene, controls: Controls, weights: Weights, draws: Sequence[Draw], *, resume: Take | None = None,
    resume_frame: int = 0, device: str | None = None, clean_up: CleanUp = RAW,
    watch: Callable[[int, np.ndarray], None] | None = None,
) -> Generator[float, None, list[Take]]:
    """Generate takes of one shot side by side, one for each of ``draws``; yields progress in [0, 1].

    ``resume``: a take whose motion before ``resume_frame`` (a frame of the controls) is kept, and gone on from. ``device``:
    None runs on NumPy, else on that torch device. ``clean_up``: what is done to the joints after the model; nothing by default.
    ``watch`` is shown each frame of the first take as it is made: its index at 30 fps, and the joints (22, 3) in the world,
    metres. Raises InputError for what cannot be used, WeightsError for weights that do not fit.
    """
    started = perf_counter()
    yield 0.0
    shot = yield from within(shot_steps(scene, controls), 0.0, _CONDITIONED)
    conditioned = perf_counter()
    sampler = Sampler(weights, device)
    z = np.concatenate([sampler.noise(d.seed, d.lower_seed, d.temperature, d.lower_temperature) for d in draws])
    kept = None
    if resume is not None and resume_frame > 0:
        kept = np.repeat(_kept(resume, resume_frame, shot.path)[:, None], len(draws), axis=1)

    def shown(frame: int, pose: np.ndarray) -> None:
        if watch is not None and frame >= PREROLL:
            at = RootPath(shot.path.position[frame - PREROLL, None], shot.path.yaw[frame - PREROLL, None])
            watch(frame - PREROLL, to_world(at, pose.reshape(1, 22, 3))[0] * controls.scale)

    conditions, sampling = shot.conditions, _CONDITIONED
    if ((shot.share > 0.0) & (shot.share < 1.0)).any():
        # Where a target counts in part, the calm take tells where the joint would be without it.
        without = replace(conditions, given=(shot.share >= 1.0).astype(float))
        sampling = (_CONDITIONED + _SAMPLED) / 2
        calm = yield from within(sampler.run(without, np.zeros((1, 66))), _CONDITIONED, sampling)
        conditions = _led_over(conditions, shot.share, model_order(calm.poses[:, 0]))
    made = yield from within(sampler.run(conditions, z, kept, shown), sampling, _SAMPLED)
    seconds = {"conditions": conditioned - started, "sampling": perf_counter() - conditioned}

    source, target = frame_times(len(shot.path), MODEL_FPS), frame_times(len(controls), controls.fps)
    takes = []
    for b in range(len(draws)):
        action = resample_positions(made.actions[PREROLL:, b], source, target)
        density = float(made.log_likelihood[PREROLL:, b].mean())
        take = yield from within(
            _finished_steps(made.poses[:, b], action, shot, controls, clean_up, density),
            _SAMPLED + (1.0 - _SAMPLED) * b / len(draws), _SAMPLED + (1.0 - _SAMPLED) * (b + 1) / len(draws),
        )
        takes.append(replace(take, seconds=seconds | take.seconds))
    return takes


def clean_again_steps(scene: Scene, controls: Controls, take: Take, clean_up: CleanUp) -> Generator[float, None, Take]:
    """The take with another clean-up, without sampling again; ``scene`` and ``controls`` as it was generated with."""
    shot = yield from within(shot_steps(scene, controls), 0.0, 0.5)
    if len(shot.path) != len(take.path):
        raise InputError("The take has other frames than the controls; generate it again.")
    return (yield from within(
        _finished_steps(take.poses, take.action, shot, controls, clean_up, take.log_likelihood), 0.5, 1.0,
    ))


def generate_steps(
    scene: Scene, controls: Controls, weights: Weights, *, seed: int = 0, lower_seed: int | None = None,
    temperature: float = 0.0, resume: Take | None = None, resume_frame: int = 0, device: str | None = None,
    clean_up: CleanUp = RAW,
) -> Generator[float, None, Take]:
    """Generate one take; yields progress in [0, 1] and returns the ``Take``.

    ``temperature`` scales the take's noise; 0 is the pose at z = 0, 1 the spread of captured takes. ``lower_seed``: another
    seed for the legs. The rest is as in ``takes_steps``.
    """
    takes = yield from takes_steps(
        scene, controls, weights, [Draw(seed, lower_seed, temperature)], resume=resume, resume_frame=resume_frame,
        device=device, clean_up=clean_up,
    )
    return takes[0]


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
