"""The body's flesh as balls along its bones, and how far furniture stays from them: what a motion
leaves room for.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core.rotations import yaw_matrix
from ...core.skeleton import SEAT_TO_PELVIS, joint
from ...core.solids import Box, Scene
from .boxes import NO_BOXES, placed
from .shapes import NO_SHAPES, ShapeBank

__all__ = [
    "FAR",
    "FOREARMS",
    "NO_BANK",
    "GIVES",
    "LIES_SUNK",
    "PROBES",
    "RADIUS",
    "STEP",
    "TRUNK",
    "Furnishing",
    "box_clearance",
    "clearance",
    "nearest_box",
    "pressed",
    "probes",
    "sunk",
]

FAR = 0.3
"""Metres beyond which it does not matter how far furniture is."""
NO_BANK = ShapeBank(())

PROBES = [  # bone from, bone to, share of the way, radius of the flesh there
    ("pelvis", "pelvis", 0.0, 0.09),
    ("left_hip", "left_knee", 0.5, 0.06),
    ("right_hip", "right_knee", 0.5, 0.06),
    ("left_hip", "left_knee", 0.0, 0.08),
    ("right_hip", "right_knee", 0.0, 0.08),
    ("left_knee", "left_ankle", 0.0, 0.05),
    ("right_knee", "right_ankle", 0.0, 0.05),
    *(
        (f"{side}_knee", f"{side}_ankle", share, 0.05)
        for side in ("left", "right")
        for share in (0.25, 0.5, 0.75)
    ),
    *(
        (f"{side}_hip", f"{side}_knee", share, 0.06)
        for side in ("left", "right")
        for share in (0.25, 0.75)
    ),
    ("left_ankle", "left_foot", 0.0, 0.05),
    ("right_ankle", "right_foot", 0.0, 0.05),
    ("left_foot", "left_foot", 0.0, 0.04),
    ("right_foot", "right_foot", 0.0, 0.04),
    ("spine1", "spine2", 0.5, 0.10),
    ("spine3", "neck", 0.3, 0.10),
    ("neck", "head", 1.0, 0.10),
    ("left_shoulder", "left_elbow", 0.0, 0.07),
    ("right_shoulder", "right_elbow", 0.0, 0.07),
    ("left_shoulder", "left_elbow", 0.6, 0.05),
    ("right_shoulder", "right_elbow", 0.6, 0.05),
    ("left_elbow", "left_wrist", 0.0, 0.04),
    ("right_elbow", "right_wrist", 0.0, 0.04),
    ("left_elbow", "left_wrist", 0.5, 0.04),
    ("right_elbow", "right_wrist", 0.5, 0.04),
    ("left_elbow", "left_wrist", 1.0, 0.04),
    ("right_elbow", "right_wrist", 1.0, 0.04),
    ("left_elbow", "left_wrist", 1.35, 0.04),
    ("right_elbow", "right_wrist", 1.35, 0.04),
]
_FROM = np.array([joint(p[0]) for p in PROBES])
_TO = np.array([joint(p[1]) for p in PROBES])
_SHARE = np.array([p[2] for p in PROBES])[:, None]
RADIUS = np.array([p[3] for p in PROBES])


@dataclass(frozen=True)
class Furnishing:
    """Furniture of the training: ``boxes`` (B, 7) and placed ``shapes`` (S, 5) of a ``bank``;
    world, metres, floor at z = 0.
    """

    boxes: np.ndarray = field(default_factory=lambda: NO_BOXES)
    shapes: np.ndarray = field(default_factory=lambda: NO_SHAPES)
    bank: ShapeBank = NO_BANK

    def __len__(self) -> int:
        return len(self.boxes) + len(self.shapes)

    def __add__(self, other: "Furnishing") -> "Furnishing":
        bank = self.bank if len(self.bank) else other.bank
        return Furnishing(
            np.concatenate([self.boxes, other.boxes]),
            np.concatenate([self.shapes, other.shapes]),
            bank,
        )

    def moved(self, position: np.ndarray, yaw: float) -> "Furnishing":
        """Turned by ``yaw`` about the origin, then moved to ``position`` (2,) on the floor."""
        shapes = self.shapes.copy()
        c, s = np.cos(yaw), np.sin(yaw)
        shapes[:, 1:3] = self.shapes[:, 1:3] @ np.array([[c, s], [-s, c]]) + position
        shapes[:, 3] += yaw
        return replace(self, boxes=placed(self.boxes, position, yaw), shapes=shapes)

    def scene(self) -> Scene:
        """The same for the core."""
        solids = [
            Box(center=r[:3], half_size=r[3:6], rotation=yaw_matrix(r[6])) for r in self.boxes
        ]
        return Scene((*solids, *self.bank.meshes(self.shapes)))


def pressed(rest: float, **parts: float) -> np.ndarray:
    """Metres by which each probe's flesh may give: ``rest``, or what is said of a part of the
    body.
    """
    out = np.full(len(PROBES), rest)
    for i, (start, end, share, _) in enumerate(PROBES):
        if "wrist" in end:
            name = "hand" if share > 1 else "wrist" if share == 1 else "elbow"
        elif start.endswith("hip"):
            name = "thigh" if share else "hip"
        elif start.endswith("shoulder"):
            name = "elbow" if share else "shoulder"
        else:
            name = {"pelvis": "hip", "spine1": "trunk", "spine3": "trunk", "neck": "head"}.get(
                start, ""
            )
        out[i] = parts.get(name, rest)

    return out


STEP = 3
"""Frames between those whose probes are tried."""
TRUNK = [i for i, p in enumerate(PROBES) if p[0] in ("spine1", "spine3")]
"""The probes of the loins and of the chest."""
FOREARMS = [
    [i for i, p in enumerate(PROBES) if p[1] == f"{side}_wrist" and p[2] <= 1.0]
    for side in ("left", "right")
]
"""The probes of the left and the right forearm, from elbow to wrist."""


def probes(joints: np.ndarray, step: int = STEP) -> np.ndarray:
    """Points (N, P, 3) of the body's flesh at every ``step``-th frame; their radii are known to
    this module.
    """
    j = joints[::step]
    return j[:, _FROM] + (j[:, _TO] - j[:, _FROM]) * _SHARE


GIVES = pressed(
    0.03, hip=0.08, thigh=0.05, trunk=0.05, shoulder=0.05, elbow=0.045, wrist=0.045, hand=0.08
)
"""Metres (P,) by which flesh gives of one that sits on something hard, or lies on it."""
_SINKS = pressed(0.3, hip=1.0, thigh=0.6)
LIES_SUNK = pressed(0.12, trunk=0.15, head=0.14, shoulder=0.2, elbow=0.22)
"""Metres (P,) by which the flesh of one that lies is lower than on a floor: a bed is soft."""


def sunk(over: float) -> np.ndarray:
    """Metres (P,) by which the flesh of one that sits is lower than on something hard, where the
    pelvis joint is ``over`` metres over the undeformed surface.
    """
    return max(0.0, SEAT_TO_PELVIS - over) * _SINKS


def nearest_box(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Signed distance (N,) of points (N, 3) to the nearest of the boxes: ``boxes.distances``, axis
    by axis for speed.
    """
    x, y, z = (points[:, i] - boxes[:, i, None] for i in range(3))
    c, s = np.cos(boxes[:, 6, None]), np.sin(boxes[:, 6, None])
    turned = c * x + s * y, c * y - s * x, z
    qx, qy, qz = (np.abs(q) - boxes[:, 3 + i, None] for i, q in enumerate(turned))
    inside = np.minimum(np.maximum(np.maximum(qx, qy), qz), 0.0)
    outside = np.sqrt(
        np.maximum(qx, 0.0) ** 2 + np.maximum(qy, 0.0) ** 2 + np.maximum(qz, 0.0) ** 2
    )
    return (outside + inside).min(0)


def box_clearance(
    boxes: np.ndarray,
    points: np.ndarray,
    gives: float | np.ndarray = 0.0,
    sinks: float | np.ndarray = 0.0,
) -> float:
    """How far (metres) the flesh about the probes (N, P, 3) stays from the boxes at least; negative
    where it cuts them.

    ``gives`` (a number, or one per probe) is let off: flesh gives where it rests on something. What
    it ``sinks`` (metres, likewise) into it counts downwards only: backs and arms do not give.
    Nothing is farther than ``FAR``.
    """
    if not len(boxes):
        return FAR

    flat = _raised(points, sinks)
    limits = np.broadcast_to(RADIUS - gives, points.shape[:2]).reshape(-1)
    centre = boxes[:, :2].mean(0)
    span = (
        np.linalg.norm(boxes[:, :2] - centre, axis=1).max()
        + np.linalg.norm(boxes[:, 3:5], axis=1).max()
        + FAR
    )
    near = ((flat[:, :2] - centre) ** 2).sum(1) < (span + 0.1) ** 2
    if not near.any():
        return FAR

    return min(FAR, float((nearest_box(boxes, flat[near]) - limits[near]).min()))


def clearance(
    furniture: Furnishing,
    points: np.ndarray,
    gives: float | np.ndarray = 0.0,
    sinks: float | np.ndarray = 0.0,
) -> float:
    """``box_clearance`` of any furniture; shapes are at most ``shapes.FARTHEST`` away, less the
    flesh's own radius.
    """
    least = box_clearance(furniture.boxes, points, gives, sinks)
    if not len(furniture.shapes):
        return least
    limits = np.broadcast_to(RADIUS - gives, points.shape[:2]).reshape(-1)
    gap = furniture.bank.distances(furniture.shapes, _raised(points, sinks))
    return min(least, float((gap - limits).min()))


def _raised(points: np.ndarray, sinks: float | np.ndarray) -> np.ndarray:
    """Probes (N · P, 3) where they would be on something hard."""
    up = np.broadcast_to(sinks, points.shape[1])[:, None] * np.array([0.0, 0.0, 1.0])
    return (points + up).reshape(-1, 3)
