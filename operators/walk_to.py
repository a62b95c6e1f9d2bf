"""Send the character to a seat or to the 3D cursor."""

from collections.abc import Generator

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty

from ..dafnet_addon.blender.character.armature import character_and_goal
from ..dafnet_addon.blender.character.walk_rows import MANNER
from ..dafnet_addon.blender.directing.walking import Walk, walk
from ..dafnet_addon.core.errors import InputError
from .base import idle
from .walking import WalkOperator

__all__ = ["DAFNET_OT_walk_to"]


class DAFNET_OT_walk_to(WalkOperator, bpy.types.Operator):
    """Continue the root's keys from the last one: the character walks around the furniture and sits
    down, or stops at the 3D cursor
    """

    bl_idname = "dafnet.walk_to"
    bl_label = "Walk To"
    bl_options = {"REGISTER", "UNDO"}

    goal: EnumProperty(
        name="To",
        default="SEAT",
        items=[
            (
                "SEAT",
                "Sit on Selected",
                "Walk to the selected piece of furniture and sit down on it; the 3D cursor, if it "
                "is on it, says where and to which side",
            ),
            ("CURSOR", "Walk to Cursor", "Walk to the 3D cursor and stand there"),
        ],
    )
    speed: FloatProperty(options={"SKIP_SAVE"}, **MANNER["speed"])
    seconds: FloatProperty(options={"SKIP_SAVE"}, **MANNER["seconds"])
    sits_down: FloatProperty(options={"SKIP_SAVE"}, **MANNER["sits_down"])
    gets_up: FloatProperty(options={"SKIP_SAVE"}, **MANNER["gets_up"])
    tables: BoolProperty(
        name="On Tables",
        options={"SKIP_SAVE"},
        description="Sit on a table or a desk as well, if that is selected",
    )
    pull_out: EnumProperty(
        name="Pull Out",
        default="NO",
        options={"SKIP_SAVE"},
        description="A seat that is tucked under a table, so that the character fits",
        items=[
            ("NO", "Leave", "Say by how far it has to come out, and do nothing"),
            ("MOVED", "Move", "Move it out"),
            (
                "KEYED",
                "Key",
                "Key its location: it comes out before the character is near",
            ),
        ],
    )
    mark_seat: BoolProperty(
        name="Mark Seat",
        options={"SKIP_SAVE"},
        description="Keep where one sits on the piece, as the custom property OMI_seat, which glTF "
        "files take along; it counts the next time",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and none is being generated."""
        if not idle(cls):
            return False
        cls.poll_message_set("Add a character, or select one together with its goal")
        return context.mode == "OBJECT" and character_and_goal(context)[0] is not None

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way, and key the walk."""
        character, seat = character_and_goal(context)
        if self.goal == "SEAT" and seat is None:
            raise InputError("Select one object to sit on, and nothing else but the character.")
        goal = seat if self.goal == "SEAT" else None
        self.take_manner(character)
        return walk.steps(
            context,
            character,
            goal,
            self.seconds,
            self.speed,
            tables=self.tables,
            pull_out=self.pull_out != "NO",
            by_keys=self.pull_out == "KEYED",
            sits_down=self.sits_down,
            gets_up=self.gets_up,
            mark_seat=self.mark_seat,
        )
