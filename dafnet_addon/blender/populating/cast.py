"""Who plays: the project's mannequin, characters of users' files, armatures that the room has."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.skeleton import STATURE
from ...core.take import Controls, Take
from ...director.plans import Plan
from ...director.shots import Shot, Somebody
from ..character.armature import create_character, is_character, metres_per_unit
from ..character.mannequin import body_material
from ..character.takes import add_take, play_take
from ..compat import assign_action
from ..directing.plan_keys import plan_keyed
from ..pipeline.baker import bake, require_bakeable
from ..rig.baker import bake_onto_rig
from ..rig.detection import detect_map
from ..rig.properties import map_of
from ..rig.sizing import leg_ratio
from .importing import added_objects

__all__ = ["Player", "dismiss", "embodied", "hire", "play"]

_BUILDS = (0.9, 1.12)
"""How thick trunks and limbs are over the usual, between which a build is drawn."""

_COLOURS = {
    "Terracotta": (0.56, 0.22, 0.13),
    "Teal": (0.10, 0.33, 0.34),
    "Mustard": (0.62, 0.42, 0.10),
    "Sage": (0.30, 0.40, 0.26),
    "Slate": (0.20, 0.27, 0.38),
    "Plum": (0.34, 0.14, 0.27),
    "Sand": (0.62, 0.52, 0.38),
    "Brick": (0.45, 0.11, 0.09),
    "Navy": (0.07, 0.11, 0.24),
    "Stone": (0.62, 0.56, 0.50),
}


@dataclass(frozen=True)
class Player:
    """Somebody, as tall as who plays him: an ``armature`` that is there already, or None for a
    mannequin that is still to be made.
    """

    who: Somebody
    armature: bpy.types.Object | None = None


def hire(context: bpy.types.Context, shot: Shot, who: Somebody) -> Player:
    """Who plays somebody. Raises InputError where the character that is named, or a file of the
    cast, cannot be used.
    """
    if who.character is not None:
        armature = _in_scene(context.scene, who.character)
    elif who.cast is not None:
        armature = _from_file(context, shot.path(who.cast), who)
    else:
        return Player(who)

    unit = metres_per_unit(context.scene)
    if not who.tasks and not is_character(armature):
        raise InputError(
            f"The armature '{armature.name}' has no root of its own to follow; give it tasks."
        )
    if is_character(armature):
        size = require_bakeable(armature, unit)
    else:
        size = leg_ratio(armature, map_of(armature)) * unit
    return Player(replace(who, height=size * STATURE), armature)


def _in_scene(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    armatures = {each.name: each for each in scene.objects if each.type == "ARMATURE"}
    if name not in armatures:
        known = ", ".join(f"'{each}'" for each in sorted(armatures)) or "none"
        raise InputError(
            f"The room has no armature '{name}'; write the name of one that it has: {known}."
        )
    return armatures[name]


def _from_file(context: bpy.types.Context, file: Path, who: Somebody) -> bpy.types.Object:
    """The armature of a file of the cast, added to the scene for this person alone."""
    collection = bpy.data.collections.new(who.name)
    context.scene.collection.children.link(collection)
    added = added_objects(context, file, collection, "the cast")
    context.view_layer.update()
    armatures = [each for each in added if each.type == "ARMATURE"]
    usable = [each for each in armatures if is_character(each) or detect_map(each).joints]
    if not usable:
        raise InputError(
            f"'{file.name}' of the cast has no armature whose bones are known; map them in Your "
            "Rig, and save the file."
        )
    return max(usable, key=lambda each: len(each.data.bones))


def embodied(
    context: bpy.types.Context, player: Player, plan: Plan | None, furniture: bpy.types.Collection
) -> Player:
    """The same, with the mannequin that plays him where nobody else does. The plan's root, targets
    and modes are keyed on a character of ours, so that they can be edited.

    All are to be made before any is baked, since Blender looks at the whole scene for each.
    """
    armature = player.armature
    if armature is None:
        armature = _mannequin(context, player.who)
        armature.dafnet.furniture = furniture
    if plan is not None and is_character(armature):
        first, unit = context.scene.frame_start, metres_per_unit(context.scene)
        with plan_keyed(context, armature, plan, first=first, unit=unit):
            pass
    return replace(player, armature=armature)


def play(
    context: bpy.types.Context,
    player: Player,
    *,
    takes: Sequence[Take],
    controls: Controls,
    first: int,
) -> tuple[bpy.types.Object, list[bpy.types.Action]]:
    """Key all takes from frame ``first`` on; the armature that plays the first one, and an action
    for each.
    """
    armature = player.armature
    assert armature is not None
    if is_character(armature):
        return armature, _own(context, armature, takes, controls, first)

    double = create_character(context, f"{player.who.name} Double", player.who.height)
    actions: list[bpy.types.Action] = []
    for action in _own(context, double, takes, controls, first):
        play_take(double, action)
        frames = range(first, first + len(takes[0]))
        name = f"{player.who.name} take {len(actions) + 1}"
        baked = bake_onto_rig(context, double, armature, map_of(armature), frames=frames, name=name)
        actions.append(baked.action)
    assign_action(armature, actions[0])
    used = [row.action for row in double.dafnet.takes if row.action is not None]
    _remove(double.users_collection[0])
    bpy.data.batch_remove(used)
    return armature, actions


def _own(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    takes: Sequence[Take],
    controls: Controls,
    first: int,
) -> list[bpy.types.Action]:
    """Actions of a character of ours."""
    unit = metres_per_unit(context.scene)
    actions = []
    for k, take in enumerate(takes, 1):
        action = bake(take, armature, first, f"{armature.name} take {k}", unit)
        add_take(armature, action, take=take, controls=controls, frame_start=first)
        actions.append(action)
    play_take(armature, actions[0])
    drawn = takes[0].draw
    armature.dafnet.seed, armature.dafnet.temperature = drawn.seed, drawn.temperature
    return actions


def _mannequin(context: bpy.types.Context, who: Somebody) -> bpy.types.Object:
    rng = np.random.default_rng(who.seed)
    build = float(rng.uniform(*_BUILDS))
    armature = create_character(context, who.name, who.height, build)
    name = list(_COLOURS)[int(rng.integers(len(_COLOURS)))]
    for child in armature.children:
        if child.type == "MESH":
            material = body_material(f"Mannequin {name}", (*_COLOURS[name], 1.0))
            child.data.materials[0] = material
    return armature


def dismiss(player: Player) -> None:
    """Remove from the scene what somebody who is left out brought with him."""
    if player.armature is not None and player.who.cast is not None:
        _remove(player.armature.users_collection[0])


def _remove(collection: bpy.types.Collection) -> None:
    """With all objects that are in it alone, and what only these use."""
    for each in list(collection.all_objects):
        data = each.data
        bpy.data.objects.remove(each)
        if data is not None and not data.users:
            bpy.data.batch_remove([data])
    bpy.data.collections.remove(collection)
