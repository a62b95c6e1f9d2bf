"""How good a motion is: the paper's three metrics (section 6.2), and others that are commonly
reported.

Joints are (T, 22, 3), world, metres, at ``fps``. What the paper counts in frames is counted in
frames of 1/30 s: a motion at another rate gets the same means. ``floor`` is the ground's height,
one number or one for each frame (T,). Distances are signed, metres, negative inside a solid. A
metric says little alone: give it beside the same metric of real motion.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .root import RootPath
from .series import MODEL_FPS, runs
from .skeleton import END_EFFECTORS, FEET, PARENTS, PELVIS, SEAT_TO_PELVIS, TOE_HEIGHT, joint
from .sliding import slides

__all__ = [
    "BAD_COLLISION_JOINTS",
    "Seat",
    "SeatEpisode",
    "foot_sliding",
    "skate",
    "end_effector_distance",
    "bad_collisions",
    "body_points",
    "penetration",
    "seat_episodes",
    "seat_report",
    "standing_pelvis_height",
    "bone_length_variation",
    "jerk",
    "diversity",
    "motion_metrics",
    "entropy",
    "action_information",
    "mutual_information",
]


# The paper's thresholds (section 6.2).
_PAPER_STATURE = 1.7  # metres; end-effector errors are divided by it
_COLLIDER = 0.10  # metres; radius of the sphere colliders
_LOW_TOE = 0.07  # metres over the floor, under which a toe base slides
_SLIDES = 0.004  # metres in a frame of 1/30 s, above which it does

# Those of mode-adaptive networks and the Neural State Machine.
_SKATES_UNDER = 0.025  # metres over the height of a planted toe base

_WALKS = 0.3  # metres a second of the root, above which it walks

BAD_COLLISION_JOINTS = tuple(
    joint(name)
    for name in (
        "spine1",
        "spine2",
        "spine3",
        "neck",
        "head",
        "left_collar",
        "right_collar",
        "left_shoulder",
        "right_shoulder",
        "left_elbow",
        "right_elbow",
        "left_knee",
        "right_knee",
    )
)
"""The 13 joints whose contact with furniture is never wanted."""


def _per_second(values: np.ndarray, fps: float) -> np.ndarray:
    """Change of values (T, …) a second, from the frame before; the first frame's is the
    second's.
    """
    change = np.diff(values, axis=0, prepend=values[:1]) * fps
    if len(values) > 1:
        change[0] = change[1]
    return change


def _over_floor(heights: np.ndarray, floor: np.ndarray | float) -> np.ndarray:
    """Heights (T, N) over the floor of their frame."""
    return heights - np.broadcast_to(np.asarray(floor, float), len(heights))[:, None]


def foot_sliding(
    joints: np.ndarray,
    fps: float,
    floor: np.ndarray | float = 0.0,
    per_frame: bool = True,
) -> np.ndarray:
    """FS: how many feet slide in each frame (T,), 0 to 2; at 30 fps its sum is the paper's count.

    Paper, 6.2: a toe base under 7 cm that moves faster than 0.4 cm "per second". Read so
    (``per_frame`` False) real motion fails more often than the paper's results, so 0.4 cm per frame
    of 1/30 s (12 cm/s) must be meant, the default. Speed is that of the joint in space, as printed;
    vertical motion counts.
    """
    toes = joints[:, FEET]
    speed = np.linalg.norm(_per_second(toes, fps), axis=-1)
    low = _over_floor(toes[..., 2], floor) < _LOW_TOE
    return (low & (speed > (_SLIDES * MODEL_FPS if per_frame else _SLIDES))).sum(axis=1)


def skate(joints: np.ndarray, fps: float, floor: np.ndarray | float = 0.0) -> float:
    """Mean skating of a foot, centimetres per frame of 1/30 s: v (2 - 2^(h / 2.5 cm)), 0 where h is
    over 2.5 cm.

    Mode-adaptive networks (Zhang et al. 2018) and the Neural State Machine (Starke et al. 2019); v
    is the toe base's horizontal speed. Their h is a foot's height over the ground; ours is over the
    height of a planted toe base, so that a planted foot has the full weight.
    """
    toes = joints[:, FEET]
    speed = np.linalg.norm(_per_second(toes[..., :2], fps), axis=-1) * 100.0 / MODEL_FPS
    height = np.clip(_over_floor(toes[..., 2], floor) - TOE_HEIGHT, 0.0, _SKATES_UNDER)
    return float((speed * (2.0 - 2.0 ** (height / _SKATES_UNDER))).mean())


def end_effector_distance(joints: np.ndarray, targets: Mapping[str, np.ndarray | None]) -> float:
    """EED: mean distance of head and wrists from their targets, over a stature of 1.7 m. NaN where
    there is no target.

    Paper, 6.2. ``targets``: (T, 3) by the names of ``skeleton.TARGETS``, None or NaN where free;
    feet do not count.
    """
    errors = [
        np.linalg.norm(joints[:, END_EFFECTORS[name]] - target, axis=-1)
        for name, target in targets.items()
        if target is not None and name in END_EFFECTORS
    ]
    given = (
        np.concatenate([error[np.isfinite(error)] for error in errors]) if errors else np.zeros(0)
    )
    return float(given.mean() / _PAPER_STATURE) if len(given) else float("nan")


def bad_collisions(distance: np.ndarray) -> np.ndarray:
    """BCC: how many of 13 spheres of 10 cm touch furniture in each frame (T,); its sum is the
    paper's count.

    ``distance`` (T, 13): of the joints ``BAD_COLLISION_JOINTS``. The paper (6.2) counts every joint
    "except the hip, hands, and feet" of its own rig; on ours these 13 are left (pelvis, hips,
    wrists, ankles and toes are not counted).
    """
    return (distance <= _COLLIDER).sum(axis=1)


def body_points(joints: np.ndarray, per_bone: int = 4) -> np.ndarray:
    """Points (T, 1 + 21 * per_bone, 3): the pelvis, and ``per_bone`` points along every bone, the
    last on its joint.
    """
    way = np.arange(1, per_bone + 1)[:, None] / per_bone
    start, end = joints[:, list(PARENTS[1:]), None], joints[:, 1:, None]
    return np.concatenate(
        [joints[:, :1], (start + way * (end - start)).reshape(len(joints), -1, 3)], axis=1
    )


def penetration(distance: np.ndarray) -> tuple[float, float]:
    """Mean and largest depth inside furniture (metres, 0 outside) of points whose distances are (T,
    N).
    """
    depth = np.maximum(-distance, 0.0)
    return float(depth.mean()), float(depth.max(initial=0.0))


@dataclass(frozen=True)
class Seat:
    """Something to sit on: ``center`` (3,) of its top in the world; a root that rests within
    ``radius`` metres sits.
    """

    name: str
    center: np.ndarray
    radius: float = 0.35


@dataclass(frozen=True)
class SeatEpisode:
    """A rest of the root: frames ``start`` to ``stop`` (exclusive), its mean ``position`` (3,) in
    the world, and the median height of the pelvis over the local floor.
    """

    start: int
    stop: int
    position: np.ndarray
    pelvis_height: float


def seat_episodes(
    joints: np.ndarray,
    path: RootPath,
    fps: float,
    speed: float = 0.1,
    seconds: float = 0.5,
) -> list[SeatEpisode]:
    """Where the root rests (slower than ``speed`` m/s on the ground, for ``seconds`` at least),
    seated or standing.

    The pelvis' height tells which: ``standing_pelvis_height``.
    """
    rests = np.linalg.norm(_per_second(path.position[:, :2], fps), axis=-1) < speed
    height = joints[:, PELVIS, 2] - path.position[:, 2]
    return [
        SeatEpisode(
            start=start,
            stop=stop,
            position=path.position[start:stop].mean(axis=0),
            pelvis_height=float(np.median(height[start:stop])),
        )
        for start, stop in runs(rests, at_least=seconds * fps)
    ]


def seat_report(
    joints: np.ndarray,
    path: RootPath,
    fps: float,
    seats: Sequence[Seat],
) -> list[dict[str, str | float | None]]:
    """For each seat its height and the pelvis' (metres over the local floor) while the root rests
    on it, and the error.

    Error: pelvis height - (seat height + 0.12). Where the root rests there several times, the
    longest rest counts; where never, pelvis height and error are None.
    """
    episodes = seat_episodes(joints, path, fps)
    report: list[dict[str, str | float | None]] = []
    for seat in seats:
        here = [
            e for e in episodes if np.linalg.norm(e.position[:2] - seat.center[:2]) <= seat.radius
        ]
        longest = max(here, key=lambda e: e.stop - e.start, default=None)
        floor = path.position[0, 2] if longest is None else longest.position[2]
        height = float(seat.center[2] - floor)
        pelvis = None if longest is None else longest.pelvis_height
        error = None if pelvis is None else pelvis - (height + SEAT_TO_PELVIS)
        report.append(
            {"name": seat.name, "seat_height": height, "pelvis_height": pelvis, "error": error}
        )

    return report


def standing_pelvis_height(joints: np.ndarray, path: RootPath, fps: float) -> float:
    """Median height of the pelvis over the local floor while the root walks (over 0.3 m/s); NaN
    where it never does.
    """
    walks = np.linalg.norm(_per_second(path.position[:, :2], fps), axis=-1) > _WALKS
    return (
        float(np.median((joints[:, PELVIS, 2] - path.position[:, 2])[walks]))
        if walks.any()
        else float("nan")
    )


def bone_length_variation(joints: np.ndarray) -> float:
    """Largest deviation of any bone's length in any frame from its mean over time, as a fraction of
    that mean.
    """
    length = np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)
    mean = length.mean(axis=0)
    return float((np.abs(length - mean) / mean).max())


def jerk(joints: np.ndarray, fps: float) -> float:
    """Mean magnitude of the joints' third derivative by time (m/s³); 0 for fewer than four frames.

    Compare only at the same frame rate: noise weighs with the rate's third power.
    """
    if len(joints) < 4:
        return 0.0
    return float(np.linalg.norm(np.diff(joints, n=3, axis=0), axis=-1).mean() * fps**3)


def diversity(samples: np.ndarray) -> float:
    """APD: mean distance (metres, over frames and joints) between all pairs of samples (S, T, 22,
    3) of one situation.

    Yuan and Kitani (2020) take the norm of the whole flattened motion; the mean over joints does
    not grow with its length.
    """
    first, second = np.triu_indices(len(samples), k=1)
    if not len(first):
        return 0.0
    pairs = zip(first, second, strict=True)
    return float(
        np.mean([np.linalg.norm(samples[a] - samples[b], axis=-1).mean() for a, b in pairs])
    )


def motion_metrics(
    joints: np.ndarray,
    fps: float,
    *,
    floor: np.ndarray | float = 0.0,
    targets: Mapping[str, np.ndarray | None] | None = None,
    distance: Callable[[np.ndarray], np.ndarray] | None = None,
) -> dict[str, float | None]:
    """All metrics of one motion, for ``report.json``: means per frame, lengths in metres unless the
    key says otherwise.

    ``distance`` gives the signed distances (T, N) of world points (T, N, 3) to the furniture. What
    cannot be said (no furniture, no targets) is None.
    """
    collisions: float | None = None
    touching: float | None = None
    depth: tuple[float, float] | tuple[None, None] = (None, None)
    if distance is not None:
        counts = bad_collisions(distance(joints[:, list(BAD_COLLISION_JOINTS)]))
        collisions, touching = float(counts.mean()), float((counts > 0).sum() / fps)
        depth = penetration(distance(body_points(joints)))

    error = end_effector_distance(joints, targets or {})
    return {
        "foot_sliding_per_frame": float(foot_sliding(joints, fps, floor).mean()),
        "foot_sliding_4mm_s": float(foot_sliding(joints, fps, floor, per_frame=False).mean()),
        "skate_cm": skate(joints, fps, floor),
        "slide_max": float(slides(joints, fps, floor, targets).max(initial=0.0)),
        "bad_collisions_per_frame": collisions,
        "bad_collision_seconds": touching,
        "penetration_mean": depth[0],
        "penetration_max": depth[1],
        "end_effector_error": None if np.isnan(error) else error,
        "bone_length_variation": bone_length_variation(joints),
        "jerk": jerk(joints, fps),
    }


def entropy(probabilities: np.ndarray) -> np.ndarray:
    """Entropy (…) in nats of distributions (…, K)."""
    return -(probabilities * np.log(np.maximum(probabilities, 1e-12))).sum(-1)


def action_information(actions: np.ndarray) -> float:
    """How far actions (T, K) tell frames apart: H(mean π) - mean H(π), nats; 0 where π is always
    the same, at most log K.
    """
    return float(entropy(actions.mean(0)) - entropy(actions).mean())


def mutual_information(first: np.ndarray, second: np.ndarray) -> float:
    """Normalised mutual information of two labellings (T,): 0 independent, 1 the same; over the
    mean of their entropies.
    """
    _, a = np.unique(first, return_inverse=True)
    _, b = np.unique(second, return_inverse=True)
    joint_share = np.zeros((a.max() + 1, b.max() + 1))
    np.add.at(joint_share, (a, b), 1.0 / len(a))
    apart = float(entropy(joint_share.sum(1)) + entropy(joint_share.sum(0)))
    return 2.0 * (apart - float(entropy(joint_share.ravel()))) / apart if apart > 0 else 0.0
