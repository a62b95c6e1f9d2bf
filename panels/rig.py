"""The animator's own rig: which bones are which joints, and the bake onto it."""

from typing import Any

import bpy

from ..dafnet_addon.blender.pipeline.running import running_job
from ..dafnet_addon.blender.rig.maps import NEEDED
from ..dafnet_addon.blender.rig.properties import rig_of
from ..operators.bake_to_rig import DAFNET_OT_bake_to_rig
from ..operators.map_rig import DAFNET_OT_detect_rig, DAFNET_OT_load_rig_map, DAFNET_OT_save_rig_map
from ..operators.size_as_rig import DAFNET_OT_size_as_rig

__all__ = ["DAFNET_PT_rig", "DAFNET_UL_rig"]


class DAFNET_UL_rig(bpy.types.UIList):
    """Joints and their bones"""

    bl_idname = "DAFNET_UL_rig"

    def draw_item(
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        data: Any,
        item: Any,
        _icon: int,
        _active: Any,
        _name: str,
        _index: int = 0,
        _flag: int = 0,
    ) -> None:
        """A row: the joint, and a search among the bones; red where a needed one is missing or
        gone.
        """
        rig = data.id_data
        row = layout.split(factor=0.4)
        row.label(text=item.name.replace("_", " ").capitalize())
        search = row.row()
        search.alert = item.bone not in rig.data.bones if item.bone else item.name in NEEDED
        search.prop_search(item, "bone", rig.data, "bones", text="")


class DAFNET_PT_rig(bpy.types.Panel):
    """Bake a character's motion onto this armature"""

    bl_label = "Your Rig"
    bl_idname = "DAFNET_PT_rig"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "DAFNet"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """An armature that is not a character is active."""
        return running_job() is None and rig_of(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the list, the choices and the button."""
        layout = self.layout
        rig: Any = rig_of(context)
        own = rig.dafnet_rig

        row = layout.row()
        row.label(text=rig.name, icon="ARMATURE_DATA")
        row.label(text=own.convention)

        row = layout.row(align=True)
        row.operator(DAFNET_OT_detect_rig.bl_idname, icon="VIEWZOOM")
        row.operator_menu_enum(DAFNET_OT_load_rig_map.bl_idname, "preset", text="", icon="PRESET")
        row.operator(DAFNET_OT_save_rig_map.bl_idname, text="", icon="ADD")
        if len(own.rows):
            layout.template_list(
                DAFNET_UL_rig.bl_idname, "", own, "rows", own, "active_row", rows=8
            )

        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(own, "character", icon="ARMATURE_DATA")
        column.prop(own, "root_motion")
        if own.root_motion == "BONE":
            column.prop_search(own, "root_bone", rig.data, "bones")

        column.prop(own, "limbs")

        layout.operator(DAFNET_OT_size_as_rig.bl_idname, icon="FULLSCREEN_ENTER")
        row = layout.row()
        row.scale_y = 1.5
        row.operator(DAFNET_OT_bake_to_rig.bl_idname, icon="ACTION")
