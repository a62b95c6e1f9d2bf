"""From the add-on's errors to Blender's reports."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ..dafnet_addon.core.errors import DafnetError

__all__ = ["reported"]


@contextmanager
def reported(operator: bpy.types.Operator) -> Iterator[None]:
    """Show an error of the add-on to the user and go on behind the block; any other exception passes."""
    try:
        yield
    except DafnetError as error:
        operator.report({"ERROR"}, str(error))
