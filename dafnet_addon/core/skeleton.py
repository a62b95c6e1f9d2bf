"""The canonical body: 22 joints in SMPL order, its bone lengths, and its upper and lower parts.

Frame of the rest pose: x right, y forward, z up, metres, the pelvis above the origin. The
proportions are this project's own, rounded from the medians of the training sources; other statures
are made by scaling.
"""

import numpy as np

__all__ = [
    "JOINTS",
    "PARENTS",
    "UPPER",
    "LOWER",
    "MODEL_ORDER",
    "POSE_SIZE",
    "UPPER_SIZE",
    "LOWER_SIZE",
    "Partition",
    "UPPER_THEN_LOWER",
    "LOWER_THEN_UPPER",
    "WHOLE_BODY",
    "model_order",
    "smpl_order",
    "MIRROR",
    "END_EFFECTORS",
    "FEET_ASKED",
    "TARGETS",
    "OFFSETS",
    "REST",
    "STANDING_PELVIS",
    "TOE_HEIGHT",
    "STATURE",
    "SEAT_TO_PELVIS",
    "PELVIS",
    "SPINE",
    "NECK",
    "HEAD",
    "HIPS",
    "KNEES",
    "ANKLES",
    "FEET",
    "COLLARS",
    "SHOULDERS",
    "ELBOWS",
    "WRISTS",
    "LIMBS",
    "LIMB_AXES",
    "LIMB_BENDS",
    "FOOT_OF",
    "joint",
]

JOINTS = (
    "pelvis",
    "left_hip",
    "right_hip",
    "spine1",
    "left_knee",
    "right_knee",
    "spine2",
    "left_ankle",
    "right_ankle",
    "spine3",
    "left_foot",
    "right_foot",
    "neck",
    "left_collar",
    "right_collar",
    "head",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
)
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
_INDEX = {name: i for i, name in enumerate(JOINTS)}


def joint(name: str) -> int:
    """Index of a joint by its name in ``JOINTS``."""
    return _INDEX[name]


PELVIS = joint("pelvis")
SPINE = [joint("spine1"), joint("spine2"), joint("spine3")]
NECK = joint("neck")
HEAD = joint("head")

# Each the left one, then the right one; lists, which NumPy takes as an index.
HIPS = [joint("left_hip"), joint("right_hip")]
KNEES = [joint("left_knee"), joint("right_knee")]
ANKLES = [joint("left_ankle"), joint("right_ankle")]
FEET = [joint("left_foot"), joint("right_foot")]
COLLARS = [joint("left_collar"), joint("right_collar")]
SHOULDERS = [joint("left_shoulder"), joint("right_shoulder")]
ELBOWS = [joint("left_elbow"), joint("right_elbow")]
WRISTS = [joint("left_wrist"), joint("right_wrist")]

LIMBS = {
    "left_arm": (SHOULDERS[0], ELBOWS[0], WRISTS[0]),
    "right_arm": (SHOULDERS[1], ELBOWS[1], WRISTS[1]),
    "left_leg": (HIPS[0], KNEES[0], ANKLES[0]),
    "right_leg": (HIPS[1], KNEES[1], ANKLES[1]),
}
"""First, middle and end joint of the limbs."""
LIMB_AXES = {
    "left_arm": (-1.0, 0.0, 0.0),
    "right_arm": (1.0, 0.0, 0.0),
    "left_leg": (0.0, 0.0, -1.0),
    "right_leg": (0.0, 0.0, -1.0),
}
"""Unit vectors along which the limbs are straight in the rest pose."""
LIMB_BENDS = {
    "left_arm": (0.0, -1.0, 0.0),
    "right_arm": (0.0, -1.0, 0.0),
    "left_leg": (0.0, 1.0, 0.0),
    "right_leg": (0.0, 1.0, 0.0),
}
"""Unit vectors along which the middle joint leaves that line: elbows go backward, knees forward."""
FOOT_OF = dict(zip(ANKLES, FEET, strict=True))
"""The foot joint that hangs on each ankle."""

UPPER = (0, 3, 6, 9, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21)
LOWER = (1, 2, 4, 5, 7, 8, 10, 11)
MODEL_ORDER = UPPER + LOWER
"""Joint order of poses inside the model: upper body first."""

UPPER_SIZE = 3 * len(UPPER)
LOWER_SIZE = 3 * len(LOWER)
POSE_SIZE = UPPER_SIZE + LOWER_SIZE
"""Coordinates of a pose, and of its parts."""

Partition = dict[str, slice]
"""The parts of the body that a model makes one after another: their names, in the order of making,
and their places in a pose in the model's order.
"""
UPPER_THEN_LOWER: Partition = {
    "upper": slice(0, UPPER_SIZE),
    "lower": slice(UPPER_SIZE, POSE_SIZE),
}
LOWER_THEN_UPPER: Partition = {name: UPPER_THEN_LOWER[name] for name in ("lower", "upper")}
WHOLE_BODY: Partition = {"whole": slice(0, POSE_SIZE)}

_TO_MODEL_ORDER = np.array([3 * j + k for j in MODEL_ORDER for k in range(3)])
_TO_SMPL_ORDER = np.argsort(_TO_MODEL_ORDER)


def model_order(poses: np.ndarray) -> np.ndarray:
    """Poses (…, 66) in SMPL order, as the model holds them: the upper body first."""
    return poses[..., _TO_MODEL_ORDER]


def smpl_order(poses: np.ndarray) -> np.ndarray:
    """Inverse of ``model_order``."""
    return poses[..., _TO_SMPL_ORDER]


END_EFFECTORS = {"head": HEAD, "hand_left": WRISTS[0], "hand_right": WRISTS[1]}
"""The paper's: joints of the upper body that may have targets."""
FEET_ASKED = {"foot_left": ANKLES[0], "foot_right": ANKLES[1]}
"""Joints of the lower body that may have targets."""
TARGETS = END_EFFECTORS | FEET_ASKED
"""All joints that may have targets."""


def _swap(name: str) -> str:
    if name.startswith("left_"):
        return "right_" + name[5:]
    if name.startswith("right_"):
        return "left_" + name[6:]
    return name


MIRROR = tuple(joint(_swap(name)) for name in JOINTS)
"""Joint order of the body seen in a mirror."""

_HALF = {  # parent to joint, left side written once; the rest pose is a T-pose
    "spine1": (0, -0.02, 0.11),
    "spine2": (0, 0.0, 0.13),
    "spine3": (0, 0.01, 0.09),
    "neck": (0, -0.02, 0.20),
    "head": (0, 0.03, 0.09),
    "left_collar": (-0.06, -0.01, 0.12),
    "left_shoulder": (-0.12, -0.01, 0.03),
    "left_elbow": (-0.26, 0, 0),
    "left_wrist": (-0.25, 0, 0),
    "left_hip": (-0.09, 0, -0.07),
    "left_knee": (0, 0, -0.41),
    "left_ankle": (0, 0, -0.41),
    "left_foot": (-0.02, 0.13, -0.06),
}


def _offsets() -> np.ndarray:
    table = np.zeros((len(JOINTS), 3))
    for name, offset in _HALF.items():
        table[joint(name)] = offset
        table[joint(_swap(name))] = (
            np.where([name.startswith("left_"), False, False], -1.0, 1.0) * offset
        )
    return table


OFFSETS = _offsets()
"""(22, 3) rest offset of every joint from its parent; zero for the pelvis."""

TOE_HEIGHT = 0.02
"""Height of a planted toe base over the floor (metres)."""
STANDING_PELVIS = TOE_HEIGHT + 0.06 + 0.41 + 0.41 + 0.07
"""Height of the pelvis in the rest pose (metres)."""
STATURE = 1.75
"""Height of the canonical body, crown to sole (metres)."""
SEAT_TO_PELVIS = 0.12
"""Height of the pelvis joint over a hard seat's top (metres)."""


def _rest() -> np.ndarray:
    rest = np.zeros((len(JOINTS), 3))
    rest[PELVIS] = (0, 0, STANDING_PELVIS)
    for j in range(1, len(JOINTS)):
        rest[j] = rest[PARENTS[j]] + OFFSETS[j]
    return rest


REST = _rest()
"""(22, 3) joints of the rest pose, standing on the floor."""
