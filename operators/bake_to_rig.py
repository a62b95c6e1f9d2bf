"""Bake what a character plays onto the animator's own rig."""

from typing import Any

import bpy

from ..dafnet_addon.blender.onto_rig import bake_onto_rig
from ..dafnet_addon.blender.rig_properties import character_for, map_of, rig_of
from .generate import idle
from .reporting import reported

__all__ = ["DAFNET_OT_bake_to_rig"]

_FAR = 0.02
"""Metres of mean error above which the user is warned."""


class DAFNET_OT_bake_to_rig(bpy.types.Operator):
    """Bake the motion that the character plays, your edits included, into a new action on this armature"""

    bl_idname = "dafnet.bake_to_rig"
    bl_label = "Bake to Rig"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """An own rig is active, and none is being generated."""
        if not idle(cls):
            return False
        cls.poll_message_set("Select the armature of your rig, in object or pose mode")
        return rig_of(context) is not None and context.mode in {"OBJECT", "POSE"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bake, and say how near the result is."""
        rig: Any = rig_of(context)
        own = rig.dafnet_rig
        with reported(self):
            baked = bake_onto_rig(
                context, character_for(context, rig), rig, map_of(rig), root_motion=own.root_motion, limbs=own.limbs,
            )
            errors = ", ".join(f"{part} {100 * mean:.1f} ({100 * most:.1f})" for part, (mean, most) in baked.errors.items())
            if max(mean for mean, _ in baked.errors.values()) > _FAR and baked.overruled:
                bones = ", ".join(f"'{bone}'" for bone in baked.overruled[:3])
                self.report({"WARNING"}, f"Off by more than 2 cm; mute the constraints and drivers of {bones} and bake again")
            elif max(baked.errors["wrists"][0], baked.errors["ankles"][0]) > _FAR:
                self.report({"WARNING"}, "Hands or feet are off by more than 2 cm; the rig's limbs are short for this motion")
            size = "" if baked.ratio == 1.0 else f", motion scaled by {baked.ratio:.2f}"
            self.report({"INFO"}, f"'{baked.action.name}': off by cm, mean (largest): {errors}{size}")
            return {"FINISHED"}
        return {"CANCELLED"}
