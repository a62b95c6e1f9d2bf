"""The demo's plan, without Blender: where its furniture stands, how its character walks, and what its report says."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .core.paths import Point, Rest, Route, Stop, facing, route
from .core.skeleton import SEAT_TO_PELVIS
from .core.take import Take

__all__ = ["FPS", "PLACES", "SEAT_HEIGHTS", "Place", "demo_route", "hand_target", "seat_report", "standing_pelvis_height"]

FPS = 30


@dataclass(frozen=True)
class Place:
    """Where a piece of furniture stands: ``position`` (x, y) and the ``yaw`` that its front looks along."""

    position: Point
    yaw: float


PLACES = {
    "Chair": Place((-0.75, 0.75), facing((0.35, -1.0))),
    "Stool": Place((1.75, 0.55), facing((-0.45, -1.0))),
    "Desk": Place((-2.05, 1.95), facing((0.0, -1.0))),
    "Whiteboard": Place((0.60, 2.05), facing((0.0, -1.0))),
    "Sofa": Place((-2.55, -0.55), facing((1.0, 0.0))),
}
SEAT_HEIGHTS = {"Chair": 0.45, "Stool": 0.63}
"""Heights of the seats that the character sits on (metres)."""

_BOARD = Stop((0.45, 1.52), 0.0, 2.6, name="Whiteboard")


def _seat(name: str, seconds: float) -> Stop:
    place = PLACES[name]
    return Stop(place.position, place.yaw, seconds, seated=True, name=name)


def demo_route() -> Route:
    """Walks in, sits on the chair, draws on the whiteboard, sits on the stool."""
    return route(
        Stop((2.6, -1.75), facing((-1.0, 0.15)), 0.5), (0.9, -0.95), _seat("Chair", 2.8),
        (0.25, 0.35), _BOARD,
        (1.05, 0.35), _seat("Stool", 3.0), fps=FPS,
    )


def hand_target(rest: Rest, frames: np.ndarray) -> np.ndarray:
    """World positions (N, 3) of the right wrist that draws a wave on the whiteboard during ``rest``."""
    u = np.clip((frames - rest.first) / max(rest.last - rest.first, 1), 0.0, 1.0)
    x = rest.stop.position[0] + 0.08 + 0.30 * u
    return np.stack([x, np.full(len(u), rest.stop.position[1] + 0.36), 1.25 + 0.07 * np.sin(4 * np.pi * u)], axis=1)


def seat_report(take: Take, walked: Route, seat_heights: dict[str, float]) -> list[dict[str, Any]]:
    """For each rest on a seat: its name and height, and the median height of the pelvis in the rest's second half."""
    seats = []
    for rest in walked.rests:
        if not rest.stop.seated:
            continue
        middle = (rest.first + rest.last) // 2
        pelvis = float(np.median(take.joints[middle : rest.last + 1, 0, 2]))
        seat = seat_heights[rest.stop.name]
        seats.append({
            "name": rest.stop.name, "seat_height": seat, "pelvis_height": round(pelvis, 4),
            "error": round(pelvis - (seat + SEAT_TO_PELVIS * take.scale), 4),
        })
    return seats


def standing_pelvis_height(take: Take) -> float:
    """Median height of the pelvis over the root (metres) while the root walks at more than half a metre a second."""
    step = np.linalg.norm(np.diff(take.root[:, :2, 3], axis=0), axis=1) * take.fps
    walking = np.concatenate([[False], step > 0.5])
    return float(np.median((take.joints[:, 0, 2] - take.root[:, 2, 3])[walking]))
