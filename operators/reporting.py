"""From the add-on's errors to Blender's reports."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ..dafnet_addon.blender.walking import Walk
from ..dafnet_addon.core.errors import DafnetError

__all__ = ["keyed", "reported"]


@contextmanager
def reported(operator: bpy.types.Operator) -> Iterator[None]:
    """Show an error of the add-on to the user and go on behind the block; any other exception
    passes.
    """
    try:
        yield
    except DafnetError as error:
        operator.report({"ERROR"}, str(error))


def keyed(operator: bpy.types.Operator, made: Walk) -> set[str]:
    """Say where the root was keyed, and what is to be seen to; what the operator returns."""
    for warning in made.warnings:
        operator.report({"WARNING"}, warning)
    ended = ", the range now ends there" if made.extended else ""
    operator.report({"INFO"}, f"Keyed the root from frame {made.first} to {made.last}{ended}.")
    return {"FINISHED"}
