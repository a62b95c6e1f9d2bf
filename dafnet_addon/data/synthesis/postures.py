"""How people sit: leaning back, slouching, on the edge, turned; forearms on the arms of a chair,
hands on its seat, one of them on a desk; one leg forward, ankles crossed.

Nobody's capture here shows it: captured sitting is led from one posture to the next. A posture is
what changes of a body that sits upright; trunk and pelvis turn, hands and feet are led, bones keep
their lengths, and a foot is lifted wherever it goes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.kinematics import two_bone
from ...core.root import root_from_joints, to_root
from ...core.rotations import rotate, yaw_matrix
from ...core.series import smoothstep
from ...core.skeleton import (
    ANKLES,
    COLLARS,
    ELBOWS,
    FEET,
    HEAD,
    HIPS,
    KNEES,
    NECK,
    PELVIS,
    SHOULDERS,
    SPINE,
    WRISTS,
)
from ..motion.canonical import LEG
from .hand_paths import min_jerk_path, wandering
from .joins import LENGTHS, fit_to_bones

__all__ = ["POSTURES", "Hand", "Posture", "posture_of", "sitting_in"]

Hand = str
"""Where a hand is: its "own" place, on an "arm" of the chair, on the "seat", on a "desk"."""

_MOVES = (26, 48)  # frames from one posture to the next
_STAYS = (40, 90)  # frames in one
_STRETCHED, _DRAWN_IN = 0.93, 0.12  # of a leg's length; metres from hip to ankle, forward
_GAZE = 0.55  # of the trunk's lean and turn, that the head does not follow
_LIFT = 0.045  # metres that a foot is lifted on its way
_CREEPS = 0.004  # metres a frame; a foot that goes nowhere faster is lifted less
_ELBOW = np.array([0.08, 0.02, -0.245])  # from the shoulder, outward, of an arm that rests
_FOREARM = np.array([0.0, 0.24, -0.01])  # from there to the wrist
_ON_SEAT = np.array([0.24, 0.02, -0.03])  # metres from the pelvis to a wrist beside the thigh
_ON_DESK = np.array([0.16, 0.34, 0.20])  # the same, of one that lies on a desk
_REACH = 0.97  # of an arm's length
_STIRS = np.array([0.004, 0.004, 0.002])  # metres, of a hand that lies
_SWAYS = np.array([0.012, 0.012, 0.03])  # radians, of a trunk that is held


@dataclass(frozen=True)
class Posture:
    """What changes of a body that sits upright.

    ``slide``: metres forward on the seat; ``lean``: of the trunk from upright, ``tilt``: of the
    pelvis from how it was, radians, back is positive; ``turn``: of the chest, radians, to the left.
    ``hands``: where the left and the right are. ``feet``: metres (right, forward, up) that the left
    and the right one are from where they were.
    """

    slide: float = 0.0
    lean: float = 0.0
    tilt: float = 0.0
    turn: float = 0.0
    hands: tuple[Hand, Hand] = ("own", "own")
    feet: tuple[tuple[float, float, float], tuple[float, float, float]] = ((0.0,) * 3, (0.0,) * 3)


def _upright(rng: np.random.Generator) -> Posture:
    return Posture(lean=rng.uniform(-0.06, 0.08))


def _leans_back(rng: np.random.Generator) -> Posture:
    lean = rng.uniform(0.17, 0.61)  # radians, from 10 to 35 degrees
    return Posture(slide=0.16 * lean + rng.uniform(0.0, 0.04), lean=lean, tilt=lean + 0.05)


def _slouches(rng: np.random.Generator) -> Posture:
    tilt = rng.uniform(0.25, 0.5)
    lean = rng.uniform(-0.12, 0.12)
    return Posture(slide=rng.uniform(0.04, 0.12), lean=lean, tilt=tilt)


def _on_the_edge(rng: np.random.Generator) -> Posture:
    back = -rng.uniform(0.02, 0.10)
    feet = ((0.0, back, 0.0), (0.0, back + rng.uniform(-0.03, 0.03), 0.0))
    return Posture(slide=rng.uniform(0.0, 0.03), lean=-rng.uniform(0.08, 0.3), feet=feet)


def _on_arms(rng: np.random.Generator) -> Posture:
    lean = rng.uniform(0.0, 0.35)
    hands = [("arm", "arm"), ("arm", "arm"), ("arm", "own"), ("own", "arm")][rng.integers(4)]
    return Posture(slide=0.12 * lean, lean=lean, tilt=lean, hands=hands)


def _hands_on_seat(rng: np.random.Generator) -> Posture:
    hands = [("seat", "seat"), ("seat", "seat"), ("seat", "own"), ("own", "seat")][rng.integers(4)]
    return Posture(lean=rng.uniform(-0.15, 0.12), hands=hands)


def _desk_and_seat(rng: np.random.Generator) -> Posture:
    hands = ("desk", "seat") if rng.random() < 0.5 else ("seat", "desk")
    return Posture(lean=-rng.uniform(0.02, 0.16), hands=hands)


def _leg_forward(rng: np.random.Generator) -> Posture:
    ahead = (rng.uniform(-0.02, 0.02), rng.uniform(0.12, 0.24), 0.0)
    back = (0.0, -rng.uniform(0.0, 0.08), 0.0)
    feet = (ahead, back) if rng.random() < 0.5 else (back, ahead)
    return Posture(lean=rng.uniform(0.0, 0.15), feet=feet)


def _ankles_crossed(rng: np.random.Generator) -> Posture:
    ahead = rng.uniform(0.08, 0.2)
    over, under = (1.0, -1.0) if rng.random() < 0.5 else (-1.0, 1.0)
    # The one in front lies on the other's instep.
    feet = (
        (_CROSSED, ahead + 0.055 * over, 0.02 if over > 0 else 0.0),
        (-_CROSSED, ahead + 0.055 * under, 0.02 if under > 0 else 0.0),
    )
    return Posture(slide=rng.uniform(0.0, 0.06), lean=rng.uniform(0.0, 0.2), tilt=0.1, feet=feet)


def _turned(rng: np.random.Generator) -> Posture:
    turn = rng.choice([-1.0, 1.0]) * rng.uniform(0.25, 0.7)
    return Posture(lean=rng.uniform(-0.08, 0.12), turn=turn)


_CROSSED = 0.13  # metres that each ankle goes to the other side
POSTURES: dict[str, tuple[float, Callable[[np.random.Generator], Posture]]] = {
    "upright": (0.10, _upright),
    "leaning back": (0.36, _leans_back),
    "slouching": (0.10, _slouches),
    "on the edge": (0.07, _on_the_edge),
    "forearms on arms": (0.12, _on_arms),
    "hands on the seat": (0.06, _hands_on_seat),
    "desk and seat": (0.05, _desk_and_seat),
    "leg forward": (0.05, _leg_forward),
    "ankles crossed": (0.05, _ankles_crossed),
    "turned": (0.04, _turned),
}
"""Shares of postures, and what draws one."""
_LEGS_TOO = ("leaning back", "slouching", "forearms on arms")
"""Postures in which half of the people do something with their legs, too."""


def posture_of(rng: np.random.Generator, name: str) -> Posture:
    """A posture of this name; one who leans back may stretch a leg or cross the ankles, too."""
    posture = POSTURES[name][1](rng)
    if name in _LEGS_TOO and rng.random() < 0.5:
        legs = (_leg_forward, _ankles_crossed)[rng.integers(2)](rng)
        posture = replace(posture, feet=legs.feet)
    return posture


def sitting_in(
    rng: np.random.Generator, joints: np.ndarray, start: int, postures: Sequence[Posture]
) -> np.ndarray:
    """The motion (T, 22, 3) of a body that sits still from frame ``start`` on, led from its own
    posture through these; it stays in the last.
    """
    moves = rng.integers(*_MOVES, len(postures))
    stays = rng.integers(*_STAYS, len(postures))
    legs = [int(n) for pair in zip(moves, stays, strict=True) for n in pair]

    def course(values: np.ndarray) -> np.ndarray:
        """Values (P, …) of the postures over time (T, …), from nothing at first."""
        rows = np.concatenate([np.zeros_like(values[:1]), np.repeat(values, 2, axis=0)])
        along = min_jerk_path(rows, legs)
        frames = np.clip(np.arange(len(joints)) - start, 0, len(along) - 1)
        return np.asarray(along[frames])

    own = _lean_of(joints[start:])
    trunk = course(np.array([(p.slide, p.lean - own, p.tilt, p.turn) for p in postures]))
    held = smoothstep((np.arange(len(joints)) - start) / _MOVES[1])[:, None]
    trunk[:, 1:] += wandering(rng, len(joints), 3, 28) * _SWAYS * held
    out = _feet_led(_trunk_led(joints, start, trunk), start, course, postures)
    for side in (0, 1):
        out = _hand_led(rng, out, start, side, course, [p.hands[side] for p in postures])
    return out


def _lean_of(joints: np.ndarray) -> float:
    """How far a body (T, 22, 3) mostly leans back, radians."""
    path = root_from_joints(joints)
    trunk = to_root(path, joints[:, NECK]) - to_root(path, joints[:, PELVIS])
    return float(np.median(np.arctan2(-trunk[:, 1], trunk[:, 2])))


Course = Callable[[np.ndarray], np.ndarray]


def _about_right(angle: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) about x that lean back by ``angle`` (T,)."""
    c, s, turn = np.cos(angle), np.sin(angle), np.zeros((len(angle), 3, 3))
    turn[:, 0, 0], turn[:, 1, 1], turn[:, 2, 2] = 1.0, c, c
    turn[:, 1, 2], turn[:, 2, 1] = -s, s
    return turn


def _trunk_led(joints: np.ndarray, start: int, trunk: np.ndarray) -> np.ndarray:
    """The motion with pelvis and chest as ``trunk`` (T, 4: slide, lean, tilt, turn) says."""
    slide, lean, tilt, turn = trunk.T
    yaw = float(root_from_joints(joints).yaw[start])
    to_world, to_body = yaw_matrix(np.array(yaw)), yaw_matrix(np.array(-yaw))

    def about(lean: np.ndarray, turn: np.ndarray) -> np.ndarray:
        return np.asarray(to_world @ yaw_matrix(turn) @ _about_right(lean) @ to_body)

    pelvis, chest = about(tilt, 0.35 * turn), about(lean, turn)
    gaze = about((1.0 - _GAZE) * lean, (1.0 + _GAZE) * turn)
    middle = joints[:, HIPS].mean(1)
    ahead = slide[:, None] * (to_world @ np.array([0.0, 1.0, 0.0]))

    def turned(rows: list[int], rotation: np.ndarray) -> np.ndarray:
        return np.asarray(
            middle[:, None]
            + np.einsum("tij,tbj->tbi", rotation, joints[:, rows] - middle[:, None])
            + ahead[:, None]
        )

    out = joints.copy()
    lower = [PELVIS, *HIPS, SPINE[0]]
    upper = [*SPINE[1:], NECK, *COLLARS, *SHOULDERS, *ELBOWS, *WRISTS]
    out[:, lower], out[:, upper] = turned(lower, pelvis), turned(upper, chest)
    out[:, HEAD] = out[:, NECK] + rotate(gaze, joints[:, HEAD] - joints[:, NECK])
    out[:, KNEES] += 0.5 * ahead[:, None]
    return fit_to_bones(out)


def _near_enough(place: np.ndarray, offset: Sequence[float]) -> np.ndarray:
    """What a foot is moved by, so that it is neither stretched out too far nor drawn in too far:
    ``place`` (3,) is where its ankle is, seen from its hip.
    """
    out = np.array(offset)
    farthest = np.sqrt(max((_STRETCHED * LEG) ** 2 - place[2] ** 2, 0.0))
    low, high = min(_DRAWN_IN, place[1]), max(farthest, place[1])
    out[1] = np.clip(place[1] + out[1], low, high) - place[1]
    return out


def _feet_led(
    joints: np.ndarray, start: int, course: Course, postures: Sequence[Posture]
) -> np.ndarray:
    """The motion with its feet where the postures have them, lifted on the way there."""
    to_world = yaw_matrix(root_from_joints(joints).yaw[start])
    out = joints.copy()
    for side in (0, 1):
        place = (joints[start, ANKLES[side]] - joints[start, HIPS[side]]) @ to_world
        offset = course(np.array([_near_enough(place, p.feet[side]) for p in postures]))
        step = np.linalg.norm(np.gradient(offset[:, :2], axis=0), axis=-1)
        quickest = max(float(step.max()), 1e-9)
        far = min(1.0, quickest / _CREEPS)  # a foot that hardly moves is hardly lifted
        offset[:, 2] += _LIFT * far * smoothstep(5.0 * step / quickest)
        moved = offset @ to_world.T
        out[:, [ANKLES[side], FEET[side]]] += moved[:, None]
        out[:, KNEES[side]] += 0.5 * moved
    return fit_to_bones(out)


def _hand_led(
    rng: np.random.Generator,
    joints: np.ndarray,
    start: int,
    side: int,
    course: Course,
    where: Sequence[Hand],
) -> np.ndarray:
    """The motion with one hand (0: left) where the postures have it: still in the world for as long
    as it is there.
    """
    to_world = yaw_matrix(root_from_joints(joints).yaw[start])
    outward = np.array([-1.0 if side == 0 else 1.0, 1.0, 1.0])
    shares = course(np.array([[float(w == place) for place in _PLACES] for w in where]))
    shoulder, elbow, wrist = SHOULDERS[side], ELBOWS[side], WRISTS[side]
    out = joints.copy()
    target, pole = out[:, wrist].copy(), out[:, elbow].copy()
    for k, (origin, to_elbow, to_wrist) in enumerate(_PLACES.values()):
        share = shares[:, k]
        there = np.flatnonzero(share > 0.98)
        if not len(there):
            continue

        from_here = np.median(joints[there, shoulder if origin == "shoulder" else PELVIS], axis=0)
        place = from_here + to_world @ ((to_elbow + to_wrist) * outward)
        if origin == "pelvis":
            place = _within_reach(place, np.median(joints[there, shoulder], axis=0), side)
        stirs = wandering(rng, len(joints), 3, 26) * _STIRS
        target += share[:, None] * (place + stirs - out[:, wrist])
        bend = to_elbow if origin == "shoulder" else _ELBOW
        pole += share[:, None] * (joints[:, shoulder] + to_world @ (bend * outward) - pole)

    # On its way a hand goes over the edge, not through it.
    away = shares.sum(1)
    target[:, 2] += 0.10 * 4.0 * np.clip(away * (1.0 - away), 0.0, 0.25)
    out[:, elbow], out[:, wrist] = two_bone(
        joints[:, shoulder], target, pole, LENGTHS[elbow], LENGTHS[wrist]
    )
    return out


def _within_reach(place: np.ndarray, shoulder: np.ndarray, side: int) -> np.ndarray:
    """A place (3,) for a wrist, raised and drawn in until the arm gets there."""
    arm = float(LENGTHS[ELBOWS[side]] + LENGTHS[WRISTS[side]]) * _REACH
    away = place - shoulder
    distance = float(np.linalg.norm(away))
    return place if distance <= arm else shoulder + away * arm / distance


_PLACES = {
    "arm": ("shoulder", _ELBOW, _FOREARM),
    "seat": ("pelvis", np.zeros(3), _ON_SEAT),
    "desk": ("pelvis", np.zeros(3), _ON_DESK),
}
