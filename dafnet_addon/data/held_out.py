"""Clips of bodies that training never sees, with furniture fitted to them once: what the metrics are measured on."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.root import RootPath, raw_root_from_joints, smoothed
from ..core.rotations import yaw_matrix
from ..core.solids import Box, Scene
from .boxes import NO_BOXES
from .furniture import Rest, probes, resting, scattered
from .prepare import TRAINED_ON_PARTLY, load_motions
from .windows import seats_for

__all__ = ["HeldClip", "held_out"]

_LONGEST = 240
_OTHERS = 40  # clips without a seat


@dataclass(frozen=True)
class HeldClip:
    """``joints`` (T, 22, 3): ground truth, 30 fps. ``path``: its raw root. ``scene``: its furniture. ``rests``: seated
    episodes. ``unseen``: whether the body has no clip in training.
    """

    name: str
    unseen: bool
    joints: np.ndarray
    path: RootPath
    scene: Scene
    rests: tuple[Rest, ...]


def _boxes(rows: np.ndarray) -> Scene:
    return Scene(tuple(Box(center=r[:3], half_size=r[3:6], rotation=yaw_matrix(r[6])) for r in rows))


def held_out(folder: Path) -> list[HeldClip]:
    """Held-out clips of the motion files in ``folder``: all that sit, and some of the others; the same on every call."""
    rng = np.random.default_rng(2024)
    motions = load_motions(folder, "test")
    seated = [m for m in motions if m.rests]
    others = [m for m in motions if not m.rests and len(m.joints) >= 60]
    chosen = seated + [others[i] for i in rng.permutation(len(others))[:_OTHERS]]
    clips = []
    for motion in chosen:
        # The part around the first sit-down or stand-up where there is one.
        focus = motion.rests[0].start if motion.rests else len(motion.joints) // 2
        start = int(np.clip(focus - _LONGEST // 2, 0, max(0, len(motion.joints) - _LONGEST)))
        joints = motion.joints[start : start + _LONGEST]
        if not motion.valid[start : start + _LONGEST].all():
            continue
        raw = raw_root_from_joints(joints)
        path = smoothed(raw)
        rests, points = resting(joints, path), probes(joints)
        seats = seats_for(rng, rests, points) if rests else [NO_BOXES]
        if not seats:
            continue
        rows = np.concatenate([*seats, scattered(rng, points, path, 2)])
        body = f"{motion.source}/{motion.subject}"
        unseen = motion.source not in TRAINED_ON_PARTLY and body not in TRAINED_ON_PARTLY
        clips.append(HeldClip(f"{motion.source}/{motion.name}", unseen, joints, raw, _boxes(rows), tuple(rests)))
    return clips
