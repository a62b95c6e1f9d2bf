"""Everybody in a shot is planned, one person after another: who is there at first, then who comes.

Those who have not been planned yet already stand or sit where they begin, so that nobody takes
their seat or walks through them.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core.errors import InputError
from ..core.paths import facing
from ..core.progress import stepwise, within
from ..core.root import RootPath
from ..core.rotations import normalised
from ..core.skeleton import STATURE
from .others import APART, Occupied
from .places import has_room
from .planner import plan_tasks
from .plans import Hold, Plan
from .room import Piece, Room
from .shots import Somebody
from .track import Targets

__all__ = ["Crowd", "Planned", "over_shot", "plan_crowd"]

_SPACE = 0.32  # metres around somebody who stands and waits to begin
_STEP = 0.85  # metres between those who wait beside one another, so that one can leave
_QUEUE = 8
_RINGS = 8


@dataclass(frozen=True)
class Planned:
    """Somebody with the plan of what he does."""

    who: Somebody
    plan: Plan


@dataclass(frozen=True)
class Crowd:
    """``people``, in the order in which they are named; ``left_out``: a sentence for each for whom
    there was no place.
    """

    people: tuple[Planned, ...]
    left_out: tuple[str, ...] = ()


@stepwise
def plan_crowd(
    room: Room,
    people: Sequence[Somebody],
    fps: float,
    *,
    present: Sequence[Plan] = (),
    fewer: bool = False,
) -> Generator[float, None, Crowd]:
    """Plan what everybody does. Those who begin at a place stand there until they do.

    ``present``: plans of others that stay as they are. ``fewer``: who finds no place is left out.
    Raises InputError, which names the person, where a task cannot be done, or there is no place for
    somebody.
    """
    order = sorted(
        range(len(people)), key=lambda k: (people[k].start is not None, people[k].begins, k)
    )
    first: dict[int, Plan] = {}
    out: dict[int, str] = {}
    for done, k in enumerate(order):
        job = _first_place(room, people[k], fps, [*present, *first.values()])
        try:
            first[k] = yield from within(job, *_part(done, 0.0, 0.3, len(people)))
        except InputError as error:
            out[k] = _refused(people[k], error, fewer)

    plans: dict[int, Plan] = {}
    for done, k in enumerate([k for k in order if k in first]):
        others = [*present, *(plans.get(j, first[j]) for j in first if j != k)]
        job = _planned(room, people[k], fps, first[k], others)
        try:
            plans[k] = yield from within(job, *_part(done, 0.3, 0.7, len(people)))
        except InputError as error:
            out[k] = _refused(people[k], error, fewer)
            del first[k]

    if not plans:
        raise InputError(f"Nobody is left in the shot: {next(iter(out.values()))}")
    return Crowd(
        tuple(Planned(people[k], plans[k]) for k in sorted(plans)),
        tuple(out[k] for k in sorted(out)),
    )


def _part(done: int, low: float, share: float, count: int) -> tuple[float, float]:
    return low + share * done / count, low + share * (done + 1) / count


def _refused(who: Somebody, error: InputError, fewer: bool) -> str:
    """What is said of somebody who is left out; raises it where nobody may be."""
    sentence = f"{who.name}: {error}"
    if not isinstance(error.__cause__ or error, Occupied):
        raise InputError(sentence) from error
    if not fewer:
        raise InputError(
            f"{sentence.rstrip('.')}; or write fewer = true to leave out those who find no place."
        ) from error
    return sentence


def _first_place(
    room: Room, who: Somebody, fps: float, others: Sequence[Plan]
) -> Generator[float, None, Plan]:
    """Somebody who only stands or sits where he begins."""
    if who.start is None:
        return (
            yield from plan_tasks.steps(
                room, who.tasks[:1], seed=who.seed, height=who.height, fps=fps, others=others
            )
        )

    spot = yield from _start_of(room, who, others)
    heading = facing(_middle(room) - spot) if who.heading is None else np.radians(who.heading)
    radius = APART * who.height / STATURE
    return Plan(
        fps=fps,
        path=RootPath(np.array([[*spot, room.floor]]), np.array([float(heading)])),
        targets=Targets({}, None, {}, ("FREE",)),
        timeline=(),
        holds=(Hold(spot, radius, 0.0, np.inf),),
        scale=who.height / STATURE,
    )


def _planned(
    room: Room, who: Somebody, fps: float, first: Plan, others: Sequence[Plan]
) -> Generator[float, None, Plan]:
    start = None if who.start is None else first.path.position[0, :2].tolist()
    plan = yield from plan_tasks.steps(
        room,
        who.tasks,
        start=start,
        heading=float(np.degrees(first.path.yaw[0])) % 360.0,
        seed=who.seed,
        height=who.height,
        fps=fps,
        begins=who.begins,
        others=others,
    )
    if who.begins > 0.0:
        spot = plan.path.position[0, :2]
        waits = Hold(spot, APART * plan.scale, 0.0, who.begins)
        plan = replace(plan, holds=(waits, *plan.holds))
    return plan


def _start_of(
    room: Room, who: Somebody, others: Sequence[Plan]
) -> Generator[float, None, np.ndarray]:
    """Where (2,) somebody waits to begin: at the place that is named, or as near to it as others
    leave room.
    """
    assert who.start is not None
    if isinstance(who.start, str):
        thing = room.things(who.start)[0]
        middle = thing.box().mean(axis=0) if isinstance(thing, Piece) else np.asarray(thing)
    else:
        middle = np.array(who.start)

    # One behind the other, seen from the room: else who waits would bar the door.
    behind = -normalised(_middle(room) - middle[:2])
    queue = middle[:2] + _STEP * np.arange(_QUEUE)[:, None] * behind
    spots = np.concatenate([queue, *(_ring(middle[:2], k) for k in range(1, _RINGS))])
    spots = spots[(spots - middle[:2]) @ behind > -0.1]
    taken = np.array([plan.path.position[0, :2] for plan in others]).reshape(-1, 2)
    away = np.linalg.norm(spots[:, None] - taken, axis=2).min(axis=1, initial=np.inf)
    spots = spots[away > _STEP - 0.01]
    free = yield from has_room(room, spots, _SPACE)
    if not free.any():
        raise Occupied(
            f"There is no room to stand around the start ({_said(who.start)}); give another place, "
            "or send fewer people."
        )
    return np.asarray(spots[free][0])


def _said(start: tuple[float, ...] | str) -> str:
    return f"'{start}'" if isinstance(start, str) else f"{start[0]:g}, {start[1]:g}"


def _ring(middle: np.ndarray, k: int) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * np.pi, 6 * k, endpoint=False)
    return np.asarray(middle + k * _STEP * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def _middle(room: Room) -> np.ndarray:
    """(2,): of the furniture."""
    boxes = [piece.box() for piece in room.pieces().values()]
    return np.mean([box.mean(axis=0)[:2] for box in boxes] or [np.zeros(2)], axis=0)


def over_shot(plan: Plan, frames: int) -> Plan:
    """A plan that lasts all of a shot of so many ``frames``: before it begins and after its end one
    stays as one is.
    """
    first = round(plan.begins * plan.fps)
    rows = np.clip(np.arange(frames) - first, 0, len(plan) - 1)
    before = np.arange(frames) < first

    def held(values: np.ndarray) -> np.ndarray:
        return np.asarray(values[rows])

    targets = plan.targets
    return replace(
        plan,
        begins=0.0,
        path=RootPath(held(plan.path.position), held(plan.path.yaw)),
        targets=Targets(
            {name: held(places) for name, places in targets.places.items()},
            None if targets.looks is None else held(targets.looks),
            {
                name: np.where(before, 0.0, held(share))
                for name, share in targets.influences.items()
            },
            tuple(
                "FREE" if early else targets.mode[row]
                for early, row in zip(before, rows, strict=True)
            ),
        ),
        timeline=tuple(
            replace(
                entry, start=entry.start + first, there=entry.there + first, stop=entry.stop + first
            )
            for entry in plan.timeline
        ),
    )
