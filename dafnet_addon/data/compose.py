"""Composed motions: captured pieces joined and combined into what nobody recorded in one go, and what training needs often.

Walking up to a seat and sitting down, getting up and walking off, working while seated, writing on a desk or a board. All is
made of captured motion on the canonical body; what is added are joins, lent upper bodies and paths of hands.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.root import root_from_joints, to_root
from ..core.rotations import frame_from, normalised, rotate, transpose, yaw_matrix
from ..core.skeleton import OFFSETS, PARENTS, REST, joint
from .canonical import FOOT, pose_legs
from .windows import COMPOSED, Motion, mirrored, motion_of

__all__ = ["Composed", "composed", "entrance", "joined", "matches"]

_WALK = {"locomotion", "walk", "turn", "carry_other", "door", "reach-hand-task", "greeting", "standing"}
_SIT = {"sit-stand", "sit_down", "stand_up"}
_MATCHED = [
    joint(n) for n in ("pelvis", "neck", "left_knee", "right_knee", "left_foot", "right_foot", "left_wrist", "right_wrist")
]
_WEIGHTS = np.array([1.0, 0.7, 1.0, 1.0, 2.5, 2.5, 0.4, 0.4])[:, None]
_SECONDS = 0.12  # by which velocities count as lengths
_ALIGNED = [joint(n) for n in ("pelvis", "left_foot", "right_foot", "left_ankle", "right_ankle", "neck")]
_BEFORE = 110  # frames of walking that are kept
_TRAVELLED = 80  # frames in which a body must have come from elsewhere
_FAR = 0.8  # metres
_FADE = 20  # frames in which the difference at a join dies away
_ALIKE = 0.09  # metres: mean weighted difference, of places and velocities, of poses that may be joined
_CLEAR = 0.42  # metres between a seat's middle and the way to it
_DIRECTIONS = 8
_SLOW = 0.45  # metres per second of the root
_LONGEST, _STAYS = 120, 60  # frames of sitting down and of resting that are kept
_FASTEST, _HARDEST = 5.0, 75.0  # metres per second, and per second squared: the 99.9th percentile of what is captured, about
_FEET = tuple((joint(s + "ankle"), joint(s + "foot")) for s in ("left_", "right_"))
_LEGS = [joint(s + n) for s in ("left_", "right_") for n in ("knee", "ankle", "foot")]
_SWINGS = 0.25  # metres per second: a slower foot stands
_ARMS = [joint(s + n) for s in ("left_", "right_") for n in ("shoulder", "elbow", "wrist")]
_LENGTHS = np.linalg.norm(OFFSETS, axis=1)


@dataclass(frozen=True)
class Composed:
    """A composed motion: one word for its ``kind``, and the frames ``focus`` (N,) around which windows are drawn."""

    kind: str
    motion: Motion
    focus: np.ndarray


def _frames(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frames (T, 3, 3) of pelvis and chest; the identity in the rest pose."""
    pelvis = frame_from(joints[:, 2] - joints[:, 1], joints[:, 3] - (joints[:, 1] + joints[:, 2]) / 2, "xz")
    chest = frame_from(joints[:, 14] - joints[:, 13], joints[:, 12] - joints[:, 9], "xz")
    return pelvis, chest


_REST_PELVIS, _REST_CHEST = (f[0].T for f in _frames(REST[None]))


def _on_the_body(joints: np.ndarray) -> np.ndarray:
    """The motion nearest to ``joints`` (T, 22, 3) with the canonical bones, a rigid pelvis and chest; the feet stay."""
    pelvis, chest = _frames(joints)
    pelvis, chest = pelvis @ _REST_PELVIS, chest @ _REST_CHEST
    out = joints.copy()
    for name in ("left_hip", "right_hip", "spine1"):
        out[:, joint(name)] = out[:, 0] + rotate(pelvis, OFFSETS[joint(name)])
    # The spine's inner joints are interpolated, as ``canonical`` does.
    for name, share in (("spine2", 1 / 3), ("spine3", 2 / 3)):
        m = (1 - share) * pelvis + share * chest
        bone = rotate(frame_from(m[..., :, 2], m[..., :, 0], "zx"), OFFSETS[joint(name)])
        out[:, joint(name)] = out[:, PARENTS[joint(name)]] + bone
    for name in ("neck", "left_collar", "right_collar"):
        out[:, joint(name)] = out[:, joint("spine3")] + rotate(chest, OFFSETS[joint(name)])
    for j in (joint("head"), *_ARMS):
        out[:, j] = out[:, PARENTS[j]] + normalised(joints[:, j] - joints[:, PARENTS[j]]) * _LENGTHS[j]
    for ankle, foot in _FEET:
        out[:, ankle] = out[:, foot] - normalised(joints[:, foot] - joints[:, ankle]) * FOOT
    return pose_legs(out)


def entrance(joints: np.ndarray, rest_start: int) -> int | None:
    """The last frame before a rest in which the body stands still and upright; None where there is none."""
    speed = np.linalg.norm(np.diff(joints, axis=0, prepend=joints[:1]), axis=-1).max(1) * 30
    stands = np.flatnonzero((joints[:rest_start, 0, 2] > 0.9) & (speed[:rest_start] < 0.35))
    return int(stands[-1]) if len(stands) else None


def _features(joints: np.ndarray) -> np.ndarray:
    """What must match at a join (T, 48): places of joints in the root's frames, and their velocities there."""
    path = root_from_joints(joints)
    places = to_root(path, joints)[:, _MATCHED]
    velocity = rotate(transpose(path.rotation)[:, None], np.gradient(joints[:, _MATCHED], axis=0)) * 30 * _SECONDS
    return np.concatenate([places * _WEIGHTS, velocity * _WEIGHTS], axis=1).reshape(len(joints), -1)


def matches(walk: np.ndarray, pose: np.ndarray) -> int | None:
    """The frame of ``walk`` (T, 22, 3) at which the body is slow and most like ``pose`` (1, 22, 3); None if not like enough."""
    slow = np.linalg.norm(np.gradient(walk[:, 0, :2], axis=0), axis=-1) * 30 < _SLOW
    frames = np.flatnonzero(slow & (np.arange(len(walk)) >= 45))
    cost = np.abs(_features(walk)[frames] - _features(np.repeat(pose, 2, axis=0))[0]).mean(1)
    return int(frames[np.argmin(cost)]) if cost.min(initial=np.inf) < _ALIKE else None


def _ease(x: np.ndarray) -> np.ndarray:
    """1 at and below 0, 0 at and above 1, smooth."""
    x = np.clip(x, 0.0, 1.0)
    return (1.0 - x) ** 2 * (1.0 + 2.0 * x)


def _aligned(joints: np.ndarray, pose: np.ndarray, target: np.ndarray) -> np.ndarray:
    """``joints`` turned about z and moved on the floor so that ``pose`` (22, 3), one of them, comes nearest to ``target``."""
    a, b = pose[_ALIGNED, :2], target[_ALIGNED, :2]
    from_, to = a - a.mean(0), b - b.mean(0)
    angle = np.arctan2((from_[:, 0] * to[:, 1] - from_[:, 1] * to[:, 0]).sum(), (from_ * to).sum())
    turned = rotate(yaw_matrix(np.array(angle)), joints - np.append(a.mean(0), 0.0))
    return np.asarray(turned + np.append(b.mean(0), 0.0))


def joined(first: np.ndarray, at: int, then: np.ndarray, entry: int) -> np.ndarray:
    """``first`` (T, 22, 3) up to frame ``at``, then ``then`` from frame ``entry`` on, turned and moved to where the first led.

    The difference of the poses at the join, and of their velocities, fades over two thirds of a second (inertialisation); a
    foot keeps its difference for as long as it stands, and works it off while it swings, so that it never slides.
    """
    before = first[max(0, at - _BEFORE) : at]
    after = _aligned(then[entry:], then[entry], first[at])
    offset = first[at] - after[0]
    drift = (first[at] - first[at - 1]) - (after[1] - after[0])
    t = np.arange(len(after))
    fade = _ease(t / _FADE)[:, None, None]
    out = after + (offset + drift * np.minimum(t, _FADE)[:, None, None]) * fade
    for ankle, foot in _FEET:
        step = np.linalg.norm(np.diff(after[:, foot, :2], axis=0, prepend=after[:1, foot, :2]), axis=-1)
        swing = np.cumsum(np.where(step * 30 > _SWINGS, step, 0.0))
        left = _ease(swing / max(0.2, 2.5 * float(np.linalg.norm(offset[foot, :2]))))[:, None]
        for j in (ankle, foot):
            out[:, j, :2] = after[:, j, :2] + offset[j, :2] * left
            out[:, j, 2] = after[:, j, 2] + offset[j, 2] * fade[:, 0, 0]
    return np.concatenate([before, _on_the_body(out)])


@dataclass(frozen=True)
class _Piece:
    """Captured motion that first stands upright and then sits down and rests, or does so in a mirror or reversed."""

    name: str
    subject: str
    joints: np.ndarray


def _sit_downs(motions: list[Motion]) -> Iterator[_Piece]:
    for m in motions:
        if m.category not in _SIT:
            continue
        for joints, how in ((m.joints, ""), (m.joints[::-1], " reversed")):
            frames, ended = len(joints), 0
            rests = [(r.start, r.end) if not how else (frames - r.end, frames - r.start) for r in m.rests]
            for start, end in sorted(rests):
                entry = entrance(joints[ended:start], start - ended)
                if entry is not None and start - ended - entry < _LONGEST:
                    piece = joints[ended + entry : min(end, start + _STAYS)]
                    yield _Piece(m.name + how, m.subject, piece)
                    yield _Piece(m.name + how + " mirrored", m.subject, mirrored(piece))
                ended = end


@dataclass(frozen=True)
class _Pool:
    """Frames (N, 2: clip, frame) in which a body is slow that comes from, or goes, elsewhere.

    ``features`` (N, 48) must match; ``tracks`` (N, T, 2): where it was before, or will be, as seen from it; the farthest moment first.
    """

    clips: list[np.ndarray]
    rows: np.ndarray
    features: np.ndarray
    tracks: np.ndarray


def _fluent(joints: np.ndarray) -> np.ndarray:
    """False in frames (T,) around a speed or an acceleration that no captured motion of these kinds has."""
    step = np.diff(joints, axis=0, prepend=joints[:1])
    change = np.diff(step, axis=0, prepend=step[:1])
    return (np.linalg.norm(step, axis=-1).max(1) * 30 < _FASTEST) & (np.linalg.norm(change, axis=-1).max(1) * 900 < _HARDEST)


def _pool(motions: list[Motion], arriving: bool) -> _Pool:
    clips: list[np.ndarray] = []
    rows, features, tracks = [], [], []
    offsets = np.arange(_TRAVELLED, -1, -8) * (-1 if arriving else 1)
    for m in motions:
        if m.category not in _WALK or m.source == "reactidle" or len(m.joints) < 2 * _BEFORE:
            continue
        for joints in (m.joints, mirrored(m.joints)):
            path = root_from_joints(joints)
            frames = np.arange(_BEFORE, len(joints) - _BEFORE, 2)
            slow = np.linalg.norm(np.gradient(path.position, axis=0), axis=-1) * 30 < _SLOW
            far = np.linalg.norm(path.position[frames + offsets[0]] - path.position[frames], axis=-1) > _FAR
            broken = np.concatenate([[0], np.cumsum(~(m.valid & _fluent(joints)))])
            frames = frames[slow[frames] & far & (broken[frames + _BEFORE] == broken[frames - _BEFORE])]
            if len(frames):
                around = path.position[frames[:, None] + offsets] - path.position[frames][:, None]
                tracks.append(np.einsum("nji,ntj->nti", path.rotation[frames], around)[..., :2])
                rows.append(np.stack([np.full(len(frames), len(clips)), frames], axis=1))
                features.append(_features(joints)[frames].astype(np.float32))
                clips.append(joints)
    if not clips:
        return _Pool([], np.zeros((0, 2), int), np.zeros((0, 48), np.float32), np.zeros((0, len(offsets), 2)))
    return _Pool(clips, np.concatenate(rows), np.concatenate(features), np.concatenate(tracks))


def _ways(pool: _Pool, pose: np.ndarray, seat: np.ndarray, each: int) -> Iterator[tuple[np.ndarray, int]]:
    """Clips of the pool, and frames, that match a pose's features: the best ``each`` for every direction seen from a seat.

    ``seat`` (2,): its middle, in the root's frame at the join. A way that leads through the seat is none.
    """
    cost = np.abs(pool.features - pose.astype(np.float32)).mean(1)
    like = np.flatnonzero(cost < _ALIKE)
    like = like[np.argsort(cost[like])]
    way = pool.tracks[like] - seat
    clear = np.linalg.norm(way[:, :-2], axis=-1).min(1) > _CLEAR
    like, way = like[clear], way[clear]
    sector = np.round(np.arctan2(-way[:, 0, 0], way[:, 0, 1]) / (2 * np.pi / _DIRECTIONS)).astype(int) % _DIRECTIONS
    for direction in range(_DIRECTIONS):
        used: set[int] = set()
        for clip, at in pool.rows[like[sector == direction]]:
            if clip not in used and len(used) < each:
                used.add(clip)
                yield pool.clips[clip], at


def _to_and_from_seats(motions: list[Motion]) -> Iterator[Composed]:
    """Walks that end in a sit-down ("approach"), and stand-ups that go on as a walk ("leave"), all around the seat."""
    to_seats, from_seats = _pool(motions, arriving=True), _pool(motions, arriving=False)
    pieces = list(_sit_downs(motions))
    borrowed = {m.name for m in motions if m.source == "ui_prmd"}  # their arms; many, and all from the front
    own, lent = ([p for p in pieces if (p.name.split(" ")[0] in borrowed) == which] for which in (False, True))
    for sit, each in [(p, 2) for p in own] + [(p, 1) for p in lent[::9]]:
        path = root_from_joints(sit.joints)
        seat = rotate(path.rotation[0].T, sit.joints[-1, 0] - path.position[0])[:2]
        down, up = sit.joints, sit.joints[::-1]
        for walk, at in _ways(to_seats, _features(down)[0], seat, each):
            whole = joined(walk, at, down, 0)
            start = _BEFORE + len(down) - 1 - _STAYS
            yield from _made("approach", sit, whole, np.arange(60, max(start, 90) + 20, 5))
        for walk, at in _ways(from_seats, _features(up)[-1], seat, each):
            whole = joined(up, len(up) - 1, walk[: at + _BEFORE], at)
            yield from _made("leave", sit, whole, np.arange(max(0, min(len(up), _BEFORE) - 60), len(whole) - 40, 5))


def _made(kind: str, piece: _Piece, joints: np.ndarray, focus: np.ndarray) -> Iterator[Composed]:
    """The composed motion, where it is fluent; nothing where it is not."""
    if _fluent(joints).all():
        yield Composed(kind, motion_of(f"{piece.name} {kind}", COMPOSED, piece.subject, "sit-stand", joints), focus)


def composed(motions: list[Motion]) -> list[Composed]:
    """All composed motions of captured ones on the canonical body; the same for the same motions."""
    return list(_to_and_from_seats(motions))
