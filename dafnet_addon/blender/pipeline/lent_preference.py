"""A preference of Blender's that has another value for a while."""

from typing import Any

import bpy

__all__ = ["LentPreference"]


class LentPreference:
    """The preference ``name`` of a ``group`` has this ``value`` from now on until it is given
    ``back``, and is not taken for a changed one. While the preferences are shown, which may be
    saved there, it has its own.
    """

    def __init__(self, group: str, name: str, value: Any) -> None:
        self._group, self._name, self._value = group, name, value
        self._own = self._now
        self._lent = False
        self.keep()

    @property
    def _now(self) -> Any:
        return getattr(getattr(bpy.context.preferences, self._group), self._name)

    def keep(self) -> None:
        """Give it back where the preferences are shown now, and take it again where they are no
        longer.
        """
        if self._lent and _shown():
            self.back()
        elif not self._lent and not _shown():
            self._own, self._lent = self._now, True
            self._set(self._value)

    def back(self) -> None:
        """Let it have its own value, unless somebody has set another one meanwhile."""
        if self._lent and self._now == self._value:
            self._set(self._own)
        self._lent = False

    def _set(self, value: Any) -> None:
        preferences = bpy.context.preferences
        dirty = preferences.is_dirty
        setattr(getattr(preferences, self._group), self._name, value)
        preferences.is_dirty = dirty


def _shown() -> bool:
    """Whether a window shows the preferences."""
    return any(
        area.type == "PREFERENCES"
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
    )
