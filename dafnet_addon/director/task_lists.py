"""Tasks from and to plain data, as TOML and JSON files and Blender's properties hold them.

A task is a table whose one verb says what is done, and to what; the other words are its options:

    tasks = [
        { walk_to = [1.5, -2.0] },
        { sit_on = "Chair.*", seconds = 4 },
        { stand_up = 1 },
    ]
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.tables import read_tables, require_known
from ..core.text import nearest_known, printable
from .tasks import VERBS, Task, options, verb

__all__ = ["plain_tasks", "read_task_file", "tasks_from"]


def tasks_from(data: object, whose: str = "") -> tuple[Task, ...]:
    """The tasks that a list of tables says; ``whose``: words before "Task 2" in a refusal.

    >>> tasks_from([{"sit_on": "Chair.*", "seconds": 4}, {"stand_up": 1}])[0].seconds
    4.0

    Raises InputError, which names the task and the nearest word that is known, for what is not one.
    """
    if not isinstance(data, list | tuple) or not data:
        raise InputError(
            f"{whose or 'The tasks'} are not a list of tables; write them like "
            '[{ sit_on = "Chair", seconds = 4 }].'
        )
    return tuple(_task(each, f"{whose} task {k}".strip()) for k, each in enumerate(data, 1))


def _task(data: object, which: str) -> Task:
    which = which[0].upper() + which[1:]
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise InputError(
            f'{which} is not a table with a verb; write it like {{ sit_on = "Chair" }}.'
        )

    verbs = [key for key in data if key in VERBS]
    if len(verbs) > 1:
        raise InputError(
            f"{which} says both '{verbs[0]}' and '{verbs[1]}'; make two tasks of it, one after the "
            "other."
        )
    if not verbs:
        unknown = printable(next(iter(data), ""), 40)
        raise InputError(
            f"{which} does not say what is to be done with '{unknown}'; "
            f"{nearest_known(unknown, VERBS)}"
        )

    kind, (word,) = VERBS[verbs[0]], verbs
    about, *others = (option.name for option in options(kind))
    for key in data:
        if key != word and key not in others:
            raise InputError(
                f"{which}, '{word}', does not know '{printable(key, 40)}'; "
                f"{nearest_known(key, others)}"
            )

    given: dict[str, Any] = {about if key == word else key: data[key] for key in data}
    try:
        return kind(**given)
    except InputError as error:
        raise InputError(f"{which} cannot be used: {_lowered(str(error))}") from error


def _lowered(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]


def plain_tasks(tasks: Sequence[Task]) -> list[dict[str, Any]]:
    """Tasks as ``tasks_from`` reads them; what is as it is by default is left out."""
    found = []
    for task in tasks:
        about, *others = options(type(task))
        said = {verb(task): _plain(getattr(task, about.name))}
        for option in others:
            value = getattr(task, option.name)
            if value != option.default:
                said[option.name] = _plain(value)
        found.append(said)
    return found


def _plain(value: object) -> object:
    return [_plain(each) for each in value] if isinstance(value, tuple) else value


def read_task_file(file: Path) -> tuple[Task, ...]:
    """The ``tasks`` of a TOML or JSON file, by its ending.

    Raises InputError where it cannot be read, is neither, or holds something else as well.
    """
    data = read_tables(file, "tasks")
    if "tasks" not in data:
        raise InputError(f"'{file}' has no 'tasks'; write them as a list of tables with that name.")
    require_known(data, ["tasks"], f"'{file}'")
    return tasks_from(data["tasks"])
