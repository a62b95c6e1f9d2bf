"""Captured pieces that motions are composed of: sit-downs, upper bodies at work, and walks that
come or go as a pose asks.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.root import root_from_joints, to_root, yaw_of
from ...core.rotations import normalised, rotate, transpose
from ...core.series import MODEL_FPS
from ...core.skeleton import PELVIS, joint
from ..motion.motion import COMPOSED, Motion, mirrored, motion_of

__all__ = [
    "BEFORE",
    "DIRECTIONS",
    "STAYS",
    "TOELESS",
    "WORKS",
    "Composed",
    "Piece",
    "WalkIndex",
    "entrance",
    "features_of",
    "fluent",
    "composition",
    "find_matches",
    "index_walks",
    "sit_downs",
    "upper_bodies",
    "find_walks",
]

_WALK = {
    "locomotion",
    "walk",
    "turn",
    "carry_other",
    "door",
    "reach-hand-task",
    "greeting",
    "standing",
}
_SIT = {"sit-stand", "sit_down", "stand_up"}
_MATCHED = [
    joint(n)
    for n in (
        "pelvis",
        "neck",
        "left_knee",
        "right_knee",
        "left_foot",
        "right_foot",
        "left_wrist",
        "right_wrist",
    )
]
_WEIGHTS = np.array([1.0, 0.7, 1.0, 1.0, 2.5, 2.5, 0.4, 0.4])[:, None]
_SECONDS = 0.12  # by which velocities count as lengths
BEFORE = 110  # frames of walking that are kept
_TRAVELLED = 80  # frames in which a body must have come from elsewhere
_FAR = 0.8  # metres
# metres: mean weighted difference, of places and velocities, of poses that may be joined
_ALIKE = 0.09
_CLEAR = 0.42  # metres between a seat's middle and the way to it
DIRECTIONS = 8
TOELESS = "reactidle"
WORKS = 180  # frames of work that are joined to a sit-down or a walk
_SLOW = 0.45  # metres per second of the root
_LONGEST, STAYS = 120, 60  # frames of sitting down and of resting that are kept
# metres per second, and per second squared: the 99.9th percentile of what is captured, about
_FASTEST, _HARDEST = 5.0, 75.0


@dataclass(frozen=True)
class Composed:
    """A composed motion: one word for its ``kind``, and the frames ``focus`` (N,) around which
    windows are drawn.
    """

    kind: str
    motion: Motion
    focus: np.ndarray


def fluent(joints: np.ndarray) -> np.ndarray:
    """False in frames (T,) around a speed or an acceleration that no captured motion of these kinds
    has.
    """
    step = np.diff(joints, axis=0, prepend=joints[:1])
    change = np.diff(step, axis=0, prepend=step[:1])
    return (np.linalg.norm(step, axis=-1).max(1) * MODEL_FPS < _FASTEST) & (
        np.linalg.norm(change, axis=-1).max(1) * 900 < _HARDEST
    )


def composition(
    kind: str, name: str, subject: str, category: str, joints: np.ndarray, focus: np.ndarray
) -> Iterator[Composed]:
    """The composed motion, where it is fluent; nothing where it is not. ``focus`` counts frames of
    ``joints``.
    """
    if not fluent(joints).all():
        return
    motion = motion_of(f"{name} {kind}", COMPOSED, subject, category, joints)
    if category == "lying":  # on a bed the feet are off the floor
        motion = replace(motion, valid=np.ones(len(motion.joints), dtype=bool))
    # ``motion_of`` holds the first pose where the body rests in it.
    held = [int(np.argmax((j != j[0]).any((1, 2)))) for j in (motion.joints, joints)]
    yield Composed(kind, motion, focus + held[0] - held[1])


def entrance(joints: np.ndarray, rest_start: int) -> int | None:
    """The last frame before a rest in which the body stands still and upright; None where there is
    none.
    """
    speed = np.linalg.norm(np.diff(joints, axis=0, prepend=joints[:1]), axis=-1).max(1) * MODEL_FPS
    stands = np.flatnonzero((joints[:rest_start, PELVIS, 2] > 0.9) & (speed[:rest_start] < 0.35))
    return int(stands[-1]) if len(stands) else None


@dataclass(frozen=True)
class Piece:
    """Captured motion that first stands upright and then sits down and rests, or does so in a
    mirror or reversed.
    """

    name: str
    subject: str
    borrowed: bool
    joints: np.ndarray
    in_mirror: bool = False


def sit_downs(motions: list[Motion]) -> Iterator[Piece]:
    for m in motions:
        if m.category not in _SIT:
            continue
        for joints, how in ((m.joints, ""), (m.joints[::-1], " reversed")):
            frames, ended = len(joints), 0
            rests = [
                (r.start, r.end) if not how else (frames - r.end, frames - r.start) for r in m.rests
            ]
            for start, end in sorted(rests):
                entry = entrance(joints[ended:start], start - ended)
                if entry is not None and start - ended - entry < _LONGEST:
                    piece = joints[ended + entry : min(end, start + STAYS)]
                    yield Piece(m.name + how, m.subject, m.source == "ui_prmd", piece)
                    yield Piece(
                        m.name + how + " mirrored",
                        m.subject,
                        m.source == "ui_prmd",
                        mirrored(piece),
                        in_mirror=True,
                    )
                ended = end


def upper_bodies(motions: list[Motion], categories: set[str]) -> list[np.ndarray]:
    """Pieces (T, 22, 3) in which a body stays where it is, upright, and does something."""
    found = []
    for m in motions:
        if m.category in categories:
            for start in range(0, len(m.joints) - WORKS + 1, WORKS):
                piece = m.joints[start : start + WORKS]
                trunk = normalised(piece[:, joint("neck")] - piece[:, 0])[:, 2]
                stays = np.ptp(piece[:, 0, :2], axis=0).max() < 0.3
                if (
                    stays
                    and trunk.min() > 0.75
                    and m.valid[start : start + WORKS].all()
                    and fluent(piece).all()
                ):
                    found.append(piece)

    return found


def features_of(joints: np.ndarray) -> np.ndarray:
    """What must match at a join (T, 48): places of joints in the root's frames, and their
    velocities there.
    """
    path = root_from_joints(joints)
    places = to_root(path, joints)[:, _MATCHED]
    velocity = (
        rotate(transpose(path.rotation)[:, None], np.gradient(joints[:, _MATCHED], axis=0))
        * MODEL_FPS
        * _SECONDS
    )
    return np.concatenate([places * _WEIGHTS, velocity * _WEIGHTS], axis=1).reshape(len(joints), -1)


@dataclass(frozen=True)
class WalkIndex:
    """Frames (N, 2: clip, frame) in which a body is slow that comes from, or goes, elsewhere.

    ``features`` (N, 48) must match; ``tracks`` (N, T, 2): where it was before, or will be, as seen
    from it, the farthest first. ``names``: of each clip its source and name, as "source/name", and
    whether it is seen in a mirror.
    """

    arriving: bool
    clips: list[np.ndarray]
    names: list[tuple[str, bool]]
    rows: np.ndarray
    features: np.ndarray
    tracks: np.ndarray


def index_walks(
    motions: list[Motion], arriving: bool, kept: tuple[int, int] = (BEFORE, BEFORE)
) -> WalkIndex:
    """All places where a walk may end, or begin, with ``kept`` frames of its clip before and after
    them.
    """
    clips: list[np.ndarray] = []
    names: list[tuple[str, bool]] = []
    rows, features, tracks = [], [], []
    offsets = np.arange(_TRAVELLED, -1, -8) * (-1 if arriving else 1)
    for m in motions:
        if m.category not in _WALK or m.source == TOELESS or len(m.joints) < sum(kept):
            continue
        for joints, mirror in ((m.joints, False), (mirrored(m.joints), True)):
            path = root_from_joints(joints)
            frames = np.arange(kept[0], len(joints) - kept[1], 2)
            slow = np.linalg.norm(np.gradient(path.position, axis=0), axis=-1) * MODEL_FPS < _SLOW
            far = (
                np.linalg.norm(path.position[frames + offsets[0]] - path.position[frames], axis=-1)
                > _FAR
            )
            broken = np.concatenate([[0], np.cumsum(~(m.valid & fluent(joints)))])
            frames = frames[
                slow[frames] & far & (broken[frames + kept[1]] == broken[frames - kept[0]])
            ]
            if len(frames):
                around = path.position[frames[:, None] + offsets] - path.position[frames][:, None]
                tracks.append(np.einsum("nji,ntj->nti", path.rotation[frames], around)[..., :2])
                rows.append(np.stack([np.full(len(frames), len(clips)), frames], axis=1))
                features.append(features_of(joints)[frames].astype(np.float32))
                clips.append(joints)
                names.append((f"{m.source}/{m.name}", mirror))

    if not clips:
        return WalkIndex(
            arriving,
            [],
            [],
            np.zeros((0, 2), int),
            np.zeros((0, 48), np.float32),
            np.zeros((0, len(offsets), 2)),
        )

    return WalkIndex(
        arriving,
        clips,
        names,
        np.concatenate(rows),
        np.concatenate(features),
        np.concatenate(tracks),
    )


def find_matches(
    pool: WalkIndex,
    pose: np.ndarray,
    place: np.ndarray,
    each: int,
    directions: Sequence[int] = range(DIRECTIONS),
) -> Iterator[tuple[int, int]]:
    """Clip and frame in the pool where a walk ends, or begins, that matches ``pose``: as
    ``find_walks`` finds them.
    """
    cost = np.abs(pool.features - pose.astype(np.float32)).mean(1)
    like = np.flatnonzero(cost < _ALIKE)
    like = like[np.argsort(cost[like])]
    way = pool.tracks[like] - place
    clear = np.linalg.norm(way[:, :-2], axis=-1).min(1) > _CLEAR
    like, way = like[clear], way[clear]
    sector = np.round(yaw_of(way[:, 0]) / (2 * np.pi / DIRECTIONS)).astype(int) % DIRECTIONS
    for direction in directions:
        used: set[int] = set()
        for clip, at in pool.rows[like[sector == direction]]:
            if clip not in used and len(used) < each:
                used.add(clip)
                yield int(clip), int(at)


def find_walks(
    pool: WalkIndex,
    pose: np.ndarray,
    place: np.ndarray,
    each: int,
    directions: Sequence[int] = range(DIRECTIONS),
) -> Iterator[np.ndarray]:
    """Walks that end, or begin, with a pose that matches ``pose`` (48,): the best ``each`` in every
    direction from a place.

    ``place`` (2,): a seat's middle, say, in the root's frame at the join; a way that leads through
    it is none. Direction 0 is the one that the body faces, the others follow counter-clockwise.
    """
    for clip, at in find_matches(pool, pose, place, each, directions):
        yield (
            pool.clips[clip][at - BEFORE : at + 1]
            if pool.arriving
            else pool.clips[clip][at : at + BEFORE]
        )
