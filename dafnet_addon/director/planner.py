"""From tasks to what a character is generated from: its root's path, hands, head and modes, with
times.

A plan is made for one person after another: those before are walked round and waited for, and keep
their places. All within is in the canonical body's metres; what comes in and goes out is in the
world's.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any

import numpy as np

from ..core.checks import FARTHEST, MAX_FRAMES, MAX_SEED, array, inside, number, whole
from ..core.errors import InputError
from ..core.progress import stepwise, within
from ..core.root import RootPath
from ..core.series import MODEL_FPS
from ..core.skeleton import STATURE
from .choosing import Chooser, Done, Job, Taken
from .handwork import look_at, reach, work_at, write_on
from .moves import lie_on, sit_on, stand_up, wait, walk_along, walk_to
from .others import Others
from .person import Person
from .plans import Entry, Plan
from .room import Room
from .tasks import (
    LieOn,
    LookAt,
    Reach,
    SitOn,
    StandUp,
    Task,
    Wait,
    WalkAlong,
    WalkTo,
    WorkAt,
    WriteOn,
    said,
)

__all__ = ["plan_tasks"]

_DOING: dict[type, Callable[[Chooser, Any], Job[Done]]] = {
    WalkTo: walk_to,
    WalkAlong: walk_along,
    SitOn: sit_on,
    LieOn: lie_on,
    StandUp: stand_up,
    WorkAt: work_at,
    WriteOn: write_on,
    Reach: reach,
    LookAt: look_at,
    Wait: wait,
}


@stepwise
def plan_tasks(
    room: Room,
    tasks: Sequence[Task],
    *,
    start: Sequence[float] | None = None,
    heading: float = 0.0,
    seed: int = 0,
    height: float = STATURE,
    fps: float = MODEL_FPS,
    begins: float = 0.0,
    others: Sequence[Plan] = (),
) -> Generator[float, None, Plan]:
    """Plan what somebody of some ``height`` does in a room, task by task.

    ``start`` (x, y): where he stands at first, looking to the ``heading`` in degrees; None: he is
    where his first task is done, and sits there already for example. ``others``: plans of those who
    were there first; ``begins``: second of the shot in which he begins. The same arguments give the
    same plan. A job: ``plan_tasks.steps`` yields progress. Raises InputError, which names the task,
    where it cannot be done: nothing of that name, no free seat, no way, out of reach, an order that
    makes no sense.

    >>> from dafnet_addon import Box
    >>> from dafnet_addon.director.tasks import SitOn, StandUp
    >>> stool = Box([0.0, 0.0, 0.225], [0.2, 0.2, 0.225], name="Stool")
    >>> plan = plan_tasks(Room([stool]), [SitOn("Stool", seconds=3), StandUp()], start=(0.0, 2.0))
    >>> sits = plan.timeline[0]
    >>> sits.seat, (sits.stop - sits.there) / plan.fps
    ('Stool', 3.0)
    """
    if not tasks:
        raise InputError("There are no tasks; give at least one, such as SitOn.")
    seed = whole(seed, "The seed", 0, MAX_SEED)
    size = number(height, "The height", 0.5, 3.0, "metres") / STATURE
    fps = number(fps, "The frame rate", 1.0, 1000.0, "frames a second")
    begins = number(begins, "The second in which the plan begins", 0.0, 1e6)
    heading = number(heading, "The heading", -360.0, 360.0, "degrees")
    own = room.resized(1.0 / size)
    person = Person(own, fps, size, begins, Others(others, fps, size, own.floor))
    if start is not None:
        place = inside(array(start, "The start"), "The start", FARTHEST)
        if place.shape not in ((2,), (3,)):
            raise InputError("The start is not a place; give x and y in metres.")
        person.appear(place[:2] / size, np.radians(heading))

    chooser, entries = Chooser(person, np.random.default_rng(seed)), []
    for k, task in enumerate(tasks):
        first = person.frames
        try:
            done = yield from within(_do(chooser, task), k / len(tasks), (k + 1) / len(tasks))
        except InputError as error:
            raise InputError(f"Task {k + 1}, '{said(task)}': {error}") from error
        if person.frames > MAX_FRAMES:
            raise InputError("The tasks take longer than a shot may last; plan fewer at once.")
        entries.append(Entry(task, first, done.there, person.frames, done.furniture, done.seat))

    path = person.here.path()
    return Plan(
        fps=fps,
        path=RootPath(path.position * size, path.yaw),
        targets=person.here.targets(size),
        timeline=tuple(entries),
        holds=tuple(person.holds),
        scale=size,
        begins=begins,
        warnings=(*chooser.warnings, *_misread(room, entries)),
    )


def _misread(room: Room, entries: Sequence[Entry]) -> Iterator[str]:
    """Sentences about seats that are sat on as they are shaped, since what they say is wrong."""
    for name in dict.fromkeys(each.seat for each in entries):
        if name in room.misread:
            yield f"{room.misread[name]} Until then it is sat on as it is shaped."


def _do(chooser: Chooser, task: Task) -> Job[Done]:
    """A task, with what is free, or else with what others leave soon."""
    try:
        return (yield from within(_DOING[type(task)](chooser, task), 0.0, 0.5))
    except Taken:
        chooser.person.waits = True
        try:
            return (yield from within(_DOING[type(task)](chooser, task), 0.5, 1.0))
        finally:
            chooser.person.waits = False
