"""A motion of the 22 joints onto another body: what is carried over is how each limb lies in the
world, and where its end lands.

Rigs rest in all kinds of poses, so a pose is never passed on as a rotation from rest. Every body is
first laid into the canonical T-pose (x right, y forward, z up; ``t_pose.lay_in_t_pose``), and
joints that it lacks are filled in. Two kinds of global joint frames occur. *Frames* are the
identity in that T-pose, so the same frames are the same pose in the world on every body; *turns*
are the identity in the rig's own rest pose. A body's ``alignment`` leads from one to the other:
turns = frames @ alignment.
"""

from dataclasses import dataclass

import numpy as np

from .body import SAME_SIZE, Body, canonical_body, size_ratio
from .kinematics import two_bone
from .reaching import REACH, SHRUG, Pose, bring_head, lean, limited, shrug
from .rotations import normalised, rotate, rotation_between, transpose
from .series import MODEL_FPS, smoothstep
from .skeleton import (
    ANKLES,
    COLLARS,
    FEET,
    FOOT_OF,
    HEAD,
    HIPS,
    JOINTS,
    LIMB_AXES,
    LIMB_BENDS,
    LIMBS,
    PARENTS,
    PELVIS,
    SHOULDERS,
    SPINE,
    WRISTS,
)
from .touching import in_lap

__all__ = ["Motion", "RetargetedMotion", "retarget"]

_ARMS = ("left_arm", "right_arm")
_LEGS = ("left_leg", "right_leg")

_SAME_ARMS = 1.25
"""Ratio of the arms' lengths, over the bodies' sizes, up to which bodies are of the same build."""
_SAME_CHEST = 1.2
"""The same of the shoulders' heights over the hips."""
_SAME_ANKLES = 0.01
"""Of the leg's length: ankles that are higher by less do not lift the body."""
_SINK = 0.3
"""Of a leg's length: the most by which the pelvis is lowered to let the feet reach."""
_HELD_SHRUG = 0.1
"""Radians that collars turn towards a wrist's place, at most, where hands need not land."""
_STRAIGHT = 0.03
"""A limb bent by less, of its length, also takes its plane from its first joint's frame."""

# Distance from hip to ankle, over the leg's length.
_SEATED = 0.75
"""Bent as in sitting."""
_STANDS = 0.95
"""Straight as in standing."""


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
    of ``LIMBS`` bend. ``laps`` (T, 2): how far hands lie on its own thighs, from 0 to 1. ``ratio``:
    the body's size over the source's.
    """

    motion: Motion
    turns: np.ndarray
    targets: np.ndarray
    bends: np.ndarray
    laps: np.ndarray
    ratio: float


def retarget(
    source: Motion,
    source_body: Body,
    body: Body,
    root: np.ndarray,
    landing: bool = True,
    held: np.ndarray | None = None,
) -> RetargetedMotion:
    """The motion on another body. ``root`` (T, 3): the place on the floor under the source, about
    which it is scaled.

    Trunk, limbs, hands, feet and head lie in the world as the source's do. ``landing``: besides,
    hips and head come where the source's came, and so do hands and feet by how far they are
    ``held`` (T, 4; see ``touching.touches``; None: all the time), at the price of its limbs'
    directions where the proportions differ; but arms keep their directions on a body of another
    size and build, whose hands would miss what they touch anyway (``_arms_land``). Without it all
    limbs keep their directions, and head and shoulders lie as the source's do from the hips. Hands
    that lie on thighs lie there on every body.

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
    targets = _targets(source, source_body, body, root, landing)
    shares = dict(zip(LIMBS, np.ones((4, len(root))) if held is None else held.T, strict=True))
    arms_land = landing and _arms_land(source_body, body)
    for limb in shares:
        if not (landing if limb in _LEGS else arms_land):
            shares[limb] = np.zeros(len(root))

    pose = Pose(body, joints=targets.copy(), frames=source.frames.copy())

    spine = pose.bones(*SPINE)
    if spine:
        # Neck and arms hang on it.
        pose.frames[:, spine[-1]] = source.frames[:, SPINE[-1]]

    _place_hips(pose, targets, lower_to_reach=landing)
    bring_head(pose, targets[:, HEAD])
    pose.place(*COLLARS, *SHOULDERS)
    if arms_land and spine and not pose.bones(*COLLARS):
        lean(pose, targets, spine[-1], np.maximum(*(shares[arm] for arm in _ARMS)))
        bring_head(pose, targets[:, HEAD], fixed=(spine[-1],))
        pose.place(*COLLARS, *SHOULDERS)

    bends = {leg: _place_limb(pose, leg, source, targets, shares[leg]) for leg in _LEGS}
    laps = _lay_in_lap(pose, source, source_body, targets, shares)
    for arm in _ARMS:
        _place_shoulder(pose, arm, source, targets, landing=landing, share=shares[arm])
        bends[arm] = _place_limb(pose, arm, source, targets, shares[arm])

    pose.place(*FEET)
    for j in range(1, len(JOINTS)):
        if not body.present[j]:
            pose.frames[:, j] = pose.frames[:, PARENTS[j]]

    return RetargetedMotion(
        motion=Motion(pose.joints, pose.frames),
        turns=pose.frames @ body.alignment,
        targets=targets,
        bends=np.stack([bends[limb] for limb in LIMBS], axis=1),
        laps=laps,
        ratio=size_ratio(source_body, body),
    )


# Where joints are to lie.


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
        targets[:, [ankle, FOOT_OF[ankle]]] += (side * wider * normalised(out))[:, None]

    trunk = body.trunk() / source_body.trunk()
    if not landing or ratio != 1.0 or abs(trunk - 1.0) > SAME_SIZE:
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


def _standing(joints: np.ndarray) -> np.ndarray:
    """How far (T,) a body stands on its straighter leg: 1 where that is straight, 0 where both are
    bent as in sitting.
    """
    hips, knees, ankles = (
        joints[:, list(pair)] for pair in zip(*(LIMBS[leg] for leg in _LEGS), strict=True)
    )
    length = np.linalg.norm(knees - hips, axis=-1) + np.linalg.norm(ankles - knees, axis=-1)
    extended = (np.linalg.norm(ankles - hips, axis=-1) / length).max(axis=1)
    return smoothstep((extended - _SEATED) / (_STANDS - _SEATED))


# Bringing them there, from the hips outward.


def _place_hips(pose: Pose, targets: np.ndarray, lower_to_reach: bool) -> None:
    """Put pelvis and hips so that the middle of the hip joints lies at its place; lower where both
    feet could not be reached.
    """
    rest = pose.body.rest
    middle = 0.5 * (rest[HIPS[0]] + rest[HIPS[1]])
    pose.joints[:, PELVIS] = targets[:, HIPS].mean(axis=1) + rotate(
        pose.frames[:, PELVIS], rest[PELVIS] - middle
    )
    pose.place(*HIPS)
    if lower_to_reach:
        pose.joints[:, PELVIS, 2] -= _too_high(pose, targets)
        pose.place(*HIPS)


def _too_high(pose: Pose, targets: np.ndarray) -> np.ndarray:
    """By how much (T,) the pelvis has to go down for both feet to be reached."""
    down = np.zeros(len(targets))
    for hip, knee, ankle in (LIMBS[leg] for leg in _LEGS):
        length = REACH * (pose.body.length(knee) + pose.body.length(ankle))
        apart = pose.joints[:, hip] - targets[:, ankle]
        highest = np.sqrt(np.maximum(length**2 - (apart[:, :2] ** 2).sum(-1), 0.0))
        down = np.maximum(down, np.minimum(apart[:, 2] - highest, _SINK * length))
    return down


def _place_shoulder(
    pose: Pose,
    arm: str,
    source: Motion,
    targets: np.ndarray,
    *,
    landing: bool,
    share: np.ndarray,
) -> None:
    """Turn an arm's collar, where there is one, and put its shoulder; towards what its hand holds
    on to by the ``share`` (T,) to which it does.
    """
    shoulder, elbow, wrist = LIMBS[arm]
    collar = PARENTS[shoulder]
    meant = sum(
        pose.body.length(j) * normalised(source.joints[:, j] - source.joints[:, PARENTS[j]])
        for j in (elbow, wrist)
    )

    if pose.body.present[collar] and landing:
        shrug(pose, arm, targets[:, wrist], np.linalg.norm(meant, axis=-1, keepdims=True), share)
    elif pose.body.present[collar]:
        # The shoulder to its place, then a little to where the wrist would come to its own.
        for place, limit in (
            (targets[:, shoulder], SHRUG),
            (targets[:, wrist] - meant, _HELD_SHRUG),
        ):
            center = pose.joints[:, collar]
            turn = rotation_between(pose.joints[:, shoulder] - center, place - center)
            pose.frames[:, collar] = limited(turn, limit) @ pose.frames[:, collar]
            pose.place(shoulder)

    pose.place(shoulder)


def _lay_in_lap(
    pose: Pose,
    source: Motion,
    source_body: Body,
    targets: np.ndarray,
    shares: dict[str, np.ndarray],
) -> np.ndarray:
    """Bring the wrists' ``targets``, and the ``shares`` of the arms, to where the source's hands
    lie on its thighs, on the body's own; how far (T, 2) they do.
    """
    size = source_body.leg() / canonical_body(1.0).leg()
    lap = in_lap(source.joints / size, MODEL_FPS)
    ratio = pose.body.leg() / source_body.leg()
    for a, arm in enumerate(_ARMS):
        wrist = LIMBS[arm][2]
        for b, leg in enumerate(_LEGS):
            share = lap[:, a, b] * (lap[:, a, b] >= lap[:, a].max(axis=-1))
            hip, knee, _ = LIMBS[leg]
            thigh = source.joints[:, knee] - source.joints[:, hip]
            off = source.joints[:, wrist] - source.joints[:, hip]
            along = np.clip((off * thigh).sum(-1) / (thigh**2).sum(-1), 0.0, 1.0)[:, None]
            aside = rotate(transpose(source.frames[:, hip]), off - along * thigh)
            place = (1.0 - along) * pose.joints[:, hip] + along * pose.joints[:, knee]
            place = place + ratio * rotate(pose.frames[:, hip], aside)
            targets[:, wrist] += share[:, None] * (place - targets[:, wrist])
            shares[arm] = np.maximum(shares[arm], share)
    return np.asarray(lap.max(axis=-1))


def _place_limb(
    pose: Pose, limb: str, source: Motion, targets: np.ndarray, share: np.ndarray
) -> np.ndarray:
    """Put a limb's joints and turn its frames; the directions (T, 3) in which it bends.

    By the ``share`` (T,) to which it is held its bones lie so that its end comes to its target;
    else they lie as the source's do, and ``targets`` say where that has brought its end.
    """
    joints, body = pose.joints, pose.body
    first, middle, end = LIMBS[limb]
    bones = (first, middle), (middle, end)
    bend = _bend(source, limb, joints[:, first], targets[:, end])
    reached = two_bone(
        joints[:, first],
        targets[:, end],
        joints[:, first] + bend,
        body.length(middle),
        body.length(end),
        bend,
    )
    came = joints[:, first].copy()
    for (start, child), there in zip(bones, reached, strict=True):
        # Directions are blended, not places: a straight limb would bend at the least pull.
        free = normalised(source.joints[:, child] - source.joints[:, start])
        held = normalised(there - came)
        along = normalised(free + share[:, None] * (held - free), held)
        joints[:, child] = joints[:, start] + body.length(child) * along
        came = there
    targets[:, end] = joints[:, end]
    bend = _bend(source, limb, joints[:, first], targets[:, end])

    axis = np.array(LIMB_AXES[limb])
    for start, child in bones:
        straight = rotation_between(
            rotate(source.frames[:, start], axis), joints[:, child] - joints[:, start]
        )
        pose.frames[:, start] = straight @ source.frames[:, start]

    return bend


def _bend(source: Motion, limb: str, first: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Unit directions (T, 3) in which a limb from ``first`` to ``target`` bends as the source's
    does.
    """
    start, middle, end = (source.joints[:, j] for j in LIMBS[limb])
    frame = source.frames[:, LIMBS[limb][0]]
    along, onward = normalised(end - start), normalised(target - first)

    upper = middle - start
    offset = upper - (upper * along).sum(-1, keepdims=True) * along
    offset = offset / np.linalg.norm(upper, axis=-1, keepdims=True)

    axis = rotate(frame, np.array(LIMB_AXES[limb]))
    hinge = rotate(rotation_between(axis, along), rotate(frame, np.array(LIMB_BENDS[limb])))
    bend = rotate(rotation_between(along, onward), offset + _STRAIGHT * hinge)
    return normalised(bend - (bend * onward).sum(-1, keepdims=True) * onward, hinge)
