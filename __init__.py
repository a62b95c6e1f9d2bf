"""DAFNet: a character that walks up to furniture and uses it, for Blender."""

__all__ = ["register", "unregister"]


def register() -> None:
    """Add the settings, operators and panels to Blender."""
    import bpy

    from . import operators, panels
    from .dafnet_addon.blender import properties

    properties.register()
    for cls in operators.CLASSES + panels.CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take away what ``register`` added."""
    import bpy

    from . import operators, panels
    from .dafnet_addon.blender import properties

    for cls in reversed(operators.CLASSES + panels.CLASSES):
        bpy.utils.unregister_class(cls)
    properties.unregister()
