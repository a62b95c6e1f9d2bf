"""DAFNet: a character that walks up to furniture and uses it, for Blender."""

from typing import Any

__all__ = ["register", "unregister"]

_commands: list[Any] = []


def register() -> None:
    """Add the settings, operators, panels and the command ``blender --command dafnet`` to Blender."""
    import bpy

    from . import operators, panels
    from .dafnet_addon import cli
    from .dafnet_addon.blender import properties

    properties.register()
    for cls in operators.CLASSES + panels.CLASSES:
        bpy.utils.register_class(cls)
    _commands.append(bpy.utils.register_cli_command("dafnet", lambda arguments: cli.main(arguments, in_blender=True)))


def unregister() -> None:
    """Take away what ``register`` added."""
    import bpy

    from . import operators, panels
    from .dafnet_addon.blender import properties

    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    for cls in reversed(operators.CLASSES + panels.CLASSES):
        bpy.utils.unregister_class(cls)
    properties.unregister()
