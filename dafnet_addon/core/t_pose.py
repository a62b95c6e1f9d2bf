"""Lays the rest pose of any rig into the canonical T-pose (x right, y forward, z up).

Rigs rest in all kinds of poses: standing, arms anywhere, sitting, bent or twisted. Each part of the
body is laid by what can be seen of it.
"""

from itertools import pairwise

import numpy as np

from .body import Body
from .rotations import (
    frame_from,
    matrix_from_quaternion,
    normalised,
    quaternion_from_matrix,
    rotation_between,
    slerp,
)
from .skeleton import (
    ANKLES,
    COLLARS,
    FEET,
    FOOT_OF,
    HEAD,
    HIPS,
    JOINTS,
    KNEES,
    LIMB_AXES,
    LIMB_BENDS,
    LIMBS,
    NECK,
    PARENTS,
    PELVIS,
    REST,
    SHOULDERS,
    SPINE,
)

__all__ = ["lay_in_t_pose"]

_BENT = np.radians(40.0)
"""Rest poses whose chest leans by more against the pelvis do not have a straight trunk."""
_UPRIGHT = np.radians(30.0)
"""A trunk that leans by less at rest has a face that looks level and soles that are flat."""
_CLEAR = np.sin(np.radians(30.0))
"""Limbs bent by more at rest show which way they bend."""
_AHEAD = np.sin(np.radians(10.0))
"""Toes that lie ahead of the ankle by more, and no higher, show where the foot points."""

_RIGHT = np.array([1.0, 0.0, 0.0])
_FORWARD = np.array([0.0, 1.0, 0.0])
_UP = np.array([0.0, 0.0, 1.0])
_ON_THE_FLOOR = np.array([1.0, 1.0, 0.0])


def lay_in_t_pose(
    rest: np.ndarray, present: np.ndarray | None = None, hands: np.ndarray | None = None
) -> Body:
    """The body of a rig that rests in any pose.

    ``rest`` (22, 3): its joints at rest, z up and y about ahead, any unit; NaN where it has none,
    which only collars, feet, neck and spine may. ``present`` (22,): the joints that a bone turns;
    those that are not NaN if not given. ``hands`` (2, 2, 3): where the fingers of the left and of
    the right hand point at rest, and the direction across them, from the little finger's side to
    the thumb's; NaN where that is not known.

    The trunk lies along the line from the hips to the neck, pelvis and chest turned as hips and
    shoulders are; where the trunk is bent, pelvis and chest lie each along its own end of the
    spine. Arms and legs lie along their bones, turned as they would come there from a T-pose by the
    shortest way, or so that elbows and knees bend as they do where the rest pose bends them
    clearly. Faces look level and soles are flat where chest and pelvis are about upright at rest;
    else faces look ahead of the chest, and soles are flat under the pelvis, or at right angles to
    shins where toes do not lie ahead of the ankles.
    """
    rest = _with_column(np.array(rest, float))
    present = np.isfinite(rest).all(axis=1) if present is None else present
    hands = np.full((2, 2, 3), np.nan) if hands is None else hands

    turn = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    pelvis, chest = _lay_trunk(turn, rest, present)
    face, soles = _level(chest), _level(pelvis)
    turn[HEAD] = face
    _add_missing(rest, chest, soles)

    for name, (_, middle, end) in LIMBS.items():
        is_arm = name.endswith("arm")
        _lay_limb(turn, rest, name, chest if is_arm else pelvis)
        lower = rest[end] - rest[middle]
        if is_arm:
            hand = hands[0 if name.startswith("left") else 1]
            turn[end] = _hand_laid(turn[middle], lower, np.array(LIMB_AXES[name]), hand)
        else:
            foot = FOOT_OF[end]
            turn[end] = turn[foot] = _foot_laid(turn[middle], soles, rest[foot] - rest[end], end)

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


def _add_missing(rest: np.ndarray, chest: np.ndarray, soles: np.ndarray) -> None:
    """Collars and feet that the rig lacks, as the canonical body has them, in its size."""
    size = np.linalg.norm(rest[KNEES + ANKLES] - rest[HIPS + KNEES]) / np.linalg.norm(
        REST[KNEES + ANKLES] - REST[HIPS + KNEES]
    )
    neighbours = [(*pair, chest) for pair in zip(COLLARS, SHOULDERS, strict=True)]
    neighbours += [(*pair, soles) for pair in zip(FEET, ANKLES, strict=True)]
    for j, neighbour, laid in neighbours:
        if not np.isfinite(rest[j]).all():
            rest[j] = rest[neighbour] + size * laid.T @ (REST[j] - REST[neighbour])


def _lay_trunk(
    turn: np.ndarray, rest: np.ndarray, present: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lay pelvis, spine, neck and collars; the rotations (3, 3) of pelvis and chest."""
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
                bone = turn[j] @ (rest[child] - rest[j])
                turn[j] = rotation_between(bone, REST[child] - REST[j]) @ turn[j]

    turn[[SPINE[-1], NECK, *COLLARS]] = chest
    return pelvis, chest


def _trunk_laid(rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (3, 3) that lay pelvis and chest upright, by joints at rest with a whole column."""
    hips, canonical_hips = rest[HIPS].mean(axis=0), REST[HIPS].mean(axis=0)
    across_hips = normalised(rest[HIPS[1]] - rest[HIPS[0]])
    across_chest = normalised(rest[SHOULDERS[1]] - rest[SHOULDERS[0]])
    along, canonical = rest[NECK] - hips, REST[NECK] - canonical_hips

    def upright(across: np.ndarray, up: np.ndarray, meant: np.ndarray) -> np.ndarray:
        return frame_from(_RIGHT, meant, "xz") @ frame_from(across, up, "xz").T

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


def _lay_limb(turn: np.ndarray, rest: np.ndarray, name: str, base: np.ndarray) -> None:
    """Lay a limb's two bones; ``base`` (3, 3) lays the part of the trunk that it hangs on."""
    first, middle, end = LIMBS[name]
    axis, bend = np.array(LIMB_AXES[name]), np.array(LIMB_BENDS[name])
    upper, lower = rest[middle] - rest[first], rest[end] - rest[middle]

    turn[first] = rotation_between(base @ upper, axis) @ base
    bent = turn[first] @ normalised(lower)
    aside = bent - (bent @ axis) * axis
    if np.linalg.norm(aside) > _CLEAR or bent @ axis < 0.0:
        turn[first] = rotation_between(aside, -bend) @ turn[first]

    turn[middle] = rotation_between(turn[first] @ lower, axis) @ turn[first]


def _hand_laid(
    forearm: np.ndarray, lower: np.ndarray, axis: np.ndarray, hand: np.ndarray
) -> np.ndarray:
    """Rotation that lays a hand: straight on, palm down, as far as its fingers are known."""
    fingers, across = hand
    pointing = fingers if np.isfinite(fingers).all() else lower
    turn = rotation_between(forearm @ pointing, axis) @ forearm
    if not np.isfinite(across).all():
        return turn

    seen = turn @ across
    return rotation_between(seen - (seen @ axis) * axis, _FORWARD) @ turn


def _foot_laid(shin: np.ndarray, soles: np.ndarray, foot: np.ndarray, ankle: int) -> np.ndarray:
    """Rotation that lays a foot: its sole counts as flat at rest where toes lie ahead of the ankle
    and lower.
    """
    ahead, seen = REST[FOOT_OF[ankle]] - REST[ankle], soles @ normalised(foot)
    if seen[1] > _AHEAD and seen[2] < _AHEAD:
        return rotation_between(seen * _ON_THE_FLOOR, ahead * _ON_THE_FLOOR) @ soles
    return rotation_between(shin @ foot, ahead) @ shin


def _angle(turn: np.ndarray) -> float:
    """Radians of a rotation (3, 3)."""
    return float(np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)))
