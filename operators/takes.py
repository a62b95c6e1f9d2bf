"""What can be done with the takes in a character's list; the work is done in
``blender.character.takes`` and ``blender.pipeline.job``.
"""

from typing import Any

import bpy
from bpy.props import EnumProperty, IntProperty

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.takes import active_take, drop_take, play_take, takes_of
from ..dafnet_addon.blender.pipeline import job
from ..dafnet_addon.core.errors import InputError
from .base import DafnetOperator, idle

__all__ = [
    "DAFNET_OT_clean_again",
    "DAFNET_OT_keep_accepted",
    "DAFNET_OT_play_take",
    "DAFNET_OT_reject_take",
]


def _character(context: bpy.types.Context) -> Any:
    """The character; ``poll`` has made sure that there is one."""
    return character_of(context)


class _OfTakes(DafnetOperator):
    """For a character that has takes, while none is being generated."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a take, and no job is running."""
        character = character_of(context)
        if not idle(cls):
            return False
        cls.poll_message_set("Generate a take first")  # type: ignore[attr-defined]
        return character is not None and bool(takes_of(character))


class DAFNET_OT_play_take(_OfTakes, bpy.types.Operator):
    """Let the character play this take"""

    bl_idname = "dafnet.play_take"
    bl_label = "Play Take"
    bl_options = {"REGISTER", "UNDO"}

    index: IntProperty(name="Row", options={"SKIP_SAVE"})
    step: EnumProperty(
        name="Step",
        default="NONE",
        options={"SKIP_SAVE"},
        items=[
            ("NONE", "This", "The take of the row"),
            ("NEXT", "Next", "The take below the one that plays"),
            ("PREVIOUS", "Previous", "The take above the one that plays"),
        ],
    )

    def run(self, context: bpy.types.Context) -> None:
        """Play it."""
        character = _character(context)
        rows = [row.action for row in character.dafnet.takes]
        index = self.index
        if self.step != "NONE":
            data = character.animation_data
            playing = rows.index(data.action) if data and data.action in rows else 0
            index = (playing + (1 if self.step == "NEXT" else -1)) % len(rows)
        if not 0 <= index < len(rows) or rows[index] is None:
            raise InputError("This take's action was deleted; remove its row.")

        play_take(character, rows[index])


class DAFNET_OT_reject_take(_OfTakes, bpy.types.Operator):
    """Remove the chosen take from the list; its action is deleted when the file is saved and
    reopened, unless something uses it
    """

    bl_idname = "dafnet.reject_take"
    bl_label = "Reject Take"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a row, whether its action still exists or not."""
        character = character_of(context)
        cls.poll_message_set("There is no take in the list")
        return idle(cls) and character is not None and len(character.dafnet.takes) > 0

    def run(self, context: bpy.types.Context) -> None:
        """Drop it."""
        own = _character(context).dafnet
        drop_take(own.id_data, max(0, min(own.active_take, len(own.takes) - 1)))


class DAFNET_OT_keep_accepted(_OfTakes, bpy.types.Operator):
    """Reject every take that is not accepted"""

    bl_idname = "dafnet.keep_accepted"
    bl_label = "Keep Accepted Only"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Drop the others."""
        character = _character(context)
        if not any(action.dafnet.accepted for action in takes_of(character)):
            raise InputError("No take is accepted; mark those to keep first.")
        rows = character.dafnet.takes
        for index in range(len(rows) - 1, -1, -1):
            if rows[index].action is None or not rows[index].action.dafnet.accepted:
                drop_take(character, index)


class DAFNET_OT_clean_again(_OfTakes, bpy.types.Operator):
    """Clean up the chosen take with the present settings, as a new take; nothing is generated"""

    bl_idname = "dafnet.clean_again"
    bl_label = "Clean Up Again"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Clean it."""
        character = _character(context)
        take = active_take(character)
        if take is None:
            raise InputError("Choose a take in the list of takes first.")
        result = job.clean_up_again(context, character, take)
        self.report({"INFO"}, f"'{result.action.name}'")
