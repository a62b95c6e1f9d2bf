"""The 17 keypoints of COCO, as datasets of people in images give them, from the 22 joints of SMPL.

Shoulders, elbows, wrists, hips, knees and ankles are the joints themselves. Nose, eyes and ears are
estimated: fixed places of the head, which a body without a face has nowhere else.
"""

import numpy as np

from .rotations import rotate
from .skeleton import ANKLES, ELBOWS, HEAD, HIPS, KNEES, SHOULDERS, WRISTS

__all__ = ["COCO", "COCO_BONES", "ESTIMATED", "face_points", "in_coco_order"]

COCO = (
    "nose",
    "left_eye",
    "right_eye",
    "left_ear",
    "right_ear",
    "left_shoulder",
    "right_shoulder",
    "left_elbow",
    "right_elbow",
    "left_wrist",
    "right_wrist",
    "left_hip",
    "right_hip",
    "left_knee",
    "right_knee",
    "left_ankle",
    "right_ankle",
)
COCO_BONES = (
    *((15, 13), (13, 11), (16, 14), (14, 12), (11, 12), (5, 11), (6, 12), (5, 6), (5, 7), (6, 8)),
    *((7, 9), (8, 10), (1, 2), (0, 1), (0, 2), (1, 3), (2, 4), (3, 5), (4, 6)),
)
"""Pairs of keypoints, numbered from 0, between which COCO draws lines."""

_FACE = np.array(
    [
        (0.0, 0.128, 0.008),  # nose
        (-0.032, 0.098, 0.045),  # eyes
        (0.032, 0.098, 0.045),
        (-0.076, 0.012, 0.03),  # ears
        (0.076, 0.012, 0.03),
    ]
)
"""From the head joint, in the head's frame (x right, y forward, z up), canonical metres."""
ESTIMATED = tuple(range(len(_FACE)))
"""Which of ``COCO`` are estimated."""
_JOINTS = [*SHOULDERS, *ELBOWS, *WRISTS, *HIPS, *KNEES, *ANKLES]


def face_points(joints: np.ndarray, heads: np.ndarray, scale: float) -> np.ndarray:
    """Nose, eyes and ears (T, 5, 3) of bodies with ``joints`` (T, 22, 3), whose heads are turned by
    ``heads`` (T, 3, 3) from looking along +y; ``scale``: the body's size over the canonical one.
    """
    found: np.ndarray = joints[:, None, HEAD] + rotate(heads[:, None], scale * _FACE)
    return found


def in_coco_order(joints: np.ndarray, face: np.ndarray) -> np.ndarray:
    """The keypoints (T, 17, …) of what is known of joints (T, 22, …) and of the face (T, 5, …)."""
    return np.concatenate([face, joints[:, _JOINTS]], axis=1)
