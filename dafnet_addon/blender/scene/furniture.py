"""The meshes that a character may touch or must avoid, as the viewport evaluates them, and how they
move.

What follows the character is not furniture, and neither are helpers: objects that no render shows
and that the viewport draws as wire or bounds, and those that Booleans cut with.
"""

from collections import defaultdict
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import InputError
from ...core.skeleton import TARGETS
from ...core.solids import Mesh
from ..character.armature import is_character, metres_per_unit
from ..character.settings import Settings
from ..rig.detection import detect_map
from ..rig.maps import NEEDED
from .dependencies import Dependencies
from .lookup import find_collection, find_object, find_scene
from .playback import play_steps

__all__ = [
    "Furniture",
    "array",
    "furniture_at",
    "furniture_now",
    "furniture_of",
    "meshes_in",
    "rendered",
]

_DRAWN_THROUGH = {"WIRE", "BOUNDS"}
"""Display types that do not look solid."""
_SHAPE_TOLERANCE = 1e-3
"""How far a vertex may move, over the mesh's size, before its shape counts as changed."""


@dataclass
class _Piece:
    """One evaluated mesh, an object's own (``source``) or an instance, with its matrix in each
    frame.

    ``key`` finds it again. ``vertices`` (V, 3), ``triangles`` (F, 3): in its own space, Blender
    units. ``softness``: metres, None where nobody says.
    """

    key: tuple
    name: str
    source: bpy.types.Object | None
    vertices: np.ndarray
    triangles: np.ndarray
    softness: float | None = None
    matrices: list[np.ndarray] = field(default_factory=list)


def furniture_of(settings: Settings, dependencies: Dependencies) -> "Furniture | None":
    """The character's furniture, None where no collection is chosen. ``InputError``: the collection
    is gone.
    """
    if settings.furniture is None:
        return None

    scene = find_scene(settings)
    armature = find_object(settings, settings.armature, "character")
    named = (settings.root, *(getattr(settings, role) for role in TARGETS))
    own = {
        armature,
        *armature.children_recursive,
        *(o for o in scene.objects if o.name_full in named),
    }
    return Furniture(
        scene,
        collection=find_collection(settings.furniture),
        armature=armature,
        own=own,
        dependencies=dependencies,
    )


def furniture_now(context: bpy.types.Context, settings: Settings) -> dict[str, list[Mesh]]:
    """The furniture's meshes in the current frame by the names of the objects that they belong to;
    world, metres.

    ``InputError`` where none is visible, as for ``scene_reader.read_scene``.
    """
    scene = find_scene(settings)
    furniture = furniture_of(settings, Dependencies(scene))
    if furniture is None:
        return {}

    furniture.begin(context.evaluated_depsgraph_get())
    found: dict[str, list[Mesh]] = defaultdict(list)
    for solid in furniture.solids(metres_per_unit(scene)):
        found[solid.name].append(solid)

    return dict(found)


def furniture_at(
    context: bpy.types.Context, settings: Settings, frame: int, look: Callable[[], None]
) -> Generator[float, None, tuple[Mesh, ...]]:
    """The furniture's meshes in another frame, as they are when the scene is played; world, metres.
    ``look`` is called in that frame, too.

    A job, see ``playback.play_steps``. ``InputError`` as for ``furniture_now``.
    """
    scene = find_scene(settings)
    dependencies = Dependencies(scene)
    furniture = furniture_of(settings, dependencies)
    simulations = dependencies.simulations(furniture.members) if furniture else []

    def begin(_frame: int, depsgraph: bpy.types.Depsgraph, _shaped: set[bpy.types.Object]) -> None:
        look()
        if furniture:
            furniture.begin(depsgraph)

    yield from play_steps(context, [frame], simulations, begin)
    return furniture.solids(metres_per_unit(scene)) if furniture else ()


def meshes_in(
    depsgraph: bpy.types.Depsgraph, members: set[bpy.types.Object], unit: float
) -> Iterator[Mesh]:
    """The evaluated meshes of some objects, what they instance included, that have faces, by their
    objects' names; world, metres (``unit``: of a Blender unit). Those of one mesh share its arrays.
    """
    shapes: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for instance in depsgraph.object_instances:
        owner = _owner(instance)
        if owner not in members or instance.object.type != "MESH":
            continue
        if not (instance.is_instance or instance.show_self):
            continue
        pointer = instance.object.data.as_pointer()
        if pointer not in shapes:
            shapes[pointer] = _geometry(instance.object)
        vertices, triangles = shapes[pointer]
        if len(triangles):
            piece = _Piece(
                _key(instance), owner.name, None, vertices, triangles, _softness(instance)
            )
            piece.matrices.append(array(instance.matrix_world))
            yield _solid(piece, unit)


class Furniture:
    """A collection's meshes as evaluated in the frame in which it begins (``begin``), and their
    matrices in that frame and in all that are added.

    ``own``: the character, its parts and what directs it. ``members``: the objects whose meshes are
    furniture.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        collection: bpy.types.Collection,
        armature: bpy.types.Object,
        own: set[bpy.types.Object],
        dependencies: Dependencies,
    ) -> None:
        self._collection = collection
        self._armature = armature
        self._own = own
        self._dependencies = dependencies

        candidates = [o for o in collection.all_objects if o not in own]
        self._carried = {o for o in candidates if dependencies.follows(o, armature)}
        drawn_through = {o for o in candidates if o.display_type in _DRAWN_THROUGH}
        unrendered = set(candidates) - rendered(scene.collection)
        self._helpers = (drawn_through & unrendered) | (
            (drawn_through | unrendered) & _cutters(scene)
        ) - self._carried
        self._doubtful = (drawn_through | unrendered) - self._helpers - self._carried
        self._bodies = _bodies_of_rigs(candidates) - self._carried
        self.members = set(candidates) - self._carried - self._helpers - self._bodies

        self._pieces: list[_Piece] = []
        self._shown: dict[bpy.types.Object, bool] = {}
        self._changed: dict[str, None] = {}
        self._toggled: dict[str, None] = {}

    def begin(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Read the meshes that have faces; instances of one mesh share its arrays. ``InputError``:
        there is none.
        """
        shapes: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        found = False
        for instance in self._meshes(depsgraph):
            found = True
            pointer = instance.object.data.as_pointer()
            if pointer not in shapes:
                shapes[pointer] = _geometry(instance.object)

            vertices, triangles = shapes[pointer]
            if len(triangles):
                source = None if instance.is_instance else instance.object.original
                piece = _Piece(
                    key=_key(instance),
                    name=_owner(instance).name,
                    source=source,
                    vertices=vertices,
                    triangles=triangles,
                    softness=_softness(instance),
                )
                piece.matrices.append(array(instance.matrix_world))
                self._pieces.append(piece)

        name = self._collection.name
        if not found:
            raise InputError(
                f"The furniture collection '{name}' has no visible mesh besides the character's "
                "own; add some, or clear the setting."
            )

        if not self._pieces:
            raise InputError(
                f"The meshes of the furniture collection '{name}' have no faces; add some, or "
                "choose another collection."
            )

        self._shown = {o: o.visible_get() for o in self.members if _may_have_faces(o)}

    def add(self, depsgraph: bpy.types.Depsgraph, shaped: set[bpy.types.Object]) -> None:
        """Add another frame's matrices; what is gone or disabled by now stays where it was.

        ``shaped``: the objects that Blender has shaped anew for this frame.
        """
        found: dict[tuple, np.ndarray] = {}
        if any(piece.source is None for piece in self._pieces):
            shapes = {piece.key: piece for piece in self._pieces}
            for instance in self._meshes(depsgraph):
                key = _key(instance)
                if not instance.is_instance:
                    continue
                if key not in shapes:
                    self._toggled[_owner(instance).name] = None
                    continue
                found[key] = array(instance.matrix_world)
                if _owner(instance) in shaped or instance.object.original in shaped:
                    self._compare(shapes[key], instance.object)

        for piece in self._pieces:
            if piece.source is not None:
                evaluated = piece.source.evaluated_get(depsgraph)
                found[piece.key] = array(evaluated.matrix_world)
                if piece.source in shaped and piece.source.visible_get():
                    self._compare(piece, evaluated)
            elif piece.key not in found:
                self._toggled[piece.name] = None
            piece.matrices.append(found[piece.key] if piece.key in found else piece.matrices[-1])

        for member, shown in self._shown.items():
            if member.visible_get() != shown:
                self._toggled[member.name] = None

    def solids(self, unit: float) -> tuple[Mesh, ...]:
        """The furniture in metres; ``unit``: a Blender unit in metres."""
        return tuple(_solid(piece, unit) for piece in self._pieces)

    def warnings(self) -> Iterator[str]:
        """Warnings about what was read differently from what the scene shows."""
        nowhere = (
            p.name
            for p in self._pieces
            if not np.any(np.abs(np.array(p.matrices)[:, :3, :3]) > 1e-9)
        )
        for name in dict.fromkeys(nowhere):
            yield (
                f"'{name}' is scaled to zero, so the character does not see it; give it a scale."
            )

        for name in self._changed:
            yield (
                f"The shape of '{name}' changes during the shot; its shape at the first frame is "
                "used."
            )

        for name in self._toggled:
            yield (
                f"'{name}' is shown or hidden during the shot; it counts throughout as it does at "
                "the first frame."
            )

        worn = {
            o
            for o in self._carried
            if any(m.type == "ARMATURE" and m.object == self._armature for m in o.modifiers)
        }
        if carried := self._named(self._carried - worn):
            yield f"Ignored as furniture, since the character moves it: {carried}."

        if bodies := self._named(self._bodies):
            yield f"Ignored as furniture, since it is somebody's body: {bodies}."

        if helpers := self._named(self._helpers):
            yield (
                f"Ignored as helpers, since no render shows them: {helpers}; let renders show "
                "what should count."
            )

        if doubtful := self._named(self._doubtful):
            yield (
                "Not rendered, or drawn as wire or bounds, but solid for the character: "
                f"{doubtful}; hide in the viewport what should not count."
            )

    def _named(self, objects: set[bpy.types.Object]) -> str:
        return ", ".join(
            sorted(f"'{o.name}'" for o in objects if o.type == "MESH" and o.visible_get())
        )

    def _meshes(
        self, depsgraph: bpy.types.Depsgraph
    ) -> Iterator[bpy.types.DepsgraphObjectInstance]:
        """Every evaluated mesh that is furniture, including instances."""
        for instance in depsgraph.object_instances:
            if instance.object.type != "MESH" or not (instance.is_instance or instance.show_self):
                continue
            owner, original = _owner(instance), instance.object.original
            if owner in self.members and owner.visible_get() and not self._follows(original):
                yield instance

    def _follows(self, original: bpy.types.Object) -> bool:
        """Whether an object that may lie outside the collection, in an instanced one, is the
        character's or moved by it.
        """
        if original in self.members:
            return False
        return original in self._own or self._dependencies.follows(original, self._armature)

    def _compare(self, piece: _Piece, evaluated: bpy.types.Object) -> None:
        if piece.name in self._changed:
            return

        vertices, _ = _geometry(evaluated)
        tolerance = _SHAPE_TOLERANCE * np.ptp(piece.vertices, axis=0).max()
        if (
            vertices.shape != piece.vertices.shape
            or np.abs(vertices - piece.vertices).max() > tolerance
        ):
            self._changed[piece.name] = None


def _bodies_of_rigs(candidates: list[bpy.types.Object]) -> set[bpy.types.Object]:
    """What the users' own people wear: deformed by, or parented to, an armature with the joints of
    a person.
    """

    def rigs_of(each: bpy.types.Object) -> set[bpy.types.Object]:
        found = {m.object for m in each.modifiers if m.type == "ARMATURE"} | {each.parent}
        return {o for o in found if o is not None and o.type == "ARMATURE" and not is_character(o)}

    rigs = set().union(*map(rigs_of, candidates)) if candidates else set()
    people = {rig for rig in rigs if all(name in detect_map(rig).joints for name in NEEDED)}
    return {each for each in candidates if rigs_of(each) & people}


def _may_have_faces(member: bpy.types.Object) -> bool:
    return member.type == "MESH" or member.is_instancer


def rendered(collection: bpy.types.Collection) -> set[bpy.types.Object]:
    """The objects of a collection and of those in it that a render shows."""
    if collection.hide_render:
        return set()
    inner = (rendered(child) for child in collection.children)
    return {o for o in collection.objects if not o.hide_render}.union(*inner)


def _cutters(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """What Boolean modifiers cut out of something, or join to it."""
    found: set[bpy.types.Object] = set()
    for modifier in (
        m for o in scene.objects for m in o.modifiers if m.type == "BOOLEAN" and m.show_viewport
    ):
        by_collection = modifier.operand_type == "COLLECTION" and modifier.collection
        found |= set(modifier.collection.all_objects) if by_collection else {modifier.object}
    return found - {None}


def array(matrix: Matrix) -> np.ndarray:
    """A matrix of Blender's as an array (4, 4)."""
    return np.array(matrix, float)


def _owner(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    return (instance.parent or instance.object).original


def _key(instance: bpy.types.DepsgraphObjectInstance) -> tuple:
    """Names one evaluated mesh of the scene, the same in every frame."""
    place = tuple(instance.persistent_id) if instance.is_instance else ()
    return (_owner(instance).name_full, instance.object.original.name_full, place)


def _softness(instance: bpy.types.DepsgraphObjectInstance) -> float | None:
    """Metres by which the instance gives way, as its object or its owner says; None where neither
    does.
    """
    for each in (instance.object.original, _owner(instance)):
        if not each.dafnet.guess_softness:
            return float(each.dafnet.softness) / 100.0
    return None


def _geometry(evaluated: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3) in the object's own space."""
    mesh = evaluated.to_mesh()
    try:
        mesh.calc_loop_triangles()
        vertices = np.empty(3 * len(mesh.vertices), np.float32)
        triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.vertices.foreach_get("co", vertices)
        mesh.loop_triangles.foreach_get("vertices", triangles)
    finally:
        evaluated.to_mesh_clear()

    return vertices.reshape(-1, 3).astype(float), triangles.reshape(-1, 3)


def _solid(piece: _Piece, unit: float) -> Mesh:
    matrices = np.array(piece.matrices)
    matrices[:, :3] *= unit
    still = np.allclose(matrices, matrices[0], atol=1e-6)
    return Mesh(
        vertices=piece.vertices,
        triangles=piece.triangles,
        matrix=matrices[0] if still else matrices,
        name=piece.name,
        softness=piece.softness,
    )
