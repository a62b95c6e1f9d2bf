"""Who rests on furniture is as high over it as it carries a body: lifted where sunk in, lowered
where hovering, thighs and back against it and not in it.

Joints are (T, 22, 3), world, canonical metres, 30 frames a second unless another rate is given.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from .kinematics import two_bone
from .root import gaussian
from .rotations import matrix_from_vector, normalised
from .series import MODEL_FPS, minimum_jerk, runs, smoothstep
from .skeleton import (
    ANKLES,
    FEET,
    HIPS,
    JOINTS,
    KNEES,
    NECK,
    OFFSETS,
    PELVIS,
    SPINE,
    joint,
)
from .softness import LIES_LOWER, Support

__all__ = [
    "Distance",
    "across_of",
    "lifted",
    "lying",
    "on_legs",
    "reclined",
    "rested",
    "resting",
    "sitting",
    "until_free",
]

Distance = Callable[[np.ndarray], np.ndarray]
"""Signed distances (T, N) of world points (T, N, 3) to the furniture, negative inside; metres."""

_OVER_LEGS = [j for j in range(len(JOINTS)) if j not in {*KNEES, *ANKLES, *FEET}]
_THIGH, _SHIN = (float(np.linalg.norm(OFFSETS[joint("left_" + n)])) for n in ("knee", "ankle"))
_LEG = 0.999 * (_THIGH + _SHIN)  # metres: as far as a leg reaches
_FOOT = float(np.linalg.norm(OFFSETS[joint("left_foot")]))
_TIPTOE = float(np.sqrt(_SHIN**2 + _FOOT**2 + 2.0 * _SHIN * _FOOT * np.cos(np.radians(35.0))))
"""Metres from a knee to a toe base on tiptoe: the foot 35 degrees from being stretched."""

_SINKS = 0.17  # metres under where it is carried, of a pelvis that rests there; lower, it is under
_HOVERS = 0.25  # metres over it, of one that rests there; higher, it stands
_STILL = 0.15  # metres a second of a pelvis that rests
_SETTLED = 3.0  # frames; deviation of the Gaussian over a pelvis whose speed is told
_RESTS = 8  # frames of the shortest rest
_STIRS = 10  # frames of the longest gap in one
_EITHER_WAY = 0.005  # metres by which bodies rest higher or lower and are left alone
_ON_THE_WAY = 25  # frames of sitting down and getting up
_SLOW = 10.0  # frames; deviation of the Gaussian that tells a rest's height from its life
_LOOKS_BACK = 2.0  # seconds before and after a rest, in which its way down or up begins and ends
_UPRIGHT = 0.2  # share of the way down that is not yet part of it
_COMES = 1 / 3  # seconds of the shortest way
_PACE = 5.0  # seconds of the shortest way for each metre that a rest is moved by
_ON_IT = (-0.05, 0.10)  # metres over a top at which an ankle begins to lie on it, and until it does
_TRUNK = [*SPINE, NECK]
_OVER_PELVIS = [j for j in _OVER_LEGS if j not in {PELVIS, *HIPS}]
_BACK_SKIN = 0.05  # metres that a hard back keeps the spine away: ten of flesh, half of which gives
_THIGH_SKIN = 0.01  # metres that a hard seat keeps a thigh's bone away: six of flesh, five give
_GIVES_WAY = 0.6  # of a seat's softness, by which its back and its edge give way
_ALONG = np.array([0.25, 0.5, 0.75, 1.0])  # places on a thigh that a seat must not be in
_LADDER = 0.02  # metres between places on the way out of furniture
_FARTHEST_OUT = 0.20  # metres of that way
_ROUNDS = 3  # of raising thighs: as they turn, another place of them comes over the edge
_LEANS = np.radians(25.0)  # at most, for a back
_LEAST_LEVER = 0.1  # metres over the pelvis, of what tells how far to lean
_STEADY = 4.0  # frames; deviation of the Gaussian over what brings a body out of furniture
_SOFT = 0.06  # share of a leg in which it stops being pulled straight
# of a trunk that has a back behind it up to the one, and a bed under it from the other on
_RECLINES = np.radians((30.0, 45.0))
_ON_TOP = 0.04  # metres over a top, of an ankle that lies on it: feet hardly sink in
_LIES = np.radians((45.0, 75.0))  # of a trunk out of the vertical: sitting up to, lying from


def rested(
    joints: np.ndarray, support: Support, strength: float = 1.0, distance: Distance | None = None
) -> np.ndarray:
    """Joints whose pelvis, wherever it rests over something, is within half a centimetre of where
    that carries it; feet stay where they are, or hang where they do not reach.

    A rest is what is slow, and neither as deep in the furniture as what is under it nor as high
    over it as what stands. The way to it and from it is moved softly, less and less.
    """
    lies = lying(joints)
    carried = support.carried - LIES_LOWER * lies
    rests = resting(joints, carried)
    if not rests:
        return joints

    lift = strength * _lift(joints, carried, rests)
    if lift.any():
        joints = lifted(joints, lift, support.top)
    if distance is not None:
        rest = strength * _during(rests, len(joints))
        sits = rest * (1.0 - lies)
        upright = rest * (1.0 - smoothstep(_between(_tilt(joints), *_RECLINES)))
        joints = _off_the_back(joints, distance, support.softness, upright)
        joints = _on_the_seat(joints, distance, support.softness, sits)
    return joints


def _tilt(joints: np.ndarray) -> np.ndarray:
    """Angle (T,) of the trunk to the vertical, radians."""
    trunk = joints[:, NECK] - joints[:, PELVIS]
    return np.arctan2(np.linalg.norm(trunk[:, :2], axis=-1), trunk[:, 2])


def lying(joints: np.ndarray) -> np.ndarray:
    """How far (T,) somebody lies, from 0, sitting up, to 1."""
    return smoothstep(_between(_tilt(joints), *_LIES))


def _between(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Which part of the way from ``low`` to ``high`` values are on."""
    return (values - low) / (high - low)


def resting(
    joints: np.ndarray, carried: np.ndarray, fps: float = MODEL_FPS
) -> list[tuple[int, int]]:
    """The (start, stop) of rests of a pelvis that furniture has to carry at these heights (T,)."""
    pelvis, rate = joints[:, PELVIS], fps / MODEL_FPS
    speed = np.zeros(len(joints))
    if len(joints) > 1:
        smooth = gaussian(pelvis, _SETTLED * rate)
        speed = np.linalg.norm(np.gradient(smooth, axis=0), axis=-1) * fps
    over = pelvis[:, 2] - carried
    there = (over > -_SINKS) & (over < _HOVERS) & (speed < _STILL)
    return runs(there, at_least=min(round(_RESTS * rate), len(joints)), gap=round(_STIRS * rate))


def sitting(joints: np.ndarray, support: Support) -> np.ndarray:
    """Whether (T,) somebody sits on what is under the root, or is about to, or gets up."""
    sits = np.zeros(len(joints), bool)
    for start, stop in resting(joints, support.carried):
        sits[max(0, start - _ON_THE_WAY) : stop + _ON_THE_WAY] = True
    return sits & (_tilt(joints) < _LIES[0])


def _lift(joints: np.ndarray, carried: np.ndarray, rests: Sequence[tuple[int, int]]) -> np.ndarray:
    """Metres (T,) by which all but the feet has to go up to rest where it is ``carried`` (T,)."""
    height = joints[:, PELVIS, 2]
    out = np.zeros(len(joints))
    for start, stop in rests:
        over = (height - carried)[start:stop]
        known = np.isfinite(over)
        over = np.interp(np.arange(len(over)), np.flatnonzero(known), over[known])
        over = gaussian(over, _SLOW)
        out[start:stop] = np.clip(over, -_EITHER_WAY, _EITHER_WAY) - over

    edges = [(0, 0), *rests, (len(joints), len(joints))]
    for (first, last), (start, stop) in pairwise(edges):
        if last == start:
            continue
        up = _way(height[last:start], out[last - 1]) if last > first else 0
        down = _way(height[last:start][::-1], out[start]) if stop > start else 0
        before, after = out[last - 1] if up else 0.0, out[start] if down else 0.0
        frames = start - last
        if up + down > frames and up and down:
            up = down = frames
        t = np.arange(1, frames + 1)
        out[last:start] = before * (1.0 - minimum_jerk(t / max(up + 1, 1))) + after * (
            1.0 - minimum_jerk((frames + 1 - t) / max(down + 1, 1))
        )
    return out


def _way(height: np.ndarray, lift: float) -> int:
    """Frames in which a pelvis goes up, from a rest that is lifted, to where it stands."""
    look = height[: round(_LOOKS_BACK * MODEL_FPS)]
    rise = look.max() - look[0]
    upright = np.flatnonzero(look >= look[0] + (1.0 - _UPRIGHT) * rise)
    return max(int(upright[0]), round(_COMES * MODEL_FPS), round(abs(lift) * _PACE * MODEL_FPS))


def lifted(joints: np.ndarray, lift: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Joints with all but the legs lifted (T,); feet stay, or go with the body where they lie on
    the same ``top`` (T,), and knees bend forward.
    """
    over = joints[:, ANKLES, 2] - top[:, None]
    on_it = smoothstep(_between(np.where(np.isfinite(over), over, -1.0), *_ON_IT))
    ankles = joints[:, ANKLES].copy()
    ankles[..., 2] += lift[:, None] * gaussian(on_it, _STIRS / 2)
    surface = np.where(np.isfinite(top), top, -np.inf)[:, None] + _ON_TOP
    ankles[..., 2] = np.maximum(ankles[..., 2], np.minimum(joints[:, ANKLES, 2], surface))

    # Legs that are nearly straight stop softly where they are pulled off the floor.
    hips = joints[:, HIPS] + lift[:, None, None] * (0.0, 0.0, 1.0)
    before = np.linalg.norm((joints[:, ANKLES] - joints[:, HIPS]), axis=-1, keepdims=True)
    legs = ankles - hips
    length = np.linalg.norm(legs, axis=-1, keepdims=True)
    over = np.maximum(length - (1.0 - _SOFT) * _LEG, 0.0) / (_SOFT * _LEG)
    bent = np.where(over > 0.0, _LEG * (1.0 - _SOFT * np.exp(-over)), length)
    shorter = np.minimum(length, np.maximum(bent, before))
    ankles = hips + legs * shorter / np.maximum(length, 1e-9)

    forward = np.cross((0.0, 0.0, 1.0), across_of(joints))
    poles = joints[:, KNEES] + (np.abs(lift)[:, None] * forward)[:, None]
    poles[..., 2] += lift[:, None] / 2
    return on_legs(joints, lift, ankles, poles)


def across_of(joints: np.ndarray) -> np.ndarray:
    """Level unit vectors (T, 3) from the left hip to the right one."""
    left, right = (joints[:, hip] for hip in HIPS)
    return normalised((right - left) * (1.0, 1.0, 0.0), np.array([1.0, 0.0, 0.0]))


def _during(rests: Sequence[tuple[int, int]], frames: int) -> np.ndarray:
    """1 in the rests, and softly from and to 0 around them (T,)."""
    out = np.zeros(frames)
    for start, stop in rests:
        out[start:stop] = 1.0
    return gaussian(out, _STEADY)


def until_free(
    points: np.ndarray, way: np.ndarray, distance: Distance, skin: np.ndarray
) -> np.ndarray:
    """How far (T, N) points (T, N, 3) have to go along ``way`` (T, 3) to be ``skin`` (T,) metres
    out of furniture; 0 where that is too far.
    """
    short = skin[:, None] - distance(points)
    if not (short > 0.0).any():
        return np.zeros(points.shape[:2])

    steps = np.arange(0.0, _FARTHEST_OUT + _LADDER, _LADDER)
    left = [short]
    for step in steps[1:]:
        left.append(skin[:, None] - distance(points + step * way[:, None]))

    shorts = np.stack(left)  # (S, T, N)
    free = shorts <= 0.0
    first = np.maximum(free.argmax(axis=0), 1)
    before, after = (np.take_along_axis(shorts, k[None], axis=0)[0] for k in (first - 1, first))
    part = before / np.maximum(before - after, 1e-9)
    return np.where(free.any(axis=0) & ~free[0], _LADDER * (first - 1 + part), 0.0)


def _off_the_back(
    joints: np.ndarray, distance: Distance, softness: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Joints whose trunk leans forward as far as the back of a seat asks for, by ``counts``
    (T,)."""
    trunk = joints[:, _TRUNK]
    forward = np.cross((0.0, 0.0, 1.0), across_of(joints))
    ahead = until_free(trunk, forward, distance, _BACK_SKIN - _GIVES_WAY * softness)
    over = np.maximum((trunk - joints[:, PELVIS, None])[..., 2], _LEAST_LEVER)
    lean = gaussian(counts * np.clip(ahead / over, 0.0, _LEANS).max(axis=1), _STEADY)
    if not lean.any():
        return joints

    return reclined(joints, -lean)


def reclined(joints: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Joints with all over the pelvis turned back about it by an ``angle`` (T,), radians."""
    turn = matrix_from_vector(angle[:, None] * across_of(joints))
    pelvis = joints[:, PELVIS, None]
    out = joints.copy()
    out[:, _OVER_PELVIS] = pelvis + np.einsum(
        "tij,tbj->tbi", turn, (joints - pelvis)[:, _OVER_PELVIS]
    )
    return out


def _on_the_seat(
    joints: np.ndarray, distance: Distance, softness: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Joints whose thighs are raised about the hips as far as a seat's edge asks for, by ``counts``
    (T,); toes stay on the floor as far as heels can be lifted, else the feet hang.
    """
    above = np.tile((0.0, 0.0, 1.0), (len(joints), 1))
    skin = _THIGH_SKIN - _GIVES_WAY * softness
    out = joints
    for _ in range(_ROUNDS):
        thighs = out[:, KNEES] - out[:, HIPS]
        points = out[:, HIPS, None] + _ALONG[:, None] * thighs[:, :, None]
        up = until_free(points.reshape(len(out), -1, 3), above, distance, skin)
        steepest = (up.reshape(len(out), 2, -1) / _ALONG).max(axis=-1)
        raised = gaussian(counts[:, None] * np.minimum(steepest, _FARTHEST_OUT), _STEADY)
        if not raised.any():
            break

        out = joints.copy() if out is joints else out
        out[:, KNEES] = out[:, HIPS] + _THIGH * normalised(
            thighs + raised[..., None] * above[:, None]
        )

    if out is not joints:
        down = joints[:, FEET] - out[:, KNEES]
        length = np.linalg.norm(down, axis=-1, keepdims=True)
        before = np.linalg.norm(joints[:, FEET] - joints[:, KNEES], axis=-1, keepdims=True)
        within = np.maximum(_TIPTOE, before) / np.maximum(length, 1e-9)
        toes = out[:, KNEES] + down * np.minimum(1.0, within)
        out[:, ANKLES], out[:, FEET] = two_bone(
            out[:, KNEES], toes, joints[:, ANKLES], _SHIN, _FOOT
        )
    return out


def on_legs(
    joints: np.ndarray, lift: np.ndarray, ankles: np.ndarray, poles: np.ndarray
) -> np.ndarray:
    """Joints with all but the legs lifted (T,), and legs bent to ``poles`` that reach ``ankles``
    (T, 2, 3).
    """
    out = joints.copy()
    out[:, _OVER_LEGS, 2] += lift[:, None]
    out[:, KNEES], out[:, ANKLES] = two_bone(out[:, HIPS], ankles, poles, _THIGH, _SHIN)
    out[:, FEET] = out[:, ANKLES] + joints[:, FEET] - joints[:, ANKLES]
    return out
