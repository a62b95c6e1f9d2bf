"""A motion of the 22 joints onto another body: what is carried is how each limb lies in the world,
and where its end lands.

Rigs rest in all kinds of poses, so nothing is told as a rotation from rest. Every body is first
laid into the canonical T-pose (x right, y forward, z up; ``lay_in_t_pose``), and joints that it
lacks are filled in. Two kinds of global joint frames occur. *Frames* are the identity in that
T-pose, so the same frames are the same pose in the world on every body; *turns* are the identity in
the rig's own rest pose. A body's ``alignment`` leads from one to the other: turns = frames @
alignment.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .kinematics import two_bone
from .rotations import (
    frame_from,
    matrix_from_quaternion,
    matrix_from_vector,
    normalised,
    quaternion_from_matrix,
    rotate,
    rotation_between,
    slerp,
    transpose,
)
from .series import smoothstep
from .skeleton import (
    ANKLES,
    COLLARS,
    ELBOWS,
    FEET,
    HEAD,
    HIPS,
    JOINTS,
    KNEES,
    LIMBS,
    NECK,
    PARENTS,
    PELVIS,
    REST,
    SHOULDERS,
    SPINE,
    WRISTS,
)

__all__ = [
    "Body",
    "RetargetedMotion",
    "Motion",
    "canonical_body",
    "lay_in_t_pose",
    "limb_errors",
    "retarget",
    "size_ratio",
]

_AXIS = {
    "left_arm": (-1.0, 0, 0),
    "right_arm": (1.0, 0, 0),
    "left_leg": (0, 0, -1.0),
    "right_leg": (0, 0, -1.0),
}
_BEND = {
    "left_arm": (0, -1.0, 0),
    "right_arm": (0, -1.0, 0),
    "left_leg": (0, 1.0, 0),
    "right_leg": (0, 1.0, 0),
}
_FOOT_OF = dict(zip(ANKLES, FEET, strict=True))
_TRUNK = (*SPINE, NECK)  # the joints that bring the head to its place
# bodies whose legs differ by less count as of one size, so that hands stay on what they touch
_SAME_SIZE = 0.03
# ratios, over the body's size, up to which bodies are of the same build
_SAME_ARMS = 1.25
_SAME_CHEST = 1.2  # of the shoulders' height over the hips
# ankles that are higher by less than this (of the leg's length) do not lift the body
_SAME_ANKLES = 0.01
_REACH = 1.0 - 1e-5
_SINK = 0.3  # of a leg's length: the most by which the pelvis is lowered to let the feet reach
_TRUNK_TURN = 0.35  # radians that the trunk turns out of the source's pose to reach, at most
_SHRUG = 0.35  # radians that collars do
_EASE = 0.2  # the most that collars turn to leave elbows as bent as they were, radians

# Rounds of what is solved step by step.
_ROUNDS = 24
_LEANS = 8
_SHRUGS = 4

# hip to ankle, over the leg's length
_SEATED = 0.75  # bent as in sitting
_STANDS = 0.95  # straight as in standing

# a limb bent by less than this (of its length) also takes its plane from its first joint's frame
_STRAIGHT = 0.03
_UP = np.array([0.0, 0.0, 1.0])
# rest poses whose chest leans by more against the pelvis do not have a straight trunk
_BENT = np.radians(40.0)
# a trunk that leans by less at rest has a face that looks level and soles that are flat
_UPRIGHT = np.radians(30.0)
_CLEAR = np.sin(np.radians(30.0))  # limbs bent by more at rest show which way they bend
_AHEAD = np.sin(np.radians(10.0))


@dataclass(frozen=True)
class Body:
    """A body laid into the canonical T-pose, whatever pose its rig rests in (``lay_in_t_pose``).

    ``rest`` (22, 3): its joints in that pose, canonical frame, any unit of length. ``present``
    (22,): which of them a bone turns; the others are rigid on their parents. ``alignment`` (22, 3,
    3): the rotations that laid it so, out of the rig's own rest pose; from the frames of a pose
    they lead to its turns.
    """

    rest: np.ndarray
    present: np.ndarray
    alignment: np.ndarray

    def length(self, child: int) -> float:
        """Of the bone from a joint's parent to the joint."""
        return float(np.linalg.norm(self.rest[child] - self.rest[PARENTS[child]]))

    def leg(self) -> float:
        """Length of the legs, mean of both, hip to ankle."""
        return 0.5 * sum(self.length(j) for j in KNEES + ANKLES)

    def arm(self) -> float:
        """Length of the arms, mean of both, shoulder to wrist."""
        return 0.5 * sum(self.length(j) for j in ELBOWS + WRISTS)

    def chest(self) -> float:
        """From the middle of the hip joints to the middle of the shoulders."""
        return float(
            np.linalg.norm(self.rest[SHOULDERS].mean(axis=0) - self.rest[HIPS].mean(axis=0))
        )

    def trunk(self) -> float:
        """From the middle of the hip joints to the head joint."""
        left, right = self.rest[HIPS]
        return float(np.linalg.norm(self.rest[HEAD] - 0.5 * (left + right)))


@dataclass(frozen=True)
class Motion:
    """``joints`` (T, 22, 3), world; ``frames`` (T, 22, 3, 3): global, the identity in a T-pose that
    looks along +y.
    """

    joints: np.ndarray
    frames: np.ndarray


@dataclass(frozen=True)
class RetargetedMotion:
    """``motion`` on the body; ``turns`` (T, 22, 3, 3): global, the identity in its rest pose.

    ``targets`` (T, 22, 3): where its joints were to lie; of these wrists, ankles, head and the
    middle of the hip joints are aimed at. ``bends`` (T, 4, 3): unit directions in which the limbs
    of ``LIMBS`` bend. ``ratio``: the body's size over the source's.
    """

    motion: Motion
    turns: np.ndarray
    targets: np.ndarray
    bends: np.ndarray
    ratio: float


def canonical_body(scale: float) -> Body:
    """The DAFNet character's own body; ``scale``: its size over the canonical one, times the unit
    of length wanted.
    """
    return Body(scale * REST, np.ones(len(JOINTS), bool), np.tile(np.eye(3), (len(JOINTS), 1, 1)))


def lay_in_t_pose(
    rest: np.ndarray, present: np.ndarray | None = None, hands: np.ndarray | None = None
) -> Body:
    """The body of a rig that rests in any pose: standing, arms anywhere, sitting, bent or twisted.

    ``rest`` (22, 3): its joints at rest, z up and y about ahead, any unit; NaN where it has none,
    which only collars, feet, neck and spine may. ``present`` (22,): the joints that a bone turns;
    those that are not NaN if not given. ``hands`` (2, 2, 3): where the fingers of the left and of
    the right hand point at rest, and the direction across them, from the little finger's side to
    the thumb's; NaN where that is not known.

    Each part is laid by what can be seen of it. The trunk lies along the line from the hips to the
    neck, pelvis and chest turned as hips and shoulders are; where the trunk is bent, pelvis and
    chest lie each along its own end of the spine. Arms and legs lie along their bones, turned as
    they would come there from a T-pose by the shortest way, or so that elbows and knees bend as
    they do where the rest pose bends them clearly. Faces look level and soles are flat where chest
    and pelvis are about upright at rest; else faces look ahead of the chest, and soles are flat
    under the pelvis, or at right angles to shins where toes do not lie ahead of the ankles.
    """
    rest = _with_column(np.array(rest, float))
    present = np.isfinite(rest).all(axis=1) if present is None else present
    size = np.linalg.norm(rest[KNEES + ANKLES] - rest[HIPS + KNEES]) / np.linalg.norm(
        REST[KNEES + ANKLES] - REST[HIPS + KNEES]
    )
    turn = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    pelvis, chest = _trunk_laid(rest)
    spine = [j for j in SPINE if present[j]]
    low, high = quaternion_from_matrix(np.array([pelvis, chest]))
    for k, j in enumerate((PELVIS, *SPINE)):
        turn[j] = matrix_from_quaternion(slerp(low, high, np.array(k / len(SPINE))))

    if spine:
        turn[spine[-1]] = chest
    else:
        chest = pelvis

    if _angle(chest @ pelvis.T) > _BENT:
        for j, child in pairwise([PELVIS, *spine]):
            if j:
                turn[j] = (
                    rotation_between(turn[j] @ (rest[child] - rest[j]), REST[child] - REST[j])
                    @ turn[j]
                )

    turn[[SPINE[-1], NECK, *COLLARS]] = chest
    turn[HEAD], ground = _level(chest), _level(pelvis)
    hung = [(collar, chest, shoulder) for collar, shoulder in zip(COLLARS, SHOULDERS, strict=True)]
    hung += [(foot, ground, ankle) for foot, ankle in zip(FEET, ANKLES, strict=True)]
    for j, base, up in hung:
        if not np.isfinite(rest[j]).all():
            rest[j] = rest[up] + size * base.T @ (REST[j] - REST[up])

    for k, (name, (first, middle, end)) in enumerate(LIMBS.items()):
        arm = name.endswith("arm")
        axis, bend = np.array(_AXIS[name]), np.array(_BEND[name])
        upper, lower = rest[middle] - rest[first], rest[end] - rest[middle]
        base = chest if arm else pelvis
        turn[first] = rotation_between(base @ upper, axis) @ base
        off = turn[first] @ normalised(lower)
        aside = off - (off @ axis) * axis
        if np.linalg.norm(aside) > _CLEAR or off @ axis < 0.0:
            turn[first] = rotation_between(aside, -bend) @ turn[first]

        turn[middle] = rotation_between(turn[first] @ lower, axis) @ turn[first]
        if arm:
            turn[end] = _hand_laid(
                turn[middle],
                lower,
                axis,
                hands[k] if hands is not None else np.full((2, 3), np.nan),
            )
        else:
            foot = _FOOT_OF[end]
            turn[end] = turn[foot] = _foot_laid(turn[middle], ground, rest[foot] - rest[end], end)

    for j in range(1, len(JOINTS)):
        if not present[j]:
            turn[j] = turn[PARENTS[j]]

    straight = rest.copy()
    for j in range(1, len(JOINTS)):
        straight[j] = straight[PARENTS[j]] + turn[PARENTS[j]] @ (rest[j] - rest[PARENTS[j]])

    return Body(straight, present, turn)


def _with_column(rest: np.ndarray) -> np.ndarray:
    """Spine and neck where they are missing, on the way from pelvis to head."""
    column = [PELVIS, *SPINE, NECK, HEAD]
    known = [j for j in column if np.isfinite(rest[j]).all()]
    along = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(REST[column], axis=0), axis=1))]
    )
    place = dict(zip(column, along, strict=True))
    for k in range(3):
        rest[column, k] = np.interp(along, [place[j] for j in known], rest[known, k])

    return rest


def _trunk_laid(rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (3, 3) that lay pelvis and chest upright, by joints at rest with a whole column."""
    hips, canonical_hips = rest[HIPS].mean(axis=0), REST[HIPS].mean(axis=0)
    across_hips = normalised(rest[HIPS[1]] - rest[HIPS[0]])
    across_chest = normalised(rest[SHOULDERS[1]] - rest[SHOULDERS[0]])
    along, canonical = rest[NECK] - hips, REST[NECK] - canonical_hips

    def upright(across: np.ndarray, up: np.ndarray, meant: np.ndarray) -> np.ndarray:
        return frame_from(np.array([1.0, 0.0, 0.0]), meant, "xz") @ frame_from(across, up, "xz").T

    size = np.linalg.norm(along)
    low = next((j for j in SPINE if np.linalg.norm(rest[j] - hips) > 0.1 * size), NECK)
    high, top = next(
        (j, end)
        for j in (*SPINE[::-1], PELVIS)
        for end in (NECK, HEAD)
        if np.linalg.norm(rest[end] - rest[j]) > 0.15 * size
    )
    pelvis = upright(across_hips, rest[low] - hips, REST[low] - canonical_hips)
    chest = upright(across_chest, rest[top] - rest[high], REST[top] - REST[high])
    up = np.array([pelvis.T[:, 2], chest.T[:, 2]])
    if up[0] @ up[1] > np.cos(_BENT) and across_hips @ across_chest > 0.0:
        return upright(across_hips, along, canonical), upright(across_chest, along, canonical)

    return pelvis, chest


def _level(part: np.ndarray) -> np.ndarray:
    """Rotation that lays what is level at rest above or below a part of the trunk that ``part``
    lays: face and soles.
    """
    return frame_from(part[0], _UP, "xz").T if part[2, 2] > np.cos(_UPRIGHT) else part


def _hand_laid(
    forearm: np.ndarray, lower: np.ndarray, axis: np.ndarray, hand: np.ndarray
) -> np.ndarray:
    """Rotation that lays a hand: straight on, palm down, as far as its fingers are known."""
    fingers, across = hand
    turn = (
        rotation_between(forearm @ (fingers if np.isfinite(fingers).all() else lower), axis)
        @ forearm
    )
    if not np.isfinite(across).all():
        return turn

    seen = turn @ across
    return rotation_between(seen - (seen @ axis) * axis, np.array([0.0, 1.0, 0.0])) @ turn


def _foot_laid(shin: np.ndarray, ground: np.ndarray, foot: np.ndarray, ankle: int) -> np.ndarray:
    """Rotation that lays a foot: its sole counts as flat at rest where toes lie ahead of the ankle
    and lower.
    """
    ahead, seen = REST[_FOOT_OF[ankle]] - REST[ankle], ground @ normalised(foot)
    if seen[1] > _AHEAD and seen[2] < _AHEAD:
        flat = np.array([1.0, 1.0, 0.0])
        return rotation_between(seen * flat, ahead * flat) @ ground
    return rotation_between(shin @ foot, ahead) @ shin


def _angle(turn: np.ndarray) -> float:
    """Radians of a rotation (3, 3)."""
    return float(np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)))


def size_ratio(source: Body, body: Body) -> float:
    """The body's size over the source's, by their legs; 1 where they differ by less than 3 %."""
    ratio = body.leg() / source.leg()
    return 1.0 if abs(ratio - 1.0) < _SAME_SIZE else ratio


def retarget(
    source: Motion, source_body: Body, body: Body, root: np.ndarray, landing: bool = True
) -> RetargetedMotion:
    """The motion on another body. ``root`` (T, 3): the place on the floor under the source, about
    which it is scaled.

    Trunk, limbs, hands, feet and head lie in the world as the source's do. ``landing``: besides,
    hands, feet and head come where the source's came, at the price of its limbs' directions where
    the proportions differ; but arms keep their directions on a body of another size and build,
    which touches nothing any more (``_arms_land``). Without it all limbs keep their directions, and
    head and shoulders lie as the source's do from the hips.

    Where the sizes differ (``size_ratio``), the source's joints are scaled about the root, except
    that steps keep their length, since the root's path keeps its own and feet would slide
    otherwise. The head is put over the hips by the size of the trunk where that differs, since it
    would be stretched or bent all the time otherwise. The middle of the hip joints comes to lie
    where the source's lies, lower where legs would not reach, and feet stand as far apart as hips
    do; the trunk turns as the source's and bends by some degrees more to bring the head to its
    place; limbs reach wrists and ankles in the planes of the source's; collars turn a little to
    leave elbows as bent as they were, more where an arm is short. An ankle that lies higher over
    its toes than the source's is held higher by that, so that soles stay on the floor, and lifts
    the body that stands on it.
    """
    ratio = size_ratio(source_body, body)
    targets = _targets(source, source_body, body, root, landing)
    lands = dict.fromkeys(LIMBS, landing)
    lands["left_arm"] = lands["right_arm"] = arms_land = landing and _arms_land(source_body, body)
    frames, joints = source.frames.copy(), targets.copy()
    spine = [j for j in SPINE if body.present[j]]
    if spine:
        frames[:, spine[-1]] = source.frames[:, SPINE[-1]]  # neck and arms hang on it

    def place(*which: int) -> None:
        for j in which:
            parent = PARENTS[j]
            if not body.present[parent] and parent != PELVIS:
                frames[:, parent] = frames[:, PARENTS[parent]]
            joints[:, j] = joints[:, parent] + rotate(
                frames[:, parent], body.rest[j] - body.rest[parent]
            )

    middle = 0.5 * (body.rest[HIPS[0]] + body.rest[HIPS[1]])
    joints[:, PELVIS] = targets[:, HIPS].mean(axis=1) + rotate(
        frames[:, PELVIS], body.rest[PELVIS] - middle
    )
    place(*HIPS)
    if landing:
        joints[:, PELVIS, 2] -= _sunk(joints, targets, body)
        place(*HIPS)

    trunk = [j for j in _TRUNK if body.present[j]]
    _bring_head(joints, frames, targets[:, HEAD], trunk, place)
    place(*COLLARS, *SHOULDERS)
    if arms_land and spine and not body.present[COLLARS].any():
        _lean(joints, frames, targets, spine[-1], body)
        _bring_head(joints, frames, targets[:, HEAD], [j for j in trunk if j != spine[-1]], place)
        place(*COLLARS, *SHOULDERS)

    for collar, shoulder, elbow, wrist in zip(COLLARS, SHOULDERS, ELBOWS, WRISTS, strict=True):
        arm = sum(
            body.length(j) * normalised(source.joints[:, j] - source.joints[:, PARENTS[j]])
            for j in (elbow, wrist)
        )
        if body.present[collar] and arms_land:
            reach = _REACH * (body.length(elbow) + body.length(wrist))
            kept = np.minimum(np.linalg.norm(arm, axis=-1, keepdims=True), reach)
            _shrug(joints, frames, targets[:, wrist], collar, shoulder, kept, reach)
        elif body.present[collar] and not landing:
            # The shoulder to its place, then a little to where the wrist would come to its own.
            for place_of, limit in (
                (targets[:, shoulder], _SHRUG),
                (targets[:, wrist] - arm, 0.5 * _EASE),
            ):
                turn = rotation_between(
                    joints[:, shoulder] - joints[:, collar], place_of - joints[:, collar]
                )
                frames[:, collar] = _limited(turn, limit) @ frames[:, collar]
                place(shoulder)
        place(shoulder)

    bends = []
    for name, (first, mid, end) in LIMBS.items():
        axis = np.array(_AXIS[name])
        if not lands[name]:
            for at, child in ((first, mid), (mid, end)):
                along = normalised(source.joints[:, child] - source.joints[:, at])
                joints[:, child] = joints[:, at] + body.length(child) * along
            targets[:, end] = joints[:, end]

        bend = _bend(source, name, joints[:, first], targets[:, end])
        if lands[name]:
            joints[:, mid], joints[:, end] = two_bone(
                joints[:, first],
                targets[:, end],
                joints[:, first] + bend,
                body.length(mid),
                body.length(end),
                bend,
            )

        for at, child in ((first, mid), (mid, end)):
            straight = rotation_between(
                rotate(source.frames[:, at], axis), joints[:, child] - joints[:, at]
            )
            frames[:, at] = straight @ source.frames[:, at]

        bends.append(bend)

    place(*FEET)
    for j in range(1, len(JOINTS)):
        if not body.present[j]:
            frames[:, j] = frames[:, PARENTS[j]]

    return RetargetedMotion(
        Motion(joints, frames), frames @ body.alignment, targets, np.stack(bends, axis=1), ratio
    )


def _arms_land(source: Body, body: Body) -> bool:
    """Whether hands come where the source's came: on a body of its size, or of its build at another
    size.
    """
    ratio = size_ratio(source, body)
    if ratio == 1.0:
        return True

    def alike(ours: float, theirs: float, limit: float) -> bool:
        return 1.0 / limit < ours / (ratio * theirs) < limit

    return alike(body.arm(), source.arm(), _SAME_ARMS) and alike(
        body.chest(), source.chest(), _SAME_CHEST
    )


def limb_errors(joints: np.ndarray, source: np.ndarray) -> dict[str, np.ndarray]:
    """By how many degrees (T,) each limb and the trunk lie otherwise than the source's; both (T,
    22, 3), any size.

    Of a limb the most that either bone's direction, or the bend of elbow or knee, is off; of the
    trunk, the way from the hips to the head or from shoulder to shoulder.
    """

    def ways(at: np.ndarray) -> dict[str, list[np.ndarray]]:
        hips = at[:, HIPS].mean(axis=1)
        limbs = {
            name: [at[:, b] - at[:, a], at[:, c] - at[:, b]] for name, (a, b, c) in LIMBS.items()
        }
        return limbs | {"trunk": [at[:, HEAD] - hips, at[:, SHOULDERS[1]] - at[:, SHOULDERS[0]]]}

    ours, theirs, found = ways(joints), ways(source), {}
    for name in ours:
        off = [_degrees(a, b) for a, b in zip(ours[name], theirs[name], strict=True)]
        if name in LIMBS:
            off.append(np.abs(_degrees(*ours[name]) - _degrees(*theirs[name])))
        found[name.replace("_", " ")] = np.max(off, axis=0)

    return found


def _degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip((normalised(a) * normalised(b)).sum(-1), -1.0, 1.0)))


def _targets(
    source: Motion, source_body: Body, body: Body, root: np.ndarray, landing: bool
) -> np.ndarray:
    """Where the joints (T, 22, 3) are to lie on the body, as for ``retarget``."""
    ratio, feet = size_ratio(source_body, body), ANKLES + FEET
    targets = root[:, None] + ratio * (source.joints - root[:, None])
    targets[:, feet, :2] = source.joints[:, feet, :2]
    # Feet stand apart as the hips do; sideways of the foot itself, since a planted one does not
    # turn.
    wider = 0.5 * (np.ptp(body.rest[HIPS, 0]) - np.ptp(source_body.rest[HIPS, 0]))
    for ankle, side in zip(ANKLES, (-1.0, 1.0), strict=True):
        out = source.frames[:, ankle, :, 0] * (1.0, 1.0, 0.0)
        targets[:, [ankle, _FOOT_OF[ankle]]] += (side * wider * normalised(out))[:, None]

    trunk = body.trunk() / source_body.trunk()
    if not landing or ratio != 1.0 or abs(trunk - 1.0) > _SAME_SIZE:
        upper = [HEAD] if landing else [HEAD, *SHOULDERS, *WRISTS]
        upright = source.joints[:, upper] - source.joints[:, HIPS].mean(axis=1, keepdims=True)
        targets[:, upper] = targets[:, HIPS].mean(axis=1, keepdims=True) + trunk * upright

    if body.present[FEET].all():
        rise = (body.rest[ANKLES, 2] - body.rest[FEET, 2]) - ratio * (
            source_body.rest[ANKLES, 2] - source_body.rest[FEET, 2]
        )
        targets[:, ANKLES] += source.frames[:, ANKLES][..., 2] * rise[:, None]
        if abs(rise.mean()) > _SAME_ANKLES * body.leg():
            # Hands of a body of the same size stay on what they touch.
            carried = [
                j for j in range(len(JOINTS)) if j not in feet and (ratio != 1.0 or j not in WRISTS)
            ]
            targets[:, carried, 2] += (rise.mean() * _standing(source.joints))[:, None]

    return targets


def _sunk(joints: np.ndarray, targets: np.ndarray, body: Body) -> np.ndarray:
    """By how much (T,) the pelvis has to go down for both feet to be reached."""
    sunk = np.zeros(len(joints))
    for first, mid, end in (LIMBS["left_leg"], LIMBS["right_leg"]):
        length = _REACH * (body.length(mid) + body.length(end))
        apart = joints[:, first] - targets[:, end]
        high = np.sqrt(np.maximum(length**2 - (apart[:, :2] ** 2).sum(-1), 0.0))
        sunk = np.maximum(sunk, np.minimum(apart[:, 2] - high, _SINK * length))
    return sunk


def _limited(turn: np.ndarray, limit: float) -> np.ndarray:
    """Rotations (T, 3, 3), none by more than ``limit`` radians (which is under half a circle)."""
    vector = 0.5 * np.stack(
        [
            turn[:, 2, 1] - turn[:, 1, 2],
            turn[:, 0, 2] - turn[:, 2, 0],
            turn[:, 1, 0] - turn[:, 0, 1],
        ],
        axis=-1,
    )
    angle = np.arctan2(
        np.linalg.norm(vector, axis=-1), 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0)
    )
    return matrix_from_vector(normalised(vector) * np.minimum(angle, limit)[:, None])


def _bring_head(
    joints: np.ndarray,
    frames: np.ndarray,
    head: np.ndarray,
    trunk: list[int],
    place: Callable[..., None],
) -> None:
    """Turn the trunk's joints, each a little, until the head joint lies at ``head`` (T, 3): cyclic
    coordinate descent.
    """
    meant = frames[:, trunk].copy()
    place(*_TRUNK, HEAD)
    for _ in range(_ROUNDS if trunk else 0):
        for k, j in enumerate(trunk):
            turn = rotation_between(joints[:, HEAD] - joints[:, j], head - joints[:, j])
            for i, above in enumerate(trunk[k:], k):
                asked = turn @ frames[:, above]
                frames[:, above] = (
                    _limited(asked @ transpose(meant[:, i]), _TRUNK_TURN) @ meant[:, i]
                )
            place(*_TRUNK, HEAD)


def _lean(
    joints: np.ndarray, frames: np.ndarray, targets: np.ndarray, chest: int, body: Body
) -> None:
    """Without collars: turn the chest towards the wrists that the arms are too short for."""
    meant, center = frames[:, chest].copy(), joints[:, chest]
    turn = np.broadcast_to(np.eye(3), meant.shape)
    for _ in range(_LEANS):
        pull = np.zeros_like(center)
        for shoulder, elbow, wrist in (LIMBS["left_arm"], LIMBS["right_arm"]):
            arm = rotate(turn, joints[:, shoulder] - center)
            away = targets[:, wrist] - center - arm
            short = np.linalg.norm(away, axis=-1, keepdims=True) - _REACH * (
                body.length(elbow) + body.length(wrist)
            )
            # A rotation vector that moves the shoulder by what is missing, as far as a turn about
            # the chest can.
            pull += np.cross(arm, np.maximum(short, 0.0) * normalised(away)) / (arm**2).sum(
                -1, keepdims=True
            )
        turn = _limited(matrix_from_vector(pull) @ turn, _TRUNK_TURN)

    frames[:, chest] = turn @ meant


def _shrug(
    joints: np.ndarray,
    frames: np.ndarray,
    wrist: np.ndarray,
    collar: int,
    shoulder: int,
    kept: np.ndarray,
    reach: float,
) -> None:
    """Turn the collar until the wrist (T, 3) is ``kept`` (T, 1) away from the shoulder, which
    leaves the elbow as it is meant.

    By a little only; by more where the arm, of length ``reach``, is too short.
    """
    meant, arm = frames[:, collar].copy(), joints[:, shoulder] - joints[:, collar]
    turn = np.broadcast_to(np.eye(3), meant.shape)
    for limit, short in ((_EASE, False), (_SHRUG, True)):
        for _ in range(_SHRUGS):
            at = joints[:, collar] + rotate(turn, arm)
            away = np.linalg.norm(wrist - at, axis=-1, keepdims=True)
            missing = np.maximum(away - reach, 0.0) if short else away - kept
            aim = at + missing * normalised(wrist - at) - joints[:, collar]
            asked = rotation_between(arm, aim)
            turn = (
                np.where(missing[..., None] > 0.0, _limited(asked, limit), turn)
                if short
                else _limited(asked, limit)
            )

    frames[:, collar] = turn @ meant


def _standing(joints: np.ndarray) -> np.ndarray:
    """How far (T,) a body stands on its straighter leg: 1 where that is straight, 0 where both are
    bent as in sitting.
    """
    hips, knees, ankles = (
        joints[:, list(pair)] for pair in zip(LIMBS["left_leg"], LIMBS["right_leg"], strict=True)
    )
    length = np.linalg.norm(knees - hips, axis=-1) + np.linalg.norm(ankles - knees, axis=-1)
    extended = (np.linalg.norm(ankles - hips, axis=-1) / length).max(axis=1)
    return smoothstep((extended - _SEATED) / (_STANDS - _SEATED))


def _bend(source: Motion, limb: str, first: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Unit directions (T, 3) in which a limb from ``first`` to ``target`` bends as the source's
    does.
    """
    a, b, c = (source.joints[:, j] for j in LIMBS[limb])
    along, onward = normalised(c - a), normalised(target - first)
    offset = (b - a) - ((b - a) * along).sum(-1, keepdims=True) * along
    offset = offset / np.linalg.norm(b - a, axis=-1, keepdims=True)
    axis = rotate(source.frames[:, LIMBS[limb][0]], np.array(_AXIS[limb]))
    hinge = rotate(
        rotation_between(axis, along),
        rotate(source.frames[:, LIMBS[limb][0]], np.array(_BEND[limb])),
    )
    bend = rotate(rotation_between(along, onward), offset + _STRAIGHT * hinge)
    return normalised(bend - (bend * onward).sum(-1, keepdims=True) * onward, hinge)
