"""Bake what a character plays onto the animator's own rig."""

from collections.abc import Generator
from typing import Any

import bpy

from ..dafnet_addon.blender.rig.baker import Baked, bake_onto_rig
from ..dafnet_addon.blender.rig.doubts import doubts
from ..dafnet_addon.blender.rig.properties import character_for, map_of, rig_of
from .base import RigOperator
from .long import LongOperator

__all__ = ["DAFNET_OT_bake_to_rig"]


class DAFNET_OT_bake_to_rig(RigOperator, LongOperator, bpy.types.Operator):
    """Bake the motion that the character plays, your edits included, into a new action on this
    armature
    """

    bl_idname = "dafnet.bake_to_rig"
    bl_label = "Bake to Rig"
    bl_options = {"REGISTER", "UNDO"}

    def steps(self, context: bpy.types.Context) -> Generator[float, None, Baked]:
        """Bake as the rig's settings say."""
        rig: Any = rig_of(context)
        own = rig.dafnet_rig
        return bake_onto_rig.steps(
            context,
            character_for(context, rig),
            rig,
            map_of(rig),
            root_motion=own.root_motion,
            limbs=own.limbs,
        )

    def report_result(self, result: Baked) -> None:
        """Say how near the result is, and what is off."""
        for doubt in doubts(result):
            self.report({"WARNING"}, doubt)

        places = ", ".join(
            f"{part} {100 * mean:.1f} ({100 * most:.1f})"
            for part, (mean, most) in result.errors.items()
        )
        limbs = ", ".join(
            f"{limb} {mean:.0f} ({most:.0f})" for limb, (mean, most) in result.angles.items()
        )
        errors = f"mean (largest) error in cm: {places}; in degrees: {limbs}"
        self.report({"INFO"}, f"'{result.action.name}': {errors}")
