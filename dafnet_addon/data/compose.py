"""Composed motions: captured pieces joined and combined into what nobody recorded in one go, and what training needs often.

Walking up to a seat and sitting down, getting up and walking off, working while seated, writing on a desk or a board. All is
made of captured motion on the canonical body; what is added are joins, lent upper bodies and paths of hands.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.kinematics import two_bone
from ..core.root import root_from_joints, to_root
from ..core.rotations import frame_from, normalised, rotate, transpose, yaw_matrix
from ..core.skeleton import OFFSETS, PARENTS, REST, SEAT_TO_PELVIS, joint
from .canonical import FOOT, pose_legs
from .uses import runs
from .windows import COMPOSED, Motion, mirrored, motion_of

__all__ = ["Composed", "composed", "entrance", "joined", "lent", "handed"]

_WALK = {"locomotion", "walk", "turn", "carry_other", "door", "reach-hand-task", "greeting", "standing"}
_SIT = {"sit-stand", "sit_down", "stand_up"}
_BUSY = {"standing_gesture", "social_gesture", "greeting", "documents", "work_standing", "reach-hand-task", "standing_idle"}
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
_HIGHEST_BED = 0.62
_CARRIES, _WRIST_LIES = 0.02, 0.09  # metres over a bed: of a body, against the bare floor; and of a wrist whose hand lies on it
_TURNING = 66  # frames of getting onto a bed
_TOELESS = "reactidle"
_IDLES = 45  # pieces of standing that are used, of many that are alike
_BOARD = np.array([0.0, 0.6])  # from the root that stands before it; or a counter
_LEANS = (-0.3, -0.15, 0.0, 0.0, 0.15, 0.3)  # radians; back is positive
_AT_DESK_LEANS = (-0.2, -0.1, 0.0, 0.0, 0.06)
_WORKS = 180  # frames of work that are joined to a sit-down or a walk
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


def joined(first: np.ndarray, then: np.ndarray) -> np.ndarray:
    """``first`` (T, 22, 3), and ``then`` turned and moved to go on from its last pose, which is left out.

    The difference of the poses at the join, and of their velocities, fades over two thirds of a second (inertialisation); a
    foot keeps its difference for as long as it stands, and works it off while it swings, so that it never slides.
    """
    after = _aligned(then, then[0], first[-1])
    offset = first[-1] - after[0]
    drift = (first[-1] - first[-2]) - (after[1] - after[0])
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
    return np.concatenate([first[:-1], _on_the_body(out)])


@dataclass(frozen=True)
class _Piece:
    """Captured motion that first stands upright and then sits down and rests, or does so in a mirror or reversed."""

    name: str
    subject: str
    borrowed: bool
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
                    yield _Piece(m.name + how, m.subject, m.source == "ui_prmd", piece)
                    yield _Piece(m.name + how + " mirrored", m.subject, m.source == "ui_prmd", mirrored(piece))
                ended = end


@dataclass(frozen=True)
class _Pool:
    """Frames (N, 2: clip, frame) in which a body is slow that comes from, or goes, elsewhere.

    ``features`` (N, 48) must match; ``tracks`` (N, T, 2): where it was before, or will be, as seen from it, the farthest first.
    """

    arriving: bool
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
        if m.category not in _WALK or m.source == _TOELESS or len(m.joints) < 2 * _BEFORE:
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
        return _Pool(arriving, [], np.zeros((0, 2), int), np.zeros((0, 48), np.float32), np.zeros((0, len(offsets), 2)))
    return _Pool(arriving, clips, np.concatenate(rows), np.concatenate(features), np.concatenate(tracks))


def _ways(
    pool: _Pool, pose: np.ndarray, place: np.ndarray, each: int, directions: Sequence[int] = range(_DIRECTIONS)
) -> Iterator[np.ndarray]:
    """Walks that end, or begin, with a pose that matches ``pose`` (48,): the best ``each`` in every direction from a place.

    ``place`` (2,): a seat's middle, say, in the root's frame at the join; a way that leads through it is none. Direction 0 is
    the one that the body faces, the others follow counter-clockwise.
    """
    cost = np.abs(pool.features - pose.astype(np.float32)).mean(1)
    like = np.flatnonzero(cost < _ALIKE)
    like = like[np.argsort(cost[like])]
    way = pool.tracks[like] - place
    clear = np.linalg.norm(way[:, :-2], axis=-1).min(1) > _CLEAR
    like, way = like[clear], way[clear]
    sector = np.round(np.arctan2(-way[:, 0, 0], way[:, 0, 1]) / (2 * np.pi / _DIRECTIONS)).astype(int) % _DIRECTIONS
    for direction in directions:
        used: set[int] = set()
        for clip, at in pool.rows[like[sector == direction]]:
            if clip not in used and len(used) < each:
                used.add(clip)
                yield pool.clips[clip][at - _BEFORE : at + 1] if pool.arriving else pool.clips[clip][at : at + _BEFORE]


def _made(kind: str, name: str, subject: str, category: str, joints: np.ndarray, focus: np.ndarray) -> Iterator[Composed]:
    """The composed motion, where it is fluent; nothing where it is not. ``focus`` counts frames of ``joints``."""
    if not _fluent(joints).all():
        return
    motion = motion_of(f"{name} {kind}", COMPOSED, subject, category, joints)
    if category == "lying":  # on a bed the feet are off the floor
        motion = replace(motion, valid=np.ones(len(motion.joints), dtype=bool))
    # ``motion_of`` holds the first pose where the body rests in it.
    held = [int(np.argmax((j != j[0]).any((1, 2)))) for j in (motion.joints, joints)]
    yield Composed(kind, motion, focus + held[0] - held[1])


def _to_and_from_seats(motions: list[Motion], sits: list[_Piece], to: _Pool, away: _Pool) -> Iterator[Composed]:
    """Walks that end in a sit-down ("approach"), and stand-ups that go on as a walk ("leave"), all around the seat."""
    for sit in sits:
        each = 1 if sit.borrowed else 2
        path = root_from_joints(sit.joints)
        seat = rotate(path.rotation[0].T, sit.joints[-1, 0] - path.position[0])[:2]
        down, up = sit.joints, sit.joints[::-1]
        for walk in _ways(to, _features(down)[0], seat, each):
            whole = joined(walk, down)
            focus = np.arange(60, max(_BEFORE + len(down) - _STAYS, 90) + 20, 5)
            yield from _made("approach", sit.name, sit.subject, "sit-stand", whole, focus)
        for walk in _ways(away, _features(up)[-1], seat, each):
            whole = joined(up, walk)
            focus = np.arange(max(0, len(up) - 60), len(whole) - 40, 5)
            yield from _made("leave", sit.name, sit.subject, "sit-stand", whole, focus)


def _about_x(angle: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) about x: forward, and up, tilt backward by ``angle`` (radians)."""
    m = np.zeros((len(angle), 3, 3))
    c, s = np.cos(angle), np.sin(angle)
    m[:, 0, 0], m[:, 1, 1], m[:, 1, 2], m[:, 2, 1], m[:, 2, 2] = 1.0, c, -s, s, c
    return m


def _through(stops: np.ndarray, frames: Sequence[int]) -> np.ndarray:
    """A course (sum of ``frames`` + 1, …) through ``stops`` (N, …) with the least jerk, at rest in each of them."""
    parts = [stops[:1]]
    for a, b, n in zip(stops[:-1], stops[1:], frames, strict=True):
        s = (np.arange(n) + 1.0).reshape(-1, *(1,) * (stops.ndim - 1)) / n
        parts.append(a + (b - a) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s))
    return np.concatenate(parts)


def _wander(rng: np.random.Generator, frames: int, columns: int, sigma: float) -> np.ndarray:
    """Smooth noise (T, columns) of unit size; ``sigma`` in frames."""
    reach = np.arange(-int(3 * sigma), int(3 * sigma) + 1)
    kernel = np.exp(-0.5 * (reach / sigma) ** 2)
    kernel /= np.sqrt((kernel**2).sum())
    noise = rng.normal(size=(frames + len(kernel) - 1, columns))
    return np.stack([np.convolve(c, kernel, mode="valid") for c in noise.T], axis=1)


def _swayed(joints: np.ndarray, lean: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """A seated body that leans back (``lean`` (T,), radians; forward where negative) and turns on its seat; its feet stay."""
    yaw = root_from_joints(joints).yaw
    about = yaw_matrix(yaw + turn) @ _about_x(lean) @ yaw_matrix(-yaw)
    middle = (joints[:, 1] + joints[:, 2]) / 2
    out = joints.copy()
    above = [j for j in range(22) if j not in _LEGS]
    out[:, above] = middle[:, None] + np.einsum("tij,tbj->tbi", about, joints[:, above] - middle[:, None])
    knees = [joint("left_knee"), joint("right_knee")]
    out[:, knees] = middle[:, None] + np.einsum("tij,tbj->tbi", yaw_matrix(turn / 2), joints[:, knees] - middle[:, None])
    return _on_the_body(out)


def lent(joints: np.ndarray, upper: np.ndarray, share: np.ndarray) -> np.ndarray:
    """The motion (T, 22, 3) with the chest's attitude, head and arms of another, as it has them in its root's frame.

    ``share`` (T,): from 0, the motion's own, to 1, the other's. Legs and pelvis stay.
    """
    to_ours = root_from_joints(joints).rotation @ transpose(root_from_joints(upper).rotation)
    other = joints[:, :1] + np.einsum("tij,tbj->tbi", to_ours, upper - upper[:, :1])
    out = joints.copy()
    (_, a), (_, b) = _frames(joints), _frames(other)
    m = (1 - share)[:, None, None] * a + share[:, None, None] * b
    # The chest is read off neck and collars; their places tell the frame alone.
    chest = frame_from(m[..., :, 0], m[..., :, 2], "xz") @ _REST_CHEST
    for name in ("neck", "left_collar", "right_collar"):
        out[:, joint(name)] = out[:, joint("spine3")] + rotate(chest, OFFSETS[joint(name)])
    for j in (joint("head"), *_ARMS):
        ours, theirs = (normalised(x[:, j] - x[:, PARENTS[j]]) for x in (joints, other))
        out[:, j] = out[:, PARENTS[j]] + normalised(ours + (theirs - ours) * share[:, None]) * _LENGTHS[j]
    return _on_the_body(out)


def handed(joints: np.ndarray, side: str, wrist: np.ndarray, share: np.ndarray) -> np.ndarray:
    """The motion with one hand (``side`` "left_" or "right_") led along ``wrist`` (T, 3), world, where ``share`` (T,) is 1."""
    shoulder, elbow, hand = (joint(side + n) for n in ("shoulder", "elbow", "wrist"))
    out, weight = joints.copy(), share[:, None]
    target = joints[:, hand] + (wrist - joints[:, hand]) * weight
    # Over a desk's edge the hand comes from above.
    early = np.sin(np.pi / 2 * share)
    target[:, 2] = joints[:, hand, 2] + (wrist[:, 2] - joints[:, hand, 2]) * early
    outward = np.array([-0.12 if side == "left_" else 0.12, -0.05, -0.25])
    hangs = (joints[:, shoulder] + wrist) / 2 + rotate(root_from_joints(joints).rotation, outward)
    pole = joints[:, elbow] + (hangs - joints[:, elbow]) * weight
    out[:, elbow], out[:, hand] = two_bone(joints[:, shoulder], target, pole, _LENGTHS[elbow], _LENGTHS[hand])
    return out


def _typing(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """A hand's course (T, 3) over a desk: x right, y forward, z over the top; small quick moves about a slow place."""
    home = np.array([side * rng.uniform(0.08, 0.16), rng.uniform(0.28, 0.36), 0.05])
    return home + _wander(rng, frames, 3, 25) * (0.012, 0.012, 0.002) + _wander(rng, frames, 3, 2.5) * (0.007, 0.006, 0.005)


def _handwriting(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """Lines from left to right, letter by letter, over a desk."""
    width, y = rng.uniform(0.10, 0.18), rng.uniform(0.28, 0.36)
    left = side * rng.uniform(0.08, 0.14) - width / 2
    stops = [np.array([left, y, 0.05])]
    times: list[int] = []
    while sum(times) < frames:
        line = len(stops) // 2 % 6
        stops += [np.array([left + width, y - 0.01 * line, 0.05]), np.array([left, y - 0.01 * (line + 1), 0.05])]
        times += [int(rng.integers(80, 150)), int(rng.integers(18, 30))]
    letters = _wander(rng, frames, 2, 2.5) * (0.004, 0.005)
    return _through(np.array(stops), times)[:frames] + np.pad(letters, ((0, 0), (0, 1)))


def _handling(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """A hand that moves between places on a desk, stays there, and is lifted between."""
    stops: list[tuple[float, float, float]] = []
    times: list[int] = []
    while sum(times) < frames:
        stops += [(side * rng.uniform(0.02, 0.34), rng.uniform(0.24, 0.40), 0.05)] * 2
        times += [int(rng.integers(8, 75)), int(rng.integers(16, 36))]
    course = _through(np.array(stops), times[:-1])
    speed = np.linalg.norm(np.gradient(course[:, :2], axis=0), axis=-1)
    course[:, 2] += rng.uniform(0.02, 0.08) * speed / speed.max()
    return np.concatenate([course, np.repeat(course[-1:], max(0, frames - len(course)), axis=0)])[:frames]


def _resting_hand(rng: np.random.Generator, frames: int, side: float) -> np.ndarray:
    """A hand that lies on a desk."""
    home = np.array([side * rng.uniform(0.10, 0.28), rng.uniform(0.24, 0.36), 0.05])
    return home + _wander(rng, frames, 3, 30) * (0.006, 0.006, 0.001)


_AT_DESKS = (  # of the left and the right hand; None hangs or lies as captured
    (_typing, _typing), (_typing, _typing), (_resting_hand, _handwriting), (_handling, _handling), (_resting_hand, _handling),
    (_typing, _handling), (None, _handwriting), (None, _handling),
)


def _presence(frames: int, start: int, end: int, rise: int = 24) -> np.ndarray:
    """A share (T,) that rises from 0 before ``start`` + ``rise`` to 1 and falls to 0 again before ``end``."""
    t = np.arange(frames)
    return np.asarray((1 - _ease((t - start) / rise)) * _ease((t - end + rise) / rise))


def _at_top(
    rng: np.random.Generator, joints: np.ndarray, start: int, end: int, height: float, farther: float = 0.0
) -> np.ndarray:
    """The motion with hands that work on a top at ``height`` in frames ``start`` to ``end``, wherever its root is then."""
    path = root_from_joints(joints)
    origin, turn = path.position[(start + end) // 2], path.rotation[(start + end) // 2]
    out = joints
    for side, sign, course in zip(("left_", "right_"), (-1.0, 1.0), _AT_DESKS[rng.integers(len(_AT_DESKS))], strict=True):
        if course is not None:
            local = course(rng, len(joints), sign) + np.array([0.0, farther, height])
            first = start + int(rng.integers(0, 12))
            out = handed(out, side, origin + rotate(turn, local), _presence(len(joints), first, end - int(rng.integers(0, 12))))
    return out


def _uppers(motions: list[Motion], categories: set[str]) -> list[np.ndarray]:
    """Pieces (T, 22, 3) in which a body stays where it is, upright, and does something."""
    found = []
    for m in motions:
        if m.category in categories:
            for start in range(0, len(m.joints) - _WORKS + 1, _WORKS):
                piece = m.joints[start : start + _WORKS]
                trunk = normalised(piece[:, joint("neck")] - piece[:, 0])[:, 2]
                stays = np.ptp(piece[:, 0, :2], axis=0).max() < 0.3
                if stays and trunk.min() > 0.75 and m.valid[start : start + _WORKS].all() and _fluent(piece).all():
                    found.append(piece)
    return found


def _leaning(rng: np.random.Generator, frames: int, rest: int, leans: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """How a body leans back and turns on its seat (T,), radians, once it rests; it goes from one of ``leans`` to another."""
    stops = np.concatenate([[0.0, 0.0], rng.choice(leans, 5) * rng.uniform(0.6, 1.0, 5)])
    lean = _through(stops, [rest, *rng.integers(30, 60, 5)])
    lean = np.pad(lean, (0, frames), mode="edge")[:frames]
    begun = 1 - _ease((np.arange(frames) - rest) / 40)
    wander = _wander(rng, frames, 2, 30) * (0.02, 0.10) * begun[:, None]
    return lean + wander[:, 0], wander[:, 1]


def _while_seated(motions: list[Motion], sits: list[_Piece]) -> Iterator[Composed]:
    """Seated legs under upper bodies that gesture, greet and reach ("work"), or whose hands work at a desk ("desk")."""
    rng = np.random.default_rng(12)
    seated = _uppers(motions, {"seated_chair", "seated_table"})
    busy = _uppers(motions, _BUSY) + seated
    for sit in sits * 3:
        for kind, uppers, leans in (("work", busy, _LEANS), ("desk", seated, _AT_DESK_LEANS)):
            if not uppers:
                continue
            body = np.concatenate([sit.joints, np.repeat(sit.joints[-1:], _WORKS, axis=0)])
            rest, frames = len(sit.joints) - 20, len(body)
            upper = uppers[rng.integers(len(uppers))]
            upper = upper if rng.random() < 0.5 else mirrored(upper)
            upper = np.pad(upper, ((rest, frames), (0, 0), (0, 0)), mode="edge")[:frames]
            body = lent(body, upper, _presence(frames, rest, 2 * frames, 30))
            body = _swayed(body, *_leaning(rng, frames, rest, leans))
            if kind == "desk":
                top = body[rest + 20, 0, 2] - SEAT_TO_PELVIS + rng.uniform(0.24, 0.33)
                body = _at_top(rng, body, rest + 5, frames + 60, top)
            yield from _made(kind, sit.name, sit.subject, "seated", body, np.arange(rest, frames - 20, 5))


def _lettering(rng: np.random.Generator, frames: int) -> np.ndarray:
    """The right hand's course (T, 3) over a board: x right, y off the body, z over the floor; lines of letters."""
    left, width, top, y = rng.uniform(-0.08, 0.05), rng.uniform(0.22, 0.34), rng.uniform(1.35, 1.62), rng.uniform(0.34, 0.42)
    down = rng.uniform(0.06, 0.11)
    stops = [np.array([left, y, top])]
    times: list[int] = []
    while sum(times) < frames:
        z = top - down * (len(stops) // 2 % 5)
        stops += [np.array([left + width, y, z]), np.array([left, y, top - down * ((len(stops) // 2 + 1) % 5)])]
        times += [int(rng.integers(50, 110)), int(rng.integers(20, 32))]
    course = _through(np.array(stops), times)[:frames]
    off = np.maximum(0.0, np.gradient(-course[:, 0]))  # on its way back the hand is off the board
    letters = _wander(rng, frames, 2, 4) * (0.010, 0.018)
    return course + np.stack([letters[:, 0], -0.06 * off / max(float(off.max()), 1e-6), letters[:, 1]], axis=1)


def _drawing(rng: np.random.Generator, frames: int) -> np.ndarray:
    """Large strokes in all directions, or wiping."""
    middle = np.array([rng.uniform(0.05, 0.2), rng.uniform(0.34, 0.42), rng.uniform(1.25, 1.5)])
    course: np.ndarray = middle + _wander(rng, frames, 3, rng.uniform(7, 14)) * (0.08, 0.0, 0.09)
    return course


def _while_standing(motions: list[Motion], to: _Pool, away: _Pool) -> Iterator[Composed]:
    """A walk up to a board ("write") or a counter ("counter"), work there on captured standing, and a walk away."""
    rng = np.random.default_rng(13)
    behind = range(_DIRECTIONS // 4, 3 * _DIRECTIONS // 4 + 1)
    idles = _uppers([m for m in motions if m.source != _TOELESS], {"standing_idle", "standing"})
    for idle in idles[:: max(1, len(idles) // _IDLES)]:
        for stands in (idle, mirrored(idle)):
            features = _features(stands)
            for kind in ("write", "counter"):
                come, go = (list(_ways(p, f, _BOARD, 1, behind)) for p, f in ((to, features[0]), (away, features[-1])))
                if not come or not go:
                    continue
                whole = joined(joined(come[rng.integers(len(come))], stands), go[rng.integers(len(go))])
                start, end = _BEFORE + 8, _BEFORE + _WORKS - 4
                if kind == "counter":
                    whole = _at_top(rng, whole, start, end, rng.uniform(0.85, 1.05))
                else:
                    path = root_from_joints(whole)
                    turn = path.rotation[(start + end) // 2]
                    course = (_lettering, _lettering, _drawing)[rng.integers(3)](rng, len(whole))
                    wrist = path.position[(start + end) // 2] + rotate(turn, course)
                    whole = handed(whole, "right_", wrist, _presence(len(whole), start, end))
                if rng.random() < 0.5:
                    whole = mirrored(whole)
                yield from _made(kind, "standing", "composed", "standing", whole, np.arange(start - 30, end + 30, 5))


def _lying_down(motions: list[Motion]) -> list[np.ndarray]:
    """Captured pieces that begin sitting on the floor, lie back and stay; also made by reversing sitting up from lying."""
    found = []
    for m in (m for m in motions if m.category == "lying"):
        for joints in (m.joints, m.joints[::-1]):
            trunk = normalised(joints[:, joint("neck")] - joints[:, 0])[:, 2]
            low, face = joints[:, 0, 2] < 0.2, _frames(joints)[1][:, 2, 1]
            sits = np.flatnonzero(low & (trunk > 0.85))
            for start, _ in runs(low & (np.abs(trunk) < 0.35) & (face > 0.5), 30):
                before = sits[(sits < start) & (sits > start - 60)]
                if len(before):
                    found.append(joints[before[-1] : start + 75])
    return found


def _lifted(joints: np.ndarray, height: float) -> np.ndarray:
    """A body on the floor, on a bed of that height instead; hands that sank into the floor lie on it."""
    out = joints + np.array([0.0, 0.0, height + _CARRIES])
    for side in ("left_", "right_"):
        wrist = out[:, joint(side + "wrist")].copy()
        over = wrist[:, 2] - height - _WRIST_LIES
        wrist[:, 2] = height + _WRIST_LIES + 0.5 * (over + np.sqrt(over**2 + 0.03**2))
        shoulder, elbow, hand = (joint(side + n) for n in ("shoulder", "elbow", "wrist"))
        out[:, elbow], out[:, hand] = two_bone(out[:, shoulder], wrist, out[:, elbow], _LENGTHS[elbow], _LENGTHS[hand])
    return out


def _onto_the_bed(seated: np.ndarray, lying: np.ndarray, turn: float, inward: float) -> np.ndarray:
    """From one seated pose (22, 3) on a bed's edge to one that sits on the bed along it: the legs rise, the body turns."""
    t = np.linspace(0.0, 1.0, _TURNING)
    rise, turned, place = (1 - _ease(x)[:, None, None] for x in (t / 0.6, (t - 0.15) / 0.85, t))
    poses = []
    for pose in (seated, lying):
        path = root_from_joints(np.repeat(pose[None], 2, axis=0))
        poses.append(to_root(path, np.repeat(pose[None], 2, axis=0))[0])
    a, b = poses
    local = a + (b - a) * place
    feet = [j for pair in _FEET for j in pair]
    local[:, feet, 2] = (a + (b - a) * rise)[:, feet, 2] + 0.05 * np.sin(np.pi * rise[:, :, 0])
    yaw = root_from_joints(np.repeat(seated[None], 2, axis=0)).yaw[0]
    origin = seated[0] * (1, 1, 0) + rotate(yaw_matrix(np.array(yaw)), np.array([0.0, -inward, 0.0])) * turned[:, 0]
    return _on_the_body(rotate(yaw_matrix(yaw + turn * turned[:, 0, 0])[:, None], local) + origin[:, None])


def _lying(motions: list[Motion], sits: list[_Piece]) -> Iterator[Composed]:
    """Sitting down on a bed's edge, turning onto it and lying back ("lie"), and the same reversed."""
    rng = np.random.default_rng(14)
    pieces = _lying_down(motions)
    for sit in (s for s in sits if pieces and not s.borrowed):
        top = sit.joints[-1, 0, 2] - SEAT_TO_PELVIS
        if top > _HIGHEST_BED:
            continue
        piece = pieces[rng.integers(len(pieces))]
        lies = _lifted(piece if rng.random() < 0.5 else mirrored(piece), top)
        turn, inward = rng.choice([-1.0, 1.0]) * rng.uniform(1.3, 1.7), rng.uniform(0.1, 0.25)
        turning = _onto_the_bed(sit.joints[-1], lies[0], turn, inward)
        whole = joined(np.concatenate([sit.joints, turning[1:]]), lies)
        start, frames = len(sit.joints) - 20, len(whole)
        yield from _made("lie", sit.name, sit.subject, "lying", whole, np.arange(start, frames, 5))
        yield from _made("lie", sit.name + " reversed", sit.subject, "lying", whole[::-1], np.arange(0, frames - start, 5))


def composed(motions: list[Motion]) -> list[Composed]:
    """All composed motions of captured ones on the canonical body; the same for the same motions."""
    to, away = _pool(motions, arriving=True), _pool(motions, arriving=False)
    sits = list(_sit_downs(motions))
    # Many of those with borrowed arms, and all of them begin in front of the seat.
    sits = [s for s in sits if not s.borrowed] + [s for s in sits if s.borrowed][::9]
    return [
        *_to_and_from_seats(motions, sits, to, away), *_while_seated(motions, sits), *_while_standing(motions, to, away),
        *_lying(motions, sits),
    ]
