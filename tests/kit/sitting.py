"""Bodies that stand, sway and sit down, made up on the canonical body."""

import numpy as np

from dafnet_addon.core.kinematics import two_bone
from dafnet_addon.core.series import smoothstep
from dafnet_addon.core.skeleton import ANKLES, FEET, KNEES, REST, joint
from dafnet_addon.data.motion.canonical import pose_legs

__all__ = ["sit_down", "standing"]

_LEGS = [*KNEES, *ANKLES, *FEET]
_ABOVE = [j for j in range(22) if j not in _LEGS]


def standing(frames: int, sway: float = 0.0, period: int = 60) -> np.ndarray:
    """A body (T, 22, 3) that stands with hanging arms and sways sideways by ``sway`` metres over
    planted feet, once in ``period`` frames.
    """
    pose = REST.copy()
    for side, sign in (("left_", -1.0), ("right_", 1.0)):
        shoulder = REST[joint(side + "shoulder")]
        wrist = shoulder + np.array([sign * 0.03, 0.12, -0.45])
        middle = shoulder + np.array([sign * 0.1, -0.2, -0.25])
        pose[joint(side + "elbow")], pose[joint(side + "wrist")] = two_bone(
            shoulder, wrist, middle, 0.26, 0.25
        )
    pose[_ABOVE, 2] -= 0.04  # soft knees
    pose[KNEES, 1] += 0.1
    joints = np.repeat(pose[None], frames, axis=0)
    joints[:, _ABOVE, 0] += sway * np.sin(np.arange(frames) * 2 * np.pi / period)[:, None]
    return pose_legs(joints)


def sit_down(
    frames: int = 150, start: int = 40, down: int = 45, back: float = 0.4, drop: float = 0.36
) -> np.ndarray:
    """The pelvis goes ``back`` and ``drop`` metres down to a seat in ``down`` frames and rests;
    feet stay.
    """
    share = smoothstep((np.arange(frames) - start) / down)
    joints = standing(frames)
    joints[:, _ABOVE] += np.array([0.0, -back, -drop]) * share[:, None, None]
    return pose_legs(joints)
