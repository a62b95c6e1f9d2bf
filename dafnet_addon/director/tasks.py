"""What a person can be asked to do: walk to, walk along, sit on, lie on, stand up, work at, write
on, reach, look at, wait.

Furniture and other things are named as in the scene. ``Chair.*`` is any of Chair, Chair.001,
Chair.002 …; ``Chair*`` all whose names begin so; a collection's name is anything in it. Where
several would do, ``choose`` takes the nearest one that is free, or a random one by the plan's seed.
Places are (x, y) on the floor or (x, y, z), world, metres. ``facing`` is in degrees, as an object's
rotation around z is, 0 towards +y, or the name of what one faces.
"""

from dataclasses import Field, dataclass, fields
from functools import partial
from typing import Any, get_args

import numpy as np

from ..core.checks import FARTHEST, array, inside, number
from ..core.errors import InputError
from ..core.take import LEANS
from ..core.text import nearest_known, printable

__all__ = [
    "VERBS",
    "LieOn",
    "LookAt",
    "Reach",
    "SitOn",
    "StandUp",
    "Task",
    "Wait",
    "WalkAlong",
    "WalkTo",
    "WorkAt",
    "WriteOn",
    "options",
    "said",
    "verb",
]

Point = tuple[float, ...]

_LONGEST = 3600.0  # seconds of one task
_FASTEST = 2.5  # metres a second, of walking
_SLOWEST = 0.4  # metres a second, of walking
_WORDS = {
    "choose": ("nearest", "random"),
    "hand": ("left", "right"),
    "how": ("typing", "writing", "handling"),
}
"""The words that an option may be."""


class _Checked:
    """A task whose options are checked when it is made; raises InputError for what cannot be."""

    def __post_init__(self) -> None:
        hold = partial(object.__setattr__, self)
        for option in options(type(self)):
            hold(option.name, _checked(self, option.name, getattr(self, option.name)))


@dataclass(frozen=True)
class WalkTo(_Checked):
    """Walk to ``where``, a place or something to stop before, and stand there, ``facing`` it or
    where one came to.
    """

    where: str | Point
    facing: float | str | None = None
    choose: str = "nearest"
    speed: float = 1.1


@dataclass(frozen=True)
class WalkAlong(_Checked):
    """Walk along a ``line``, a curve's name or points (x, y), to its end."""

    line: str | tuple[Point, ...]
    speed: float = 1.1


@dataclass(frozen=True)
class SitOn(_Checked):
    """Sit down ``on`` something for some ``seconds``.

    On a wide seat ``near`` is the place to sit by; ``facing`` counts on what has no back. ``lean``:
    degrees that the trunk leans back, more than by itself, until he sits down elsewhere.
    """

    on: str
    seconds: float = 3.0
    facing: float | str | None = None
    near: Point | None = None
    choose: str = "nearest"
    lean: float = 0.0


@dataclass(frozen=True)
class LieOn(_Checked):
    """Sit down ``on`` a bed or sofa, lie down, and stay so for some ``seconds``."""

    on: str
    seconds: float = 4.0
    choose: str = "nearest"


@dataclass(frozen=True)
class StandUp(_Checked):
    """Get up from where one sits or lies, and stand before it for some ``seconds``."""

    seconds: float = 0.5


@dataclass(frozen=True)
class WorkAt(_Checked):
    """Work ``at`` a desk, table or counter, ``how``: typing, writing or handling things.

    Who sits stays; who stands takes a free seat that stands at it, or works standing where it is
    high enough. ``hand`` is the one that writes.
    """

    at: str
    how: str = "typing"
    seconds: float = 6.0
    hand: str = "right"
    near: Point | None = None
    choose: str = "nearest"


@dataclass(frozen=True)
class WriteOn(_Checked):
    """Walk up to a board or wall and write ``on`` it; ``near`` is the place to write by."""

    on: str
    seconds: float = 5.0
    hand: str = "right"
    near: Point | None = None
    choose: str = "nearest"


@dataclass(frozen=True)
class Reach(_Checked):
    """Reach ``what``, a thing or a place, with a ``hand`` (None: the nearer one), and hold it there
    for some ``seconds``; who stands walks up to it.
    """

    what: str | Point
    seconds: float = 1.0
    hand: str | None = None
    choose: str = "nearest"


@dataclass(frozen=True)
class LookAt(_Checked):
    """Look at ``what``, a thing or a place, for some ``seconds``; who stands turns round to it."""

    what: str | Point
    seconds: float = 2.0
    choose: str = "nearest"


@dataclass(frozen=True)
class Wait(_Checked):
    """Go on standing, sitting or lying for some ``seconds``."""

    seconds: float = 2.0


Task = WalkTo | WalkAlong | SitOn | LieOn | StandUp | WorkAt | WriteOn | Reach | LookAt | Wait

VERBS: dict[str, type[Task]] = {
    "walk_to": WalkTo,
    "walk_along": WalkAlong,
    "sit_on": SitOn,
    "lie_on": LieOn,
    "stand_up": StandUp,
    "work_at": WorkAt,
    "write_on": WriteOn,
    "reach": Reach,
    "look_at": LookAt,
    "wait": Wait,
}
"""The tasks by the words that a file says."""

_VERB_OF: dict[type, str] = {kind: word for word, kind in VERBS.items()}
assert set(VERBS.values()) == set(get_args(Task))


def verb(task: Task) -> str:
    """The word for a task: "sit_on"."""
    return _VERB_OF[type(task)]


def options(kind: type) -> tuple[Field[Any], ...]:
    """What can be said of a kind of task; the first is what the verb is about."""
    return fields(kind)


def said(task: Task) -> str:
    """A task in words: "sit on Chair.*"."""
    about = getattr(task, options(type(task))[0].name)
    words = verb(task).replace("_", " ")
    if isinstance(about, str):
        return f"{words} {about}"
    if isinstance(task, StandUp):
        return words
    if isinstance(about, float):
        return f"{words} {about:g} s"
    if isinstance(task, WalkAlong):
        return f"{words} {len(about)} points"
    return f"{words} {_place_said(about)}"


def _place_said(place: Point) -> str:
    return f"({', '.join(f'{value:g}' for value in place)})"


def _checked(task: _Checked, option: str, value: object) -> object:
    """The value of an option; each option means the same in all tasks that have it."""
    what = f"The '{option}' of '{_VERB_OF[type(task)]}'"
    if option == "seconds":
        return number(value, what, 0.0, _LONGEST, "seconds")
    if option == "speed":
        return number(value, what, _SLOWEST, _FASTEST, "metres a second")
    if option == "lean":
        return number(value, what, *LEANS, "degrees")
    if option in _WORDS:
        if value is None and option == "hand" and isinstance(task, Reach):
            return None
        if value not in _WORDS[option]:
            hint = nearest_known(printable(value, 40), _WORDS[option])
            raise InputError(f"{what} is {_shown(value)}; {hint}")
        return value

    if value is None and option in ("facing", "near"):
        return None
    if option == "facing" and not isinstance(value, str):
        return number(value, what, -360.0, 360.0, "degrees, or the name of what is faced")
    if option == "line" and not isinstance(value, str):
        if isinstance(value, list | tuple | np.ndarray) and len(value) > 1:
            return tuple(_place(each, f"A point of {_lowered(what)}", (2, 3))[:2] for each in value)
        raise InputError(f"{what} is not a line; give at least two places, or a curve's name.")

    if option in ("where", "what", "near") and not isinstance(value, str):
        return _place(value, what, (3,) if option == "what" else (2, 3))

    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{what} is {_shown(value)}; give the name of something in the scene.")
    return value


def _place(value: object, what: str, sizes: tuple[int, ...]) -> Point:
    """A place in metres, of so many coordinates."""
    try:
        found = inside(array(value, what), what, FARTHEST)
    except InputError:
        found = np.zeros(0)
    if found.ndim != 1 or len(found) not in sizes:
        numbers = "three numbers" if 2 not in sizes else "two numbers"
        raise InputError(
            f"{what} is not a place; give {numbers} in metres, or a name in the scene."
        )
    return tuple(map(float, found))


def _lowered(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]


def _shown(value: object) -> str:
    return f"'{printable(value, 40)}'" if isinstance(value, str) else printable(value, 40)
