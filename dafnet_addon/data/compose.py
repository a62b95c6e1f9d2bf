"""Composed approaches: captured walks and turns that end as a captured sit-down begins, joined where the poses match.

Sit-downs that somebody walks up to are the scarcest of all captured motion; walks that come to a stand, and sit-downs from a
stand, are not. Where such a pair would lead through the seat, fitting the seat fails later and the pair is not used.
"""

from dataclasses import dataclass

import numpy as np

from ..core.root import root_from_joints, to_root
from ..core.rotations import rotate, yaw_matrix
from ..core.skeleton import joint
from .canonical import pose_legs
from .windows import COMPOSED, Motion, mirrored, motion_of

__all__ = ["Composed", "composed", "entrance", "joined", "matches"]

_WALK = {"locomotion", "walk", "turn", "run", "carry_other", "door"}
_TRIES, _JOINS = 60, 8  # walks tried and joins kept for each captured sit-down and its mirror image
_BEFORE = 110  # frames of walking that are kept
_FADE = 14  # frames in which the difference at the join dies away
_MATCHED = [
    joint(n) for n in ("pelvis", "neck", "left_knee", "right_knee", "left_foot", "right_foot", "left_wrist", "right_wrist")
]
_WEIGHTS = np.array([1.0, 0.7, 1.0, 1.0, 2.5, 2.5, 0.4, 0.4])[:, None]
_LARGEST = 0.16  # metres a matched joint may be off, on average and as weighted


def entrance(joints: np.ndarray, rest_start: int) -> int | None:
    """The last frame before a rest in which the body stands still and upright; None where there is none."""
    speed = np.linalg.norm(np.diff(joints, axis=0, prepend=joints[:1]), axis=-1).max(1) * 30
    stands = np.flatnonzero((joints[:rest_start, 0, 2] > 0.9) & (speed[:rest_start] < 0.25))
    return int(stands[-1]) if len(stands) else None


def _poses(joints: np.ndarray) -> np.ndarray:
    return (to_root(root_from_joints(joints), joints)[:, _MATCHED] * _WEIGHTS).reshape(len(joints), -1)


def matches(walk: np.ndarray, pose: np.ndarray) -> int | None:
    """The frame of ``walk`` (T, 22, 3) at which the body is slow and most like ``pose`` (1, 22, 3); None if not like enough."""
    if len(walk) < 50:
        return None
    slow = np.linalg.norm(np.gradient(walk[:, 0, :2], axis=0), axis=-1) * 30 < 0.35
    slow[:45] = False
    frames = np.flatnonzero(slow)[::2]
    if not len(frames):
        return None
    distance = np.abs(_poses(walk)[frames] - _poses(pose)).mean(1)
    best = int(np.argmin(distance))
    return int(frames[best]) if distance[best] < _LARGEST / 3 else None


def joined(walk: np.ndarray, at: int, sit: np.ndarray, entry: int) -> np.ndarray:
    """``walk`` up to frame ``at``, then ``sit`` from frame ``entry`` on, turned and moved to where the walk has led.

    The difference of the poses at the join, and of their velocities, fades over half a second (inertialisation).
    """
    ahead, behind = root_from_joints(walk[: at + 1]), root_from_joints(sit)
    turn = yaw_matrix(np.array(ahead.yaw[-1] - behind.yaw[entry]))
    origin = behind.position[entry] * (1, 1, 0)
    after = rotate(turn, sit[entry:] - origin) + ahead.position[-1] * (1, 1, 0)
    offset = walk[at] - after[0]
    drift = (walk[at] - walk[at - 1]) - (after[1] - after[0])
    t = np.arange(min(len(after), _FADE))[:, None, None]
    fade = (1.0 - t / _FADE) ** 2 * (1.0 + 2.0 * t / _FADE)
    after[: len(t)] += (offset + drift * t) * fade
    return pose_legs(np.concatenate([walk[max(0, at - _BEFORE) : at], after]))


@dataclass(frozen=True)
class Composed:
    """A composed motion: one word for its ``kind``, and the frames ``focus`` (N,) around which windows are drawn."""

    kind: str
    motion: Motion
    focus: np.ndarray


def composed(motions: list[Motion]) -> list[Composed]:
    """Motions that walk up to a seat, from every captured sit-down and its mirror image."""
    rng = np.random.default_rng(11)
    walks = [m for m in motions if m.category in _WALK and len(m.joints) > 60 and m.valid.all()]
    made = []
    for m in motions:
        entry = entrance(m.joints, m.rests[0].start) if m.rests and m.source != "ui_prmd" else None
        if entry is None:
            continue
        for sit in (m.joints, mirrored(m.joints)):
            kept = 0
            for k in rng.permutation(len(walks))[:_TRIES]:
                at = matches(walks[k].joints, sit[entry : entry + 1])
                if at is None or kept == _JOINS:
                    continue
                whole = joined(walks[k].joints, at, sit, entry)
                motion = motion_of(f"{walks[k].name} + {m.name}", COMPOSED, m.subject, m.category, whole)
                if motion.rests:
                    made.append(Composed("approach", motion, np.arange(60, motion.rests[0].start + 10, 5)))
                    kept += 1
    return made
