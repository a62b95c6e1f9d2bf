"""The demo's plan, without Blender: where its furniture stands, how its character walks, and what
its report says.
"""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from .core.metrics import Seat, motion_metrics, seat_report, standing_pelvis_height
from .core.occupancy import distance
from .core.paths import Point, Rest, Route, Stop, facing, route
from .core.root import root_from_matrices
from .core.skeleton import END_EFFECTORS
from .core.solids import Scene
from .core.take import Controls, Take
from .core.weights import Weights

__all__ = ["FPS", "PLACES", "SEATS", "Place", "demo_report", "demo_route", "hand_target"]

FPS = 30


@dataclass(frozen=True)
class Place:
    """Where a piece of furniture stands: ``position`` (x, y) and the ``yaw`` that its front looks
    along.
    """

    position: Point
    yaw: float


PLACES = {
    "Chair": Place((-0.75, 0.75), facing((0.35, -1.0))),
    "Stool": Place((1.75, 0.55), facing((-0.45, -1.0))),
    "Desk": Place((-2.05, 1.95), facing((0.0, -1.0))),
    "Whiteboard": Place((0.60, 2.05), facing((0.0, -1.0))),
    "Sofa": Place((-2.55, -0.55), facing((1.0, 0.0))),
}
SEATS = tuple(
    Seat(name, np.array([*PLACES[name].position, height]))
    for name, height in (("Chair", 0.45), ("Stool", 0.63))
)
"""The seats that the character sits on."""

_BOARD = Stop((0.45, 1.52), 0.0, 2.6, name="Whiteboard")


def _seat(name: str, seconds: float) -> Stop:
    place = PLACES[name]
    return Stop(place.position, place.yaw, seconds, seated=True, name=name)


def demo_route() -> Route:
    """Walks in, sits on the chair, draws on the whiteboard, sits on the stool."""
    return route(
        Stop((2.2, -1.35), facing((-1.0, 0.25)), 0.5),
        (0.8, -0.80),
        _seat("Chair", 2.8),
        (0.25, 0.35),
        _BOARD,
        (1.05, 0.35),
        _seat("Stool", 3.0),
        fps=FPS,
    )


def hand_target(rest: Rest, frames: np.ndarray) -> np.ndarray:
    """World positions (N, 3) of the right wrist that draws a wave on the whiteboard during
    ``rest``.
    """
    share = np.clip((frames - rest.start) / max(rest.stop - 1 - rest.start, 1), 0.0, 1.0)
    along = rest.place.position[0] + 0.08 + 0.30 * share
    ahead = np.full(len(share), rest.place.position[1] + 0.36)
    up = 1.25 + 0.07 * np.sin(4 * np.pi * share)
    return np.stack([along, ahead, up], axis=1)


def demo_report(
    take: Take, scene: Scene, controls: Controls, weights: Weights, seconds: dict[str, float]
) -> dict[str, Any]:
    """What ``report.json`` holds: how the character sits, stands and moves, compared with real
    motion, and the time taken.
    """
    path, _ = root_from_matrices(take.root)
    floor = path.position[:, 2]
    is_ee = np.broadcast_to(np.asarray(controls.mode) == "EE", len(controls))
    targets = {
        name: np.where(is_ee[:, None], target, np.nan)
        for name in END_EFFECTORS
        if (target := getattr(controls, name)) is not None
    }
    generated = motion_metrics(
        take.joints,
        take.fps,
        floor=floor,
        targets=targets,
        distance=lambda points: distance(scene, points, floor),
    )
    report = {
        "seats": seat_report(take.joints, path, take.fps, SEATS),
        "standing_pelvis_height": standing_pelvis_height(take.joints, path, take.fps),
        "metrics": {"generated": generated, "ground_truth": weights.says("ground_truth") or {}},
        "note": (
            "ground_truth was measured on held-out motion capture with the same code; the weights "
            "file carries it."
        ),
        "seconds": seconds,
    }
    rounded: dict[str, Any] = json.loads(
        json.dumps(report), parse_float=lambda digits: round(float(digits), 5)
    )
    return rounded
