"""Moves captured sitting to seats, and hands at work to tops, of other heights: contacts are kept,
and the body leans and bends as the new height asks.

Paper, section 5.2, after Tonneau et al. (2016): a key joint near the source's furniture keeps its
place relative to sampled points of it when these move. Here the points are the seat, which goes up
or down, the floor, which stays, and, for hands, the body's own thighs and shoulders; the whole body
is then solved on its key joints. All is closed-form and treats every frame at once, so that windows
can be drawn with it; nothing in it knows which way time runs.
"""

import numpy as np

from ...core.kinematics import two_bone
from ...core.rotations import normalised
from ...core.skeleton import OFFSETS, PELVIS, REST, SEAT_TO_PELVIS, joint
from ..synthesis.joins import presence
from .canonical import FOOT, LEG, SHIN, THIGH
from .interactions import Interaction

__all__ = ["at_seat_height", "at_top_height"]

_HIPS, _KNEES, _ANKLES, _TOES, _SHOULDERS, _ELBOWS, _WRISTS = (
    [joint("left_" + n), joint("right_" + n)]
    for n in ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "wrist")
)
_ARMS = _ELBOWS + _WRISTS
_NECK, _HEAD = joint("neck"), joint("head")
_BODY = [j for j in range(22) if j not in _KNEES + _ANKLES + _TOES]
_UPPER_ARM, _FOREARM = (float(np.linalg.norm(OFFSETS[j[0]])) for j in (_ELBOWS, _WRISTS))
# of what moves with the pelvis (all but shins and feet), near each joint; after de Leva (1996)
_MASS = np.zeros(22)
for _joints, _share in (
    ([0], 0.20),
    ([joint("spine2")], 0.13),
    ([joint("spine3")], 0.14),
    ([_HEAD], 0.07),
    (_SHOULDERS, 0.03),
    (_ELBOWS, 0.025),
    (_WRISTS, 0.02),
    (_HIPS, 0.08),
):
    _MASS[_joints] = _share
_MASS /= _MASS.sum()
_UP = np.array([0.0, 0.0, 1.0])

_STANDING = 0.92  # metres; a pelvis above it is not moved
# of the way from standing to seated, over which the pelvis' own course fades into the seat's
_CORNER = 0.2
_CARRIED = 0.12  # metres over the seat, within which the seat takes over the weight
_LEAN = 1.5  # share of its lean that the trunk gains for each metre that the seat is lower
_GAIN = (0.6, 1.5)
_SIGMA = 9  # frames; the trunk leans before the pelvis moves, and until after
# metres; near this length the heel begins to lift, so that the knee does not lock
_STRAIGHT, _SOFT = 0.985 * LEG, 0.03
_TIPTOE = np.radians(40.0)  # between foot and leg; beyond it the toes leave the floor, too
# metres; a foot higher over the floor than the first begins to belong to the seat
_HANGS = (0.06, 0.18)
# above this height (metres) one sits nearer the edge: by this share of what the pelvis is higher
_PERCH = (0.75, 0.6)
# metres from the wrist to thigh bone or seat: the hand rests there; it has nothing to do with it
_TOUCH = (0.12, 0.30)
_REACHES = 0.96  # of an arm's length
_COMES = 30  # frames in which a hand comes to a top, and goes
_PLACES, _AT_IT = 40, 0.04  # points of a top; metres from them, of a wrist that works there
_WORKS = 0.3  # of the time that a top is worked at: a hand that is there for less has its own place
_SEAT = np.array([(x, y, -SEAT_TO_PELVIS) for x in (-0.25, 0.25) for y in (-0.15, 0.05)])
_THIGH = np.array([0.1, 0.35, 0.6, 0.85])


def _ramp(x: np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, straight between but for round corners."""
    x = np.clip(x, 0.0, 1.0)
    corner = 2 * _CORNER * (1 - _CORNER)
    rising = np.where(x < _CORNER, x**2 / corner, (x - _CORNER / 2) / (1 - _CORNER))
    return np.where(x > 1 - _CORNER, 1 - (1 - x) ** 2 / corner, rising)


def _positive(x: np.ndarray) -> np.ndarray:
    """The larger of ``x`` and 0, with a round corner."""
    return np.where(np.abs(x) < _SOFT, (x + _SOFT) ** 2 / (4 * _SOFT), np.maximum(x, 0.0))


def _smoothed(values: np.ndarray) -> np.ndarray:
    """Gaussian smoothing of (T,) along time, the ends held."""
    reach = 3 * _SIGMA
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / _SIGMA) ** 2)
    return np.convolve(np.pad(values, reach, mode="edge"), kernel / kernel.sum(), mode="valid")


def _turned(v: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Vectors (T, N, 3) turned about unit axes (T, 3) by angles (T,)."""
    axis, cosine, sine = axis[:, None], np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    return v * cosine + np.cross(axis, v) * sine + axis * _dot(axis, v) * (1 - cosine)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1, keepdims=True)


def _length(v: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(v, v))


def _feet(joints: np.ndarray, hips: np.ndarray, rise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ankles and toes (T, 2, 3) under moved hips, whose seat has risen by ``rise`` (T, 1): where
    they were, if on the floor.

    Where the leg is too short the heel lifts about the planted toes, and at last the toes come with
    it. Feet that hang go with the seat, down to the floor.
    """
    ankle, toe = joints[:, _ANKLES], joints[:, _TOES]
    over = np.minimum(toe[..., 2] - REST[_TOES, 2], ankle[..., 2] - REST[_ANKLES, 2])
    # Over a longer way where the seat rises: a foot that steps or taps must not shoot up.
    hangs = np.clip((over - _HANGS[0]) / np.maximum(_HANGS[1] - _HANGS[0], rise), 0.0, 1.0)
    along = np.maximum(hangs * rise, -np.maximum(over, 0.0))[..., None] * _UP
    need, before = _length(ankle + along - hips), joints[:, _ANKLES] - joints[:, _HIPS]
    ankle, toe = ankle + along, toe + along
    moved = np.minimum(_length(hips - joints[:, _HIPS]) / _SOFT, 1.0)
    excess = need - np.maximum(_STRAIGHT, _length(before))
    leg = np.minimum(need - moved * _positive(excess), LEG * (1 - 1e-12))

    # The triangle of hip, toe and ankle: the angle at the toe closes as the heel lifts.
    apart = _length(hips - toe)
    toward, heel = (hips - toe) / apart, (ankle - toe) / FOOT
    angle = _dot(toward, heel)  # its cosine, like the next
    tiptoe = np.maximum((1 + angle) / 2, np.cos(_TIPTOE))
    farthest = FOOT * tiptoe + np.sqrt(np.maximum(leg**2 - FOOT**2 * (1 - tiptoe**2), 0.0))
    lift = np.maximum(apart - farthest, 0.0)
    apart = apart - lift
    closed = np.clip((apart**2 + FOOT**2 - leg**2) / (2 * apart * FOOT), angle, 1.0)
    toe = toe + toward * lift
    return toe + FOOT * (
        closed * toward + np.sqrt(1 - closed**2) * normalised(heel - toward * angle)
    ), toe


def _knees(
    joints: np.ndarray, hips: np.ndarray, ankles: np.ndarray, forward: np.ndarray
) -> np.ndarray:
    """Knees (T, 2, 3) between moved hips and ankles: their hinges turn as little as they can."""
    hinge = np.cross(joints[:, _KNEES] - joints[:, _HIPS], joints[:, _ANKLES] - joints[:, _KNEES])
    bend = np.cross(ankles - hips, hinge)
    return two_bone(
        hips,
        ankles,
        hips + bend,
        THIGH,
        SHIN,
        fallback=np.broadcast_to(forward[:, None], bend.shape),
    )[0]


def _thighs(joints: np.ndarray) -> np.ndarray:
    """Points (T, 8, 3) along both thighs."""
    hips, knees = joints[:, _HIPS, None], joints[:, _KNEES, None]
    return (hips + _THIGH[:, None] * (knees - hips)).reshape(len(joints), -1, 3)


def _arms(
    joints: np.ndarray, out: np.ndarray, seat: np.ndarray, heading: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Elbows and wrists (T, 2, 3) of the moved body ``out``, whose seat has moved by ``seat`` (T,
    3).

    A hand keeps its place to the points of thighs and seat that it is near to: p' = sum of w_j (t_j
    + p - s_j), w_j falling linearly from 1 at the smallest distance to 0 at the mean one (paper,
    section 5.2); a free hand goes with its shoulder. ``heading`` (T, 3, 3): rows right, forward,
    up.
    """
    shoulder, elbow, wrist = joints[:, _SHOULDERS], joints[:, _ELBOWS], joints[:, _WRISTS]
    thighs = _thighs(joints)
    points = np.concatenate([thighs, joints[:, :1] + _SEAT @ heading], axis=1)
    moved = np.concatenate(
        [_thighs(out) - thighs, np.repeat(seat[:, None], len(_SEAT), axis=1)], axis=1
    )
    distance = _length(wrist[:, :, None] - points[:, None])[..., 0]
    least, mean = distance.min(-1, keepdims=True), distance.mean(-1, keepdims=True)
    weight = np.clip((mean - distance) / (mean - least), 0.0, 1.0)
    rests = np.clip((_TOUCH[1] - least) / (_TOUCH[1] - _TOUCH[0]), 0.0, 1.0)
    nearby = weight @ moved / weight.sum(-1, keepdims=True)
    shoulders = out[:, _SHOULDERS]
    wrists = wrist + rests * nearby + (1 - rests) * (shoulders - shoulder)
    backward = np.broadcast_to(-heading[:, None, 1], elbow.shape)
    return two_bone(
        shoulders, wrists, shoulders + elbow - shoulder, _UPPER_ARM, _FOREARM, fallback=backward
    )


def at_seat_height(joints: np.ndarray, resting_pelvis: float, wanted: float) -> np.ndarray:
    """The motion (T, 22, 3) of the canonical body with its resting pelvis moved from one height to
    another (metres).

    The pelvis goes all the way while seated, none while standing, in between in proportion. Feet
    stay; on a high seat heels lift, then toes. On the way to a lower seat the trunk leans further,
    to a higher one less, and as long as the seat does not carry it the upper body keeps its centre
    of mass over the feet as it was. Hands go with what they are near to. Bones keep their lengths.
    """
    height = joints[:, PELVIS, 2]
    standing = max(_STANDING, resting_pelvis + 0.08)
    down = (standing - height) / (standing - resting_pelvis)
    share = _ramp(down)[:, None]
    rise = (wanted - resting_pelvis) * share
    right = normalised(
        (joints[:, _HIPS[1]] - joints[:, _HIPS[0]]) * (1, 1, 0), fallback=np.array([1.0, 0.0, 0.0])
    )
    heading = np.stack([right, np.cross(_UP, right), np.broadcast_to(_UP, right.shape)], axis=1)
    forward = heading[:, 1]

    trunk = joints[:, _NECK] - joints[:, PELVIS]
    lean = np.arctan2((trunk * forward).sum(-1), trunk[:, 2])
    on_the_way = np.minimum(2.0 * _smoothed(((down > 0.1) & (down < 0.85)).astype(float)), 1.0)
    gain = np.clip(1.0 + _LEAN * (resting_pelvis - wanted), *_GAIN) - 1.0
    further = on_the_way * gain * np.maximum(lean, 0.0)

    out, pelvis = joints.copy(), joints[:, :1]
    out[:, _BODY] = pelvis + _turned(joints[:, _BODY] - pelvis, right, -further)
    # Arms hang and the face looks ahead, however the trunk leans.
    out[:, _HEAD] = out[:, _NECK] + joints[:, _HEAD] - joints[:, _NECK]
    out[:, _ARMS] = joints[:, _ARMS] + np.tile(
        out[:, _SHOULDERS] - joints[:, _SHOULDERS], (1, 2, 1)
    )
    balance = (
        np.einsum("tjc,j->tc", joints - out, _MASS)
        * (1, 1, 0)
        * _ramp((height - resting_pelvis) / _CARRIED)[:, None]
    )
    edge = _PERCH[1] * max(0.0, wanted - max(_PERCH[0], resting_pelvis))
    out[:, _BODY] += (rise * _UP + balance + edge * share * forward)[:, None]
    ankles, out[:, _TOES] = _feet(joints, out[:, _HIPS], rise)
    out[:, _KNEES], out[:, _ANKLES] = _knees(joints, out[:, _HIPS], ankles, forward), ankles
    out[:, _ELBOWS], out[:, _WRISTS] = _arms(joints, out, rise * _UP, heading)
    return out


def at_top_height(joints: np.ndarray, use: Interaction, rise: float) -> np.ndarray:
    """The motion (T, 22, 3) of the canonical body with the top that its hands work on
    (``interactions``) ``rise`` metres higher.

    The points of the top are where wrists were. A hand that works there keeps its place to them
    while it is within 12 cm, is its own again from 30 cm on or a second before and after, and goes
    over in between; the arms follow, all else stays. Where arms are too short for that, the top
    moves by less.
    """
    wrist, shoulders = joints[:, _WRISTS], joints[:, _SHOULDERS]
    places = use.points[:: max(1, len(use.points) // _PLACES)]
    gap = _length(wrist[:, :, None] - places)[..., 0].min(-1)
    works = (gap[use.start : use.end] < _AT_IT).mean(0) > _WORKS
    near = _ramp((_TOUCH[1] - gap) / (_TOUCH[1] - _TOUCH[0]))
    # Earlier and later the body may walk, hands beside it, where the top will be.
    there = presence(len(joints), use.start - _COMES, use.end + _COMES, _COMES)
    share = (near * works * there[:, None])[..., None]
    own = np.maximum(_length(wrist - shoulders), _REACHES * (_UPPER_ARM + _FOREARM))
    for part in np.linspace(1.0, 0.0, 9):
        target = wrist + part * rise * share * _UP
        if (_length(target - shoulders) <= own + 1e-9).all():
            break

    right = normalised(
        (joints[:, _HIPS[1]] - joints[:, _HIPS[0]]) * (1, 1, 0), fallback=np.array([1.0, 0.0, 0.0])
    )
    backward = np.broadcast_to(-np.cross(_UP, right)[:, None], wrist.shape)
    out = joints.copy()
    out[:, _ELBOWS], out[:, _WRISTS] = two_bone(
        shoulders,
        target,
        joints[:, _ELBOWS],
        _UPPER_ARM,
        _FOREARM,
        fallback=backward,
    )
    return out
