"""Bake what a character plays onto the animator's own rig."""

from typing import Any

import bpy

from ..dafnet_addon.blender.rig.baker import Baked, bake_onto_rig
from ..dafnet_addon.blender.rig.properties import character_for, map_of, rig_of
from .base import DafnetOperator, idle

__all__ = ["DAFNET_OT_bake_to_rig"]

_FAR = 0.02
"""Metres of mean error above which the user is warned."""
_TURNED = 8.0
"""Degrees of mean error above which the user is warned."""


class DAFNET_OT_bake_to_rig(DafnetOperator, bpy.types.Operator):
    """Bake the motion that the character plays, your edits included, into a new action on this
    armature
    """

    bl_idname = "dafnet.bake_to_rig"
    bl_label = "Bake to Rig"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A rig of the animator's own is active, and no job is running."""
        if not idle(cls):
            return False
        cls.poll_message_set("Select the armature of your rig, in object or pose mode")
        return rig_of(context) is not None and context.mode in {"OBJECT", "POSE"}

    def run(self, context: bpy.types.Context) -> None:
        """Bake, and say how near the result is."""
        rig: Any = rig_of(context)

        own = rig.dafnet_rig
        baked = bake_onto_rig(
            context,
            character_for(context, rig),
            rig,
            map_of(rig),
            root_motion=own.root_motion,
            limbs=own.limbs,
        )

        if baked.ratio != 1.0:
            self.report(
                {"WARNING"},
                f"The motion was made for a body of another size, and scaled by {baked.ratio:.2f}: "
                "it may miss seats, tables and targets; press Size Character as Rig, and generate "
                "it again",
            )

        if off := _deviations(baked):
            bones = ", ".join(f"'{bone}'" for bone in baked.overruled[:3])

            why = (
                f"mute the constraints and drivers of {bones} and bake again"
                if bones
                else "its proportions differ"
            )
            self.report({"WARNING"}, f"The rig deviates from the character's motion, {off}: {why}")

        places = ", ".join(
            f"{part} {100 * mean:.1f} ({100 * most:.1f})"
            for part, (mean, most) in baked.errors.items()
        )
        limbs = ", ".join(
            f"{limb} {mean:.0f} ({most:.0f})" for limb, (mean, most) in baked.angles.items()
        )
        errors = f"mean (largest) error in cm: {places}; in degrees: {limbs}"
        self.report({"INFO"}, f"'{baked.action.name}': {errors}")


def _deviations(baked: Baked) -> str:
    """What a viewer would see to be off, with its mean error; empty where nothing is."""
    places = [
        f"{part} by {100 * mean:.0f} cm" for part, (mean, _) in baked.errors.items() if mean > _FAR
    ]
    limbs = [
        f"{limb} by {mean:.0f} degrees"
        for limb, (mean, _) in baked.angles.items()
        if mean > _TURNED
    ]
    return ", ".join(limbs + places)
