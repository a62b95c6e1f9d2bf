"""What goes into a generation besides the scene (``Controls``, ``Asked``) and what comes out of it
(``Take``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from .checks import FARTHEST, MAX_FRAMES, inside, number, rotations, shaped
from .draws import Draw
from .errors import InputError
from .resampling import covering_frames
from .root import RootPath
from .skeleton import JOINTS, LOWER, TARGETS, UPPER
from .text import printable

__all__ = ["LEANS", "MODES", "Asked", "Controls", "Finding", "Take", "warnings_of"]

MODES = ("FREE", "EE", "FULL")
LEANS = (-20.0, 35.0)
"""Degrees that a trunk leans forward and back at most, more than by itself."""

_SLOWEST = 1.0  # frames a second
_FASTEST = 1000.0  # frames a second
_SMALLEST = 1e-3  # size over the canonical body
_LARGEST = 1e3  # size over the canonical body
_LONGEST_BLEND = 600.0  # seconds
_ROUNDED = 1e-3  # degrees, by which single precision is off


@dataclass(frozen=True)
class Controls:
    """What the animator asks of the character, frame by frame. World: z up, metres.

    ``fps``: frames a second of every array here. ``root`` (T, 4, 4): x right, y forward, z up, on
    the ground under the pelvis. ``mode``: FREE, EE or FULL, one word or one for each frame.
    ``head``, ``hand_left``, ``hand_right``, ``foot_left``, ``foot_right`` (T, 3): targets of the
    head, wrist and ankle joints, NaN where free; those of head and hands count in EE, those of feet
    in EE and FULL. The matching ``…_rotation`` (T, 3, 3) turn head, hands and feet (y where the
    face looks, or fingers or toes point, z the crown, the back of the hand or of the foot), NaN
    where free. ``upper_body`` (T, 14, 3), ``lower_body`` (T, 8, 3): the joints ``skeleton.UPPER``
    and ``skeleton.LOWER`` for FULL, either or both; ``pelvis_given``: whether the upper body's
    pelvis counts, or only the rest of it. ``…_influence`` (T,): how far a target counts, from 0,
    where it is free, to 1; all of it where None. ``blend``: seconds in which the body comes over
    where the mode changes. ``scale``: the character's size over the canonical body of 1.75 m.
    ``look_at`` (T, 3): what is looked at, in any mode, NaN where nothing is: the head turns to it,
    and the chest where that is not enough; the network is not told.
    ``lean`` (T,), or one number: degrees that the trunk leans back, more than by itself, while one
    sits; forward below 0; within ``LEANS``. The network is not told.
    ``before`` (K, 22, 3), ``before_root`` (K, 4, 4): the joints and the root in the frames before
    the first one and, last of all, in it: the take begins with that motion, else from standing, or
    from having sat down where the root is over a seat.
    Of more than 70 / 30 seconds the last count; before the first of them it is taken to be still.

    Lists will do for arrays. Raises InputError, which names the field, for what cannot be used:
    another shape, what is not a number, a rotation that is none, a mode that is unknown, more than
    ``MAX_FRAMES`` frames.
    """

    fps: float
    root: np.ndarray
    mode: str | Sequence[str] = "FREE"
    head: np.ndarray | None = None
    hand_left: np.ndarray | None = None
    hand_right: np.ndarray | None = None
    foot_left: np.ndarray | None = None
    foot_right: np.ndarray | None = None
    upper_body: np.ndarray | None = None
    lower_body: np.ndarray | None = None
    head_rotation: np.ndarray | None = None
    hand_left_rotation: np.ndarray | None = None
    hand_right_rotation: np.ndarray | None = None
    foot_left_rotation: np.ndarray | None = None
    foot_right_rotation: np.ndarray | None = None
    head_influence: np.ndarray | None = None
    hand_left_influence: np.ndarray | None = None
    hand_right_influence: np.ndarray | None = None
    foot_left_influence: np.ndarray | None = None
    foot_right_influence: np.ndarray | None = None
    pelvis_given: bool = True
    blend: float = 1 / 3
    scale: float = 1.0
    look_at: np.ndarray | None = None
    look_at_influence: np.ndarray | None = None
    lean: np.ndarray | float | None = None
    before: np.ndarray | None = None
    before_root: np.ndarray | None = None

    def __post_init__(self) -> None:
        hold = partial(object.__setattr__, self)
        hold("fps", number(self.fps, "The frame rate", _SLOWEST, _FASTEST, "frames a second"))
        hold("scale", number(self.scale, "The character's scale", _SMALLEST, _LARGEST))
        hold("blend", number(self.blend, "The blend", 0.0, _LONGEST_BLEND, "seconds"))
        hold("root", _checked_root(self.root))
        frames = len(self)
        if max(frames, covering_frames(frames, self.fps)) > MAX_FRAMES:
            raise InputError(
                f"The root has {frames} frames at {self.fps:g} a second, more than a shot may "
                "have; split it."
            )

        hold("mode", _checked_mode(self.mode, frames))
        if not isinstance(self.pelvis_given, bool | np.bool_):
            raise InputError(
                f"'pelvis_given' is {printable(self.pelvis_given, 40)}; give True or False."
            )

        like, free = ", like the root's frames", "give metres, or NaN where it is free"
        shapes: dict[str, tuple[int, ...]] = {
            "upper_body": (frames, len(UPPER), 3),
            "lower_body": (frames, len(LOWER), 3),
        }
        shapes |= {"look_at": (frames, 3), "look_at_influence": (frames,)}
        for name in TARGETS:
            shapes |= {
                name: (frames, 3),
                f"{name}_rotation": (frames, 3, 3),
                f"{name}_influence": (frames,),
            }

        for name, shape in shapes.items():
            if getattr(self, name) is not None:
                what = f"'{name}'"
                found = shaped(getattr(self, name), what, shape, like=like)
                is_share = name.endswith("_influence")
                inside(
                    found,
                    what,
                    FARTHEST,
                    free=not is_share,
                    fix="give numbers from 0 to 1" if is_share else free,
                )
                hold(name, rotations(found, what) if name.endswith("_rotation") else found)

        if self.lean is not None:
            hold("lean", _checked_lean(self.lean, frames))

        if (self.before is None) != (self.before_root is None):
            raise InputError("'before' and 'before_root' belong together; give both, or neither.")
        if self.before is not None:
            before = shaped(self.before, "'before'", (-1, len(JOINTS), 3))
            like = ", like 'before'"
            root = shaped(self.before_root, "'before_root'", (len(before), 4, 4), like=like)
            for found, what in ((before, "'before'"), (root, "'before_root'")):
                if not len(found):
                    raise InputError(f"{what} has no frames; give at least the first one.")
                inside(found, what, FARTHEST)
            hold("before", before)
            hold("before_root", root)

    def __len__(self) -> int:
        return len(self.root)


def _checked_root(root: object) -> np.ndarray:
    found = shaped(root, "The root", (-1, 4, 4), like=", one matrix for each frame")
    if not len(found):
        raise InputError("The root has no frames; give at least one frame, a 4 × 4 matrix.")

    broken = np.flatnonzero(~np.isfinite(found).all(axis=(1, 2)))
    if len(broken):
        raise InputError(
            f"The root's transform is not a number at frame {broken[0]}; fix its keys, drivers or "
            "constraints."
        )

    return inside(found, "The root", FARTHEST)


def _checked_lean(lean: object, frames: int) -> np.ndarray:
    found = np.full(frames, lean) if isinstance(lean, int | float) else lean
    found = shaped(found, "'lean'", (frames,), like=", like the root's frames")
    inside(found, "'lean'", FARTHEST)
    low, high = LEANS
    if not ((found >= low - _ROUNDED) & (found <= high + _ROUNDED)).all():
        raise InputError(f"'lean' leaves {low:g} to {high:g} degrees; keep within.")
    return found


def _checked_mode(mode: object, frames: int) -> str | tuple[str, ...]:
    modes = (
        (mode,)
        if isinstance(mode, str)
        else mode.tolist()
        if isinstance(mode, np.ndarray)
        else mode
    )
    if not isinstance(modes, tuple | list):
        raise InputError(
            f"The mode is {printable(mode, 40)}; use FREE, EE or FULL, one word or one for each "
            "frame."
        )

    wrong = [each for each in modes if not isinstance(each, str) or each not in MODES]
    if wrong:
        raise InputError(f"The mode '{printable(wrong[0], 40)}' is unknown; use FREE, EE or FULL.")

    if not isinstance(mode, str) and len(modes) != frames:
        raise InputError(
            f"There are {len(modes)} modes for {frames} frames; give one word, or one for each "
            "frame."
        )

    return mode if isinstance(mode, str) else tuple(modes)


@dataclass(frozen=True)
class Asked:
    """What is asked of one person: his ``controls``, and what each of his takes is drawn with."""

    controls: Controls
    draws: tuple[Draw, ...]

    def tried(self, times: int) -> "Asked":
        """The same with so many draws for each of his."""
        draws = tuple(draw.other(k) for draw in self.draws for k in range(times))
        return replace(self, draws=draws)


@dataclass(frozen=True)
class Finding:
    """One thing that an eye sees of a take: ``word`` in short, ``text`` as a sentence, which says
    what to do where it is not ``good``.
    """

    word: str
    text: str
    good: bool


@dataclass(frozen=True)
class Take:
    """One generated motion at the controls' frame rate.

    ``joints`` (T, 22, 3): world, metres, constant bone lengths. ``rotations`` (T, 22, 4):
    quaternions w x y z of each joint's frame in its parent's, the pelvis' in the world; the
    identity everywhere is the rest pose (a T-pose that looks along +y); signs are continuous in
    time. ``root`` (T, 4, 4): the smoothed root. ``action`` (T, 10): action probabilities.
    ``scale``: the character's size. ``poses`` (70 + N, 66) and ``path`` (N): the model's own poses
    at 30 fps, canonical size, in the frames of ``path``, after 70 of standing in its first one;
    ``unchanged`` (M, 66): those that it would have gone on with over each change of mode, one after
    another, if there had been none: what resuming and cleaning again need. ``touches`` (T, 4): how
    far hands and feet hold on to something (``touching.touches``), what another body's have to keep
    to. ``verdict``: what an eye would say of it, the worst first. ``log_likelihood``: of a
    standardised pose after those before it, mean over the frames, nats. ``draw``: what it was drawn
    with, which may not be what was asked for: who stays standing before a seat is drawn anew.
    ``raw_metrics``, ``metrics``: ``metrics.motion_metrics`` of the model's own motion and of this
    one after the clean-up, at these frames and canonical size. ``seconds``: time spent by stage.
    ``warnings``: sentences for the user.
    """

    fps: float
    joints: np.ndarray
    rotations: np.ndarray
    root: np.ndarray
    action: np.ndarray
    scale: float
    poses: np.ndarray
    path: RootPath
    unchanged: np.ndarray = field(default_factory=lambda: np.zeros((0, 66)))
    touches: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    log_likelihood: float = float("nan")
    draw: Draw = field(default_factory=Draw)
    raw_metrics: dict[str, float | None] = field(default_factory=dict)
    metrics: dict[str, float | None] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    verdict: tuple[Finding, ...] = ()

    def __len__(self) -> int:
        return len(self.joints)


def warnings_of(takes: Sequence[Take]) -> dict[str, list[int]]:
    """The sentences that takes have for the user, and the numbers of those that have each, from
    0.
    """
    found: dict[str, list[int]] = {}
    for k, take in enumerate(takes):
        for sentence in dict.fromkeys(take.warnings):
            found.setdefault(sentence, []).append(k)
    return found
