"""What populations cost and whether they are right, as ``dafnet bench scale`` measures it.

``sixty_people``: one room, 300 frames, from the shot's words to the saved .blend. ``by_number``:
the same hall with few and with many people. ``many_populations``: a café planned by one seed after
another, checked for seats that are taken twice and for bodies that overlap; what is refused is
listed. All return plain data.
"""

import resource
import sys
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import bpy
import numpy as np

from ...core.errors import InputError
from ...director.crowds import over_shot, plan_crowd
from ...director.others import APART
from ...director.plans import Plan
from ...director.shots import drawn, shot_of
from ..pipeline.batch import save_scene
from ..showcase.rooms import FPS, build_hall
from .openings import empty_scene, open_room
from .populate import populate
from .surroundings import room_of

__all__ = ["CAFE", "by_number", "many_populations", "sixty_people"]

_HALL_ROWS = 12
_OVERLAP = 0.02  # metres by which bodies may overlap
_LAST = 60.0  # seconds of a shot that are looked at

CAFE: dict[str, Any] = {
    "room": "cafe",
    "people": [
        {
            "name": "Barista",
            "start": [-2.0, 2.4],
            "tasks": [{"work_at": "Counter", "how": "handling", "near": [-2.0, 2.4]}],
        },
        {
            "name": "Guest",
            "count": 4,
            "height": [1.5, 1.95],
            "tasks": [
                [{"sit_on": "Chair.*", "choose": "random", "seconds": 30}],
                [{"sit_on": "Chair.*", "choose": "random", "seconds": 4}, {"walk_to": "Exit"}],
            ],
        },
        {
            "name": "Friend",
            "count": 2,
            "height": [1.5, 1.95],
            "tasks": [{"sit_on": "Sofa", "seconds": 5}, {"stand_up": 2}, {"look_at": "Menu"}],
        },
        {
            "name": "Newcomer",
            "count": 4,
            "height": [1.5, 1.95],
            "begins": [0, 12],
            "start": "Door",
            "tasks": [
                [{"sit_on": "Chair.*", "choose": "random", "seconds": 9}],
                [{"walk_to": "Counter"}, {"sit_on": "Chair.*", "seconds": 9}],
            ],
        },
        {
            "name": "Regular",
            "count": 2,
            "height": [1.5, 1.95],
            "begins": [0, 12],
            "start": "Door",
            "tasks": [{"look_at": "Menu"}, {"sit_on": "Stool.*", "seconds": 9}],
        },
    ],
}
"""A café in which people come, sit, go elsewhere and leave."""


def _viewers(room: str, count: int, late: int) -> dict[str, Any]:
    """People in a cinema for ten seconds, some of whom come ``late``."""
    sits = {"sit_on": "Seat.*", "choose": "random", "seconds": 60}
    group = {"height": [1.55, 1.9], "tasks": [sits]}
    return {
        "room": room,
        "seconds": 10,
        "people": [
            {"name": "Viewer", "count": count - late, **group},
            {"name": "Latecomer", "count": late, "begins": [0, 8], "start": "Door", **group},
        ],
    }


def sixty_people(
    folder: Path, progress: Callable[[float], None] = lambda share: None
) -> dict[str, Any]:
    """60 people of a cinema, 300 frames each, every eighth of whom comes late; the shot is written
    below ``folder``.

    Gives ``seconds`` of the clock and ``processor_seconds`` from words to files, ``stages``, the
    ``megabytes`` of memory that the process ever took, ``people`` and ``frames``.
    """
    return _measured(_viewers("cinema", 60, 8), folder / "sixty", progress)


def by_number(
    folder: Path,
    counts: Sequence[int] = (10, 100),
    progress: Callable[[float], None] = lambda share: None,
) -> dict[int, dict[str, Any]]:
    """As many of the people of one hall as each of the ``counts`` says, every tenth of whom comes
    late: what ``sixty_people`` gives, and ``processor_seconds_each``, by the count.
    """
    room = folder / "hall.blend"
    empty_scene()
    build_hall(bpy.context.scene, _HALL_ROWS)
    save_scene(room)
    found = {}
    for k, count in enumerate(counts):
        made = _measured(
            _viewers(str(room), count, count // 10),
            folder / f"{count} people",
            lambda share, k=k: progress((k + share) / len(counts)),  # type: ignore[misc]
        )
        found[count] = made | {
            "processor_seconds_each": made["processor_seconds"] / count,
            "seconds_each": made["seconds"] / count,
        }
    return found


def _measured(
    words: dict[str, Any], output: Path, progress: Callable[[float], None]
) -> dict[str, Any]:
    clock, processor = perf_counter(), process_time()
    made = populate(words, output, progress=progress)
    return {
        "seconds": round(perf_counter() - clock, 2),
        "processor_seconds": round(process_time() - processor, 2),
        "stages": dict(made.seconds),
        "megabytes": _peak(),
        "people": len(made.people),
        "frames": round(FPS * words["seconds"]),
    }


def _peak() -> float:
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(most / (1 << 20 if sys.platform == "darwin" else 1 << 10), 1)


def many_populations(
    seeds: Iterable[int] = range(100), progress: Callable[[float], None] = lambda share: None
) -> dict[str, Any]:
    """The café by each of some seeds, planned, not generated.

    Gives how many were ``made``; ``seats_taken_twice`` and ``overlaps``: sentences about what is
    wrong, none where all is right; ``deepest``: metres by which two bodies, capsules around their
    roots, ever overlap, negative for a gap; ``refused``: sentences by seed.
    """
    shots = [shot_of({**CAFE, "seed": seed}) for seed in seeds]
    open_room(shots[0])
    room = room_of(bpy.context)
    twice: list[str] = []
    overlaps: list[str] = []
    refused: dict[int, str] = {}
    deepest = -np.inf
    for k, shot in enumerate(shots):
        progress(k / len(shots))
        try:
            crowd = plan_crowd(room, drawn(shot), FPS)
        except InputError as error:
            refused[shot.seed] = str(error)
            continue
        plans = {each.who.name: over_shot(each.plan, round(_LAST * FPS)) for each in crowd.people}
        twice += [f"Seed {shot.seed}: {each}" for each in _taken_twice(plans)]
        for (one, first), (other, second) in combinations(plans.items(), 2):
            depth = _overlap(first, second)
            deepest = max(deepest, depth)
            if depth > _OVERLAP:
                overlaps.append(f"Seed {shot.seed}: {one} and {other} by {100 * depth:.0f} cm")
    return {
        "made": len(shots) - len(refused),
        "seats_taken_twice": twice,
        "overlaps": overlaps,
        "deepest": round(float(deepest), 4),
        "refused": refused,
    }


def _taken_twice(plans: dict[str, Plan]) -> list[str]:
    """Where two sit on one place at the same time."""
    found = []
    for (one, first), (other, second) in combinations(plans.items(), 2):
        for a in first.timeline:
            for b in second.timeline:
                if not a.seat or a.seat != b.seat:
                    continue
                frames = range(max(a.there, b.there), min(a.stop, b.stop, len(first)))
                if not frames:
                    continue
                places = first.path.position[frames[0], :2], second.path.position[frames[0], :2]
                if np.linalg.norm(places[0] - places[1]) < 0.3:
                    found.append(f"{one} and {other} on '{a.seat}'")
    return found


def _overlap(first: Plan, second: Plan) -> float:
    """Metres by which two bodies overlap where they are nearest."""
    away = np.linalg.norm(first.path.position[:, :2] - second.path.position[:, :2], axis=1)
    return float(0.5 * APART * (first.scale + second.scale) - away.min())
