"""A character as large as the animator's own rig: its motion then needs no scaling, and it walks
with that rig's stride and sits on its thighs.
"""

import bpy
import numpy as np

from ...core.body import canonical_body
from ...core.errors import InputError
from ...core.skeleton import ANKLES, JOINTS, KNEES, PARENTS, STATURE
from ...core.units import PERSON, likely_unit, require_human_height
from ..character.armature import character_scale, metres_per_unit
from ..compat import playing_paths
from .maps import RigMap, require_usable, with_bone_names_of
from .reading import rest_matrices, rigid_parts

__all__ = ["leg_ratio", "require_rig_of_a_person", "size_as_rig"]


def leg_ratio(rig: bpy.types.Object, rig_map: RigMap) -> float:
    """The rig's size over the canonical body, by its legs, in Blender units for a canonical metre.

    ``InputError``: the map lacks joints, or the rig is scaled unevenly.
    """
    rig_map = with_bone_names_of(rig_map, rig.data.bones.keys())
    require_usable(rig, rig_map)
    world = np.array(rig.matrix_world, float)[None]
    _, scale = rigid_parts(world, f"armature '{rig.name}'")
    heads = rest_matrices(rig, [rig_map.place(name) for name in JOINTS])[:, :3, 3]
    bones = [np.linalg.norm(heads[j] - heads[PARENTS[j]]) for j in KNEES + ANKLES]
    return 0.5 * scale * float(np.sum(bones)) / canonical_body(1.0).leg()


def require_rig_of_a_person(scene: bpy.types.Scene, rig: bpy.types.Object, rig_map: RigMap) -> None:
    """``InputError`` where a rig is so tall that its unit is not the scene's, with the likely
    one.
    """
    height = leg_ratio(rig, rig_map) * metres_per_unit(scene) * STATURE
    if (unit := likely_unit(height, PERSON)) is not None:
        remedy = f"scale the armature object by {unit[1]:g}, or import it with that scale"
        require_human_height(height, f"A person with the legs of '{rig.name}'", remedy)


def size_as_rig(
    context: bpy.types.Context,
    character: bpy.types.Object,
    rig: bpy.types.Object,
    rig_map: RigMap,
) -> float:
    """Scale the character so that its legs are as long as the rig's: the height (metres) of a
    person with such legs.

    ``InputError``: the character or the rig cannot be measured, or the character's scale is locked,
    keyed or driven.
    """
    wanted = leg_ratio(rig, rig_map)
    require_rig_of_a_person(context.scene, rig, rig_map)
    factor = wanted / character_scale(character)
    if any(character.lock_scale) or "scale" in playing_paths(character):
        raise InputError(
            f"The scale of '{character.name}' is locked, keyed or driven; unlock it, or remove its "
            "keys, NLA strips and drivers, and try again."
        )

    character.scale = [each * factor for each in character.scale]
    context.view_layer.update()
    return wanted * metres_per_unit(context.scene) * STATURE
