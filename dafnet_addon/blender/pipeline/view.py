"""The 3D view while a job runs in a window."""

import bpy

from .lent_preference import LentPreference

__all__ = ["DrawnOnce"]

_DRAWN_ONCE = "FXAA"
"""The anti-aliasing of one pass; those of more draw the view eight times and oftener."""


class DrawnOnce:
    """From now on until its ``end`` the view is drawn once for each time that it is asked for,
    instead of again and again until its edges are smooth.
    """

    def __init__(self) -> None:
        own = bpy.context.preferences.system.viewport_aa
        self._lent: LentPreference | None = None
        if own not in {"OFF", _DRAWN_ONCE}:
            self._lent = LentPreference("system", "viewport_aa", _DRAWN_ONCE)

    def keep(self) -> None:
        """Called now and then: see ``LentPreference``."""
        if self._lent is not None:
            self._lent.keep()

    def end(self) -> None:
        """Let the view be drawn as ever."""
        if self._lent is not None:
            self._lent.back()
