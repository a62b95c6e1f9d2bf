"""Notes which character the user has chosen last: the tab belongs to it until another one is."""

import bpy
from bpy.app.handlers import persistent

from .armature import choose, owner_of

__all__ = ["register", "unregister"]

_owner = object()
"""By what Blender knows whose subscription it is."""


def _note() -> None:
    """Choose the character that the active object of a window belongs to."""
    for window in bpy.context.window_manager.windows:
        active = window.view_layer.objects.active
        if active is not None and (character := owner_of(window.scene, active)) is not None:
            choose(window.scene, character)


@persistent
def _restored(*_: object) -> None:
    """What was noted is gone after an undo."""
    _note()


@persistent
def _opened(*_: object) -> None:
    """Subscriptions end with the file."""
    _listen()


def _listen() -> None:
    bpy.msgbus.subscribe_rna(
        key=(bpy.types.LayerObjects, "active"), owner=_owner, args=(), notify=_note
    )


_HANDLERS = {"undo_post": _restored, "redo_post": _restored, "load_post": _opened}


def register() -> None:
    """Listen to what the user makes active."""
    _listen()
    for event, function in _HANDLERS.items():
        getattr(bpy.app.handlers, event).append(function)


def unregister() -> None:
    """Listen no longer."""
    bpy.msgbus.clear_by_owner(_owner)
    for event, function in _HANDLERS.items():
        getattr(bpy.app.handlers, event).remove(function)
