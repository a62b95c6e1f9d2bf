"""Show where takes are at fault, in the timeline."""

from collections.abc import Generator
from typing import Any

import bpy

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.takes import PACKED, played_take, takes_of
from ..dafnet_addon.blender.overlay import display
from ..dafnet_addon.blender.overlay.faults import faults_of
from .base import idle
from .long import LongOperator

__all__ = ["DAFNET_OT_mark_frames"]


class DAFNET_OT_mark_frames(LongOperator, bpy.types.Operator):
    """Show in the timeline where feet slide (yellow) and joints touch furniture (red) in the take
    that plays, or hide it
    """

    bl_idname = "dafnet.mark_frames"
    bl_label = "Mark Frames"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A take plays, and none is being generated."""
        if not idle(cls):
            return False
        cls.poll_message_set("Let the character play a take first")
        character = character_of(context)
        return character is not None and played_take(character) is not None

    def steps(self, context: bpy.types.Context) -> Generator[float, None, str]:
        """Measure all takes of the character, or hide what was measured; what to say of the one
        that plays.
        """
        character: Any = character_of(context)
        plays: Any = played_take(character)
        if display.shown_faults(plays) is not None:
            display.hide_faults()
            return ""

        number = plays.session_uid
        others = (action for action in takes_of(character) if PACKED in action)
        takes = [*dict.fromkeys([plays, *others])]
        found = yield from faults_of.steps(context, character, takes)
        display.show_faults(found)
        faults = found[number]
        sliding, touching = (
            int((counts > 0).sum()) for counts in (faults.sliding, faults.collisions)
        )
        return f"Feet slide in {sliding} frames, joints touch furniture in {touching}."

    def report_result(self, result: str) -> None:
        """Say it."""
        if result:
            self.report({"INFO"}, result)
