"""Arms for bodies whose own were not captured as they are: hung as another's, standing, seated."""

import numpy as np

from ...core.rotations import frame_from, normalised
from ...core.skeleton import COLLARS, ELBOWS, NECK, OFFSETS, PARENTS, PELVIS, SPINE, WRISTS

__all__ = ["with_arms"]

_ARMS = [ELBOWS[0], WRISTS[0], ELBOWS[1], WRISTS[1]]  # elbow and wrist, left then right
_LEAST_WAY = 0.05  # metres that a pelvis goes down, so that a body counts as having sat


def _arm_directions(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chest frames (T, 3, 3) and, in them, unit directions (T, 4, 3) of upper arms and forearms."""
    chest = frame_from(
        joints[:, NECK] - joints[:, SPINE[-1]], joints[:, COLLARS[1]] - joints[:, COLLARS[0]], "zx"
    )
    bones = normalised(joints[:, _ARMS] - joints[:, [PARENTS[j] for j in _ARMS]])
    return chest, np.einsum("tji,tbj->tbi", chest, bones)


def with_arms(joints: np.ndarray, standing: np.ndarray, seated: np.ndarray) -> np.ndarray:
    """The motion (T, 22, 3) with its arms hung as in one standing and one seated pose (22, 3),
    blended as the pelvis goes down.
    """
    height = joints[:, PELVIS, 2]
    way = max(float(np.ptp(height)), _LEAST_WAY)
    share = np.clip((height.max() - height) / way, 0.0, 1.0)[:, None, None]
    chest, _ = _arm_directions(joints)
    ends = [_arm_directions(pose[None])[1][0] for pose in (standing, seated)]
    world = np.einsum("tij,tbj->tbi", chest, normalised(ends[0] * (1 - share) + ends[1] * share))

    out = joints.copy()
    for k, j in enumerate(_ARMS):
        out[:, j] = out[:, PARENTS[j]] + world[:, k] * np.linalg.norm(OFFSETS[j])
    return out
