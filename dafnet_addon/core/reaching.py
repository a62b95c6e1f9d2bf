"""How trunk and collars turn so that head and hands come to their places on another body."""

from dataclasses import dataclass

import numpy as np

from .body import Body
from .rotations import (
    matrix_from_vector,
    normalised,
    rotate,
    rotation_between,
    transpose,
)
from .skeleton import HEAD, LIMBS, NECK, PARENTS, PELVIS, SPINE

__all__ = ["REACH", "SHRUG", "Pose", "bring_head", "lean", "limited", "partly", "shrug"]

REACH = 1.0 - 1e-5
"""Of a limb's length: the most that it reaches, so that it always has a plane to bend in."""
SHRUG = 0.35
"""Radians that collars turn, at most."""
_EASE = 0.2
"""Radians that collars turn, at most, to leave elbows as bent as they were."""
_TRUNK_TURN = 0.35
"""Radians that the trunk turns out of the source's pose to reach, at most."""
_TRUNK = (*SPINE, NECK)
"""The joints that bring the head to its place."""

# Rounds of what is solved step by step.
_HEAD_ROUNDS = 24
_LEAN_ROUNDS = 8
_SHRUG_ROUNDS = 4


@dataclass
class Pose:
    """A body's poses while they are being found: ``joints`` (T, 22, 3) and ``frames`` (T, 22, 3,
    3), which change in place.
    """

    body: Body
    joints: np.ndarray
    frames: np.ndarray

    def place(self, *joints: int) -> None:
        """Put joints where their parents' frames hold them."""
        for j in joints:
            parent = PARENTS[j]
            if not self.body.present[parent] and parent != PELVIS:
                self.frames[:, parent] = self.frames[:, PARENTS[parent]]
            bone = self.body.rest[j] - self.body.rest[parent]
            self.joints[:, j] = self.joints[:, parent] + rotate(self.frames[:, parent], bone)

    def bones(self, *which: int) -> list[int]:
        """Those of the joints that a bone of this body turns."""
        return [j for j in which if self.body.present[j]]


def limited(turn: np.ndarray, limit: float) -> np.ndarray:
    """Rotations (T, 3, 3), none by more than ``limit`` radians (which is under half a circle)."""
    axis, angle = _axis_angle(turn)
    farther = angle > limit
    if not farther.any():
        return turn
    out = turn.copy()
    out[farther] = matrix_from_vector(limit * axis[farther])
    return out


def partly(turn: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3), each by a ``share`` (T,) of it."""
    axis, angle = _axis_angle(turn)
    return matrix_from_vector(axis * (share * angle)[:, None])


def _axis_angle(turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (T, 3) and angles (T,) of rotations by less than half a circle."""
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
    return normalised(vector), angle


def bring_head(pose: Pose, head: np.ndarray, fixed: tuple[int, ...] = ()) -> None:
    """Turn the trunk's joints, except ``fixed`` ones, each a little, until the head joint lies at
    ``head`` (T, 3): cyclic coordinate descent.
    """
    joints, frames = pose.joints, pose.frames
    trunk = [j for j in pose.bones(*_TRUNK) if j not in fixed]
    meant = frames[:, trunk].copy()

    pose.place(*_TRUNK, HEAD)

    for _ in range(_HEAD_ROUNDS if trunk else 0):
        for k, j in enumerate(trunk):
            turn = rotation_between(joints[:, HEAD] - joints[:, j], head - joints[:, j])
            for i, above in enumerate(trunk[k:], k):
                off = turn @ frames[:, above] @ transpose(meant[:, i])
                frames[:, above] = limited(off, _TRUNK_TURN) @ meant[:, i]
            pose.place(*_TRUNK, HEAD)


def lean(pose: Pose, targets: np.ndarray, chest: int, share: np.ndarray) -> None:
    """On a body without collars: turn the chest towards the wrists' ``targets`` (T, 22, 3) that the
    arms are too short for; by a ``share`` (T,) of it.
    """
    joints, body = pose.joints, pose.body
    meant, center = pose.frames[:, chest].copy(), joints[:, chest]
    turn = np.broadcast_to(np.eye(3), meant.shape)

    for _ in range(_LEAN_ROUNDS):
        pull = np.zeros_like(center)
        for shoulder, elbow, wrist in (LIMBS["left_arm"], LIMBS["right_arm"]):
            arm = rotate(turn, joints[:, shoulder] - center)
            away = targets[:, wrist] - center - arm
            reach = REACH * (body.length(elbow) + body.length(wrist))
            short = np.linalg.norm(away, axis=-1, keepdims=True) - reach
            # A rotation vector that moves the shoulder by what is missing, as far as a turn about
            # the chest can.
            pull += np.cross(arm, np.maximum(short, 0.0) * normalised(away)) / (arm**2).sum(
                -1, keepdims=True
            )
        turn = limited(matrix_from_vector(pull) @ turn, _TRUNK_TURN)

    pose.frames[:, chest] = partly(turn, share) @ meant


def shrug(pose: Pose, arm: str, wrist: np.ndarray, meant: np.ndarray, share: np.ndarray) -> None:
    """Turn the collar of an ``arm`` (of ``LIMBS``) until its wrist's place ``wrist`` (T, 3) is as
    far from the shoulder as it is ``meant`` to be (T, 1), which leaves the elbow as bent as it was;
    by a ``share`` (T,) of that turn.

    By a little only; by more where the arm is too short.
    """
    shoulder, elbow, end = LIMBS[arm]
    collar, body = PARENTS[shoulder], pose.body
    reach = REACH * (body.length(elbow) + body.length(end))
    meant = np.minimum(meant, reach)

    center = pose.joints[:, collar]
    held = pose.joints[:, shoulder] - center
    own = pose.frames[:, collar].copy()
    turn = np.broadcast_to(np.eye(3), own.shape)

    def asked(missing: np.ndarray, place: np.ndarray, limit: float) -> np.ndarray:
        aim = place + missing * normalised(wrist - place) - center
        return limited(rotation_between(held, aim), limit)

    for _ in range(_SHRUG_ROUNDS):
        place = center + rotate(turn, held)
        away = np.linalg.norm(wrist - place, axis=-1, keepdims=True)
        turn = asked(away - meant, place, _EASE)

    for _ in range(_SHRUG_ROUNDS):
        place = center + rotate(turn, held)
        away = np.linalg.norm(wrist - place, axis=-1, keepdims=True)
        missing = np.maximum(away - reach, 0.0)
        turn = np.where(missing[..., None] > 0.0, asked(missing, place, SHRUG), turn)

    pose.frames[:, collar] = partly(turn, share) @ own
