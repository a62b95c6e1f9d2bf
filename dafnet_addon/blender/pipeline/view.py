"""The 3D view while a job runs in a window."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

__all__ = ["drawn_once"]

_DRAWN_ONCE = "FXAA"
"""The anti-aliasing of one pass; those of more draw the view eight times and oftener."""


@contextmanager
def drawn_once(preferences: bpy.types.Preferences) -> Iterator[None]:
    """A block in which the view is drawn once for each time that it is asked for, instead of again
    and again until its edges are smooth; the preferences are afterwards as they were, and meanwhile
    not taken for changed ones.
    """
    system, was, dirty = preferences.system, preferences.system.viewport_aa, preferences.is_dirty
    if was in {"OFF", _DRAWN_ONCE}:
        yield
        return
    system.viewport_aa, preferences.is_dirty = _DRAWN_ONCE, dirty
    try:
        yield
    finally:
        if system.viewport_aa == _DRAWN_ONCE:
            dirty = preferences.is_dirty
            system.viewport_aa, preferences.is_dirty = was, dirty
