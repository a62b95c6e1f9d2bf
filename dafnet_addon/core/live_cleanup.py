"""What the clean-up does for a body that is played as it is made, where no later frame is known:
feet that stand are held, and who rests on a seat is as high as that carries a body.

It is milder than ``cleanup``: thighs and backs are not turned out of furniture, and hands are where
the network brings them. Canonical metres, world, 30 frames a second.
"""

import numpy as np

from .cleanup import CleanUp, too_high
from .following import PointFollower
from .resting import lifted, on_legs
from .rotations import normalised
from .series import MODEL_FPS, minimum_jerk
from .skeleton import ANKLES, FEET, HIPS, KNEES, OFFSETS, PELVIS, TOE_HEIGHT
from .softness import Support

__all__ = ["LiveCleanUp"]

_FOOT = float(np.linalg.norm(OFFSETS[FEET[0]]))
"""Metres from an ankle to its toe base."""

_LOW = 0.035  # metres over a planted toe base
_LANDS = 0.35  # metres a second, under which a foot that is low stands
_LEAVES = 0.80  # metres a second, over which one that stood is lifted
_SLIPS = 0.11  # metres from where the network has it, at which a foot that is held steps there
_FARTHEST = 0.22  # metres at which it is let go though the other foot steps
_STEP = 11  # frames of such a step
_LIFTS = 0.035  # metres
_GRIPS = 3  # frames in which a foot is brought to a stand
_FADES = 0.11  # seconds, in which what a foot was held by is down to a third
_STRAIGHT = 0.985  # of a leg's length: knees that are quite straight snap
_SINKS = 0.12  # seconds behind, of a pelvis that is too high for the legs

_LOWEST, _HIGHEST = -0.17, 0.25  # metres over where a seat carries it, of a pelvis that rests on it
_STILL = 0.15  # metres a second, of one
_SETTLES = 0.35  # seconds behind, of what brings it to where it is carried
_EITHER_WAY = 0.005  # metres by which bodies rest higher or lower and are left alone


class _Foot:
    """One foot: how far it is moved, ``offset`` (3,), from where the network brings its toe base,
    and the ``place`` (3,) where it is held, None where it is not. ``steps``: it is lifted to where
    the network has it, since it was held too far from there.
    """

    def __init__(self) -> None:
        self.offset = np.zeros(3)
        self.place: np.ndarray | None = None
        self._before: np.ndarray | None = None
        self._gripped = 0
        self._stepped = _STEP
        self._from = np.zeros(3)

    @property
    def steps(self) -> bool:
        return self._stepped < _STEP

    def move(self, toe: np.ndarray, floor: float, may_step: bool) -> None:
        """The next frame, in which the network brings the toe base to ``toe`` (3,); ``may_step``:
        the other foot stands.
        """
        before = toe if self._before is None else self._before
        speed = float(np.linalg.norm(toe - before)) * MODEL_FPS
        self._before = toe.copy()
        low = toe[2] - floor < TOE_HEIGHT + _LOW

        if self.place is not None:
            away = float(np.linalg.norm((toe - self.place)[:2]))
            if not low or speed > _LEAVES or away > _FARTHEST:
                self.place = None
            elif away > _SLIPS and may_step:
                self.place, self._stepped, self._from = None, 0, self.offset
        elif low and speed < _LANDS and not self.steps:
            self.place, self._gripped = toe + self.offset, 0
            self.place[2] = floor + TOE_HEIGHT

        if self.place is not None:
            self._gripped += 1
            share = min(1.0, self._gripped / _GRIPS)
            self.offset = (1.0 - share) * self.offset + share * (self.place - toe)
        elif self.steps:
            self._stepped += 1
            share = self._stepped / _STEP
            self.offset = self._from * (1.0 - float(minimum_jerk(np.array(share))))
            self.offset[2] += _LIFTS * np.sin(np.pi * share) ** 2
        else:
            self.offset = self.offset * np.exp(-1.0 / (_FADES * MODEL_FPS))


class LiveCleanUp:
    """Frame by frame, by the strengths ``feet`` and ``seat`` of a ``CleanUp``."""

    def __init__(self, settings: CleanUp) -> None:
        self.settings = settings
        self._feet = (_Foot(), _Foot())
        self._down = PointFollower(np.zeros(1), _SINKS, 1.0)
        self._lift = PointFollower(np.zeros(1), _SETTLES, 0.5)
        self._pelvis: np.ndarray | None = None
        self._speed = 0.0

    def step(self, joints: np.ndarray, floor: float, support: Support | None) -> np.ndarray:
        """The next frame's joints (22, 3), as near to constant bones as the network's are;
        ``support``: what is under the root, where that is known (one frame).
        """
        pelvis = joints[PELVIS]
        before = pelvis if self._pelvis is None else self._pelvis
        speed = float(np.linalg.norm(pelvis - before)) * MODEL_FPS
        self._speed += 0.3 * (speed - self._speed)
        self._pelvis = pelvis.copy()

        out = self._on_its_feet(joints[None], floor)
        return self._carried(out, support)[0]

    def _on_its_feet(self, joints: np.ndarray, floor: float) -> np.ndarray:
        strength = self.settings.feet
        if strength == 0.0:
            return joints
        for foot, other, toe in zip(self._feet, self._feet[::-1], FEET, strict=True):
            foot.move(joints[0, toe], floor, may_step=not other.steps)

        moved = strength * np.stack([foot.offset for foot in self._feet])[None]
        joints = joints.copy()
        joints[:, ANKLES] = joints[:, FEET] - _FOOT * normalised(
            joints[:, FEET] - joints[:, ANKLES]
        )
        ankles = joints[:, ANKLES] + moved
        held = np.array([[foot.place is not None for foot in self._feet]])
        down = self._down.step(too_high(joints[:, HIPS], ankles, held, _STRAIGHT))
        return on_legs(joints, -down, ankles, joints[:, KNEES] + moved / 2)

    def _carried(self, joints: np.ndarray, support: Support | None) -> np.ndarray:
        strength = self.settings.seat
        if strength == 0.0:
            return joints
        wanted, top = 0.0, np.full(1, np.nan)
        if support is not None and np.isfinite(support.top[0]):
            top = support.top
            over = float(joints[0, PELVIS, 2] - support.carried[0])
            if _LOWEST < over < _HIGHEST and self._speed < _STILL:
                wanted = float(np.clip(over, -_EITHER_WAY, _EITHER_WAY)) - over
        lift = strength * self._lift.step(np.array([wanted]))
        return lifted(joints, lift, top) if abs(float(lift[0])) > 1e-4 else joints
