"""Key the character's root from a curve, something that moves, or points on the floor."""

from collections.abc import Callable, Generator

import bpy
from bpy.props import BoolProperty, FloatProperty

from ..dafnet_addon.blender.character.armature import sent
from ..dafnet_addon.blender.directing.path_sources import (
    along_curve,
    as_moved,
    chosen,
    floor_points,
    is_curve,
    may_move,
    through_points,
)
from ..dafnet_addon.blender.directing.walking import Walk
from ..dafnet_addon.core.trails import FASTEST, SLOWEST
from .base import idle
from .walking import WalkOperator

__all__ = [
    "DAFNET_OT_root_from_object",
    "DAFNET_OT_walk_along_curve",
    "DAFNET_OT_walk_through_points",
    "may_direct",
]

_SPEED = "Of walking, in metres a second for a body of 1.75 m"


def may_direct(cls: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether there is a character to direct in object mode and none is being generated; says what
    is missing.
    """
    if not idle(cls):
        return False

    if context.mode != "OBJECT":
        cls.poll_message_set("Leave the current mode for object mode first")
    elif (character := sent(context)[0]) is None:
        cls.poll_message_set("Add a character, or select one")
    elif character.dafnet.root is None:
        cls.poll_message_set("Choose the character's root")
    else:
        return True

    return False


def _has(
    cls: type[bpy.types.Operator],
    context: bpy.types.Context,
    fits: Callable[[bpy.types.Object], bool],
    missing: str,
) -> bool:
    if not may_direct(cls, context):
        return False
    cls.poll_message_set(missing)
    return chosen(context, fits)[1] is not None


class DAFNET_OT_walk_along_curve(WalkOperator, bpy.types.Operator):
    """Key the character's root along the selected curve from the current frame on; keys after that
    are replaced
    """

    bl_idname = "dafnet.walk_along_curve"
    bl_label = "Walk along Curve"
    bl_options = {"REGISTER", "UNDO"}

    speed: FloatProperty(name="Speed", default=1.1, min=SLOWEST, max=FASTEST, description=_SPEED)
    seconds: FloatProperty(
        name="Stay",
        default=1.0,
        min=0.0,
        max=600.0,
        subtype="TIME_ABSOLUTE",
        description="Seconds of rest at the end",
    )
    keep_facing: BoolProperty(
        name="Keep Facing", description="Look where it looks now all the way, not along the curve"
    )
    backwards: BoolProperty(
        name="Backwards", description="Walk from the curve's end to its beginning"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and a curve."""
        return _has(
            cls,
            context,
            is_curve,
            "Select the one curve to walk along, with the character or alone",
        )

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way to the curve, and key the walk."""
        character, curve = chosen(context, is_curve)
        return along_curve.steps(
            context,
            character,
            curve,
            speed=self.speed,
            seconds=self.seconds,
            keep_facing=self.keep_facing,
            backwards=self.backwards,
        )


class DAFNET_OT_walk_through_points(WalkOperator, bpy.types.Operator):
    """Key the root on through the selected empties in the order of their names; where none is
    selected, to the 3D cursor
    """

    bl_idname = "dafnet.walk_through_points"
    bl_label = "Walk through Points"
    bl_options = {"REGISTER", "UNDO"}

    speed: FloatProperty(name="Speed", default=1.1, min=SLOWEST, max=FASTEST, description=_SPEED)
    seconds: FloatProperty(
        name="Stay",
        default=1.0,
        min=0.0,
        max=600.0,
        subtype="TIME_ABSOLUTE",
        description="Seconds of rest at the last one",
    )
    to_cursor: BoolProperty(
        name="On to Cursor", description="Walk on from the last empty to the 3D cursor"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send."""
        return may_direct(cls, context)

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look for the way, and key the walk."""
        return through_points.steps(
            context,
            sent(context)[0],
            floor_points(context),
            speed=self.speed,
            seconds=self.seconds,
            to_cursor=self.to_cursor,
        )


class DAFNET_OT_root_from_object(WalkOperator, bpy.types.Operator):
    """Key the root where the selected moving object goes, in the same frames; keys from there on
    are replaced
    """

    bl_idname = "dafnet.root_from_object"
    bl_label = "Root from Object"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a character to send, and something that moves."""
        return _has(
            cls,
            context,
            may_move,
            "Select the one animated object to follow, with the character or alone",
        )

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Walk]:
        """Look where it goes, and key that."""
        character, source = chosen(context, may_move)
        return as_moved.steps(context, character, source)
