"""What goes into a generation besides the scene (``Controls``) and what comes out of it (``Take``)."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .root import RootPath

__all__ = ["MODES", "Controls", "Take"]

MODES = ("FREE", "EE", "FULL")


@dataclass(frozen=True)
class Controls:
    """What the animator asks of the character, frame by frame. World: z up, metres.

    ``fps``: frames a second of every array here. ``root`` (T, 4, 4): x right, y forward, z up, on the ground under the pelvis.
    ``mode``: FREE, EE or FULL, one word or one for each frame. ``head``, ``hand_left``, ``hand_right`` (T, 3): targets of the
    head and wrist joints, NaN where free; the matching ``…_rotation`` (T, 3, 3) turn head and hands (y where the face looks
    or the fingers point, z the crown or the back of the hand), NaN where free. ``upper_body`` (T, 14, 3): the joints
    ``skeleton.UPPER`` for FULL; ``pelvis_given``: whether its pelvis counts, or only the rest of it. ``…_influence`` (T,): how
    far a target counts, from 0, where it is free, to 1; all of it where None. ``blend``: seconds in which the body comes over
    where the mode changes. ``scale``: the character's size over the canonical body of 1.75 m.
    """

    fps: float
    root: np.ndarray
    mode: str | Sequence[str] = "FREE"
    head: np.ndarray | None = None
    hand_left: np.ndarray | None = None
    hand_right: np.ndarray | None = None
    upper_body: np.ndarray | None = None
    head_rotation: np.ndarray | None = None
    hand_left_rotation: np.ndarray | None = None
    hand_right_rotation: np.ndarray | None = None
    head_influence: np.ndarray | None = None
    hand_left_influence: np.ndarray | None = None
    hand_right_influence: np.ndarray | None = None
    pelvis_given: bool = True
    blend: float = 1 / 3
    scale: float = 1.0

    def __len__(self) -> int:
        return len(self.root)


@dataclass(frozen=True)
class Take:
    """One generated motion at the controls' frame rate.

    ``joints`` (T, 22, 3): world, metres, constant bone lengths. ``rotations`` (T, 22, 4): quaternions w x y z of each joint's
    frame in its parent's, the pelvis' in the world; the identity everywhere is the rest pose (a T-pose that looks along +y);
    signs are continuous in time. ``root`` (T, 4, 4): the smoothed root. ``action`` (T, 10): action probabilities.
    ``scale``: the character's size. ``poses`` (70 + N, 66) and ``path`` (N): the model's own poses at 30 fps, canonical size,
    in the frames of ``path``, after 70 of standing in its first one: what resuming and cleaning again need.
    ``log_likelihood``: of a standardised pose after those before it, mean over the frames, nats. ``raw_metrics``, ``metrics``:
    ``metrics.summary`` of the model's own motion and of this one after the clean-up, at 30 fps and canonical size.
    ``seconds``: time spent by stage. ``warnings``: sentences for the user.
    """

    fps: float
    joints: np.ndarray
    rotations: np.ndarray
    root: np.ndarray
    action: np.ndarray
    scale: float
    poses: np.ndarray
    path: RootPath
    log_likelihood: float = float("nan")
    raw_metrics: dict[str, float | None] = field(default_factory=dict)
    metrics: dict[str, float | None] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.joints)
