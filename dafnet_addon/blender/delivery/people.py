"""The people of a shot, each with takes; one take of all of them plays at a time."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.errors import InputError
from ...core.files import portable_name
from ...core.retargeting import Motion
from ...core.skeleton import JOINTS
from ...core.take import Take
from ...director.plans import Plan
from ..character.armature import is_character, objects_of
from ..character.mannequin import FACING
from ..character.takes import PACKED, active_take, stored_take
from ..compat import assign_action
from ..pipeline.rollback import state_restorer
from ..rig.maps import RigMap, with_bone_names_of
from ..rig.properties import map_of
from ..rig.reading import (
    character_motion,
    motion_of,
    pose_matrices,
    rest_matrices,
    rigid_parts,
    shape_of,
)
from ..scene.playback import frame_kept

__all__ = [
    "Body",
    "Played",
    "distinct_names",
    "facing_of",
    "file_names",
    "playing",
    "takes_to_play",
    "with_chosen_take",
]


@dataclass(frozen=True)
class Played:
    """Somebody of a shot: the ``armature``, a character of ours or a rig that is mapped, with
    ``actions`` of hers, one for each of ``takes``, and the ``plan`` of her tasks, if she has any.

    ``instead_of``: the character whose motion a rig has; it is not shown where the rig is. Her
    furniture is the collection of ``armature.dafnet.furniture``, or all that stands in the
    scene. An action's first frame is that of its take and of the plan.
    """

    armature: bpy.types.Object
    takes: Sequence[Take]
    actions: Sequence[bpy.types.Action]
    plan: Plan | None = None
    instead_of: bpy.types.Object | None = None

    @property
    def name(self) -> str:
        return str(self.armature.name)

    def frames(self, number: int) -> range:
        """The scene's frames of a take."""
        action = self.actions[number]
        is_take = PACKED in action
        first = action.dafnet.frame_start if is_take else round(action.frame_range[0])
        return range(first, first + len(self.takes[number]))

    def meshes(self) -> set[bpy.types.Object]:
        """All that she looks like: what is parented to her armature or deformed by it."""
        worn = {
            each
            for each in bpy.data.objects
            if any(m.type == "ARMATURE" and m.object == self.armature for m in each.modifiers)
        }
        return worn | objects_of(self.armature)


def with_chosen_take(armature: bpy.types.Object) -> Played:
    """A character with the take that is chosen in her list. ``InputError`` where none is."""
    action = active_take(armature)
    if action is None:
        raise InputError(f"'{armature.name}' has no take that is chosen; choose one in the list.")
    return Played(armature, [stored_take(action)[0]], [action])


def takes_to_play(people: Sequence[Played]) -> range:
    """The numbers of the takes. ``InputError`` where there is nobody, or not everybody has as
    many.
    """
    counts = {len(person.takes) for person in people} | {len(person.actions) for person in people}
    if len(counts) != 1 or counts == {0}:
        raise InputError(
            "Not everybody has as many takes, or nobody has any; generate them together."
        )
    return range(counts.pop())


@contextmanager
def playing(scene: bpy.types.Scene, people: Sequence[Played], number: int) -> Iterator[None]:
    """A block in which everybody plays this take; afterwards all is as it was."""
    with ExitStack() as undo:
        undo.enter_context(frame_kept(scene))
        for person in people:
            undo.callback(state_restorer(person.armature), person.armature)
            assign_action(person.armature, person.actions[number])
            for hidden in objects_of(person.instead_of) if person.instead_of else ():
                undo.callback(setattr, hidden, "hide_render", hidden.hide_render)
                hidden.hide_render = True
        yield


def file_names(people: Sequence[Played]) -> list[str]:
    """A name of a file for each of them, without an ending, all different."""
    return distinct_names([person.name for person in people])


def distinct_names(names: Sequence[str]) -> list[str]:
    """For each of these names one that a file can have on any system, without an ending, all
    different there, also where upper and lower case are one.
    """
    found: list[str] = []
    for each in names:
        cleaned = name = portable_name(bpy.path.clean_name(each))
        while name.lower() in (other.lower() for other in found):
            name = f"{cleaned}_{len(found) + 1}"
        found.append(name)
    return found


def facing_of(armature: bpy.types.Object) -> np.ndarray:
    """The axes of the canonical frame (x right, y forward, z up) in an armature's space, as columns
    (3, 3).
    """
    if is_character(armature):
        return FACING
    rig_map = with_bone_names_of(map_of(armature), armature.data.bones.keys())
    rest = rest_matrices(armature, [rig_map.place(name) for name in JOINTS])
    return shape_of(armature, rig_map, rest, 1.0).axes


class Body:
    """The joints of an armature, noted frame by frame as Blender plays them."""

    def __init__(self, armature: bpy.types.Object) -> None:
        self._armature = armature
        self._map: RigMap | None = None
        self._places: list[str | None] = [*JOINTS]
        if not is_character(armature):
            self._map = with_bone_names_of(map_of(armature), armature.data.bones.keys())
            self._places = [self._map.place(name) for name in JOINTS]
        self._bodies: list[np.ndarray] = []
        self._poses: list[np.ndarray] = []

    def add(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Note the frame that the scene shows now."""
        evaluated = self._armature.evaluated_get(depsgraph)
        self._bodies.append(np.array(evaluated.matrix_world, float))
        self._poses.append(pose_matrices(evaluated, self._places))

    def motion(self, frames: slice = slice(None)) -> Motion:
        """What was noted in these frames; world, Blender units."""
        bodies, poses = np.array(self._bodies[frames]), np.array(self._poses[frames])
        if self._map is None:
            return character_motion(self._armature, bodies, poses)
        rest = rest_matrices(self._armature, self._places)
        _, scale = rigid_parts(bodies, f"armature '{self._armature.name}'")
        return motion_of(shape_of(self._armature, self._map, rest, scale), bodies, poses)
