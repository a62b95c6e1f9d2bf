"""What an object of the scene follows, directly or indirectly, with its place or with its shape,
and which simulations move it.

Blender's own graph of dependencies cannot be asked for this, so what that graph is built from is
read: parents, constraints (of bones, too), drivers, modifiers with their node groups, shape keys,
collections. What a driver's script names itself (``bpy.data.objects["…"]``) counts as well, though
Blender does not know of it.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import bpy

from ..compat import animated_paths, node_inputs

__all__ = ["Dependencies", "Simulation"]

_PLACE = ("location", "rotation", "scale", "delta_", "constraints[", "parent")
"""How the data paths begin that move an object."""
_SHAPE = ("modifiers[", "pose.", "instance_")
"""How the data paths begin that shape an object."""
_SIMULATED = {
    "CLOTH",
    "SOFT_BODY",
    "PARTICLE_SYSTEM",
    "PARTICLE_INSTANCE",
    "DYNAMIC_PAINT",
    "FLUID",
    "COLLISION",
}
"""Modifiers that name what they may push against: ``Simulation.colliders``, not what they follow.
"""
_BY_PLACE = {
    "COPY_LOCATION",
    "COPY_ROTATION",
    "COPY_SCALE",
    "COPY_TRANSFORMS",
    "LIMIT_DISTANCE",
    "TRANSFORM",
    "DAMPED_TRACK",
    "TRACK_TO",
    "LOCKED_TRACK",
    "STRETCH_TO",
    "CHILD_OF",
    "FLOOR",
    "PIVOT",
    "ACTION",
    "ARMATURE",
    "IK",
}
"""Constraints that follow their target's place, and its shape only where they name a bone or a
vertex group of it.
"""
_QUOTED = re.compile(r"""["'](.+?)["']""")
_NESTED = 2
"""How many levels of properties in a constraint or a modifier are searched for what it points to.
"""


class _Aspect(NamedTuple):
    """What of a datablock something follows.

    ``what``: of an object its place (``_IN_PLACE``) or its shape as well (``_IN_SHAPE``), of any
    datablock a single property by its data path; otherwise everything, except of objects.
    """

    owner: bpy.types.ID
    what: str


_IN_PLACE = "its place"
_IN_SHAPE = "its shape"


@dataclass(frozen=True)
class Simulation:
    """A simulation that is not baked: the ``name`` of its object, and the frame ``since`` which it
    runs. ``colliders``: the objects that may push it.
    """

    name: str
    since: int
    colliders: tuple[bpy.types.Object, ...]


class Dependencies:
    """What the objects of one scene follow, at the moment when this is made: each datablock is read
    only once.
    """

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        self._next: dict[_Aspect, set[_Aspect]] = {}

    def follows(
        self, follower: bpy.types.Object, leader: bpy.types.Object, shaped: bool = True
    ) -> bool:
        """Whether ``leader`` moves ``follower``, or with ``shaped`` also whether it shapes it; an
        object follows itself.
        """
        return _includes(self._all([_Aspect(follower, _IN_SHAPE if shaped else _IN_PLACE)]), leader)

    def setting_follows(self, owner: bpy.types.Object, path: str, leader: bpy.types.Object) -> bool:
        """Whether drivers let ``leader`` set any property of ``owner`` whose data path begins with
        ``path``.
        """
        return _includes(self._all([_Aspect(owner, path)]), leader)

    def simulations(
        self, owners: Iterable[bpy.types.Object], shaped: bool = True
    ) -> list[Simulation]:
        """The simulations, none of them baked, that move these objects or with ``shaped`` also
        shape them.
        """
        found: dict[Simulation, None] = {}
        for owner, what in self._all(
            _Aspect(owner, _IN_SHAPE if shaped else _IN_PLACE) for owner in owners
        ):
            if isinstance(owner, bpy.types.Object) and what in {_IN_PLACE, _IN_SHAPE}:
                found |= dict.fromkeys(self._rigid(owner))
                found |= dict.fromkeys(self._soft(owner) if what == _IN_SHAPE else ())
        return list(found)

    def _all(self, aspects: Iterable[_Aspect]) -> set[_Aspect]:
        """These and all that they follow."""
        found: set[_Aspect] = set()
        waiting = list(aspects)
        while waiting:
            aspect = waiting.pop()
            if aspect not in found:
                found.add(aspect)
                if aspect not in self._next:
                    self._next[aspect] = set(_followed(*aspect))
                waiting += self._next[aspect]

        return found

    def _rigid(self, owner: bpy.types.Object) -> Iterator[Simulation]:
        """The rigid body that moves an object: an active one, unless it is animated throughout."""
        world, body = self._scene.rigidbody_world, owner.rigid_body
        if (
            world is None
            or not world.enabled
            or world.collection is None
            or world.point_cache.is_baked
        ):
            return

        may_be_released = "rigid_body.kinematic" in animated_paths(owner)
        if (
            body is not None
            and body.type == "ACTIVE"
            and body.enabled
            and (may_be_released or not body.kinematic)
        ):
            yield Simulation(
                owner.name, world.point_cache.frame_start, tuple(world.collection.all_objects)
            )

    def _soft(self, owner: bpy.types.Object) -> Iterator[Simulation]:
        """Simulations among the modifiers."""
        scene = self._scene
        modifiers = list(_effective(owner.modifiers, owner))
        since = [
            cache.frame_start for each in modifiers for cache in _caches(each) if not cache.is_baked
        ]
        if any(
            each.type == "NODES" and each.node_group and _simulates(each.node_group)
            for each in modifiers
        ):
            since.append(
                scene.simulation_frame_start
                if scene.use_custom_simulation_range
                else scene.frame_start
            )

        if since:
            colliders = (
                o for o in scene.objects if any(m.type == "COLLISION" for m in o.modifiers)
            )
            yield Simulation(owner.name, min(since), tuple(colliders))


def _includes(aspects: set[_Aspect], leader: bpy.types.Object) -> bool:
    return not aspects.isdisjoint({_Aspect(leader, _IN_PLACE), _Aspect(leader, _IN_SHAPE)})


def _followed(owner: bpy.types.ID, what: str) -> Iterator[_Aspect]:
    """What one aspect follows directly."""
    if what not in {_IN_PLACE, _IN_SHAPE}:
        yield from _driven(owner, what)
    elif isinstance(owner, bpy.types.Object):
        yield from _driven(owner, _PLACE if what == _IN_PLACE else _PLACE + _SHAPE)
        yield from _placed(owner)
        if what == _IN_SHAPE:
            yield from _shaped(owner)
    else:
        yield from _driven(owner, "")
        yield from _aspects(_inside(owner))


def _inside(owner: bpy.types.ID) -> Iterator[Any]:
    """What a datablock other than an object is made of, as far as shapes may depend on it."""
    if isinstance(owner, bpy.types.Collection):
        yield from owner.all_objects
    elif isinstance(owner, bpy.types.NodeTree):
        for node in owner.nodes:
            yield getattr(node, "node_tree", None)
            yield from (
                getattr(each, "default_value", None) for each in node.inputs if not each.is_linked
            )
    else:
        yield from (
            getattr(owner, name, None)
            for name in ("shape_keys", "bevel_object", "taper_object", "follow_curve")
        )


def _aspects(found: Iterable[Any], what: str = _IN_SHAPE) -> Iterator[_Aspect]:
    """The datablocks among some values."""
    return (_Aspect(each, what) for each in found if isinstance(each, bpy.types.ID))


def _placed(owner: bpy.types.Object) -> Iterator[_Aspect]:
    if owner.parent:
        instanced = owner.parent.instance_type in {"VERTS", "FACES"}
        yield _Aspect(
            owner.parent, _IN_SHAPE if instanced or owner.parent_type != "OBJECT" else _IN_PLACE
        )
    yield from _constrained(owner.constraints, owner)


def _shaped(owner: bpy.types.Object) -> Iterator[_Aspect]:
    yield from _aspects([owner.data])
    for modifier in _effective(owner.modifiers, owner):
        if modifier.type not in _SIMULATED:
            yield from _aspects(_pointers(modifier, _NESTED))
    if owner.pose is not None:
        for bone in owner.pose.bones:
            yield from _constrained(bone.constraints, owner)


def _constrained(
    constraints: Iterable[bpy.types.Constraint], owner: bpy.types.Object
) -> Iterator[_Aspect]:
    for constraint in _effective(constraints, owner):
        parts = [constraint, *getattr(constraint, "targets", ())]
        inside = constraint.type not in _BY_PLACE or any(
            getattr(part, "subtarget", "") for part in parts
        )
        yield from _aspects(_pointers(constraint, _NESTED), _IN_SHAPE if inside else _IN_PLACE)


def _effective(blocks: Iterable[Any], owner: bpy.types.Object) -> Iterator[Any]:
    """Those of an object's modifiers or constraints that have an effect now, or that may have one
    since their switch is animated.
    """
    for block in blocks:
        off = (
            block.mute or not block.influence
            if isinstance(block, bpy.types.Constraint)
            else not block.show_viewport
        )
        if off:
            path = block.path_from_id()
            switches = {
                f"{path}.{name}" for name in ("mute", "enabled", "influence", "show_viewport")
            }
            if switches.isdisjoint(animated_paths(owner)):
                continue
        yield block


def _pointers(block: bpy.types.bpy_struct, depth: int) -> Iterator[bpy.types.ID]:
    """The datablocks that a block's properties point to, including its inputs of a node group."""
    for each in node_inputs(block) if isinstance(block, bpy.types.NodesModifier) else ():
        if isinstance(each, bpy.types.ID):
            yield each

    for kind in block.bl_rna.properties:
        if kind.type not in {"POINTER", "COLLECTION"} or kind.identifier == "rna_type":
            continue
        value = getattr(block, kind.identifier)
        for each in value if kind.type == "COLLECTION" else (value,):
            if isinstance(each, bpy.types.ID):
                yield each
            elif each is not None and depth:
                yield from _pointers(each, depth - 1)


def _driven(owner: bpy.types.ID, paths: str | tuple[str, ...]) -> Iterator[_Aspect]:
    """What the drivers of the properties whose data path begins with one of these read."""
    data = getattr(owner, "animation_data", None)
    for curve in data.drivers if data else ():
        if curve.mute or not curve.data_path.startswith(paths):
            continue
        if "bpy." in curve.driver.expression:
            yield from _aspects(
                bpy.data.objects.get(name) for name in _QUOTED.findall(curve.driver.expression)
            )

        for variable in curve.driver.variables:
            for target in variable.targets:
                if target.id is None:
                    continue

                path = target.data_path if variable.type == "SINGLE_PROP" else ""
                if _is_setting(path):
                    yield _Aspect(target.id, path)
                elif (
                    path.startswith(_SHAPE)
                    or target.bone_target
                    or not isinstance(target.id, bpy.types.Object)
                ):
                    yield _Aspect(target.id, _IN_SHAPE)
                else:
                    yield _Aspect(target.id, _IN_PLACE)


def _is_setting(path: str) -> bool:
    """Whether a data path is that of a custom property or of one of ours: these are keyed by hand,
    and only drivers move them.
    """
    return path.startswith("dafnet.") or path.endswith(('"]', "']"))


def _caches(modifier: bpy.types.Modifier) -> Iterator[Any]:
    """The point caches of a modifier."""
    if modifier.type in {"CLOTH", "SOFT_BODY"}:
        yield modifier.point_cache
    elif modifier.type == "PARTICLE_SYSTEM":
        yield modifier.particle_system.point_cache
    elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings:
        yield from (surface.point_cache for surface in modifier.canvas_settings.canvas_surfaces)


def _simulates(tree: bpy.types.NodeTree) -> bool:
    """Whether a node group has a simulation zone, also in a group in it."""
    inner = (node.node_tree for node in tree.nodes if getattr(node, "node_tree", None))
    return any(node.bl_idname == "GeometryNodeSimulationOutput" for node in tree.nodes) or any(
        map(_simulates, inner)
    )
