"""DAFNet: a character that walks up to furniture and uses it, for Blender."""

from pathlib import Path
from typing import Any

from .dafnet_addon.blender.gltf_seats import glTF2ExportUserExtension, glTF2ImportUserExtension

__all__ = ["glTF2ExportUserExtension", "glTF2ImportUserExtension", "register", "unregister"]

_commands: list[Any] = []
_FILES = str(Path(__file__).parent / "dafnet_addon" / "blender")
"""Holds the folder ``presets``."""


def register() -> None:
    """Add the settings, operators, panels and the command ``blender --command dafnet`` to
    Blender.
    """
    import bpy

    from . import operators, panels
    from .dafnet_addon import cli
    from .dafnet_addon.blender import preferences, translations
    from .dafnet_addon.blender.character import choosing, properties
    from .dafnet_addon.blender.overlay import display

    preferences.register()
    properties.register()
    choosing.register()
    display.register()
    bpy.utils.register_preset_path(_FILES)
    translations.register()
    for cls in operators.CLASSES + panels.CLASSES:
        bpy.utils.register_class(cls)

    bpy.types.VIEW3D_MT_add.append(panels.add_menu)
    _commands.append(bpy.utils.register_cli_command("dafnet", cli.run_in_blender))


def unregister() -> None:
    """End what runs, and take away what ``register`` added."""
    from .dafnet_addon.blender.live import listening
    from .dafnet_addon.blender.pipeline import running

    try:
        running.stop_job()
        listening.end_live()
    finally:
        _take_away()


def _take_away() -> None:
    import bpy

    from . import operators, panels
    from .dafnet_addon.blender import preferences, translations
    from .dafnet_addon.blender.character import choosing, properties
    from .dafnet_addon.blender.overlay import display

    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())

    bpy.types.VIEW3D_MT_add.remove(panels.add_menu)
    for cls in reversed(operators.CLASSES + panels.CLASSES):
        bpy.utils.unregister_class(cls)

    translations.unregister()
    bpy.utils.unregister_preset_path(_FILES)
    display.unregister()
    choosing.unregister()
    properties.unregister()
    preferences.unregister()
