"""Presets of temperature, number of takes and clean-up, as Blender keeps presets."""

from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase

from ..dafnet_addon.blender.character.settings import CLEAN_UP

__all__ = ["DAFNET_OT_add_preset", "PRESETS"]

PRESETS = "dafnet"
"""Folder of the presets, below Blender's own and below the add-on's."""


class DAFNET_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Add a preset of temperature, number of takes and clean-up, or remove the chosen one"""

    bl_idname = "dafnet.add_preset"
    bl_label = "Add Preset"
    preset_menu = "DAFNET_MT_presets"
    preset_subdir = PRESETS
    preset_defines: ClassVar[list[str]] = ["own = bpy.context.object.dafnet"]
    preset_values: ClassVar[list[str]] = [
        f"own.{name}" for name in ("temperature", "take_count", *CLEAN_UP)
    ]
