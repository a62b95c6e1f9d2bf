"""How captured pieces become one body in motion: joins by inertialisation, lent upper bodies,
leaning, led hands.

All is done on joints and ends with the canonical bones; feet that stand stay where they are.
"""

import numpy as np

from ...core.kinematics import two_bone
from ...core.root import root_from_joints
from ...core.rotations import frame_from, normalised, rotate, transpose, yaw_matrix
from ...core.series import MODEL_FPS
from ...core.skeleton import COLLARS, HIPS, KNEES, NECK, OFFSETS, PARENTS, REST, SPINE, joint
from ..motion.canonical import FOOT, pose_legs

__all__ = [
    "FEET",
    "LENGTHS",
    "ease",
    "frames_of",
    "lead_hand",
    "join",
    "lend_upper_body",
    "fit_to_bones",
    "presence",
    "lean_and_turn",
]

_ALIGNED = [
    joint(n) for n in ("pelvis", "left_foot", "right_foot", "left_ankle", "right_ankle", "neck")
]
_FADE = 20  # frames in which the difference at a join dies away
FEET = tuple((joint(s + "ankle"), joint(s + "foot")) for s in ("left_", "right_"))
_LEGS = [joint(s + n) for s in ("left_", "right_") for n in ("knee", "ankle", "foot")]
_SWINGS = 0.25  # metres per second: a slower foot stands
_ARMS = [joint(s + n) for s in ("left_", "right_") for n in ("shoulder", "elbow", "wrist")]
LENGTHS = np.linalg.norm(OFFSETS, axis=1)


def frames_of(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frames (T, 3, 3) of pelvis and chest; the identity in the rest pose."""
    left_hip, right_hip = (joints[:, j] for j in HIPS)
    pelvis = frame_from(
        right_hip - left_hip, joints[:, SPINE[0]] - (left_hip + right_hip) / 2, "xz"
    )
    left_collar, right_collar = (joints[:, j] for j in COLLARS)
    chest = frame_from(right_collar - left_collar, joints[:, NECK] - joints[:, SPINE[-1]], "xz")
    return pelvis, chest


_REST_PELVIS, _REST_CHEST = (f[0].T for f in frames_of(REST[None]))


def fit_to_bones(joints: np.ndarray) -> np.ndarray:
    """The motion nearest to ``joints`` (T, 22, 3) with the canonical bones, a rigid pelvis and
    chest; the feet stay.
    """
    pelvis, chest = frames_of(joints)
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
        out[:, j] = (
            out[:, PARENTS[j]] + normalised(joints[:, j] - joints[:, PARENTS[j]]) * LENGTHS[j]
        )
    for ankle, foot in FEET:
        out[:, ankle] = out[:, foot] - normalised(joints[:, foot] - joints[:, ankle]) * FOOT

    return pose_legs(out)


def ease(x: np.ndarray) -> np.ndarray:
    """1 at and below 0, 0 at and above 1, smooth."""
    x = np.clip(x, 0.0, 1.0)
    return (1.0 - x) ** 2 * (1.0 + 2.0 * x)


def presence(frames: int, start: int, end: int, rise: int = 24) -> np.ndarray:
    """A share (T,) that rises from 0 before ``start`` + ``rise`` to 1 and falls to 0 again before
    ``end``.
    """
    t = np.arange(frames)
    return np.asarray((1 - ease((t - start) / rise)) * ease((t - end + rise) / rise))


def _aligned(joints: np.ndarray, pose: np.ndarray, target: np.ndarray) -> np.ndarray:
    """``joints`` turned about z and moved on the floor so that ``pose`` (22, 3), one of them, comes
    nearest to ``target``.
    """
    a, b = pose[_ALIGNED, :2], target[_ALIGNED, :2]
    from_, to = a - a.mean(0), b - b.mean(0)
    angle = np.arctan2((from_[:, 0] * to[:, 1] - from_[:, 1] * to[:, 0]).sum(), (from_ * to).sum())
    turned = rotate(yaw_matrix(np.array(angle)), joints - np.append(a.mean(0), 0.0))
    return np.asarray(turned + np.append(b.mean(0), 0.0))


def join(first: np.ndarray, then: np.ndarray) -> np.ndarray:
    """``first`` (T, 22, 3), and ``then`` turned and moved to go on from its last pose, which is
    left out.

    The difference of the poses at the join, and of their velocities, fades over two thirds of a
    second (inertialisation); a foot keeps its difference for as long as it stands, and works it off
    while it swings, so that it never slides.
    """
    after = _aligned(then, then[0], first[-1])
    offset = first[-1] - after[0]
    drift = (first[-1] - first[-2]) - (after[1] - after[0])
    t = np.arange(len(after))
    fade = ease(t / _FADE)[:, None, None]
    out = after + (offset + drift * np.minimum(t, _FADE)[:, None, None]) * fade
    for ankle, foot in FEET:
        step = np.linalg.norm(
            np.diff(after[:, foot, :2], axis=0, prepend=after[:1, foot, :2]), axis=-1
        )
        swing = np.cumsum(np.where(step * MODEL_FPS > _SWINGS, step, 0.0))
        left = ease(swing / max(0.2, 2.5 * float(np.linalg.norm(offset[foot, :2]))))[:, None]
        for j in (ankle, foot):
            out[:, j, :2] = after[:, j, :2] + offset[j, :2] * left
            out[:, j, 2] = after[:, j, 2] + offset[j, 2] * fade[:, 0, 0]

    return np.concatenate([first[:-1], fit_to_bones(out)])


def _about_x(angle: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) about x: forward, and up, tilt backward by ``angle`` (radians)."""
    m = np.zeros((len(angle), 3, 3))
    c, s = np.cos(angle), np.sin(angle)
    m[:, 0, 0], m[:, 1, 1], m[:, 1, 2], m[:, 2, 1], m[:, 2, 2] = 1.0, c, -s, s, c
    return m


def lean_and_turn(joints: np.ndarray, lean: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """A seated body that leans back (``lean`` (T,), radians; forward where negative) and turns on
    its seat; its feet stay.
    """
    yaw = root_from_joints(joints).yaw
    about = yaw_matrix(yaw + turn) @ _about_x(lean) @ yaw_matrix(-yaw)
    middle = (joints[:, HIPS[0]] + joints[:, HIPS[1]]) / 2
    out = joints.copy()
    above = [j for j in range(22) if j not in _LEGS]
    out[:, above] = middle[:, None] + np.einsum(
        "tij,tbj->tbi", about, joints[:, above] - middle[:, None]
    )
    knees = KNEES
    out[:, knees] = middle[:, None] + np.einsum(
        "tij,tbj->tbi", yaw_matrix(turn / 2), joints[:, knees] - middle[:, None]
    )
    return fit_to_bones(out)


def lend_upper_body(joints: np.ndarray, upper: np.ndarray, share: np.ndarray) -> np.ndarray:
    """The motion (T, 22, 3) with the chest's attitude, head and arms of another, as it has them in
    its root's frame.

    ``share`` (T,): from 0, the motion's own, to 1, the other's. Legs and pelvis stay.
    """
    to_ours = root_from_joints(joints).rotation @ transpose(root_from_joints(upper).rotation)
    other = joints[:, :1] + np.einsum("tij,tbj->tbi", to_ours, upper - upper[:, :1])
    out = joints.copy()
    (_, a), (_, b) = frames_of(joints), frames_of(other)
    m = (1 - share)[:, None, None] * a + share[:, None, None] * b
    # The chest is read off neck and collars; their places tell the frame alone.
    chest = frame_from(m[..., :, 0], m[..., :, 2], "xz") @ _REST_CHEST
    for name in ("neck", "left_collar", "right_collar"):
        out[:, joint(name)] = out[:, joint("spine3")] + rotate(chest, OFFSETS[joint(name)])

    for j in (joint("head"), *_ARMS):
        ours, theirs = (normalised(x[:, j] - x[:, PARENTS[j]]) for x in (joints, other))
        out[:, j] = (
            out[:, PARENTS[j]] + normalised(ours + (theirs - ours) * share[:, None]) * LENGTHS[j]
        )

    return fit_to_bones(out)


def lead_hand(joints: np.ndarray, side: str, wrist: np.ndarray, share: np.ndarray) -> np.ndarray:
    """The motion with one hand (``side`` "left_" or "right_") led along ``wrist`` (T, 3), world,
    where ``share`` (T,) is 1.
    """
    shoulder, elbow, hand = (joint(side + n) for n in ("shoulder", "elbow", "wrist"))
    out, weight = joints.copy(), share[:, None]
    target = joints[:, hand] + (wrist - joints[:, hand]) * weight
    # Over a desk's edge the hand comes from above.
    early = np.sin(np.pi / 2 * share)
    target[:, 2] = joints[:, hand, 2] + (wrist[:, 2] - joints[:, hand, 2]) * early
    outward = np.array([-0.12 if side == "left_" else 0.12, -0.05, -0.25])
    hangs = (joints[:, shoulder] + wrist) / 2 + rotate(root_from_joints(joints).rotation, outward)
    pole = joints[:, elbow] + (hangs - joints[:, elbow]) * weight
    out[:, elbow], out[:, hand] = two_bone(
        joints[:, shoulder], target, pole, LENGTHS[elbow], LENGTHS[hand]
    )
    return out
