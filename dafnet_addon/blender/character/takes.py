"""A character's takes: actions that carry what they were made from, listed on the armature and kept
in the file.

An action's ``dafnet`` settings say how it was generated and how good it is. The motion before the
clean-up and the controls are packed into the action as well, so a take that is copied or appended
to another file keeps them.
"""

import bpy

from ...core.draws import Draw
from ...core.errors import InputError
from ...core.storage import packed, unpacked
from ...core.take import Controls, Take
from ..compat import assign_action
from ..overridable import add_named, rows_of_library
from .nla_modes import require_no_tweak_mode

__all__ = [
    "PACKED",
    "active_take",
    "add_take",
    "draw_of",
    "drop_take",
    "frames_of",
    "play_take",
    "played_take",
    "stored_take",
    "takes_of",
]

PACKED = "dafnet_take"
"""The custom property of an action that holds its take."""

_STATURE = 1.7
"""Metres by which ``end_effector_error`` is divided, so that it does not depend on size."""
_METRICS = {
    "sliding": ("foot_sliding_per_frame", 1.0),
    "collisions": ("bad_collisions_per_frame", 1.0),
    "jerk": ("jerk", 1.0),
    "slide_cm": ("slide_max", 100.0),
    "touching": ("bad_collision_seconds", 1.0),
    "miss_cm": ("end_effector_error", 100.0 * _STATURE),
}
"""The metrics of a take by the names of an action's settings, and by what each is multiplied."""
_LENGTHS = {"jerk", "slide_cm", "miss_cm"}
"""Those that grow with the character: a take's metrics are those of the canonical body."""
_unpacked: dict[int, tuple[int, tuple[Take, Controls]]] = {}
"""The take unpacked last, by its action's pointer, with a hash of what was unpacked."""


def add_take(
    armature: bpy.types.Object,
    action: bpy.types.Action,
    take: Take,
    controls: Controls,
    frame_start: int,
    whole: bool = True,
) -> None:
    """Pack into ``action`` what it was made from, and list it as the armature's active take.
    ``whole``: whether its draw alone makes it again.
    """
    action[PACKED] = packed(take, controls)
    facts, draw = action.dafnet, take.draw
    facts.frame_start = frame_start
    facts.seed, facts.temperature = draw.seed, draw.temperature
    facts.lower_seed = draw.seed if draw.lower_seed is None else draw.lower_seed
    facts.lower_temperature = (
        draw.temperature if draw.lower_temperature is None else draw.lower_temperature
    )
    facts.held, facts.whole = draw.held, whole
    facts.log_likelihood = take.log_likelihood
    for prefix, metrics in (("", take.metrics), ("raw_", take.raw_metrics)):
        for name, (metric, factor) in _METRICS.items():
            value = metrics.get(metric)
            size = take.scale if name in _LENGTHS else 1.0
            setattr(facts, prefix + name, -1.0 if value is None else value * factor * size)

    facts.verdict.clear()
    for finding in take.verdict:
        row = facts.verdict.add()
        row.word, row.text, row.good = finding.word, finding.text, finding.good

    own = armature.dafnet
    add_named(own.takes).action = action
    own.active_take = len(own.takes) - 1


def draw_of(action: bpy.types.Action) -> Draw:
    """What the take was drawn with."""
    facts = action.dafnet
    return Draw(
        seed=facts.seed,
        lower_seed=facts.lower_seed,
        temperature=facts.temperature,
        lower_temperature=facts.lower_temperature,
        held=facts.held,
    )


def takes_of(armature: bpy.types.Object) -> list[bpy.types.Action]:
    """The actions in the armature's list, without rows whose action was deleted."""
    return [row.action for row in armature.dafnet.takes if row.action is not None]


def played_take(armature: bpy.types.Object) -> bpy.types.Action | None:
    """The take that the armature plays, None where it plays none."""
    data = armature.animation_data
    return data.action if data and data.action and PACKED in data.action else None


def active_take(armature: bpy.types.Object) -> bpy.types.Action | None:
    """The take of the row that is chosen in the list."""
    own = armature.dafnet
    return own.takes[own.active_take].action if 0 <= own.active_take < len(own.takes) else None


def stored_take(action: bpy.types.Action) -> tuple[Take, Controls]:
    """The take and its controls. ``InputError`` where the action holds none."""
    data = action.get(PACKED)
    if not isinstance(data, bytes):
        raise InputError(
            f"The action '{action.name}' is not a take, or its motion was removed; generate a new "
            "one."
        )

    key, mark = action.as_pointer(), hash(data)
    if key not in _unpacked or _unpacked[key][0] != mark:
        _unpacked.clear()  # one is enough: what asks again asks for the same
        _unpacked[key] = mark, unpacked(data)

    return _unpacked[key][1]


def frames_of(action: bpy.types.Action) -> tuple[int, int]:
    """The take's first and last frame in the scene."""
    take, _ = stored_take(action)
    return action.dafnet.frame_start, action.dafnet.frame_start + len(take) - 1


def play_take(armature: bpy.types.Object, action: bpy.types.Action) -> None:
    """Let the armature play one of its takes; what it plays now is kept by a fake user.

    ``InputError``: it edits a strip in tweak mode; nothing is changed then.
    """
    require_no_tweak_mode(armature)
    data = armature.animation_data
    if data and data.action and data.action != action:
        data.action.use_fake_user = True
    assign_action(armature, action)
    armature.dafnet.active_take = [row.action for row in armature.dafnet.takes].index(action)


def drop_take(armature: bpy.types.Object, index: int) -> None:
    """Remove a row from the list; if its take was playing, another one plays instead. Blender
    deletes the action with the file, unless something uses it.

    ``InputError``: the armature edits a strip in tweak mode, or the take is of the library that it
    is overridden from; nothing is changed then.
    """
    require_no_tweak_mode(armature)
    own = armature.dafnet
    action = own.takes[index].action
    if index < rows_of_library(armature, "takes"):
        raise InputError(
            f"This take is of the library that '{armature.name}' comes from; make the character "
            "local to remove it."
        )
    own.takes.remove(index)
    own.active_take = max(0, min(own.active_take, len(own.takes) - 1))
    if action is None or action in takes_of(armature):
        return

    action.use_fake_user = action.dafnet.accepted = action.dafnet.ghost = False
    plays = armature.animation_data and armature.animation_data.action == action
    if plays and (others := takes_of(armature)):
        play_take(armature, others[min(index, len(others) - 1)])
