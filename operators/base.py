"""What the add-on's operators share: errors become reports, and results what Blender expects."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..dafnet_addon.blender.character.armature import character_of, choose
from ..dafnet_addon.blender.live.listening import live_state
from ..dafnet_addon.blender.pipeline.running import running_job
from ..dafnet_addon.blender.rig.properties import rig_of
from ..dafnet_addon.core.errors import DafnetError

__all__ = [
    "DafnetOperator",
    "RigOperator",
    "asked_to_replace",
    "idle",
    "may_be_led",
    "remember_character",
    "reported",
]


@contextmanager
def reported(operator: bpy.types.Operator) -> Iterator[None]:
    """A block whose errors, if they are the add-on's own, are shown to the user and end only the
    block; any other exception passes.
    """
    try:
        yield
    except DafnetError as error:
        operator.report({"ERROR"}, str(error))


class DafnetOperator:
    """An operator whose ``run`` does all its work at once.

    Mixed into ``bpy.types.Operator``, before it. An operator's docstring is its tooltip, in one
    line, as it is translated.
    """

    bl_description: str

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.bl_description = " ".join((cls.__doc__ or "").split())

    def run(self, context: bpy.types.Context) -> None:
        """Do it; an ``InputError`` or ``WeightsError`` says to the user why it cannot be done."""
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run, as Blender calls it: finished, or cancelled and the error reported."""
        remember_character(context)
        with reported(self):
            self.run(context)
            return {"FINISHED"}
        return {"CANCELLED"}


def remember_character(context: bpy.types.Context) -> None:
    """Let the tab belong to the character that is directed now."""
    character = character_of(context)
    if character is not None and not character.library:
        choose(context.scene, character)


def idle(operator: Any) -> bool:
    """Whether no job is running, nor Live; else the operator's button says why it has to wait."""
    if live_state() is not None:
        operator.poll_message_set("End Live first, with Esc")
        return False
    if running_job() is None:
        return True
    operator.poll_message_set("Wait for the job that is running, or cancel it with Esc")
    return False


def may_be_led(operator: Any, context: bpy.types.Context) -> bool:
    """Whether there is a character with a root, and no job; else the operator's button says what is
    missing.
    """
    if not idle(operator):
        return False

    character = character_of(context)
    if character is None:
        operator.poll_message_set("Select a character, or add one")
    elif character.dafnet.root is None:
        operator.poll_message_set("Choose the character's root")
    elif context.mode not in {"OBJECT", "POSE"}:
        operator.poll_message_set("Switch to object or pose mode first")
    else:
        return True

    return False


def asked_to_replace(
    operator: bpy.types.Operator, context: bpy.types.Context, event: bpy.types.Event
) -> set[str]:
    """Ask whether keys that the user has edited are replaced; what Blender runs then is
    ``execute``.
    """
    manager: Any = context.window_manager
    answer: set[str] = manager.invoke_confirm(
        operator,
        event,
        title="Replace edited keys?",
        message="Keys were edited since they were made. A copy of their action is kept.",
        confirm_text="Replace",
    )
    return answer


class RigOperator(DafnetOperator):
    """An operator that works on the animator's own rig and a character."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A rig of the animator's own is active, and no job is running."""
        if not idle(cls):
            return False
        cls.poll_message_set(  # type: ignore[attr-defined]
            "Select the armature of your rig, in object or pose mode"
        )
        return rig_of(context) is not None and context.mode in {"OBJECT", "POSE"}
