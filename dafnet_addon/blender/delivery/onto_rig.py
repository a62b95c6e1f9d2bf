"""Takes put onto a rig of the user's, each as an action of its own."""

from collections.abc import Generator
from dataclasses import replace

import bpy

from ...core.errors import InputError
from ...core.progress import stepwise
from ..compat import assign_action
from ..rig.baker import bake_onto_rig
from ..rig.doubts import doubts
from ..rig.properties import map_of
from .people import Played

__all__ = ["onto_rig", "rig_named"]


def rig_named(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """The armature of this name in the scene. ``InputError`` where there is none."""
    rigs = [each for each in scene.objects if each.type == "ARMATURE"]
    for rig in rigs:
        if name in (rig.name, rig.name_full):
            return rig
    names = ", ".join(f"'{rig.name}'" for rig in rigs) or "none"
    raise InputError(
        f"The scene '{scene.name}' has no armature '{name}'; give --rig one that it has: {names}."
    )


@stepwise
def onto_rig(
    context: bpy.types.Context, person: Played, rig: bpy.types.Object
) -> Generator[float, None, tuple[Played, tuple[str, ...]]]:
    """Bake all takes of a character onto a rig, as its settings in *Your Rig* say; the first one
    plays.

    Returns the rig as the person, and sentences about what is off. ``InputError``: the rig cannot
    be used; it is then as it was.
    """
    own, rig_map = rig.dafnet_rig, map_of(rig)
    actions: list[bpy.types.Action] = []
    said: dict[str, None] = {}
    for number, action in enumerate(person.actions):
        assign_action(person.armature, action)
        baked = bake_onto_rig(
            context,
            person.armature,
            rig,
            rig_map,
            root_motion=own.root_motion,
            limbs=own.limbs,
            frames=person.frames(number),
            name=f"{action.name} on {rig.name}",
        )
        actions.append(baked.action)
        said |= dict.fromkeys(f"{doubt}." for doubt in doubts(baked))
        yield (number + 1) / len(person.actions)

    assign_action(person.armature, person.actions[0])
    assign_action(rig, actions[0])
    onto = replace(person, armature=rig, actions=actions, instead_of=person.armature)
    return onto, tuple(said)
