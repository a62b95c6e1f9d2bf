"""A motion of the 22 joints onto another body: hands, feet and head land where they landed, bones keep their lengths.

Every body has a canonical frame (x right, y forward, z up) and 22 joints at rest in it, those that it lacks filled in. Two
kinds of global joint frames occur. *Turns* are the identity in the body's own rest pose, whatever that is; *frames* are the
identity where its limbs lie as in a T-pose. A body's ``alignment`` leads from one to the other: turns = frames @ alignment.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .kinematics import two_bone
from .rotations import matrix_from_vector, normalised, rotate, rotation_between, transpose
from .skeleton import PARENTS, REST

__all__ = ["LIMBS", "Body", "Landed", "Motion", "canonical_body", "filled", "onto", "size_ratio"]

LIMBS = {
    "left_arm": (16, 18, 20), "right_arm": (17, 19, 21), "left_leg": (1, 4, 7), "right_leg": (2, 5, 8),
}
"""First, middle and end joint of the limbs."""

_AXIS = {"left_arm": (-1.0, 0, 0), "right_arm": (1.0, 0, 0), "left_leg": (0, 0, -1.0), "right_leg": (0, 0, -1.0)}
_BEND = {"left_arm": (0, -1.0, 0), "right_arm": (0, -1.0, 0), "left_leg": (0, 1.0, 0), "right_leg": (0, 1.0, 0)}
_TRUNK = (3, 6, 9, 12)  # the joints that bring the head to its place
_SAME_SIZE = 0.03  # bodies whose legs differ by less count as of one size, so that hands stay on what they touch
_REACH = 1.0 - 1e-5
_SINK = 0.3  # of a leg's length: the most by which the pelvis is lowered to let the feet reach
_TRUNK_TURN, _SHRUG = 0.35, 0.35  # the most that trunk and collars turn out of the source's pose to reach, radians
_ROUNDS, _LEANS = 24, 8
_STRAIGHT = 0.03  # a limb bent by less than this (of its length) also takes its plane from its first joint's frame


@dataclass(frozen=True)
class Body:
    """``rest`` (22, 3): joints at rest in the canonical frame, any place and unit of length, all finite (``filled``).

    ``present`` (22,): which of them a bone turns; the others are rigid on their parents. ``fingers`` (2, 3): where the
    fingers of the left and the right hand point at rest, NaN where that is not known.
    """

    rest: np.ndarray
    present: np.ndarray
    fingers: np.ndarray

    def length(self, child: int) -> float:
        """Of the bone from a joint's parent to the joint."""
        return float(np.linalg.norm(self.rest[child] - self.rest[PARENTS[child]]))

    def leg(self) -> float:
        """Length of the legs, mean of both, hip to ankle."""
        return 0.5 * sum(self.length(j) for j in (4, 5, 7, 8))

    def trunk(self) -> float:
        """From the middle of the hip joints to the head joint."""
        return float(np.linalg.norm(self.rest[15] - 0.5 * (self.rest[1] + self.rest[2])))

    def alignment(self) -> np.ndarray:
        """(22, 3, 3) rotations that lay the limbs at rest as in a T-pose: arms to the sides, legs down, feet ahead.

        Trunk and head count as upright, soles as flat, and hands are straight with their fingers where those are known.
        """
        turns = np.tile(np.eye(3), (22, 1, 1))
        for name, (first, middle, end) in LIMBS.items():
            axis = np.array(_AXIS[name])
            upper, lower = self.rest[middle] - self.rest[first], self.rest[end] - self.rest[middle]
            turns[first] = rotation_between(upper, axis)
            turns[middle] = rotation_between(turns[first] @ lower, axis) @ turns[first]
            if end in (20, 21):
                fingers = self.fingers[end - 20]
                pointing = turns[middle] @ (fingers if np.isfinite(fingers).all() else lower)
                turns[end] = rotation_between(pointing, axis) @ turns[middle]
            else:
                flat = np.array([1.0, 1.0, 0.0])
                ahead = REST[end + 3] - REST[end]
                turns[end] = rotation_between((self.rest[end + 3] - self.rest[end]) * flat, ahead * flat)
                turns[end + 3] = turns[end]
        return turns


@dataclass(frozen=True)
class Motion:
    """``joints`` (T, 22, 3), world; ``frames`` (T, 22, 3, 3): global, the identity in a T-pose that looks along +y."""

    joints: np.ndarray
    frames: np.ndarray


@dataclass(frozen=True)
class Landed:
    """``motion`` on the body; ``turns`` (T, 22, 3, 3): global, the identity in its rest pose.

    ``targets`` (T, 22, 3): where its joints were to lie; of these wrists, ankles, head and the middle of the hip joints
    are aimed at. ``bends`` (T, 4, 3): unit directions in which the limbs of ``LIMBS`` bend. ``ratio``: the body's size over
    the source's.
    """

    motion: Motion
    turns: np.ndarray
    targets: np.ndarray
    bends: np.ndarray
    ratio: float


def canonical_body(scale: float) -> Body:
    """The DAFNet character's own body; ``scale``: its size over the canonical one, times the unit of length wanted."""
    return Body(scale * REST, np.ones(22, bool), np.full((2, 3), np.nan))


def filled(rest: np.ndarray) -> np.ndarray:
    """Rest joints (22, 3) with those that are NaN put where they would lie; pelvis, limbs and head have to be there."""
    rest = np.array(rest, float)
    legs = np.linalg.norm(rest[[4, 5, 7, 8]] - rest[[1, 2, 4, 5]], axis=1).sum()
    size = legs / np.linalg.norm(REST[[4, 5, 7, 8]] - REST[[1, 2, 4, 5]], axis=1).sum()
    column = [0, 3, 6, 9, 12, 15]
    known = [j for j in column if np.isfinite(rest[j]).all()]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(REST[column], axis=0), axis=1))])
    place = dict(zip(column, along, strict=True))
    for k in range(3):
        rest[column, k] = np.interp(along, [place[j] for j in known], rest[known, k])
    for collar, shoulder in ((13, 16), (14, 17)):
        if not np.isfinite(rest[collar]).all():
            rest[collar] = rest[shoulder] + size * (REST[collar] - REST[shoulder])
    for ankle in (7, 8):
        if not np.isfinite(rest[ankle + 3]).all():
            rest[ankle + 3] = rest[ankle] + size * (REST[ankle + 3] - REST[ankle])
    return rest


def size_ratio(source: Body, body: Body) -> float:
    """The body's size over the source's, by their legs; 1 where they differ by less than 3 %."""
    ratio = body.leg() / source.leg()
    return 1.0 if abs(ratio - 1.0) < _SAME_SIZE else ratio


def onto(source: Motion, source_body: Body, body: Body, root: np.ndarray) -> Landed:
    """The motion on another body. ``root`` (T, 3): the place on the floor under the source, about which it is scaled.

    Where the sizes differ (``size_ratio``), the source's joints are scaled about the root, except that steps keep their
    length, since the root's path keeps its own and feet would slide otherwise, and that the head is put over the hips by the
    size of the trunk, which would be stretched or bent all the time otherwise. Then hands, feet and head turn as the
    source's do; the middle of the hip joints comes to lie where the source's lies, lower where legs would not reach; the
    trunk turns as the source's and bends by some degrees more to bring the head to its place; limbs reach wrists and ankles
    in the planes of the source's; collars help where an arm is short. An ankle that lies higher over its toes than the
    source's is held higher by that, so that soles stay on the floor.
    """
    ratio = size_ratio(source_body, body)
    targets = _scaled(source.joints, root, ratio)
    if ratio != 1.0:
        upright = source.joints[:, 15] - source.joints[:, [1, 2]].mean(axis=1)
        targets[:, 15] = targets[:, [1, 2]].mean(axis=1) + body.trunk() / source_body.trunk() * upright
    if body.present[[10, 11]].all():
        rise = (body.rest[[7, 8], 2] - body.rest[[10, 11], 2]) - ratio * (
            source_body.rest[[7, 8], 2] - source_body.rest[[10, 11], 2])
        targets[:, [7, 8]] += source.frames[:, [7, 8]][..., 2] * rise[:, None]

    alignment = body.alignment()
    turns = source.frames @ alignment
    spine = [j for j in (3, 6, 9) if body.present[j]]
    if spine:
        turns[:, spine[-1]] = source.frames[:, 9]  # neck and arms hang on it
    joints = targets.copy()

    def place(*which: int) -> None:
        for j in which:
            parent = PARENTS[j]
            if not body.present[parent] and parent != 0:
                turns[:, parent] = turns[:, PARENTS[parent]]
            joints[:, j] = joints[:, parent] + rotate(turns[:, parent], body.rest[j] - body.rest[parent])

    middle = 0.5 * (body.rest[1] + body.rest[2])
    joints[:, 0] = targets[:, [1, 2]].mean(axis=1) + rotate(turns[:, 0], body.rest[0] - middle)
    place(1, 2)
    joints[:, 0, 2] -= _sunk(joints, targets, body)
    place(1, 2)

    trunk = [j for j in _TRUNK if body.present[j]]
    _bring_head(joints, turns, targets[:, 15], trunk, place)
    place(13, 14, 16, 17)
    if spine and not body.present[[13, 14]].any():
        _lean(joints, turns, targets, spine[-1], body)
        _bring_head(joints, turns, targets[:, 15], [j for j in trunk if j != spine[-1]], place)
        place(13, 14, 16, 17)
    for collar, shoulder, elbow, wrist in ((13, 16, 18, 20), (14, 17, 19, 21)):
        if body.present[collar]:
            reach = _REACH * (body.length(elbow) + body.length(wrist))
            _shrug(joints, turns, targets[:, wrist], collar, shoulder, reach)
        place(shoulder)

    bends = []
    for name, (first, mid, end) in LIMBS.items():
        axis = np.array(_AXIS[name])
        bend = _bend(source, name, joints[:, first], targets[:, end])
        joints[:, mid], joints[:, end] = two_bone(
            joints[:, first], targets[:, end], joints[:, first] + bend, body.length(mid), body.length(end), bend)
        for at, child in ((first, mid), (mid, end)):
            straight = rotation_between(rotate(source.frames[:, at], axis), joints[:, child] - joints[:, at])
            turns[:, at] = straight @ source.frames[:, at] @ alignment[at]
        bends.append(bend)
    place(10, 11)
    for j in range(1, 22):
        if not body.present[j]:
            turns[:, j] = turns[:, PARENTS[j]]
    moved = Motion(joints, turns @ transpose(alignment))
    return Landed(moved, turns, targets, np.stack(bends, axis=1), ratio)


def _scaled(joints: np.ndarray, root: np.ndarray, ratio: float) -> np.ndarray:
    scaled = root[:, None] + ratio * (joints - root[:, None])
    feet = [7, 8, 10, 11]
    scaled[:, feet, :2] = joints[:, feet, :2]
    return scaled


def _sunk(joints: np.ndarray, targets: np.ndarray, body: Body) -> np.ndarray:
    """By how much (T,) the pelvis has to go down for both feet to be reached."""
    sunk = np.zeros(len(joints))
    for first, mid, end in (LIMBS["left_leg"], LIMBS["right_leg"]):
        length = _REACH * (body.length(mid) + body.length(end))
        apart = joints[:, first] - targets[:, end]
        high = np.sqrt(np.maximum(length**2 - (apart[:, :2] ** 2).sum(-1), 0.0))
        sunk = np.maximum(sunk, np.minimum(apart[:, 2] - high, _SINK * length))
    return sunk


def _limited(turn: np.ndarray, most: float) -> np.ndarray:
    """Rotations (T, 3, 3), none by more than ``most`` radians (which is under half a circle)."""
    vector = 0.5 * np.stack([
        turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=-1)
    angle = np.arctan2(np.linalg.norm(vector, axis=-1), 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0))
    return matrix_from_vector(normalised(vector) * np.minimum(angle, most)[:, None])


def _bring_head(
    joints: np.ndarray, turns: np.ndarray, head: np.ndarray, trunk: list[int], place: Callable[..., None],
) -> None:
    """Turn the trunk's joints, each a little, until the head joint lies at ``head`` (T, 3): cyclic coordinate descent."""
    meant = turns[:, trunk].copy()
    place(3, 6, 9, 12, 15)
    for _ in range(_ROUNDS if trunk else 0):
        for k, j in enumerate(trunk):
            turn = rotation_between(joints[:, 15] - joints[:, j], head - joints[:, j])
            for i, above in enumerate(trunk[k:], k):
                asked = turn @ turns[:, above]
                turns[:, above] = _limited(asked @ transpose(meant[:, i]), _TRUNK_TURN) @ meant[:, i]
            place(3, 6, 9, 12, 15)


def _lean(joints: np.ndarray, turns: np.ndarray, targets: np.ndarray, chest: int, body: Body) -> None:
    """Without collars: turn the chest towards the wrists that the arms are too short for."""
    meant, center = turns[:, chest].copy(), joints[:, chest]
    turn = np.broadcast_to(np.eye(3), meant.shape)
    for _ in range(_LEANS):
        pull = np.zeros_like(center)
        for shoulder, elbow, wrist in ((16, 18, 20), (17, 19, 21)):
            arm = rotate(turn, joints[:, shoulder] - center)
            away = targets[:, wrist] - center - arm
            short = np.linalg.norm(away, axis=-1, keepdims=True) - _REACH * (body.length(elbow) + body.length(wrist))
            # A rotation vector that moves the shoulder by what is missing, as far as a turn about the chest can.
            pull += np.cross(arm, np.maximum(short, 0.0) * normalised(away)) / (arm**2).sum(-1, keepdims=True)
        turn = _limited(matrix_from_vector(pull) @ turn, _TRUNK_TURN)
    turns[:, chest] = turn @ meant


def _shrug(
    joints: np.ndarray, turns: np.ndarray, wrist: np.ndarray, collar: int, shoulder: int, reach: float,
) -> None:
    """Turn the collar towards a wrist (T, 3) that the arm is too short for."""
    meant, arm = turns[:, collar].copy(), joints[:, shoulder] - joints[:, collar]
    turn = np.broadcast_to(np.eye(3), meant.shape)
    for _ in range(3):
        at = joints[:, collar] + rotate(turn, arm)
        missing = np.linalg.norm(wrist - at, axis=-1, keepdims=True) - reach
        aim = at + np.maximum(missing, 0.0) * normalised(wrist - at) - joints[:, collar]
        turn = _limited(rotation_between(arm, aim), _SHRUG)
    turns[:, collar] = turn @ meant


def _bend(source: Motion, limb: str, first: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Unit directions (T, 3) in which a limb from ``first`` to ``target`` bends as the source's does."""
    a, b, c = (source.joints[:, j] for j in LIMBS[limb])
    along, onward = normalised(c - a), normalised(target - first)
    offset = (b - a) - ((b - a) * along).sum(-1, keepdims=True) * along
    offset = offset / np.linalg.norm(b - a, axis=-1, keepdims=True)
    axis = rotate(source.frames[:, LIMBS[limb][0]], np.array(_AXIS[limb]))
    hinge = rotate(rotation_between(axis, along), rotate(source.frames[:, LIMBS[limb][0]], np.array(_BEND[limb])))
    bend = rotate(rotation_between(along, onward), offset + _STRAIGHT * hinge)
    return normalised(bend - (bend * onward).sum(-1, keepdims=True) * onward, hinge)
