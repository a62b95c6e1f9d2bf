"""Fits furniture to captured motion: a seat under the pelvis that rests, other pieces where the body never goes.

The paper (section 5.2) matched virtual furniture to be consistent with the captured interaction and switched its shape; motion
capture here has no furniture at all, so every piece is drawn at random and kept only if the body's swept volume allows it.
"""

from dataclasses import dataclass

import numpy as np

from ..core.root import RootPath
from ..core.skeleton import SEAT_TO_PELVIS, joint
from .boxes import NO_BOXES, box, distances, placed

__all__ = ["Rest", "resting", "probes", "seat_for", "seats_for", "scattered", "furnished"]

_PROBES = [  # bone from, bone to, share of the way, radius of the flesh there
    ("pelvis", "pelvis", 0.0, 0.09), ("left_hip", "left_knee", 0.5, 0.06), ("right_hip", "right_knee", 0.5, 0.06),
    ("left_hip", "left_knee", 0.0, 0.08), ("right_hip", "right_knee", 0.0, 0.08),
    ("left_knee", "left_ankle", 0.0, 0.05), ("right_knee", "right_ankle", 0.0, 0.05),
    ("left_knee", "left_ankle", 0.5, 0.05), ("right_knee", "right_ankle", 0.5, 0.05),
    ("left_ankle", "left_foot", 0.0, 0.05), ("right_ankle", "right_foot", 0.0, 0.05),
    ("left_foot", "left_foot", 0.0, 0.04), ("right_foot", "right_foot", 0.0, 0.04),
    ("spine1", "spine2", 0.5, 0.10), ("spine3", "neck", 0.3, 0.10), ("neck", "head", 1.0, 0.10),
    ("left_shoulder", "left_elbow", 0.0, 0.07), ("right_shoulder", "right_elbow", 0.0, 0.07),
    ("left_shoulder", "left_elbow", 0.6, 0.05), ("right_shoulder", "right_elbow", 0.6, 0.05),
    ("left_elbow", "left_wrist", 0.0, 0.04), ("right_elbow", "right_wrist", 0.0, 0.04),
    ("left_elbow", "left_wrist", 1.0, 0.04), ("right_elbow", "right_wrist", 1.0, 0.04),
    ("left_elbow", "left_wrist", 1.35, 0.04), ("right_elbow", "right_wrist", 1.35, 0.04),
]
_FROM = np.array([joint(p[0]) for p in _PROBES])
_TO = np.array([joint(p[1]) for p in _PROBES])
_SHARE = np.array([p[2] for p in _PROBES])[:, None]
_RADIUS = np.array([p[3] for p in _PROBES])
_SITS = np.array([p[0] in ("pelvis", "left_hip", "right_hip") for p in _PROBES])
_MIN_REST = 8


@dataclass(frozen=True)
class Rest:
    """A seated episode: in frames ``start`` to ``end`` (exclusive) the pelvis rests at ``position`` (3,), facing ``yaw``."""

    start: int
    end: int
    position: np.ndarray
    yaw: float


def resting(joints: np.ndarray, path: RootPath) -> list[Rest]:
    """Seated episodes of a clip (T, 22, 3): the pelvis low and still, the trunk upright, for a quarter of a second or more."""
    pelvis = joints[:, 0]
    speed = np.linalg.norm(np.gradient(pelvis, axis=0), axis=-1) * 30.0 if len(pelvis) > 2 else np.zeros(len(pelvis))
    trunk = joints[:, joint("neck")] - pelvis
    upright = trunk[:, 2] > 0.6 * np.linalg.norm(trunk, axis=-1)
    # In a squat the heels are under the hips; on a seat the knees reach forward and the shins stand.
    ankles = (joints[:, joint("left_ankle")] + joints[:, joint("right_ankle")]) / 2
    ahead = np.linalg.norm((ankles - pelvis)[:, :2], axis=-1) > 0.15
    still = (pelvis[:, 2] < 0.88) & (speed < 0.12) & upright & ahead
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    episodes = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start >= _MIN_REST:
            middle = np.median(pelvis[start:end], axis=0)
            episodes.append(Rest(int(start), int(end), middle, float(np.median(path.yaw[start:end]))))
    return episodes


def probes(joints: np.ndarray, step: int = 3) -> np.ndarray:
    """Points (N, P, 3) of the body's flesh at every ``step``-th frame; their radii are known to this module."""
    j = joints[::step]
    return j[:, _FROM] + (j[:, _TO] - j[:, _FROM]) * _SHARE


def _clear(boxes: np.ndarray, points: np.ndarray, margin: float, sits: bool = False) -> bool:
    """Whether no probe comes nearer to a box than its radius plus ``margin``; those that sit are let off where ``sits``."""
    keep = ~_SITS if sits else np.ones(len(_RADIUS), dtype=bool)
    flat = points[:, keep].reshape(-1, 3)
    limits = np.tile(_RADIUS[keep] + margin, len(points))
    near = np.ones(len(flat), dtype=bool)
    if len(boxes):
        centre = boxes[:, :2].mean(0)
        span = np.linalg.norm(boxes[:, :2] - centre, axis=1).max() + np.linalg.norm(boxes[:, 3:5], axis=1).max() + 0.3
        near = np.linalg.norm(flat[:, :2] - centre, axis=1) < span
    return bool((distances(boxes, flat[near]) > limits[near]).all())


def _frame_under(rng: np.random.Generator, top: float, thick: float, x: float, back: float, front: float) -> list[np.ndarray]:
    """What carries a seat or table top between ``back`` and ``front`` (y), ``x`` to either side: block, legs or column."""
    middle, depth, under = (front + back) / 2, front - back, top - thick
    style = rng.choice(["block", "legs", "column", "panels"], p=[0.3, 0.4, 0.15, 0.15])
    if style == "block":
        gap = rng.choice([0.0, rng.uniform(0.05, 0.15)])
        return [box((0, middle, (under + gap) / 2), (2 * x, depth, max(under - gap, 0.02)))]
    if style == "legs":
        t = rng.uniform(0.03, 0.07)
        ys = (back + t / 2, front - t / 2)
        return [box((sx * (x - t / 2), y, under / 2), (t, t, under)) for sx in (-1, 1) for y in ys]
    if style == "column":
        t = rng.uniform(0.05, 0.12)
        return [box((0, middle, under / 2), (t, t, under)), box((0, middle, 0.03), (0.3, 0.3, 0.06))]
    return [box((sx * (x - 0.02), middle, under / 2), (0.04, depth, under)) for sx in (-1, 1)]


def _seat(rng: np.random.Generator, top: float, small: float) -> tuple[np.ndarray, np.ndarray]:
    """A seat with its front along +y, the sitter's pelvis over the origin: (carrying boxes, back and arms)."""
    sofa = rng.random() < 0.2
    x = rng.uniform(0.45, 1.1) if sofa else rng.uniform(0.17, 0.32)
    shift = rng.uniform(-0.8, 0.8) * (x - 0.25) if sofa else rng.uniform(-0.03, 0.03)
    back, front = -rng.uniform(0.12, 0.30), rng.uniform(0.14, 0.40) * small
    thick = min(rng.uniform(0.03, 0.25 if sofa else 0.10), top - 0.05)
    rows = [box((0, (front + back) / 2, top - thick / 2), (2 * x, front - back, thick))]
    rows += _frame_under(rng, top, thick, x, back, front)
    extra = []
    if rng.random() < (0.85 if sofa else 0.6):
        t, h = rng.uniform(0.03, 0.2 if sofa else 0.08), rng.uniform(0.25, 0.6)
        low = 0.0 if sofa else rng.choice([0.0, rng.uniform(0.05, 0.2)])
        extra.append(box((0, back - t / 2 + rng.uniform(0, 0.03), top + (low + h) / 2), (2 * x, t, h - low)))
    if rng.random() < (0.6 if sofa else 0.2):
        t, h = rng.uniform(0.04, 0.2 if sofa else 0.06), rng.uniform(0.12, 0.25)
        extra += [box((s * (x + t / 2), (front + back) / 2, (top + h) / 2), (t, front - back, top + h)) for s in (-1, 1)]
    both = np.array(rows), (np.array(extra) if extra else NO_BOXES.copy())
    for part in both:
        part[:, 0] += shift
    return both


def seat_for(rng: np.random.Generator, rest: Rest, points: np.ndarray) -> np.ndarray | None:
    """Boxes of a random seat under a resting pelvis, or None where no try leaves the body's path (``points``) free."""
    top = rest.position[2] - SEAT_TO_PELVIS + rng.uniform(-0.012, 0.012)
    for attempt in range(14):
        carrying, extra = _seat(rng, top, small=1.0 - 0.04 * attempt)
        yaw = rest.yaw + rng.normal(0.0, 0.08)
        carrying, extra = (placed(part, rest.position[:2], yaw) for part in (carrying, extra))
        if not _clear(carrying, points, -0.025, sits=True):
            continue
        if len(extra) and not _clear(extra, points, -0.02):
            if attempt < 7:
                continue
            extra = NO_BOXES
        return np.concatenate([carrying, extra])
    return None


def _piece(rng: np.random.Generator) -> np.ndarray:
    kind = rng.choice(["block", "wall", "table", "seat"], p=[0.3, 0.2, 0.25, 0.25])
    if kind == "block":
        size = rng.uniform((0.2, 0.2, 0.2), (1.2, 0.8, 1.9))
        return box((0, 0, size[2] / 2 + rng.choice([0.0, rng.uniform(0, 0.8)])), tuple(size))[None]
    if kind == "wall":
        length, height = rng.uniform(1.0, 4.0), rng.uniform(1.0, 2.6)
        return box((0, 0, height / 2 + rng.choice([0.0, 0.8])), (length, rng.uniform(0.03, 0.2), height))[None]
    if kind == "table":
        top, x, y = rng.uniform(0.4, 1.0), rng.uniform(0.25, 0.9), rng.uniform(0.2, 0.45)
        thick = rng.uniform(0.02, 0.08)
        return np.array([box((0, 0, top - thick / 2), (2 * x, 2 * y, thick)), *_frame_under(rng, top, thick, x, -y, y)])
    return np.concatenate(_seat(rng, rng.uniform(0.3, 0.75), 1.0))


def scattered(rng: np.random.Generator, points: np.ndarray, path: RootPath, count: int) -> np.ndarray:
    """Up to ``count`` random pieces near the path, none of which the body (``points``) comes near to."""
    kept = [NO_BOXES]
    for _ in range(count):
        piece = _piece(rng)
        for _ in range(5):
            at = path.position[rng.integers(len(path)), :2]
            direction, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.25, 1.5)
            spot = at + distance * np.array([np.cos(direction), np.sin(direction)])
            candidate = placed(piece, spot, rng.uniform(0, 2 * np.pi))
            if _clear(candidate, points, 0.03):
                kept.append(candidate)
                break
    return np.concatenate(kept)


def seats_for(rng: np.random.Generator, rests: list[Rest], points: np.ndarray) -> list[np.ndarray]:
    """A seat for every place of rest (places within 0.25 m share one); empty where one cannot be had."""
    places: list[Rest] = []
    for rest in rests:
        if all(np.linalg.norm(rest.position - other.position) > 0.25 for other in places):
            places.append(rest)
    seats = [seat_for(rng, place, points) for place in places]
    return [] if any(seat is None for seat in seats) else [seat for seat in seats if seat is not None]


def furnished(rng: np.random.Generator, joints: np.ndarray, path: RootPath) -> tuple[np.ndarray | None, str]:
    """All boxes (B, 7) of a room for one motion (T, 22, 3) with its root path, what the body uses and random pieces, and "".

    Or None and one word for what could not be had: "seat".
    """
    points = probes(joints)
    rests = resting(joints, path)
    seats = seats_for(rng, rests, points)
    if rests and not seats:
        return None, "seat"
    count = int(rng.integers(1, 5)) if rng.random() < 0.8 else 0
    return np.concatenate([NO_BOXES, *seats, scattered(rng, points, path, count)]), ""
