"""Which bone of the animator's own rig is which joint: detected, saved as a preset, loaded from
one.
"""

from typing import Any

import bpy
from bpy.props import EnumProperty, StringProperty

from ..dafnet_addon.blender.rig.detection import detect_map
from ..dafnet_addon.blender.rig.maps import (
    NEEDED,
    load_map,
    map_files,
    require_usable,
    save_map,
    with_bone_names_of,
)
from ..dafnet_addon.blender.rig.properties import map_of, presets, rig_of, show_map
from .base import DafnetOperator

__all__ = ["DAFNET_OT_detect_rig", "DAFNET_OT_load_rig_map", "DAFNET_OT_save_rig_map"]


class _OfRig(DafnetOperator):
    """For an armature that is not a DAFNet character."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """One is active."""
        cls.poll_message_set("Select the armature of your rig")  # type: ignore[attr-defined]
        return rig_of(context) is not None


def _rig(context: bpy.types.Context) -> Any:
    """The rig; ``poll`` has made sure that there is one."""
    return rig_of(context)


class DAFNET_OT_detect_rig(_OfRig, bpy.types.Operator):
    """Find the bone of each joint by its name"""

    bl_idname = "dafnet.detect_rig"
    bl_label = "Detect Bones"
    bl_options = {"REGISTER", "UNDO"}

    def run(self, context: bpy.types.Context) -> None:
        """Fill the list."""
        rig = _rig(context)
        found = detect_map(rig)
        show_map(rig, found)
        missing = [joint for joint in NEEDED if joint not in found.joints]
        if missing:
            names = ", ".join(joint.replace("_", " ") for joint in missing)
            self.report({"WARNING"}, f"No bone was found for: {names}; choose them in the list")
        else:
            self.report({"INFO"}, f"{found.name}: {len(found.joints)} joints")


class DAFNET_OT_load_rig_map(_OfRig, bpy.types.Operator):
    """Load the bones from a preset"""

    bl_idname = "dafnet.load_rig_map"
    bl_label = "Load Rig Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", items=presets)

    def run(self, context: bpy.types.Context) -> None:
        """Fill the list."""
        rig = _rig(context)
        found = with_bone_names_of(load_map(map_files()[self.preset]), rig.data.bones.keys())
        show_map(rig, found)
        self.report({"INFO"}, f"{found.name}: {len(found.joints)} joints")


class DAFNET_OT_save_rig_map(_OfRig, bpy.types.Operator):
    """Save the bones of the list as a preset of your own"""

    bl_idname = "dafnet.save_rig_map"
    bl_label = "Save Rig Preset"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Name", default="My Rig")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the name."""
        self.name = _rig(context).name
        return context.window_manager.invoke_props_dialog(self)

    def run(self, context: bpy.types.Context) -> None:
        """Write the file."""
        rig = _rig(context)
        rig_map = map_of(rig)
        require_usable(rig, rig_map)
        file = save_map(rig_map, self.name)
        self.report({"INFO"}, f"Saved '{file.name}'")
