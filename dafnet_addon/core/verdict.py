"""What an eye would say of a take, in words: whether it sits where it was sent, what it goes
through and whether its feet slide.

Joints are (T, 22, 3), world, canonical metres, at ``fps``.
"""

from collections.abc import Iterable, Iterator, Mapping
from itertools import product
from types import MappingProxyType

import numpy as np

from .cleanup import standing_still
from .metrics import body_points, seat_episodes
from .occupancy import distance
from .root import RootPath
from .series import runs
from .skeleton import FEET, JOINTS, PARENTS, PELVIS
from .sliding import led
from .softness import Support, guessed
from .solids import Scene
from .take import Finding

__all__ = ["STANDS", "verdict"]

STANDS = "stands"
"""The word of a finding: who rests over a seat does not sit down."""

_OFF_SEAT = 0.04  # metres from where a seat carries a pelvis, from where on it is seen
_STANDS = 0.80  # metres of a pelvis over the floor, of one who did not sit down
_SEATS = 0.22  # metres of a top over the floor, from where on one is to sit on it
_DEEP = 0.05  # metres of a body's bones in something hard: its flesh is past it
_CLOSE = 0.06  # metres from a bone's points, within which it may be across something thin
_TOUCHES = 0.005  # metres of a bone in what it only touches
_FINELY = 24  # points of a bone that is looked at closely: those of a trunk, a centimetre apart
# Directions (14, 3) to move out of something: along the axes, and between them.
_MOVES = np.array([w for w in product((0, 1, -1), repeat=3) if np.abs(w).sum() in (1, 3)], float)
_MOVES /= np.linalg.norm(_MOVES, axis=1, keepdims=True)
_BRIEF = 0.2  # seconds of what is hardly seen
_SLIDES = 0.06  # metres that a standing foot moves; of captured walkers, as they roll off, 5 cm
_ROLLS = 0.2  # metres a second of a foot that comes down or rolls off
_USUAL_TOP = 0.45  # metres over the floor
_UNNAMED = "the furniture"
_PER_BONE = 4
_PARTS = {  # what is between a joint and the one it hangs on
    "hip": "hips", "knee": "thigh", "ankle": "shin", "foot": "foot", "spine1": "trunk",
    "spine2": "trunk", "spine3": "trunk", "neck": "trunk", "head": "head", "collar": "shoulder",
    "shoulder": "shoulder", "elbow": "upper arm", "wrist": "forearm", "pelvis": "hips",
}  # fmt: skip


def verdict(
    joints: np.ndarray,
    fps: float,
    path: RootPath,
    scene: Scene,
    support: Support,
    targets: Mapping[str, np.ndarray] = MappingProxyType({}),
    also: Iterable[Finding] = (),
    scale: float = 1.0,
) -> tuple[Finding, ...]:
    """What there is to say of a take: seats first, then what it goes through, then its feet.

    ``path`` (T): its root's; ``support``: of ``softness.support_under``, where the root is;
    ``targets``: of ``conditions.targets_of``, to which feet are moved; ``also``: what was found
    before; ``scale``: the character's, in whose centimetres it is said.
    """
    found = [
        *also,
        *_seats(joints, fps, path, scene, support, scale),
        *_inside(joints, fps, path, scene, scale),
        *_feet(joints, fps, path, targets, scale),
    ]
    return tuple(sorted(found, key=lambda each: each.good))


def _cm(length: float, scale: float) -> str:
    return f"{100.0 * scale * length:.0f} cm"


def _seats(
    joints: np.ndarray, fps: float, path: RootPath, scene: Scene, support: Support, scale: float
) -> Iterator[Finding]:
    if not np.isfinite(support.top).any():
        return
    for episode in seat_episodes(joints, path, fps):
        here = slice(episode.start, episode.stop)
        middle = (episode.start + episode.stop) // 2
        over_floor = np.median(support.top[here]) - episode.position[2]
        if not over_floor > _SEATS:
            continue

        name = scene.solids[support.solid[middle]].name or _UNNAMED
        over = float(np.median(joints[here, PELVIS, 2] - support.carried[here]))
        amount, when = _cm(abs(over), scale), f"at {middle / fps:.1f} s"
        if episode.pelvis_height > _STANDS and over > 2 * _OFF_SEAT:
            yield Finding(
                STANDS,
                f"Stands in '{name}' {when} and does not sit down; rest the root on the level part "
                "of a seat, or make other takes",
                good=False,
            )
        elif abs(over) <= _OFF_SEAT:
            yield Finding("sits", f"Sits on '{name}' {when}, within {amount}", good=True)
        else:
            does = "hovers" if over > 0 else "sinks"
            where = "over" if over > 0 else "into"
            yield Finding(
                f"{does} {amount}",
                f"{does.capitalize()} {amount} {where} '{name}' {when}; raise Rest on Seats, set "
                "its Softness, or move the root onto its level part",
                good=False,
            )


def _inside(
    joints: np.ndarray, fps: float, path: RootPath, scene: Scene, scale: float
) -> Iterator[Finding]:
    points, floor = body_points(joints, _PER_BONE), path.position[:, 2]
    at_least = max(1, round(_BRIEF * fps))
    for solid in scene.solids:
        own = Scene((solid,))
        depth = -distance(own, points, floor)
        if not (depth > -_CLOSE).any():
            continue
        gives = guessed(solid, _USUAL_TOP) if solid.softness is None else solid.softness
        allowed = _DEEP + gives
        name = solid.name or _UNNAMED
        what_to_do = "lead the root farther around it, or move it"
        deep = runs((depth > allowed).any(1), at_least)
        for start, stop in deep:
            part = depth[start:stop]
            frame, point = np.unravel_index(np.argmax(part), part.shape)
            yield Finding(
                f"in {name}",
                f"The {_part_of(int(point))} is {_cm(part.max(), scale)} inside '{name}' at "
                f"{(start + frame) / fps:.1f} s; {what_to_do}",
                good=False,
            )

        across = (
            np.zeros(depth.shape, bool) if deep else _across(own, joints, floor, depth, allowed)
        )
        for start, stop in runs(across.any(1), at_least):
            bone = int(np.argmax(across[start:stop].sum(axis=0)))
            yield Finding(
                f"through {name}",
                f"The {_part_of(1 + _PER_BONE * bone)} goes through '{name}' at "
                f"{(start + stop) / (2 * fps):.1f} s; {what_to_do}",
                good=False,
            )


def _across(
    own: Scene, joints: np.ndarray, floor: np.ndarray, depth: np.ndarray, allowed: float
) -> np.ndarray:
    """Which bones (T, 21) are across a solid, by themselves or with the bone that they hang on, so
    that no move by as much as is ``allowed`` frees both: as in a board that is too thin for
    anything to be deep in it. ``depth`` (T, 1 + 21 * _PER_BONE): of the body's points.
    """
    out = np.zeros((len(joints), len(JOINTS) - 1), bool)
    near = (depth[:, 1:].reshape(*out.shape, _PER_BONE) > -_CLOSE).any(axis=(0, 2))
    ends = 1 + np.flatnonzero(near)
    begins = np.array(PARENTS)[ends]
    start, way = joints[:, begins, None], np.linspace(0.0, 1.0, _FINELY)[:, None]
    points = (start + way * (joints[:, ends, None] - start)).reshape(len(joints), -1, 3)
    place = {int(end): k for k, end in enumerate(ends)}
    hangs_on = [place.get(int(begin), k) for k, begin in enumerate(begins)]

    def met(moved: np.ndarray) -> np.ndarray:
        inside = distance(own, points + moved, floor) < -_TOUCHES
        inside = inside.reshape(len(joints), -1, _FINELY).any(axis=2)
        return np.asarray(inside | inside[:, hangs_on])

    across = met(np.zeros(3))
    for move in _MOVES:
        if not across.any():
            break
        across &= met(allowed * move)
    out[:, ends - 1] = across
    return out


def _part_of(point: int) -> str:
    """What of the body a point of ``body_points`` is on."""
    joint = JOINTS[0 if point == 0 else 1 + (point - 1) // _PER_BONE]
    side, _, name = joint.rpartition("_")
    return f"{side} {_PARTS[name]}".strip()


def _slid(places: np.ndarray, fps: float) -> float:
    """Metres that a foot moves while it stands at places (T, 2), but for how it comes down at first
    and rolls off at last, which is a part of it at rates that are lower than the model's.
    """
    slow = np.flatnonzero(np.linalg.norm(np.gradient(places, axis=0), axis=-1) * fps < _ROLLS)
    if len(slow) and slow[-1] - slow[0] >= 0.5 * len(places):
        places = places[slow[0] : slow[-1] + 1]
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def _feet(
    joints: np.ndarray,
    fps: float,
    path: RootPath,
    targets: Mapping[str, np.ndarray],
    scale: float,
) -> Iterator[Finding]:
    by_itself = ~led(targets, len(joints), fps)
    for foot, side in enumerate(("left", "right")):
        slides = [
            (_slid(joints[first + start : first + stop, FEET[foot], :2], fps), first + start)
            for own, first, last in standing_still(joints, path.position[:, 2], fps)
            if own == foot
            for start, stop in runs(by_itself[first:last, foot], at_least=_BRIEF * fps)
        ]
        if slides and max(slides)[0] > _SLIDES:
            far, when = max(slides)
            yield Finding(
                f"slides {_cm(far, scale)}",
                f"The {side} foot slides {_cm(far, scale)} while it stands, at {when / fps:.1f} "
                "s; raise Plant Feet, or lower the temperature",
                good=False,
            )
