"""What a body touches, told by its joints: feet that stand, a pelvis that is carried, hands on
things.
"""

import numpy as np

from .skeleton import FEET, PELVIS, SEAT_TO_PELVIS, TOE_HEIGHT, WRISTS

__all__ = ["CONTACTS", "contacts"]

CONTACTS = ("left_foot", "right_foot", "seat", "left_hand", "right_hand")

# Canonical metres, and metres a second.
_LOW = 0.03  # of a toe base over where it is when planted
_STILL = 0.25  # of a toe base that stands
_CARRIED = SEAT_TO_PELVIS + 0.025  # from the pelvis joint to what carries it
_SEATED = 0.88  # of the pelvis joint over the floor, at most
_TOUCHES = 0.10  # from a wrist to what its palm touches


def contacts(
    joints: np.ndarray, fps: float, floor: np.ndarray, distance: np.ndarray, scale: float
) -> np.ndarray:
    """Which of ``CONTACTS`` there are (T, 5): a foot is low over the ``floor`` (T,) and still, the
    pelvis low and as near to furniture as over a seat or bed, a wrist as near as where a palm lies
    on it.

    ``joints`` (T, 22, 3): world, metres; ``distance`` (T, 22): theirs to furniture, infinite far
    from it; ``scale``: the body's size over the canonical one.
    """
    toes = joints[:, FEET]
    speed = np.zeros(toes.shape[:2])
    if len(joints) > 1:
        speed = np.linalg.norm(np.gradient(toes, axis=0), axis=-1) * fps
    low = toes[..., 2] - floor[:, None] < scale * (TOE_HEIGHT + _LOW)
    return np.column_stack(
        [
            low & (speed < scale * _STILL),
            (distance[:, PELVIS] < scale * _CARRIED)
            & (joints[:, PELVIS, 2] - floor < scale * _SEATED),
            distance[:, WRISTS] < scale * _TOUCHES,
        ]
    )
