"""The add-on's preferences: which weights are used."""

from pathlib import Path

import bpy
from bpy.props import StringProperty

__all__ = ["ADDON", "Preferences", "draw_help", "register", "unregister", "weights_path"]

ADDON = (__package__ or "").removesuffix(".dafnet_addon.blender")
"""The name by which Blender knows the extension."""

_ROOT = Path(__file__).parents[2]
_GUIDES = (_ROOT / "pages" / "guide.html", _ROOT / "docs" / "guide.md")
"""The guide as a page, where the extension was built with its pages, and its source."""


class Preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = ADDON

    weights: StringProperty(
        name="Weights",
        subtype="FILE_PATH",
        description=(
            "File of trained weights. Leave it empty for the weights that come with the add-on"
        ),
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the settings."""
        self.layout.use_property_split = True
        self.layout.prop(self, "weights")
        draw_help(self.layout)


def draw_help(layout: bpy.types.UILayout) -> None:
    """Draw the ways to help: the guide, and a report to ask with."""
    guide = next((file for file in _GUIDES if file.exists()), _GUIDES[-1])
    layout.operator("wm.path_open", text="Open the Guide", icon="HELP").filepath = str(guide)
    layout.operator("dafnet.copy_report", icon="TEXT")


def weights_path(context: bpy.types.Context) -> str | None:
    """The weights file chosen in the preferences, or None for the shipped weights."""
    addon = context.preferences.addons.get(ADDON)
    return bpy.path.abspath(addon.preferences.weights) or None if addon else None


def register() -> None:
    """Add the preferences to the add-on."""
    bpy.utils.register_class(Preferences)


def unregister() -> None:
    """Undo ``register``."""
    bpy.utils.unregister_class(Preferences)
