"""A shot: a room, the people in it with what they do, a seed, takes, and what is delivered of it.

A file says it in TOML or JSON:

    room = "cafe"
    seed = 1

    [[people]]
    count = 8
    height = [1.55, 1.90]
    tasks = [{ sit_on = "Chair.*", choose = "random", seconds = 5 }]

``drawn`` makes one person after another of it, by the seed: what is drawn for somebody does not
depend on the groups and the people after him.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..core.checks import FARTHEST, MAX_SEED, array, inside, number, whole
from ..core.errors import InputError
from ..core.skeleton import STATURE
from ..core.tables import require_known
from ..core.text import printable
from ..core.wishes import Wishes
from .task_lists import tasks_from
from .tasks import Task

__all__ = ["MAX_PEOPLE", "MAX_TAKES", "People", "Shot", "Somebody", "drawn", "shot_of"]

MAX_PEOPLE = 1000
MAX_TAKES = 64

_SMALLEST = 0.5  # metres tall
_TALLEST = 3.0  # metres tall
_LATEST = 3600.0  # seconds
_HOTTEST = 10.0
_LIVELY = 1.0
"""Temperature where none is said: people who all sit calmly would all sit alike."""

Span = tuple[float, float]
"""From and to, between which a number is drawn."""


@dataclass(frozen=True)
class People:
    """Some people who do the like.

    ``count`` of them, each of a ``height`` in metres, beginning at a second of the shot
    (``begins``), drawn from these spans. ``start``: a place (x, y), the name of a thing, or None:
    where the first task is done. ``heading``: degrees, None for towards the furniture. Each does
    one of the lists of ``tasks``, drawn by their ``shares``. ``character``: the armature in the
    room's file that is meant, else they are made, or taken from the cast; without tasks it goes the
    way that its own root goes. ``name``: what they are called, with a number behind it where they
    are several.
    """

    count: int = 1
    name: str = "Person"
    height: Span = (STATURE, STATURE)
    begins: Span = (0.0, 0.0)
    start: tuple[float, ...] | str | None = None
    heading: float | None = None
    tasks: tuple[tuple[Task, ...], ...] = ()
    shares: tuple[float, ...] = ()
    character: str | None = None


@dataclass(frozen=True)
class Shot:
    """What ``populate`` makes.

    ``room``: a name of ours or a path; ``people``, groups of them; ``cast``: paths of files with
    users' own characters, drawn for those who are not named; ``seconds``: how long it is, None for
    as long as the tasks take; ``takes`` of everybody, at a ``temperature``; ``fewer``: whether
    those are left out for whom there is no place; ``wishes``: what is delivered besides. Paths are
    relative to ``folder``. ``words``: the plain data that it was read from.
    """

    room: str
    people: tuple[People, ...]
    seed: int = 0
    seconds: float | None = None
    takes: int = 1
    temperature: float = _LIVELY
    cast: tuple[str, ...] = ()
    fewer: bool = False
    wishes: Wishes = field(default_factory=Wishes)
    folder: Path = Path()
    words: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def path(self, name: str) -> Path:
        """That of a file or folder that the shot names."""
        return self.folder / Path(name).expanduser()


@dataclass(frozen=True)
class Somebody:
    """One person of a shot, drawn: see ``People``. ``seed``: of what he chooses; ``cast``: the path
    of his file, None for the project's mannequin.
    """

    name: str
    seed: int
    height: float
    begins: float
    start: tuple[float, ...] | str | None
    heading: float | None
    tasks: tuple[Task, ...]
    character: str | None
    cast: str | None
    take_seeds: tuple[int, ...]


_WISHED = tuple(each.name for each in fields(Wishes) if each.name != "rig")
_OWN = ("room", "seed", "seconds", "takes", "temperature", "cast", "people", "fewer")


def shot_of(data: Mapping[str, Any], folder: Path = Path()) -> Shot:
    """The shot that tables say, as a file holds them; paths in it are relative to ``folder``.

    Raises InputError, which names the word and the nearest one that is known, for what cannot be.
    """
    if "rig" in data:
        raise InputError(
            "The shot has a 'rig', which is for one character alone; name the rig's file in the "
            'cast: [cast] files = ["hero.blend"].'
        )
    said = require_known(data, (*_OWN, *_WISHED), "The shot")
    room = said.get("room")
    if not isinstance(room, str) or not room.strip():
        raise InputError(
            'The shot has no room; write room = "cafe", or the path of a .blend, a .glb or a '
            "folder of pieces."
        )

    groups = said.get("people")
    if not isinstance(groups, list | tuple) or not groups:
        raise InputError("The shot has no people; write [[people]] and what they do under it.")

    several = len(groups) > 1
    people = tuple(
        _people(each, f"Group {k} of the people" if several else "A group of people")
        for k, each in enumerate(groups, 1)
    )
    total = sum(each.count for each in people)
    if total > MAX_PEOPLE:
        raise InputError(f"The shot has {total:,} people; {MAX_PEOPLE:,} are the most in one.")

    seconds = said.get("seconds")
    fewer = said.get("fewer", False)
    if not isinstance(fewer, bool):
        raise InputError(f"'fewer' is {_shown(fewer)}; write true or false.")
    return Shot(
        room=room,
        people=people,
        seed=whole(said.get("seed", 0), "The seed", 0, MAX_SEED),
        seconds=None if seconds is None else number(seconds, "'seconds'", 0.1, _LATEST, "seconds"),
        takes=whole(said.get("takes", 1), "The number of takes", 1, MAX_TAKES),
        temperature=number(said.get("temperature", _LIVELY), "The temperature", 0.0, _HOTTEST),
        cast=_cast(said.get("cast", {})),
        fewer=fewer,
        wishes=Wishes(**{word: said[word] for word in _WISHED if word in said}),
        folder=folder,
        words=said,
    )


def _cast(data: object) -> tuple[str, ...]:
    files = require_known(data, ["files"], "The cast").get("files", [])
    files = [files] if isinstance(files, str) else files
    if not isinstance(files, list | tuple) or not all(isinstance(each, str) for each in files):
        raise InputError('The files of the cast are not paths; write files = ["hero.blend"].')
    return tuple(files)


def _people(data: object, which: str) -> People:
    known = tuple(each.name for each in fields(People))
    said = require_known(data, known, which)
    name, character = said.get("name"), said.get("character")
    for word, value in (("name", name), ("character", character)):
        if value is not None and (not isinstance(value, str) or not value.strip()):
            raise InputError(f"{which} has a {word} that is {_shown(value)}; give a word.")

    of = partial(_span, whose=which)
    tasks = _task_lists(said.get("tasks"), which)
    if not tasks and character is None:
        raise InputError(
            f"{which} has no tasks; write them like "
            'tasks = [{ sit_on = "Chair.*", seconds = 4 }].'
        )

    count = whole(said.get("count", 1), f"{which} has a count that", 1, MAX_PEOPLE)
    if character is not None and count != 1:
        raise InputError(
            f"{which} is the character '{printable(character, 40)}' {count} times; leave the count "
            "out, or make a file of the cast of it."
        )
    if character is not None and "height" in said:
        raise InputError(
            f"{which} is the character '{printable(character, 40)}', who has a height already; "
            "leave the height out."
        )

    return People(
        count=count,
        name=name or character or "Person",
        height=of(said.get("height", STATURE), "height", _SMALLEST, _TALLEST, "metres"),
        begins=of(said.get("begins", 0.0), "begins", 0.0, _LATEST, "seconds"),
        start=_start(said.get("start"), which),
        heading=_heading(said.get("heading"), which),
        tasks=tasks,
        shares=_shares(said.get("shares"), len(tasks), which),
        character=character,
    )


def _span(
    value: object, word: str, low: float, high: float, unit: str, *, whose: str
) -> tuple[float, float]:
    """A number, or two of which a number between is drawn."""
    ends = value if isinstance(value, list | tuple) else [value, value]
    if len(ends) != 2:
        raise InputError(
            f"{whose} has a '{word}' of {len(ends)} numbers; give one, or two to draw from."
        )
    first, last = (number(end, f"{whose} has a '{word}' that", low, high, unit) for end in ends)
    if first > last:
        raise InputError(
            f"{whose} has a '{word}' from {first:g} to {last:g}; put the smaller number first."
        )
    return first, last


def _start(value: object, which: str) -> tuple[float, ...] | str | None:
    if value is None or (isinstance(value, str) and value.strip()):
        return value
    try:
        place = inside(array(value, "start"), "start", FARTHEST)
    except InputError:
        place = np.zeros(0)
    if place.shape not in ((2,), (3,)):
        raise InputError(
            f"{which} has a start that is not a place; give two numbers in metres, or the name of "
            "a thing."
        )
    return tuple(map(float, place[:2]))


def _heading(value: object, which: str) -> float | None:
    if value is None:
        return None
    return number(value, f"{which} has a heading that", -360.0, 360.0, "degrees")


def _task_lists(value: object, which: str) -> tuple[tuple[Task, ...], ...]:
    """One list of tasks, or several to draw from."""
    if value is None:
        return ()
    if isinstance(value, list | tuple) and value and isinstance(value[0], list | tuple):
        return tuple(
            tasks_from(each, f"{which}, list {k} of tasks,") for k, each in enumerate(value, 1)
        )
    return (tasks_from(value, f"{which},"),)


def _shares(value: object, lists: int, which: str) -> tuple[float, ...]:
    """How often each list of tasks is drawn; equally often where nothing is said."""
    if value is None:
        return (1.0,) * lists
    if not isinstance(value, list | tuple) or len(value) != lists:
        raise InputError(
            f"{which} has {lists} lists of tasks, but not as many shares; give one number for each "
            "list."
        )
    shares = tuple(number(each, f"{which} has a share that", 0.0, 1e6) for each in value)
    if not sum(shares) > 0.0:
        raise InputError(f"{which} has shares that are all 0; give one that is not.")
    return shares


def drawn(shot: Shot) -> tuple[Somebody, ...]:
    """Everybody in a shot, in the order in which they are named.

    >>> shot = shot_of({
    ...     "room": "cafe", "people": [{"count": 2, "height": [1.5, 1.9],
    ...     "tasks": [{"sit_on": "Chair.*"}]}]})
    >>> [somebody.name for somebody in drawn(shot)]
    ['Person 1', 'Person 2']
    """
    names = _names(shot.people)
    found = []
    for g, group in enumerate(shot.people):
        for k in range(group.count):
            rng = np.random.default_rng([shot.seed, g, k])
            height, begins = (float(rng.uniform(*span)) for span in (group.height, group.begins))
            shares = np.array(group.shares)
            which = int(rng.choice(len(shares), p=shares / shares.sum())) if len(shares) else 0
            cast = shot.cast[int(rng.integers(len(shot.cast)))] if shot.cast else None
            found.append(
                Somebody(
                    name=names[g] if group.count == 1 else f"{names[g]} {k + 1}",
                    seed=int(rng.integers(MAX_SEED)),
                    # in steps of 2.5 cm, so that what is found out for a size serves several
                    height=round(round(height * 40.0) / 40.0, 3),
                    begins=round(begins, 3),
                    start=group.start,
                    heading=group.heading,
                    tasks=group.tasks[which] if group.tasks else (),
                    character=group.character,
                    cast=None if group.character else cast,
                    take_seeds=tuple(_seed(shot.seed, g, k, take) for take in range(shot.takes)),
                )
            )
    return tuple(found)


def _names(groups: Sequence[People]) -> list[str]:
    """Of each group, made different where several have the same."""
    names, used = [], set()
    for group in groups:
        name, k = group.name, 1
        while name in used:
            k += 1
            name = f"{group.name} {chr(ord('A') + k - 1) if k <= 26 else k}"
        used.add(name)
        names.append(name)
    return names


def _seed(*numbers: int) -> int:
    """A take's seed, by the shot, the group, the person in it and the take."""
    return int(np.random.SeedSequence(numbers).generate_state(1)[0]) % MAX_SEED


def _shown(value: object) -> str:
    return f"'{printable(value, 40)}'" if isinstance(value, str) else printable(value, 40)
