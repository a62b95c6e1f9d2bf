"""Walks through rooms of boxes that nobody was captured in: whether takes drift in a minute, and
whether a seat's height decides how high one sits.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...core.conditions import shot_steps
from ...core.metrics import (
    BAD_COLLISION_JOINTS,
    Seat,
    bad_collisions,
    body_points,
    foot_sliding,
    jerk,
    penetration,
    seat_report,
    skate,
)
from ...core.occupancy import distance
from ...core.paths import Point, Route, Stop, facing, route
from ...core.progress import run_to_end
from ...core.sampler import Sampler
from ...core.series import MODEL_FPS
from ...core.skeleton import POSE_SIZE, SEAT_TO_PELVIS
from ...core.take import Controls
from ...core.weights import Weights
from ...data.furnish.boxes import box, placed
from ...data.furnish.flesh import Furnishing
from .clips import SEEDS, Figures, map_clips, pooled_row, sample_takes

__all__ = ["Room", "drift", "long_rooms", "seat_rooms", "seats_of_three_heights"]

_MINUTE = 1800
"""Frames of a long take."""
_LOOPS = 3
"""How often a long take goes round."""
_HEIGHTS = {"low": 0.35, "medium": 0.45, "high": 0.60}
"""Metres of a seat's top."""
_RIGHT_HEIGHT = 0.05
"""Metres by which a pelvis may be off and still shows the seat's height."""
_SITS_WITHIN = 0.06
"""Metres by which a pelvis may be off and still sits."""
_STANDS_ABOVE = 0.86
"""Metres of the pelvis of one who stands."""
_AWAY = 0.8
"""Metres from a seat's middle, beyond which one stands."""


@dataclass(frozen=True)
class Room:
    """A root path among seats: ``boxes`` (B, 7); ``heights`` of the seats by the names of the
    route's stops.
    """

    name: str
    boxes: np.ndarray
    walked: Route
    heights: dict[str, float]


def _seat(stop: Stop, height: float, back: bool) -> np.ndarray:
    """A seat of boxes at a stop: a slab on four legs, and a back where asked for."""
    rows = [box((0.0, 0.01, height - 0.025), (0.44, 0.44, 0.05))]
    rows += [
        box((x, 0.01 + y, height / 2 - 0.025), (0.04, 0.04, height - 0.05))
        for x in (-0.2, 0.2)
        for y in (-0.2, 0.2)
    ]
    if back:
        rows.append(box((0.0, -0.23, height + 0.185), (0.44, 0.04, 0.47)))

    return placed(np.array(rows), np.array(stop.position), stop.yaw)


def _round_walk(mirror: float, seconds: float) -> Route:
    """From standing to a chair, to a stool, and back, three times, with ``seconds`` at each."""
    stand = Stop((mirror * 1.2, 3.4), facing((0.0, -1.0)), seconds)
    chair = Stop((0.0, 0.0), 0.0, seconds, seated=True, name="chair")
    stool = Stop((mirror * 3.0, 2.0), facing((-mirror, 0.0)), seconds, seated=True, name="stool")
    once: tuple[Point | Stop, ...] = (
        (mirror * 0.12, 1.5),
        chair,
        (mirror * 1.2, 1.3),
        stool,
        stand,
    )
    return route(stand, *(once * _LOOPS))


def long_rooms() -> list[Room]:
    """Rooms walked round three times in a minute, each round the same: what differs between rounds
    is drift.
    """
    rooms = []
    for mirror, chair, stool in (
        (1.0, 0.45, 0.40),
        (-1.0, 0.50, 0.45),
        (1.0, 0.42, 0.55),
        (-1.0, 0.45, 0.60),
    ):
        # A round is to last 600 frames: what it lacks is shared out among its three rests.
        brief = _round_walk(mirror, 1.0)
        walked = _round_walk(mirror, 1.0 + (_MINUTE / _LOOPS - brief.rests[3].start) / 90.0)

        seats = [
            _seat(walked.rests[k].place, height, back)
            for k, height, back in ((1, chair, True), (2, stool, False))
        ]
        heights = {"chair": chair, "stool": stool}
        name = f"{chair:.2f}, {stool:.2f} m"
        rooms.append(Room(name, np.concatenate(seats), walked, heights))

    return rooms


def seat_rooms() -> list[Room]:
    """The same three root paths to a seat, its height low, medium and high."""
    stop = Stop((0.0, 0.0), 0.0, 3.0, seated=True, name="seat")
    ways = {
        "front": route(Stop((-1.6, 3.2), facing((0.5, -1.0)), 0.5), stop),
        "side": route(Stop((3.2, 0.8), facing((-1.0, 0.0)), 0.5), stop),
        "behind": route(Stop((-0.3, -3.2), 0.0, 0.5), (-0.95, -0.6), (-0.85, 0.45), stop),
    }
    return [
        Room(f"{way}, {name}", _seat(stop, height, back=True), walked, {"seat": height})
        for way, walked in ways.items()
        for name, height in _HEIGHTS.items()
    ]


def _sample(sampler: Sampler, room: Room, seeds: int) -> np.ndarray:
    """Takes (1 + seeds, T, 22, 3) in a room: temperature 0 first, then 1."""
    controls = Controls(fps=MODEL_FPS, root=room.walked.path.matrices())
    shot = run_to_end(shot_steps(Furnishing(room.boxes).scene(), controls))
    frames = len(shot.conditions)
    lively = (sampler.noise(frames, seed) for seed in range(seeds))
    noise = [np.zeros((frames, 1, POSE_SIZE)), *lively]
    return sample_takes(sampler, shot, np.concatenate(noise, axis=1))


def _measure(room: Room, takes: np.ndarray, first: int, last: int) -> Figures:
    """Figures of takes (S, T, 22, 3) in frames ``first`` to ``last``; a seat's right height is that
    of its top plus 0.12 m.
    """
    walked = room.walked
    cut = takes[:, first:last]
    flat, weight = cut.reshape(-1, 22, 3), float(cut.shape[0] * cut.shape[1])

    outside = partial(distance, Furnishing(room.boxes).scene(), floor=0.0)
    collisions = bad_collisions(outside(flat[:, list(BAD_COLLISION_JOINTS)]))
    depth = penetration(outside(body_points(flat)))[0]

    places = np.array([rest.place.position for rest in walked.rests if rest.place.seated])
    away = (
        np.linalg.norm(walked.path.position[first:last, None, :2] - places, axis=-1).min(1) > _AWAY
    )
    standing = float((cut[:, away, 0, 2] > _STANDS_ABOVE).sum())

    seats = [
        float(
            np.median(take[rest.start : rest.stop, 0, 2])
            - room.heights[rest.place.name]
            - SEAT_TO_PELVIS
        )
        for take in takes
        for rest in walked.rests
        if rest.place.seated and first <= rest.start < last
    ]
    sits = float(sum(abs(error) <= _SITS_WITHIN for error in seats))

    each = [
        (foot_sliding(take, MODEL_FPS).mean(), skate(take, MODEL_FPS), jerk(take, MODEL_FPS))
        for take in cut
    ]
    sliding, skating, jerking = (np.array(each).mean(0) * weight).tolist()

    return Figures(
        {
            "foot_sliding_per_frame": (sliding, weight),
            "skate_cm": (skating, weight),
            "jerk": (jerking, weight),
            "bad_collisions_per_frame": (float(collisions.sum()), weight),
            "penetration_mean": (depth * weight, weight),
            "sits_within_6cm": (sits, float(len(seats))),
            "stands_when_it_should": (standing, float(cut.shape[0] * away.sum())),
        },
        seats,
    )


def _rounds(sampler: Sampler, room: Room) -> dict[str, Figures]:
    """Figures of the first and the last round of a long walk."""
    takes = _sample(sampler, room, seeds=3)
    starts = [rest.start for rest in room.walked.rests[::3]]
    rounds = {"first": (starts[0], starts[1]), "last": (starts[_LOOPS - 1], starts[_LOOPS])}

    out = {}
    for name, (first, last) in rounds.items():
        for temperature, chosen in (("t0", takes[:1]), ("t1", takes[1:])):
            out[f"{name}_third_{temperature}"] = _measure(room, chosen, first, last)

    return out


def _heights(sampler: Sampler, room: Room) -> list[float]:
    """Height of the pelvis of every take while the root rests on the seat."""
    seat = Seat("seat", np.array([0.0, 0.0, room.heights["seat"]]))
    reports = [
        seat_report(take, room.walked.path, MODEL_FPS, [seat])[0]
        for take in _sample(sampler, room, SEEDS)
    ]
    return [float(report["pelvis_height"] or np.nan) for report in reports]


def drift(weights: Weights, progress: Callable[[float], None]) -> dict[str, dict[str, Any]]:
    found = list(map_clips(weights, _rounds, long_rooms(), progress))
    return {name: pooled_row([rounds[name] for rounds in found]) for name in found[0]}


def seats_of_three_heights(weights: Weights, progress: Callable[[float], None]) -> dict[str, Any]:
    """Pelvis over seats of three heights on the same root path, and how often all three are
    right.
    """
    rooms = seat_rooms()
    found = np.array(list(map_clips(weights, _heights, rooms, progress)))
    found = found.reshape(-1, len(_HEIGHTS), found.shape[1])  # way, height, take

    wanted = np.array(list(_HEIGHTS.values()))[:, None] + SEAT_TO_PELVIS
    right = np.abs(found - wanted) <= _RIGHT_HEIGHT

    out: dict[str, Any] = {}
    for temperature, takes in (("t0", slice(0, 1)), ("t1", slice(1, None))):
        out[temperature] = {
            "paths_and_seeds": int(right[:, 0, takes].size),
            "all_three_right": round(float(right[:, :, takes].all(1).mean()), 4),
            **{
                name: {
                    "seat": _HEIGHTS[name],
                    "wanted": round(float(wanted[k, 0]), 4),
                    "pelvis_median": round(float(np.median(found[:, k, takes])), 4),
                    "right": round(float(right[:, k, takes].mean()), 4),
                }
                for k, name in enumerate(_HEIGHTS)
            },
        }

    return out
