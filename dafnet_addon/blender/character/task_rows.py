"""The tasks of a character as the animator lists them (``Object.dafnet.tasks``), a row each."""

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    StringProperty,
)

from ...core.errors import InputError
from ...core.take import LEANS
from ...director.task_lists import tasks_from
from ...director.tasks import VERBS, Task, options
from ..overridable import LOCALLY, add_named

__all__ = ["LEAN", "TaskRow", "add_row", "fields_of", "tasks_of", "title_of"]

LEAN: dict[str, Any] = {
    "name": "Lean",
    "default": 0.0,
    "min": float(np.radians(LEANS[0])),
    "max": float(np.radians(LEANS[1])),
    "subtype": "ANGLE",
    "description": (
        "How far the trunk leans back while the character sits, more than by itself; forward below "
        "0. Hands that hold on to something stay there, and a chair's back is where it ends"
    ),
}
"""How far one leans: what Blender is told."""

_PLACES = ("where", "what")
"""What a verb may be about that may be a place as well as a thing."""


def _names(row: "TaskRow", context: bpy.types.Context, _typed: str) -> list[str]:
    """What can be named: objects and collections of the scene."""
    own = row.id_data
    objects = [o.name for o in context.scene.objects if o != own and o.parent != own]
    return sorted(objects) + sorted(c.name for c in context.scene.collection.children_recursive)


class TaskRow(bpy.types.PropertyGroup):
    """One task. Which of the properties count depends on the ``verb``: ``fields_of``."""

    verb: EnumProperty(
        override=LOCALLY,
        name="Verb",
        options=set(),
        default="SIT_ON",
        items=[
            ("WALK_TO", "Walk to", "Walk to a place or up to something, and stand there"),
            ("WALK_ALONG", "Walk along", "Walk along a curve to its end"),
            ("SIT_ON", "Sit on", "Sit down on a seat"),
            ("LIE_ON", "Lie on", "Lie down on a bed or sofa"),
            ("STAND_UP", "Stand Up", "Get up from where one sits or lies"),
            ("WORK_AT", "Work at", "Work at a desk, table or counter"),
            ("WRITE_ON", "Write on", "Write on a board or wall"),
            ("REACH", "Reach", "Reach for something with a hand"),
            ("LOOK_AT", "Look at", "Look at something"),
            ("WAIT", "Wait", "Stay as one is"),
        ],
    )
    about: StringProperty(
        override=LOCALLY,
        name="Thing",
        options=set(),
        search=_names,
        description=(
            "An object or a collection. Chair.* is any of Chair, Chair.001 …; *board all whose "
            "names end so"
        ),
    )
    at_place: BoolProperty(
        override=LOCALLY,
        name="At a Place",
        options=set(),
        description="A place counts: where to go, or where on a wide seat, top or board",
    )
    place: FloatVectorProperty(
        override=LOCALLY,
        name="Place",
        options=set(),
        subtype="TRANSLATION",
        description="In the world",
    )
    seconds: FloatProperty(
        override=LOCALLY,
        name="Seconds",
        options=set(),
        default=3.0,
        min=0.0,
        max=3600.0,
        description="How long it takes, once one is there",
    )
    speed: FloatProperty(
        override=LOCALLY,
        name="Speed",
        options=set(),
        default=1.1,
        min=0.4,
        max=2.5,
        description="Walking speed, in metres per second",
    )
    lean: FloatProperty(override=LOCALLY, options=set(), **LEAN)
    turned: BoolProperty(
        override=LOCALLY,
        name="Facing",
        options=set(),
        description="Face something, or in a direction",
    )
    facing: FloatProperty(
        override=LOCALLY,
        name="Direction",
        options=set(),
        subtype="ANGLE",
        min=-2.0 * np.pi,
        max=2.0 * np.pi,
        description="0 looks along +Y, counter-clockwise seen from above",
    )
    faced: StringProperty(
        override=LOCALLY,
        name="Faced",
        options=set(),
        search=_names,
        description="What is faced; leave it empty to give a direction",
    )
    choose: EnumProperty(
        override=LOCALLY,
        name="Choose",
        options=set(),
        items=[
            ("NEAREST", "Nearest", "The nearest one that is free and can be reached"),
            ("RANDOM", "At Random", "Any, by the character's seed"),
        ],
    )
    how: EnumProperty(
        override=LOCALLY,
        name="How",
        options=set(),
        items=[
            ("TYPING", "Typing", "Both hands type"),
            ("WRITING", "Writing", "One hand writes, the other lies beside"),
            ("HANDLING", "Handling", "Both hands handle things"),
        ],
    )
    hand: EnumProperty(
        override=LOCALLY,
        name="Hand",
        options=set(),
        items=[
            ("EITHER", "Either", "The nearer one to reach, the right one to write"),
            ("LEFT", "Left", "The left one"),
            ("RIGHT", "Right", "The right one"),
        ],
    )


def add_row(character: bpy.types.Object, verb: str) -> None:
    """Add a task after the chosen one, as long as such a task takes by default; it is chosen."""
    own = character.dafnet
    row = add_named(own.tasks)
    row.verb = verb
    defaults = {option.name: option.default for option in options(VERBS[verb.lower()])}
    row.seconds = float(defaults.get("seconds", row.seconds))
    at = min(own.active_task + 1, len(own.tasks) - 1)
    own.tasks.move(len(own.tasks) - 1, at)
    own.active_task = at


def fields_of(row: TaskRow) -> tuple[str, ...]:
    """The properties that count for a row's verb, in the order in which they are shown."""
    names = [option.name for option in options(VERBS[row.verb.lower()])]
    about, *others = names
    found = [] if about == "seconds" else ["about"]
    if about in _PLACES or "near" in others:
        found += ["at_place", *(["place"] if row.at_place else [])]
    if "facing" in others:
        found += ["turned"]
        if row.turned:
            found += ["faced", *([] if row.faced else ["facing"])]
    shown = ("seconds", "speed", "lean", "choose", "how", "hand")
    return (*found, *(name for name in shown if name in names))


def title_of(row: TaskRow) -> str:
    """A row in words, such as "Sit on Chair"."""
    verb = row.bl_rna.properties["verb"].enum_items[row.verb].name
    return f"{verb} {row.about}" if "about" in fields_of(row) and row.about else str(verb)


def tasks_of(character: bpy.types.Object, unit: float) -> tuple[Task, ...]:
    """The tasks in a character's list; ``unit``: metres of a Blender unit. ``InputError``, which
    names the task, where something is missing.
    """
    rows = character.dafnet.tasks
    if not len(rows):
        raise InputError(f"'{character.name}' has no tasks; add some to its list.")
    return tasks_from([dict(_said(row, unit)) for row in rows], f"'{character.name}':")


def _said(row: TaskRow, unit: float) -> Iterator[tuple[str, Any]]:
    """What a row says as words of a file."""
    verb = row.verb.lower()
    about, *others = (option.name for option in options(VERBS[verb]))
    place = [float(value) * unit for value in row.place]
    if about == "seconds":
        yield verb, row.seconds
    elif about in _PLACES and row.at_place:
        yield verb, place
    else:
        yield verb, row.about

    for name in others:
        if name == "near" and row.at_place:
            yield name, place
        elif name == "facing" and row.turned:
            yield name, row.faced or round(float(np.degrees(row.facing)), 4)
        elif name == "hand" and row.hand != "EITHER":
            yield name, row.hand.lower()
        elif name == "lean":
            yield name, round(float(np.degrees(row.lean)), 4)
        elif name in ("choose", "how"):
            yield name, getattr(row, name).lower()
        elif name in ("seconds", "speed"):
            yield name, round(getattr(row, name), 4)  # Blender keeps single precision
