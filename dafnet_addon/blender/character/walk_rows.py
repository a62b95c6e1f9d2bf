"""The walks that a character's root was keyed for (``Object.dafnet.walks``), a row each: what was
asked for, in which frames it is, and what tells its keys from edited ones.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.paths import GETS_UP, SITS_DOWN
from ...core.trails import FASTEST, SLOWEST
from ..overridable import LOCALLY, ROWS_LOCALLY

__all__ = [
    "BED",
    "CURVE",
    "GROUPS",
    "MANNER",
    "OBJECT",
    "PLACE",
    "POINTS",
    "SEAT",
    "Asked",
    "Manner",
    "WalkRow",
    "asked_in",
    "fields_of_walk",
    "manner_counts",
    "manner_of",
    "set_manner",
    "title_of_walk",
]

SEAT, BED, PLACE, CURVE, POINTS, OBJECT = "SEAT", "BED", "PLACE", "CURVE", "POINTS", "OBJECT"
"""The kinds of walks: to a seat, to a bed to lie on, to a place, along a curve, through points, as
an object moves.
"""

MANNER: dict[str, dict[str, Any]] = {
    "speed": {
        "name": "Speed",
        "default": 1.1,
        "min": SLOWEST,
        "max": FASTEST,
        "description": "Walking speed, in metres per second for a body of 1.75 m",
    },
    "seconds": {
        "name": "Stay",
        "default": 3.0,
        "min": 0.0,
        "max": 600.0,
        "subtype": "TIME_ABSOLUTE",
        "description": "How long it stays where the walk ends, in seconds",
    },
    "sits_down": {
        "name": "Sitting Down",
        "default": SITS_DOWN,
        "min": 0.3,
        "max": 10.0,
        "soft_max": 4.0,
        "subtype": "TIME_ABSOLUTE",
        "description": "Seconds that most of the way down onto the seat takes",
    },
    "gets_up": {
        "name": "Getting Up",
        "default": GETS_UP,
        "min": 0.3,
        "max": 10.0,
        "soft_max": 4.0,
        "subtype": "TIME_ABSOLUTE",
        "description": "Seconds that most of the way up takes, where the walk begins on a seat",
    },
}
"""How one walks, sits down and gets up: of each property what Blender is told."""


@dataclass(frozen=True)
class Manner:
    """How a walk is gone: ``speed`` in metres a second for a body of 1.75 m, ``seconds`` of staying
    at its end, ``sits_down`` and ``gets_up``: see ``core.paths.Stop``.
    """

    speed: float = 1.1
    seconds: float = 3.0
    sits_down: float = SITS_DOWN
    gets_up: float = GETS_UP


@dataclass(frozen=True)
class Asked:
    """What a walk was asked for. ``goal``: the ``name_full`` of the seat, bed, curve or moving
    object, "" for none; ``points``: those of the empties on the way; ``place`` (3,), Blender units:
    where it ends, or where on the seat, in the seat's own space; None where that is left open.
    ``by_keys``: whether the seat is pulled out by keys of its own.
    """

    kind: str
    manner: Manner
    goal: str = ""
    points: tuple[str, ...] = ()
    place: tuple[float, float, float] | None = None
    tables: bool = False
    pull_out: bool = False
    by_keys: bool = False
    keep_facing: bool = False
    backwards: bool = False


class WalkPoint(bpy.types.PropertyGroup):
    """An empty on the way of a walk."""

    point: PointerProperty(override=LOCALLY, type=bpy.types.Object, options=set())


class WalkRow(bpy.types.PropertyGroup):
    """One walk. Which of the properties count depends on the ``kind``: ``fields_of_walk``."""

    kind: EnumProperty(
        override=LOCALLY,
        name="Kind",
        options={"HIDDEN"},
        items=[
            (SEAT, "Sit on", "To a seat"),
            (BED, "Lie on", "To a bed, to lie down on it"),
            (PLACE, "Walk to", "To a place"),
            (CURVE, "Walk along", "Along a curve"),
            (POINTS, "Walk through", "Through points"),
            (OBJECT, "Root from", "As an object moves"),
        ],
    )
    goal: PointerProperty(
        override=LOCALLY,
        name="Goal",
        type=bpy.types.Object,
        options=set(),
        description="The seat, the curve or the moving object that the walk was made for",
    )
    points: CollectionProperty(override=ROWS_LOCALLY, type=WalkPoint, options={"HIDDEN"})
    placed: BoolProperty(override=LOCALLY, options={"HIDDEN"})
    place: FloatVectorProperty(
        override=LOCALLY,
        name="Place",
        options=set(),
        subtype="TRANSLATION",
        description="Where the walk ends, in the world",
    )
    speed: FloatProperty(override=LOCALLY, options=set(), **MANNER["speed"])
    seconds: FloatProperty(override=LOCALLY, options=set(), **MANNER["seconds"])
    sits_down: FloatProperty(override=LOCALLY, options=set(), **MANNER["sits_down"])
    gets_up: FloatProperty(override=LOCALLY, options=set(), **MANNER["gets_up"])
    tables: BoolProperty(override=LOCALLY, options={"HIDDEN"})
    pull_out: BoolProperty(override=LOCALLY, options={"HIDDEN"})
    by_keys: BoolProperty(override=LOCALLY, options={"HIDDEN"})
    keep_facing: BoolProperty(override=LOCALLY, options={"HIDDEN"})
    backwards: BoolProperty(override=LOCALLY, options={"HIDDEN"})
    first: IntProperty(override=LOCALLY, options={"HIDDEN"})
    last: IntProperty(override=LOCALLY, options={"HIDDEN"})
    digest: StringProperty(override=LOCALLY, options={"HIDDEN"})


GROUPS = (WalkPoint, WalkRow)
"""In the order in which Blender is told of them."""


def manner_of(owner: Any) -> Manner:
    """What the properties of a row, an operator or a character's settings say."""
    return Manner(**{name: float(getattr(owner, name)) for name in MANNER})


def set_manner(owner: Any, manner: Manner, names: Iterable[str] = tuple(MANNER)) -> None:
    """Let a row, or a character's settings, say this, or those of the ``names`` of it."""
    for name in names:
        setattr(owner, name, getattr(manner, name))


def manner_counts(row: WalkRow) -> tuple[str, ...]:
    """What of the manner counts for a row's kind."""
    walks = ("speed", "seconds", "gets_up")
    return {SEAT: tuple(MANNER), BED: ("seconds",), OBJECT: ()}.get(row.kind, walks)


def fields_of_walk(row: WalkRow) -> tuple[str, ...]:
    """The properties that say where a row's walk leads, in the order in which they are shown."""
    return {PLACE: ("place",), POINTS: ()}.get(row.kind, ("goal",))


def title_of_walk(row: WalkRow) -> str:
    """A row in words, such as "Sit on Chair"."""
    does = row.bl_rna.properties["kind"].enum_items[row.kind].name
    if row.kind == PLACE:
        return f"{does} {row.place[0]:.1f}, {row.place[1]:.1f}"
    if row.kind == POINTS:
        return f"{does} {len(row.points) + row.placed} points"
    return f"{does} {row.goal.name if row.goal else '?'}"


def asked_in(row: WalkRow) -> Asked:
    """What a row asks for; a goal that is gone has the name ""."""
    return Asked(
        kind=row.kind,
        manner=manner_of(row),
        goal=row.goal.name_full if row.goal else "",
        points=tuple(each.point.name_full if each.point else "" for each in row.points),
        place=tuple(float(value) for value in row.place) if row.placed else None,  # type: ignore[arg-type]
        tables=row.tables,
        pull_out=row.pull_out,
        by_keys=row.by_keys,
        keep_facing=row.keep_facing,
        backwards=row.backwards,
    )
