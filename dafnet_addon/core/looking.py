"""Who looks at something turns the head, and where that is not enough the chest, as far and as fast
as people do; the body stays where it is.

Angles are of the chest: yaw to the left, pitch up, radians.
"""

import numpy as np

from .kinematics import Turn, with_wrists_at
from .root import gaussian, yaw_of
from .rotations import matrix_from_vector, rotate, transpose
from .skeleton import ELBOWS, HEAD, PARENTS, SPINE, WRISTS, joint

__all__ = ["counting", "eye_turns", "head_turn", "look_away", "with_chest_turned"]

_EYES = np.array([0.0, 0.09, 0.08])
"""Metres from the head joint, in its frame."""
_HEAD_YAW = np.radians(65.0)
_HEAD_UP, _HEAD_DOWN = np.radians(40.0), np.radians(45.0)
_ALONE = np.radians(35.0)  # of yaw that the head does without the chest
_CHEST_YAW = np.radians(30.0)
_CHEST_SHARE = 0.5  # of what is beyond that which the chest takes
_EYES_SIDE, _EYES_UP, _EYES_DOWN = np.radians((35.0, 25.0, 25.0))  # of eyes in the head
_EYES_EASE = 0.03  # seconds; deviation of a Gaussian: eyes jump
_BEHIND = np.radians(210.0)  # of yaw, at which one turns to the other side
_HEAD_SPEED = np.radians(200.0)  # a second
_CHEST_SPEED = np.radians(80.0)
_HEAD_EASE, _CHEST_EASE = 0.08, 0.2  # seconds; deviations of Gaussians over time
_CHEST_LATER = 0.12  # seconds after the head
_FADE = 0.12  # seconds; deviation of the Gaussian over how far a target counts
_SOFT = 0.2  # share of a limit in which a turn comes to it

_CHEST = joint("spine3")


def counting(target: np.ndarray, share: np.ndarray, fps: float) -> np.ndarray:
    """How far (T,) a target (T, 3), NaN where it is free, counts, beginning and ending softly."""
    counts = np.where(np.isfinite(target).all(-1), share, 0.0)
    return counts if not counts.any() else np.clip(gaussian(counts, _FADE * fps), 0.0, 1.0)


def _held(target: np.ndarray) -> np.ndarray:
    """A target (T, 3) that stays, where it is free, as it was before, or will be at first."""
    known = np.isfinite(target).all(-1)
    last = np.maximum.accumulate(np.where(known, np.arange(len(target)), -1))
    return target[np.where(last < 0, np.argmax(known), last)]


def _softly(angle: np.ndarray, limit: float) -> np.ndarray:
    """An angle that nears its limit as it grows, without a kink."""
    bend = _SOFT * limit
    over = np.maximum(np.abs(angle) - (limit - bend), 0.0)
    return np.sign(angle) * np.where(over > 0.0, limit - bend * np.exp(-over / bend), np.abs(angle))


def _followed(angle: np.ndarray, speed: float, ease: float, fps: float) -> np.ndarray:
    """An angle (T,) that goes no faster than ``speed`` a second, and begins and ends softly."""
    out, most = angle.copy(), speed / fps
    for t in range(1, len(out)):
        out[t] = out[t - 1] + np.clip(angle[t] - out[t - 1], -most, most)
    return gaussian(out, ease * fps)


def look_away(chest: np.ndarray, eyes: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Yaw and pitch (T, 2) from the chest's frames (T, 3, 3) of what is seen from ``eyes`` (T, 3).

    What passes behind is looked at over the same shoulder until the other one is much nearer.
    """
    away = rotate(transpose(chest), target - eyes)
    yaw = np.unwrap(yaw_of(away[:, :2]))
    yaw -= 2.0 * np.pi * np.round(yaw[0] / (2.0 * np.pi))
    for t in range(len(yaw)):
        if abs(yaw[t]) > _BEHIND:
            yaw[t:] -= np.sign(yaw[t]) * 2.0 * np.pi
    return np.stack([yaw, np.arctan2(away[:, 2], np.hypot(away[:, 0], away[:, 1]))], axis=-1)


def with_chest_turned(
    joints: np.ndarray,
    frames: np.ndarray,
    target: np.ndarray,
    counts: np.ndarray,
    *,
    holds: np.ndarray,
    fps: float,
) -> np.ndarray:
    """Joints (T, 22, 3) whose chest turns to what the head cannot look at alone, as far as the
    target ``counts`` (T,). ``frames`` (T, 22, 3, 3): theirs, global. Hands stay as far as they hold
    on to something: ``holds`` (T, 2).
    """
    eyes = joints[:, HEAD] + rotate(frames[:, HEAD], _EYES)
    yaw = look_away(frames[:, _CHEST], eyes, _held(target))[:, 0]
    beyond = np.sign(yaw) * np.maximum(np.abs(yaw) - _ALONE, 0.0)
    asked = counts * _softly(_CHEST_SHARE * beyond, _CHEST_YAW)
    later = round(_CHEST_LATER * fps)
    asked = np.concatenate([np.repeat(asked[:1], later), asked])[: len(asked)]
    angle = _followed(asked, _CHEST_SPEED, _CHEST_EASE, fps)
    if not np.abs(angle).max() > 1e-4:
        return joints

    out = joints.copy()
    up = np.array([0.0, 0.0, 1.0])
    for at in SPINE:  # a share each
        turn = matrix_from_vector(up * (angle / len(SPINE))[:, None])
        above = [j for j in range(len(PARENTS)) if _hangs(j, at)]
        out[:, above] = out[:, [at]] + np.einsum("tij,tbj->tbi", turn, out[:, above] - out[:, [at]])
    wrists, elbows = (
        out[:, at] + holds[..., None] * (joints[:, at] - out[:, at]) for at in (WRISTS, ELBOWS)
    )
    return with_wrists_at(out, wrists, elbows)


def _hangs(j: int, above: int) -> bool:
    """Whether a joint hangs from another one."""
    while j > 0:
        j = PARENTS[j]
        if j == above:
            return True
    return False


def head_turn(
    joints: np.ndarray, frames: np.ndarray, target: np.ndarray, counts: np.ndarray, fps: float
) -> Turn:
    """How the head of joints (T, 22, 3) with global ``frames`` (T, 22, 3, 3) turns to a target
    (T, 3), as far as it ``counts`` (T,).
    """
    head, chest = frames[:, HEAD], frames[:, _CHEST]
    eyes = joints[:, HEAD] + rotate(head, _EYES)
    wanted = look_away(chest, eyes, _held(target))
    yaw = _softly(wanted[:, 0], _HEAD_YAW)
    pitch = np.where(
        wanted[:, 1] > 0.0, _softly(wanted[:, 1], _HEAD_UP), _softly(wanted[:, 1], _HEAD_DOWN)
    )
    own = look_away(chest, np.zeros(3), head[:, :, 1])
    off_yaw, off_pitch = (
        _followed(asked - has, _HEAD_SPEED, _HEAD_EASE, fps)
        for asked, has in ((yaw, own[:, 0]), (pitch, own[:, 1]))
    )
    up, right = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    across = chest @ matrix_from_vector(up * off_yaw[:, None]) @ transpose(chest)
    return Turn(across @ head @ matrix_from_vector(right * off_pitch[:, None]), counts)


def eye_turns(
    face: np.ndarray, eye: np.ndarray, target: np.ndarray, counts: np.ndarray, fps: float
) -> np.ndarray:
    """How an ``eye`` (T, 3) in a ``face`` (T, 3, 3), y ahead and z the crown, turns by what is left
    of the angle to a target (T, 3), as far as that ``counts`` (T,) and eyes go: rotations (T, 3, 3)
    in the face's frame. Any unit of length.
    """
    wanted = look_away(face, eye, _held(target))
    yaw = _softly(wanted[:, 0], _EYES_SIDE)
    up = wanted[:, 1] > 0.0
    pitch = np.where(up, _softly(wanted[:, 1], _EYES_UP), _softly(wanted[:, 1], _EYES_DOWN))
    yaw, pitch = (gaussian(counts * angle, _EYES_EASE * fps) for angle in (yaw, pitch))
    upright, right = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    return matrix_from_vector(upright * yaw[:, None]) @ matrix_from_vector(right * pitch[:, None])
