"""What is reported of a walk, whichever operator keyed it."""

import bpy

from ..dafnet_addon.blender.walking import Walk
from .base import reported

__all__ = ["keyed", "reported"]


def keyed(operator: bpy.types.Operator, made: Walk) -> set[str]:
    """Say where the root was keyed, and what is to be seen to; what the operator returns."""
    for warning in made.warnings:
        operator.report({"WARNING"}, warning)
    ended = ", the range now ends there" if made.extended else ""
    operator.report({"INFO"}, f"Keyed the root from frame {made.first} to {made.last}{ended}.")
    return {"FINISHED"}
