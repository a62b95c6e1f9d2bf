"""Key the character's root from a curve, something that moves, or points on the floor."""

from collections.abc import Callable, Generator

import bpy
from bpy.props import BoolProperty, FloatProperty

from ..dafnet_addon.blender.character.armature import character_of
from ..dafnet_addon.blender.character.walk_rows import MANNER
from ..dafnet_addon.blender.directing.path_sources import (
    along_curve,
    along_object,
    character_and_source,
    floor_points,
    is_curve,
    may_move,
    through_points,
)
from ..dafnet_addon.blender.directing.walking import Walk
from .base import idle
from .walking import WalkOperator

__all__ = [
    "DAFNET_OT_root_from_object",
    "DAFNET_OT_walk_along_curve",
    "DAFNET_OT_walk_through_points",
    "can_direct",
]


def can_direct(cls: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether there is a character to direct in object mode and none is being generated; says what
    is missing.
    """
    if not idle(cls):
        return False

    if context.mode != "OBJECT":
        cls.poll_message_set("Switch to object mode first")
    elif (character := character_of(context)) is None:
        cls.poll_message_set("Add a character, or select one")
    elif character.dafnet.root is None:
        cls.poll_message_set("Choose the character's root")
    else:
        return True

    return False


def _can_follow(
    cls: type[bpy.types.Operator],
    context: bpy.types.Context,
    fits: Callable[[bpy.types.Object], bool],
    missing: str,
) -> bool:
    if not can_direct(cls, context):
        return False
    cls.poll_message_set(missing)
    return character_and_source(context, fits)[1] is not None


class DAFNET_OT_walk_along_curve(WalkOperator, bpy.types.Operator):
    """Key the character's root along the selected curve from the current frame on; later keys are
    replaced
    """

    bl_idname = "dafnet.walk_along_curve"
    bl_label = "Walk along Curve"
    bl_options = {"REGISTER", "UNDO"}

    speed: FloatProperty(options={"SKIP_SAVE"}, **MANNER["speed"])
    seconds: FloatProperty(options={"SKIP_SAVE"}, **MANNER["seconds"])
    gets_up: FloatProperty(options={"SKIP_SAVE"}, **MANNER["gets_up"])
    keep_facing: BoolProperty(
        name="Keep Facing",
        options={"SKIP_SAVE"},
        description="Keep looking where it looks now, instead of along the curve",
    )
    backwards: BoolProperty(
        name="Backwards",
        options={"SKIP_SAVE"},
        description="Walk from the curve's end to its beginning",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and a curve."""
        return _can_follow(
            cls,
            context,
            is_curve,
            "Select one curve to walk along, and nothing else but the character",
        )

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way to the curve, and key the walk."""
        character, curve = character_and_source(context, is_curve)
        self.take_manner(character)
        return along_curve.steps(
            context,
            character,
            curve,
            speed=self.speed,
            seconds=self.seconds,
            gets_up=self.gets_up,
            keep_facing=self.keep_facing,
            backwards=self.backwards,
        )


class DAFNET_OT_walk_through_points(WalkOperator, bpy.types.Operator):
    """Continue the root's keys through the selected empties, in the order of their names, or to the
    3D cursor if none is selected
    """

    bl_idname = "dafnet.walk_through_points"
    bl_label = "Walk through Points"
    bl_options = {"REGISTER", "UNDO"}

    speed: FloatProperty(options={"SKIP_SAVE"}, **MANNER["speed"])
    seconds: FloatProperty(options={"SKIP_SAVE"}, **MANNER["seconds"])
    gets_up: FloatProperty(options={"SKIP_SAVE"}, **MANNER["gets_up"])
    to_cursor: BoolProperty(
        name="On to Cursor",
        options={"SKIP_SAVE"},
        description="Walk on from the last empty to the 3D cursor",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send."""
        return can_direct(cls, context)

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way, and key the walk."""
        character = character_of(context)
        self.take_manner(character)
        return through_points.steps(
            context,
            character,
            floor_points(context),
            speed=self.speed,
            seconds=self.seconds,
            gets_up=self.gets_up,
            to_cursor=self.to_cursor,
        )


class DAFNET_OT_root_from_object(WalkOperator, bpy.types.Operator):
    """Key the root along the path of the selected moving object, in the same frames; later keys are
    replaced
    """

    bl_idname = "dafnet.root_from_object"
    bl_label = "Root from Object"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and something that moves."""
        return _can_follow(
            cls,
            context,
            may_move,
            "Select one animated object to follow, and nothing else but the character",
        )

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look where it goes, and key that."""
        character, source = character_and_source(context, may_move)
        return along_object.steps(context, character, source)
