"""From the animator's controls and the scene to what the model is given at each frame, at 30 fps
and on the canonical body.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .beginning import PREROLL, beginning_at
from .checks import in_frames
from .distance import prepared, rigid_split, scaled
from .drawn_up import seen_while_sitting_down
from .errors import InputError
from .grid import BAND
from .kinematics import Turn
from .nearby import REACH_OF_A_BODY, solids_near
from .occupancy import occupancy
from .passage import SatOn, listed, passages, seats_along
from .progress import within
from .resampling import (
    covering_frames,
    frame_times,
    resample_nearest,
    resample_path,
    resample_positions,
    resample_rigid,
)
from .root import RootPath, ahead, root_from_matrices, smoothed, to_root, to_world, velocities
from .rotations import frame_from, normalised, rotate, transpose
from .sampler import Conditions
from .series import MODEL_FPS, smoothstep
from .skeleton import FEET_ASKED, LOWER, MODEL_ORDER, OFFSETS, PARENTS, PELVIS, TARGETS, UPPER
from .solids import Box, Mesh, Scene
from .take import Controls

__all__ = [
    "Change",
    "Shot",
    "Request",
    "rolled",
    "shot_steps",
    "foot_targets",
    "targets_of",
    "turns_of",
    "STAYS",
]

_SLOTS = {name: MODEL_ORDER.index(j) for name, j in TARGETS.items()}
_TOES = {name: PARENTS.index(j) for name, j in FEET_ASKED.items()}
_COUNTS_IN = {name: ("EE", "FULL") if name in FEET_ASKED else ("EE",) for name in TARGETS}
"""The modes in which a target counts."""
_TILT = np.radians(5.0)  # of a root, above which the user is told that it is flattened
_SPRINT = 10.5  # metres a second, which nobody runs: a root that is faster jumps

# A sphere that holds every head and wrist of the training poses, and one that holds every ankle:
# its centre over the root, and its radius, metres.
_REACH_FROM = np.array([0.0, 0.0, 1.0])
_REACH = 1.25
_FEET_REACH_FROM = np.array([0.0, 0.0, 0.7])
_FEET_REACH = 1.1

STAYS = (
    "The root does not move, so the character stays where it is; animate the root to make it walk."
)
"""What is said of a root that does not move in the whole shot."""
_STILL = 0.02  # metres or radians in the whole shot, under which a root does not move
_FAR_FROM_ROOT = 1.0  # metres that a pelvis may be beside its root where the character begins
_CROWDED = 0.35  # share of the sensor that furniture fills, above which the user is told
_FILLED = 0.75  # occupancy of a sphere whose centre is 4 cm from a solid


@dataclass(frozen=True)
class Change:
    """A change of mode at the frame ``start``; ``ease`` (M,): how far the new mode counts at that
    frame and those after it.

    ``observation`` (M, 66), ``share`` (M, 22): what would be asked at these frames if the mode
    stayed as it was before.
    """

    start: int
    ease: np.ndarray
    observation: np.ndarray
    share: np.ndarray

    @property
    def frames(self) -> slice:
        """Those over which the body comes over."""
        return slice(self.start, self.start + len(self.ease))


@dataclass(frozen=True)
class Request:
    """What is asked of the body at N frames of a root's path, in its frames, canonical metres.

    ``observation`` (N, 66): c_ob, model order; ``share`` (N, 22): how far each joint in it counts,
    0 where it is not given; ``changes``: those changes of mode that make a difference to either.
    """

    observation: np.ndarray
    share: np.ndarray
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class Shot:
    """``conditions`` of ``PREROLL`` + N frames at 30 fps; ``path`` (N): R^τ, canonical metres;
    ``request``: what is asked at its frames; ``scene``: the furniture within reach at these frames,
    canonical metres. ``own_path``, ``own_request``, ``own_scene``: the same at the controls' own
    frames. ``warnings``: sentences for the user. ``before`` (PREROLL + 1, 66): the body's poses
    before the first frame and in it, where they are given.
    """

    conditions: Conditions
    path: RootPath
    request: Request
    scene: Scene
    own_path: RootPath
    own_request: Request
    own_scene: Scene
    warnings: tuple[str, ...]
    before: np.ndarray | None = None


def _path_of(
    controls: Controls, times: np.ndarray, target: np.ndarray, warnings: list[str]
) -> tuple[RootPath, RootPath | None]:
    """R^τ: the root flattened, at 30 fps, smoothed once; and that of the ``PREROLL`` frames before
    it, where it is said how it moved.
    """
    raw, tilt = root_from_matrices(np.asarray(controls.root, float))
    if tilt > _TILT:
        warnings.append(
            f"The root tilts by up to {np.degrees(tilt):.0f}°; only its heading and position were "
            "used."
        )

    moved = np.ptp(raw.position, axis=0).max() / controls.scale
    if len(raw) == 1:
        warnings.append(
            "There is only one frame, so the result is a pose; widen the frame range to get motion."
        )
    elif moved < _STILL and np.ptp(raw.yaw) < _STILL:
        warnings.append(STAYS)

    step = np.linalg.norm(np.diff(raw.position, axis=0), axis=1) / controls.scale
    if len(step) and step.max() > _SPRINT / controls.fps:
        frame = int(np.argmax(step)) + 1
        warnings.append(
            f"The root jumps {step.max() * controls.scale:.1f} m, {frame} frames after the first; "
            "slow it down there."
        )

    earlier = 0
    if controls.before_root is not None:
        earlier = PREROLL
        whole = np.concatenate([controls.before_root[:-1], controls.root])
        raw, _ = root_from_matrices(whole)
        times = np.concatenate([_times_before(controls)[:-1], times])
        target = np.concatenate([_model_times_before(controls)[:-1], target])

    position = resample_positions(raw.position / controls.scale, times, target)
    path = smoothed(RootPath(position, resample_positions(raw.yaw, times, target)))
    if not earlier:
        return path, None
    return (
        RootPath(path.position[earlier:], path.yaw[earlier:]),
        RootPath(path.position[:earlier], path.yaw[:earlier]),
    )


def _times_before(controls: Controls) -> np.ndarray:
    """Seconds of what is given of the time before the first frame, up to it: 0."""
    frames = 0 if controls.before is None else len(controls.before)
    return -frame_times(frames, controls.fps)[::-1]


def _model_times_before(controls: Controls) -> np.ndarray:
    """The same of the model's ``PREROLL`` frames and the first one; what came before all that is
    given was as its first frame.
    """
    return np.maximum(-frame_times(PREROLL + 1, MODEL_FPS)[::-1], _times_before(controls)[0])


def _poses_before(controls: Controls, whole: RootPath) -> np.ndarray | None:
    """The body's poses (PREROLL + 1, 66) before the first frame and in it, on a path that begins
    as long before; None where nothing is said of them. Raises InputError where the body is far from
    its root.
    """
    if controls.before is None:
        return None
    joints = resample_positions(
        controls.before / controls.scale, _times_before(controls), _model_times_before(controls)
    )
    there = RootPath(whole.position[: PREROLL + 1], whole.yaw[: PREROLL + 1])
    poses = to_root(there, joints)
    away = float(np.linalg.norm(poses[-1, PELVIS, :2]))
    if away > _FAR_FROM_ROOT:
        raise InputError(
            f"The character is {away * controls.scale:.1f} m from its root in the first frame; "
            "bring the root there, or let the character begin standing."
        )
    return poses.reshape(PREROLL + 1, -1)


def _targets(
    controls: Controls, name: str, times: np.ndarray, target: np.ndarray, path: RootPath
) -> np.ndarray | None:
    value = getattr(controls, name)
    if value is None:
        return None
    return to_root(
        path, resample_positions(np.asarray(value, float) / controls.scale, times, target)
    )


def _body(
    controls: Controls, name: str, times: np.ndarray, target: np.ndarray, path: RootPath
) -> np.ndarray:
    """The upper or the lower body to follow (N, J, 3), root frame; between a frame that has one and
    one that has none, the nearest's.
    """
    body = np.asarray(getattr(controls, name), float) / controls.scale
    full = _modes(controls) == "FULL"
    if not np.isfinite(body[full]).all():
        raise InputError(
            f"The {name.replace('_', ' ')} to follow has a joint that is not a number; fix its "
            "animation."
        )

    between = resample_positions(body, times, target)
    return to_root(
        path, np.where(np.isfinite(between), between, resample_nearest(body, times, target))
    )


def _to_toes(
    controls: Controls, name: str, times: np.ndarray, target: np.ndarray, path: RootPath
) -> np.ndarray:
    """From a foot's ankle to its toe base (N, 3), root frame, as its rotation asks; NaN where that
    is free.
    """
    asked = getattr(controls, f"{name}_rotation")
    if asked is None:
        return np.full((len(path), 3), np.nan)
    known = np.isfinite(asked).all(axis=(1, 2))
    ahead, up = (np.where(known[:, None], asked[..., k], np.eye(3)[k]) for k in (1, 2))
    axes = frame_from(ahead, up, "yz")
    offsets = np.where(known[:, None], axes @ OFFSETS[_TOES[name]], np.nan)
    across = normalised(resample_positions(offsets, times, target))
    return rotate(transpose(path.rotation), across * np.linalg.norm(OFFSETS[_TOES[name]]))


def _influence(controls: Controls, name: str, times: np.ndarray, target: np.ndarray) -> np.ndarray:
    """How far a target counts at the model's frames (N,)."""
    value = getattr(controls, f"{name}_influence")
    if value is None:
        return np.ones(len(target))
    return np.clip(
        resample_positions(np.asarray(value, float)[:, None], times, target)[:, 0], 0.0, 1.0
    )


def _observed(
    controls: Controls,
    modes: np.ndarray,
    times: np.ndarray,
    target: np.ndarray,
    path: RootPath,
    warnings: list[str],
) -> tuple[np.ndarray, np.ndarray]:
    """c_ob (N, 66), root frame, model order, and how far each joint in it counts (N, 22), 0 where
    it is not given.
    """
    frames = len(path)
    observation, share = np.zeros((frames, 22, 3)), np.zeros((frames, 22))
    full = modes == "FULL"
    if full.any() and controls.upper_body is None and controls.lower_body is None:
        raise InputError(
            "The mode is FULL but there is no upper body to follow; choose a source, or use FREE "
            "or EE."
        )

    for name, joints in (("upper_body", UPPER), ("lower_body", LOWER)):
        if not full.any() or getattr(controls, name) is None:
            continue

        body = _body(controls, name, times, target, path)
        rows = full & np.isfinite(body).all(axis=(1, 2))
        slots = [MODEL_ORDER.index(j) for j in joints]
        observation[np.ix_(rows, slots)], share[np.ix_(rows, slots)] = body[rows], 1.0
        if name == "upper_body":
            share[rows, MODEL_ORDER.index(0)] = float(controls.pelvis_given)

    for name, slot in _SLOTS.items():
        place = _targets(controls, name, times, target, path)
        if place is None:
            continue

        influence = _influence(controls, name, times, target)
        used = np.isin(modes, _COUNTS_IN[name]) & np.isfinite(place).all(-1) & (influence > 0.0)
        middle, reach = (
            (_FEET_REACH_FROM, _FEET_REACH) if name in FEET_ASKED else (_REACH_FROM, _REACH)
        )
        far = np.linalg.norm(place - middle, axis=-1)
        if (used & (far > reach)).any():
            metres = float(np.nanmax(np.where(used, far, np.nan))) * controls.scale
            words = name.replace("_", " ")
            warnings.append(
                f"The target of '{words}' is up to {metres:.1f} m away; it is reached for, not "
                "reached."
            )
            within = middle + normalised(place - middle) * reach
            place = np.where((far > reach)[:, None], within, place)

        observation[used, slot], share[used, slot] = place[used], influence[used]
        if name in FEET_ASKED:
            toes = place + _to_toes(controls, name, times, target, path)
            used &= np.isfinite(toes).all(-1)
            slot = MODEL_ORDER.index(_TOES[name])
            observation[used, slot], share[used, slot] = toes[used], influence[used]

    return observation.reshape(frames, -1), share


def _request(controls: Controls, path: RootPath, fps: float, warnings: list[str]) -> Request:
    """What is asked at the frames of ``path``, ``fps`` of them a second."""
    times, target = frame_times(len(controls), controls.fps), frame_times(len(path), fps)
    modes = resample_nearest(_modes(controls), times, target)
    observation, share = _observed(controls, modes, times, target, path, warnings)
    changes = []
    for start, ease in _starts(modes, controls.blend * fps):
        frames = slice(start, start + len(ease))
        there = RootPath(path.position[frames], path.yaw[frames])
        stayed = np.repeat(modes[start - 1], len(ease))
        change = Change(start, ease, *_observed(controls, stayed, times, target[frames], there, []))
        _hold(change, observation[start - 1], share[start - 1])
        if _altered(change, observation, share).any():
            changes.append(change)

    return Request(observation, share, tuple(changes))


def _modes(controls: Controls) -> np.ndarray:
    """That of each frame (T,)."""
    return np.array(
        [controls.mode] * len(controls) if isinstance(controls.mode, str) else controls.mode
    )


def _starts(modes: np.ndarray, length: float) -> list[tuple[int, np.ndarray]]:
    """The frames at which another mode begins, and how far it counts there and after it (M,),
    ``length`` frames long.

    No more than two are under way at once: of modes that change sooner the first has come over when
    the third begins.
    """
    longest_ease = round(length)
    starts = (np.flatnonzero(modes[1:] != modes[:-1]) + 1).tolist() if longest_ease else []
    out = []
    for start, third in zip(starts, [*starts[2:], *2 * [len(modes) + longest_ease]], strict=False):
        longest = min(longest_ease, third - start)
        out.append(
            (
                start,
                smoothstep((np.arange(min(longest, len(modes) - start)) + 1.0) / (longest + 1.0)),
            )
        )

    return out


def _hold(change: Change, observation: np.ndarray, share: np.ndarray) -> None:
    """What a mode that has ended tells no more stays, beside the root, as it was: targets may end
    with it.

    ``observation`` (66,), ``share`` (22,): of the frame before the change.
    """
    for t, stayed in enumerate(change.observation.reshape(-1, 22, 3)):
        gone = (change.share[t] == 0.0) & (share > 0.0)
        change.share[t, gone] = share[gone]
        stayed[gone] = observation.reshape(22, 3)[gone]
        observation, share = stayed, change.share[t]


def _altered(change: Change, observation: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Of which joints (M, 22) a change of mode tells something else, at each of its frames."""
    now, then = (
        each.reshape(-1, 22, 3) for each in (observation[change.frames], change.observation)
    )
    counts = share[change.frames]
    return (counts != change.share) | ((counts > 0.0) & (now != then).any(-1))


def targets_of(path: RootPath, request: Request) -> dict[str, np.ndarray]:
    """Where head, wrists and ankles have to be: world positions (N, 3), canonical metres, NaN where
    they are free, even in part, or on their way from what another mode asked.
    """
    places = to_world(path, request.observation.reshape(-1, 22, 3))
    given = request.share >= 1.0
    for change in request.changes:
        given[change.frames] &= ~_altered(change, request.observation, request.share)
    return {
        name: np.where(given[:, slot, None], places[:, slot], np.nan)
        for name, slot in _SLOTS.items()
    }


def foot_targets(controls: Controls) -> dict[str, np.ndarray]:
    """Where feet are asked to be (T, 3), metres, by name; NaN where they are free, even in part."""
    out, counts = {}, _modes(controls) != "FREE"
    for name in FEET_ASKED:
        if (target := getattr(controls, name)) is not None:
            share = getattr(controls, f"{name}_influence")
            whole = counts if share is None else counts & (share >= 1.0)
            out[name] = np.where(whole[:, None], target, np.nan)
    return out


def turns_of(controls: Controls, path: RootPath) -> dict[str, Turn]:
    """How head, hands and feet have to be turned, at the controls' own frames, those of ``path``:
    by name, where anything is asked.

    As positions do, a rotation counts in the mode EE, a foot's in FULL as well, by its influence,
    and more and more after a change of mode.
    """
    modes, times = _modes(controls), frame_times(len(controls), controls.fps)
    out = {}
    for name in TARGETS:
        asked = getattr(controls, f"{name}_rotation")
        if asked is None:
            continue

        asked = np.array(asked, float)
        known = np.isfinite(asked).all(axis=(1, 2))
        counts = np.where(
            np.isin(modes, _COUNTS_IN[name]) & known, _influence(controls, name, times, times), 0.0
        )
        share = counts.copy()
        for start, ease in _starts(modes, controls.blend * controls.fps):
            frames = slice(start, start + len(ease))
            share[frames] = (1.0 - ease) * share[start - 1] + ease * counts[frames]
            for t in np.flatnonzero(~known[frames]) + start:  # as it was, beside the root
                asked[t] = path.rotation[t] @ path.rotation[t - 1].T @ asked[t - 1]

        if (share > 0.0).any():
            out[name] = Turn(asked, share)

    return out


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


def _look_around(
    scene: Scene,
    path: RootPath,
    seats: Sequence[SatOn],
    occupied: np.ndarray,
    warnings: list[str],
) -> None:
    met = passages(scene, path, MODEL_FPS, seats)
    if met:
        places = listed(
            met,
            lambda each: (
                f"from {each.start / MODEL_FPS:.1f} to {(each.stop - 1) / MODEL_FPS:.1f} s"
            ),
        )
        warnings.append(
            f"The root runs through furniture in the shot, {places}; move the path or the "
            "furniture."
        )

    crowd = (occupied > _FILLED).mean(axis=1)
    if crowd.max() > _CROWDED:
        warnings.append(
            f"Furniture fills {100 * crowd.max():.0f} % of the character's surroundings "
            f"{np.argmax(crowd) / MODEL_FPS:.1f} s "
            "into the shot, more than the sensor can tell apart; give the character room."
        )


def shot_steps(scene: Scene, controls: Controls) -> Generator[float, None, Shot]:
    """Everything that the model is given; yields progress in [0, 1], solid by solid. Raises
    InputError for bad controls.
    """
    if not isinstance(scene, Scene) or not isinstance(controls, Controls):
        raise InputError(
            "What is to be generated is not given as a Scene and Controls; make one of each."
        )

    for solid in scene.solids:
        in_frames(
            solid.matrices() if isinstance(solid, Box) else solid.matrix, solid.name, len(controls)
        )

    warnings: list[str] = []
    frames = covering_frames(len(controls), controls.fps)
    times, target = frame_times(len(controls), controls.fps), frame_times(frames, MODEL_FPS)
    path, lead = _path_of(controls, times, target, warnings)
    request = _request(controls, path, MODEL_FPS, warnings)

    if not scene.solids:
        warnings.append("There is no furniture; the character walks and stands on a bare floor.")

    # Nothing farther away than the body, or the upper body that it is given, is felt or seen: it
    # need not be measured.
    farthest = float(np.linalg.norm(request.observation.reshape(-1, 3), axis=1).max())
    places = path.position * controls.scale
    moved = _at_model_rate(scene, times, target)
    near = solids_near(moved, places, max(REACH_OF_A_BODY, farthest + BAND), controls.scale)
    # Measured in the body's own metres: a giant's grids reach as far for its size as a child's, and
    # are as fine.
    own_scene = scaled(_those(scene, moved, near), 1.0 / controls.scale)
    floor = float(np.median(path.position[:, 2]))
    scene, said = yield from within(
        prepared.steps(scaled(near, 1.0 / controls.scale), floor, controls.scale), 0.0, 0.5
    )
    warnings += said
    occupied = yield from within(occupancy.steps(scene, path), 0.5, 1.0)
    seats = seats_along(scene, path, MODEL_FPS)
    _look_around(scene, path, seats, occupied, warnings)
    start = RootPath(path.position[:1], path.yaw[:1])
    begun = beginning_at(scene, start, occupied[0], lead)
    occupied = seen_while_sitting_down(scene, path, seats, occupied)
    whole = RootPath(
        np.concatenate([begun.path.position, path.position]),
        np.concatenate([begun.path.yaw, path.yaw]),
    )
    given = rolled(request.share > 0.0).astype(float)
    given[: begun.arrives] = 0.0
    conditions = Conditions(
        velocity=velocities(whole),
        ahead=ahead(whole),
        occupancy=np.concatenate([begun.occupancy, occupied]),
        observation=rolled(request.observation),
        given=given,
    )
    own_path = resample_path(path, MODEL_FPS, controls.fps, len(controls))
    return Shot(
        conditions=conditions,
        path=path,
        request=request,
        scene=scene,
        own_path=own_path,
        own_request=_request(controls, own_path, controls.fps, []),
        own_scene=_with_grids(own_scene, scene),
        warnings=tuple(warnings),
        before=_poses_before(controls, whole),
    )


def rolled(values: np.ndarray) -> np.ndarray:
    """Values (N, …) of a shot with the first one held for ``PREROLL`` frames before it."""
    return np.concatenate([np.repeat(values[:1], PREROLL, axis=0), values])


def _those(scene: Scene, moved: Scene, near: Scene) -> Scene:
    """The solids of a scene whose counterparts in the same scene, ``moved``, are ``near``."""
    found = {id(solid) for solid in near.solids}
    return Scene(
        tuple(a for a, b in zip(scene.solids, moved.solids, strict=True) if id(b) in found)
    )


def _with_grids(scene: Scene, ready: Scene) -> Scene:
    """A scene with the grids that the meshes of another one, the same at other frames, have."""
    solids: list[Box | Mesh] = []
    for solid, other in zip(scene.solids, ready.solids, strict=True):
        if isinstance(solid, Mesh) and isinstance(other, Mesh):
            solid = replace(solid, grid=other.grid)
        solids.append(solid)
    return Scene(tuple(solids))
