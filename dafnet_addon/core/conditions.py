"""From the animator's controls and the scene to what the model is told at each frame, at 30 fps and on the canonical body."""

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from .checks import in_frames
from .distance import BAND, prepared_steps, rigid_split, scaled
from .errors import InputError
from .nearby import REACH_OF_A_BODY, beside
from .occupancy import occupancy_steps
from .passage import listed, passages, seats_along
from .progress import within
from .resampling import MODEL_FPS, covering_frames, frame_times, resample_nearest, resample_positions, resample_rigid
from .root import RootPath, ahead, root_from_matrices, smoothed, to_root, velocities
from .rotations import normalised
from .sampler import Conditions
from .sensor import SPHERES
from .skeleton import END_EFFECTORS, MODEL_ORDER, UPPER
from .solids import Box, Mesh, Scene
from .take import Controls

__all__ = ["Shot", "over_a_seat", "shot_steps", "PREROLL"]

PREROLL = 70
"""Frames for which the root stands still before the first one, so that the model's memory has settled."""

_EFFECTORS = {name: MODEL_ORDER.index(j) for name, j in END_EFFECTORS.items()}
_TILT, _SPRINT = np.radians(5.0), 10.5  # radians; metres a second
_REACH_FROM, _REACH = np.array([0.0, 0.0, 1.0]), 1.25  # a sphere that holds every head and wrist of the training poses
_STILL, _CROWDED = 0.02, 0.35
_AROUND = 6  # spheres of the sensor's innermost ring
_UNDER = (np.hypot(SPHERES[:, 0], SPHERES[:, 1]) < 0.2) & (SPHERES[:, 2] > 0.2) & (SPHERES[:, 2] < 0.9)
_SOLID = 0.3


@dataclass(frozen=True)
class Shot:
    """``conditions`` of ``PREROLL`` + N frames at 30 fps; ``path`` (N): R^τ, canonical metres; ``modes`` (N,) of MODES;
    ``scene``: the furniture within reach at these frames, canonical metres; ``share`` (``PREROLL`` + N, 22): how far what is
    given counts; ``warnings``: sentences for the user.
    """

    conditions: Conditions
    path: RootPath
    modes: np.ndarray
    scene: Scene
    share: np.ndarray
    warnings: tuple[str, ...]


def _path_of(controls: Controls, times: np.ndarray, target: np.ndarray, warnings: list[str]) -> RootPath:
    """R^τ: the root flattened, at 30 fps, smoothed once."""
    raw, tilt = root_from_matrices(np.asarray(controls.root, float))
    if tilt > _TILT:
        warnings.append(f"The root tilts by up to {np.degrees(tilt):.0f}°; only its heading and position were used.")
    moved = np.ptp(raw.position, axis=0).max() / controls.scale
    if len(raw) == 1:
        warnings.append("There is only one frame, so the result is a pose; widen the frame range to get motion.")
    elif moved < _STILL and np.ptp(raw.yaw) < _STILL:
        warnings.append("The root does not move, so the character stays where it is; animate the root to make it walk.")
    step = np.linalg.norm(np.diff(raw.position, axis=0), axis=1) / controls.scale
    if len(step) and step.max() > _SPRINT / controls.fps:
        frame = int(np.argmax(step)) + 1
        warnings.append(
            f"The root jumps {step.max() * controls.scale:.1f} m, {frame} frames after the first; slow it down there."
        )
    position = resample_positions(raw.position / controls.scale, times, target)
    path = RootPath(position, resample_positions(raw.yaw, times, target))
    return smoothed(path)


def _targets(controls: Controls, name: str, times: np.ndarray, target: np.ndarray, path: RootPath) -> np.ndarray | None:
    value = getattr(controls, name)
    if value is None:
        return None
    return to_root(path, resample_positions(np.asarray(value, float) / controls.scale, times, target))


def _influence(controls: Controls, name: str, times: np.ndarray, target: np.ndarray) -> np.ndarray:
    """How far a target counts at the model's frames (N,)."""
    value = getattr(controls, f"{name}_influence")
    if value is None:
        return np.ones(len(target))
    return np.clip(resample_positions(np.asarray(value, float)[:, None], times, target)[:, 0], 0.0, 1.0)


def _observed(
    controls: Controls, modes: np.ndarray, times: np.ndarray, target: np.ndarray, path: RootPath, warnings: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """c_ob (N, 66), root frame, model order, and how far each joint in it counts (N, 22), 0 where it is not given."""
    frames = len(path)
    observation, share = np.zeros((frames, 22, 3)), np.zeros((frames, 22))
    for name, slot in _EFFECTORS.items():
        place = _targets(controls, name, times, target, path)
        if place is None:
            continue
        influence = _influence(controls, name, times, target)
        used = (modes == "EE") & np.isfinite(place).all(-1) & (influence > 0.0)
        far = np.linalg.norm(place - _REACH_FROM, axis=-1)
        if (used & (far > _REACH)).any():
            metres = float(np.nanmax(np.where(used, far, np.nan))) * controls.scale
            words = name.replace("_", " ")
            warnings.append(f"The target of '{words}' is up to {metres:.1f} m away; it is reached for, not reached.")
            within = _REACH_FROM + normalised(place - _REACH_FROM) * _REACH
            place = np.where((far > _REACH)[:, None], within, place)
        observation[used, slot], share[used, slot] = place[used], influence[used]
    full = modes == "FULL"
    if full.any():
        body = _targets(controls, "upper_body", times, target, path)
        if body is None:
            raise InputError("The mode is FULL but there is no upper body to follow; choose a source, or use FREE or EE.")
        if not np.isfinite(body[full]).all():
            raise InputError("The upper body to follow has a joint that is not a number; fix its animation.")
        observation[full, : len(UPPER)], share[full, : len(UPPER)] = body[full], 1.0
        share[full, MODEL_ORDER.index(0)] = float(controls.pelvis_given)
    return observation.reshape(frames, -1), share


def _at_model_rate(scene: Scene, times: np.ndarray, target: np.ndarray) -> Scene:
    """The scene with moving solids at the model's frames."""
    solids: list[Box | Mesh] = []
    for solid in scene.solids:
        if isinstance(solid, Box):
            frames = solid.matrices()
            if frames.ndim == 3 and len(frames) > 1:
                moved = resample_rigid(frames, times, target)
                solid = replace(solid, center=moved[:, :3, 3], rotation=moved[:, :3, :3])
        elif np.ndim(solid.matrix) == 3 and len(solid.matrix) > 1:
            rigid, linear = rigid_split(np.asarray(solid.matrix, float))
            full = resample_rigid(rigid, times, target)
            full[:, :3, :3] = full[:, :3, :3] @ resample_positions(linear, times, target)
            solid = replace(solid, matrix=full)
        solids.append(solid)
    return Scene(tuple(solids))


def _look_around(scene: Scene, path: RootPath, occupied: np.ndarray, warnings: list[str]) -> None:
    met = passages(scene, path, MODEL_FPS, seats_along(scene, path, MODEL_FPS))
    if met:
        places = listed(met, lambda each: f"from {each.first / MODEL_FPS:.1f} to {each.last / MODEL_FPS:.1f} s")
        warnings.append(f"The root runs through furniture in the shot, {places}; move the path or the furniture.")
    crowd = occupied.mean(axis=1)
    if crowd.max() > _CROWDED:
        warnings.append(
            f"Furniture fills {100 * crowd.max():.0f} % of the character's surroundings {np.argmax(crowd) / MODEL_FPS:.1f} s "
            "into the shot, more than the sensor can tell apart; give the character room."
        )


def over_a_seat(occupancy: np.ndarray) -> bool:
    """Whether a root that sees this (2640,) is over a seat or bed, not beside one: at a seat's height all around is solid."""
    around = occupancy[_UNDER].reshape(-1, _AROUND)
    return bool(((around > _SOLID).sum(axis=1) >= _AROUND - 1).any())


def shot_steps(scene: Scene, controls: Controls) -> Generator[float, None, Shot]:
    """Everything that the model is told; yields progress in [0, 1], solid by solid. Raises InputError for bad controls."""
    if not isinstance(scene, Scene) or not isinstance(controls, Controls):
        raise InputError("What is to be generated is not given as a Scene and Controls; make one of each.")
    for solid in scene.solids:
        in_frames(solid.matrices() if isinstance(solid, Box) else solid.matrix, solid.name, len(controls))
    warnings: list[str] = []
    modes = np.array([controls.mode] * len(controls) if isinstance(controls.mode, str) else controls.mode)
    frames = covering_frames(len(controls), controls.fps)
    times, target = frame_times(len(controls), controls.fps), frame_times(frames, MODEL_FPS)
    path = _path_of(controls, times, target, warnings)
    modes = resample_nearest(modes, times, target)
    observation, share = _observed(controls, modes, times, target, path, warnings)

    if not scene.solids:
        warnings.append("There is no furniture; the character walks and stands on a bare floor.")
    # Nothing farther away than the body, or the upper body that it is given, is felt or seen: it need not be measured.
    reach = max(REACH_OF_A_BODY, float(np.linalg.norm(observation.reshape(-1, 3), axis=1).max()) + BAND)
    places = path.position * controls.scale
    near = beside(_at_model_rate(scene, times, target), places, reach, controls.scale)
    floor = float(np.median(path.position[:, 2])) * controls.scale
    moved, said = yield from within(prepared_steps(near, floor), 0.0, 0.5)
    warnings += said
    scene = scaled(moved, 1.0 / controls.scale)
    occupied = yield from within(occupancy_steps(scene, path), 0.5, 1.0)
    _look_around(scene, path, occupied, warnings)

    def rolled(values: np.ndarray, before: np.ndarray) -> np.ndarray:
        return np.concatenate([np.repeat(before, PREROLL, axis=0), values])

    # Before the first frame nothing but a seat under the root is there, so that who starts beside furniture starts standing.
    before = occupied[:1] if over_a_seat(occupied[0]) else np.zeros_like(occupied[:1])
    whole = RootPath(rolled(path.position, path.position[:1]), rolled(path.yaw, path.yaw[:1]))
    conditions = Conditions(
        velocities(whole), ahead(whole), rolled(occupied, before),
        rolled(observation, observation[:1]), rolled(share > 0.0, share[:1] > 0.0).astype(float),
    )
    return Shot(conditions, path, modes, scene, rolled(share, share[:1]), tuple(warnings))
