"""The add-on's preferences: which weights are used, and what runs the network."""

import importlib.util
from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ..core.errors import InputError

__all__ = ["ADDON", "Preferences", "device_of", "register", "unregister", "weights_path"]

ADDON = (__package__ or "").removesuffix(".dafnet_addon.blender")
"""The name by which Blender knows the extension."""

_GUIDE = Path(__file__).parents[2] / "docs" / "guide.md"


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

    engine: EnumProperty(
        name="Engine",
        default="NUMPY",
        description="What runs the network",
        items=[
            (
                "NUMPY",
                "NumPy",
                "Comes with Blender, and is as fast as anything else for a single take",
            ),
            ("cpu", "PyTorch on the CPU", "Where PyTorch is installed in Blender's Python"),
            (
                "cuda",
                "PyTorch on a GPU (CUDA)",
                "For many takes at once, where PyTorch is installed in Blender's Python",
            ),
            (
                "mps",
                "PyTorch on a GPU (Metal)",
                "For many takes at once, where PyTorch is installed in Blender's Python",
            ),
        ],
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the settings."""
        self.layout.use_property_split = True
        self.layout.prop(self, "weights")
        self.layout.prop(self, "engine")
        self.layout.operator("wm.path_open", text="Open the Guide", icon="HELP").filepath = str(
            _GUIDE
        )


def weights_path(context: bpy.types.Context) -> str | None:
    """The weights file chosen in the preferences, or None for the shipped weights."""
    addon = context.preferences.addons.get(ADDON)
    return bpy.path.abspath(addon.preferences.weights) or None if addon else None


def device_of(context: bpy.types.Context) -> str | None:
    """The torch device chosen in the preferences, or None for NumPy. ``InputError`` where torch or
    the device is missing.
    """
    addon = context.preferences.addons.get(ADDON)
    engine = addon.preferences.engine if addon else "NUMPY"
    if engine == "NUMPY":
        return None

    if importlib.util.find_spec("torch") is None:
        raise InputError(
            "PyTorch is not installed in Blender's Python; set the engine in the add-on's "
            "preferences to NumPy."
        )

    import torch

    there = {
        "cpu": True,
        "cuda": torch.cuda.is_available(),
        "mps": torch.backends.mps.is_available(),
    }
    if not there[engine]:
        raise InputError(
            f"PyTorch finds no device '{engine}'; choose another engine in the add-on's "
            "preferences."
        )

    return engine


def register() -> None:
    """Add the preferences to the add-on."""
    bpy.utils.register_class(Preferences)


def unregister() -> None:
    """Undo ``register``."""
    bpy.utils.unregister_class(Preferences)
