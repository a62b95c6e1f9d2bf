"""The menu of presets in the head of the tab."""

import bpy
from bl_ui.utils import PresetPanel

from ..operators.presets import PRESETS, DAFNET_OT_add_preset

__all__ = ["DAFNET_MT_presets", "DAFNET_PT_presets"]


class DAFNET_MT_presets(bpy.types.Menu):
    """Presets of temperature, number of takes and clean-up"""

    bl_idname = "DAFNET_MT_presets"
    bl_label = "DAFNet Presets"
    preset_subdir = PRESETS
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class DAFNET_PT_presets(PresetPanel, bpy.types.Panel):
    """Presets of temperature, number of takes and clean-up"""

    bl_idname = "DAFNET_PT_presets"
    bl_label = "DAFNet Presets"
    preset_subdir = PRESETS
    preset_operator = "script.execute_preset"
    preset_add_operator = DAFNET_OT_add_preset.bl_idname
