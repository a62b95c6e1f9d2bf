"""The scene as plain arrays: evaluated furniture, the root, targets, mode and source pose, frame by frame, in metres.

One unit of Blender is ``metres_per_unit`` metres; everything handed to the core is in metres. The evaluated scene is
read, so keys, constraints, drivers, modifiers and instances all count; what is hidden in the viewport does not exist.
"""

from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.errors import InputError
from ..core.progress import drained
from ..core.root import POSITION_SIGMA, YAW_SIGMA, root_from_joints, root_from_matrices, smoothed, to_root, to_world
from ..core.skeleton import JOINTS, OFFSETS, PARENTS, UPPER
from ..core.solids import Mesh, Scene
from ..core.take import Controls
from .armature import is_character, metres_per_unit
from .baker import laid_over, require_bakeable
from .compat import action_curves
from .mannequin import FACING
from .properties import Settings, find_action, find_collection, find_object, find_scene
from .rig_properties import map_of
from .rig_reading import joints_of, pose_matrices
from .rigs import RigMap, required
from .takes import stored

__all__ = ["ReadScene", "frame_kept", "furniture_now", "read_steps", "read_scene"]

_BATCH = 16
_TURNED = np.radians(0.1)
_TARGETS = {"head": "head target", "hand_left": "left hand target", "hand_right": "right hand target"}


@dataclass(frozen=True)
class ReadScene:
    """What generation needs: the furniture, the controls at the scene's frame rate, and sentences for the user."""

    scene: Scene
    controls: Controls
    warnings: tuple[str, ...]


@dataclass
class _Piece:
    """One evaluated mesh, an object's own (``source``) or an instance, with its matrix in each frame.

    ``key`` finds it again. ``vertices`` (V, 3), ``triangles`` (F, 3): in its own space, Blender units.
    """

    key: tuple
    name: str
    source: bpy.types.Object | None
    vertices: np.ndarray
    triangles: np.ndarray
    matrices: list[np.ndarray] = field(default_factory=list)


def read_scene(context: bpy.types.Context, settings: Settings) -> ReadScene:
    """``read_steps`` drained."""
    return drained(read_steps(context, settings))


def read_steps(context: bpy.types.Context, settings: Settings) -> Generator[float, None, ReadScene]:
    """Read the scene; yields progress in [0, 1], at which the current frame is as it was.

    Furniture: every mesh of the collection and of the collections in it, as the viewport evaluates it at the first
    frame, with its matrix for each frame if it moves; shapes that change over time are warned about. The character,
    what is parented to it or deformed by it, the root and the targets are never furniture.

    Targets: the empties' places. Their rotations count where they are keyed, or where a target was ever turned in its
    parent's space; a target that was only moved leaves head and hands free to turn.

    Upper body: the source's bones, carried from the source's root onto this character's and to its size. The source is
    another character or any rig whose bones are known (``rig_properties.map_of``). Its root is its object if it is one of
    our characters, else it is found from hips and shoulders.

    ``InputError``: something that is needed is missing, gone, linked, empty or not a number.
    """
    scene = find_scene(settings)
    if context.scene != scene:
        raise InputError(f"The scene '{settings.scene}' is not the active one; make it active and generate again.")
    if scene.render.frame_map_old != scene.render.frame_map_new:
        raise InputError(f"The scene '{settings.scene}' stretches time; set its Time Stretching back to 100 : 100.")
    unit = metres_per_unit(scene)
    armature = find_object(settings, settings.armature, "character")
    size = require_bakeable(armature, unit)
    if settings.root is None:
        raise InputError(f"The character '{armature.name}' has no root; choose its root object in the DAFNet panel.")
    root = find_object(settings, settings.root, "root")
    names = {role: name for role in _TARGETS if (name := getattr(settings, role))}
    targets = {role: find_object(settings, name, _TARGETS[role]) for role, name in names.items()}
    for driver, role in ((root, "root"), *((target, _TARGETS[name]) for name, target in targets.items())):
        if armature in _followed(driver):
            raise InputError(f"The {role} '{driver.name}' follows the character itself; let it follow something else.")
    source, source_map = _upper_body_source(settings, armature)
    places = [source_map.place(name) if source_map else name for name in JOINTS]
    own = {armature, root, *targets.values(), *armature.children_recursive}
    furniture = _Furniture(find_collection(settings.furniture), armature, own) if settings.furniture else None

    frames = range(settings.frame_start, settings.frame_end + 1)
    pieces: list[_Piece] = []
    modes: list[str] = []
    influences: dict[str, list[float]] = defaultdict(list)
    tracks = defaultdict(list)
    bones: list[np.ndarray] = []
    bodies: list[np.ndarray] = []
    for start in range(0, len(frames), _BATCH):
        with frame_kept(scene):
            for frame in frames[start : start + _BATCH]:
                scene.frame_set(frame)
                depsgraph = context.evaluated_depsgraph_get()
                if frame == frames[0]:
                    _require_alive(depsgraph, [armature, root, *targets.values(), *([source] if source else [])])
                    pieces = furniture.pieces(depsgraph) if furniture else []
                _follow(depsgraph, pieces)
                modes.append(settings.mode or armature.dafnet.mode)
                for role in targets:
                    influences[role].append(getattr(armature.dafnet, f"{role}_influence"))
                tracks["root"].append(_array(root.evaluated_get(depsgraph).matrix_world))
                for role, target in targets.items():
                    evaluated = target.evaluated_get(depsgraph)
                    tracks[role].append(_array(evaluated.matrix_world))
                    tracks[f"{role} local"].append(_array(evaluated.matrix_local))
                if source:
                    evaluated = source.evaluated_get(depsgraph)
                    bodies.append(_array(evaluated.matrix_world))
                    bones.append(pose_matrices(evaluated, places))
        yield min(start + _BATCH, len(frames)) / (len(frames) + 1)

    warnings = tuple(_told(armature, pieces))
    if furniture:
        with frame_kept(scene):
            warnings += furniture.deforming(context, frames, pieces)
    fps = scene.render.fps / scene.render.fps_base
    root_matrices = _rigid(np.array(tracks["root"]), unit, f"root '{root.name}'")
    given: dict[str, Any] = {}
    for role, target in targets.items():
        matrices = _rigid(np.array(tracks[role]), unit, f"{_TARGETS[role]} '{target.name}'")
        given[role] = matrices[:, :3, 3]
        if _is_turned(target, np.array(tracks[f"{role} local"])):
            given[f"{role}_rotation"] = matrices[:, :3, :3]
    if source and "FULL" in modes:
        given["upper_body"] = _carried(source, source_map, np.array(bones), np.array(bodies), unit, root_matrices, size, fps)
    elif settings.upper_body_take and "FULL" in modes:
        given["upper_body"] = _of_take(settings, np.array([mode == "FULL" for mode in modes]), root_matrices, size, fps)
    elif "FULL" in modes:
        raise InputError(f"The mode of '{armature.name}' is FULL but no source is set; choose one to copy from.")
    for role in targets:
        if min(influences[role]) < 1.0:
            given[f"{role}_influence"] = np.array(influences[role])
    mode = modes[0] if len(set(modes)) == 1 else tuple(modes)
    controls = Controls(fps=fps, root=root_matrices, mode=mode, blend=settings.blend_frames / fps, scale=size, **given)

    solids = tuple(_solid(piece, unit) for piece in pieces)
    yield 1.0
    return ReadScene(Scene(solids), controls, warnings)


@contextmanager
def frame_kept(scene: bpy.types.Scene) -> Iterator[None]:
    """Return to the current frame at the end, whatever happens."""
    frame, subframe = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=subframe)


def _require_alive(depsgraph: bpy.types.Depsgraph, needed: list[bpy.types.Object]) -> None:
    """Blender does not move objects that are disabled in viewports; those hidden with H it does."""
    alive = {each.original for each in depsgraph.ids}
    for each in needed:
        if each not in alive:
            raise InputError(f"'{each.name}' or its collection is disabled in viewports; enable it, or hide it with H.")


def _followed(follower: bpy.types.Object) -> set[bpy.types.Object]:
    """The object itself and all that it follows by parents and constraints, and what those follow."""
    found: set[bpy.types.Object] = set()
    waiting = [follower]
    while waiting:
        each = waiting.pop()
        if each is not None and each not in found:
            found.add(each)
            waiting += [each.parent, *(getattr(c, "target", None) for c in each.constraints if not c.mute)]
    return found


def _told(armature: bpy.types.Object, pieces: list[_Piece]) -> Iterator[str]:
    """Warnings about what can be used, but hardly as it was meant."""
    if laid_over(armature):
        yield f"Bones of '{armature.name}' have constraints or drivers, which change the take; mute them to see it as made."
    for name in dict.fromkeys(p.name for p in pieces if not np.any(np.abs(np.array(p.matrices)[:, :3, :3]) > 1e-9)):
        yield f"'{name}' is scaled to zero, so it is not there for the character; give it a scale."


def _array(matrix: Matrix) -> np.ndarray:
    return np.array(matrix, float)


def _owner(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    return (instance.parent or instance.object).original


def _key(instance: bpy.types.DepsgraphObjectInstance) -> tuple:
    """Names one evaluated mesh of the scene, the same in every frame."""
    place = tuple(instance.persistent_id) if instance.is_instance else ()
    return (_owner(instance).name_full, instance.object.original.name_full, place)


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


def furniture_now(context: bpy.types.Context, settings: Settings) -> dict[str, list[Mesh]]:
    """The furniture's meshes in the current frame by the names of the objects that they belong to; world, metres.

    ``InputError`` where there is none to be seen, as for ``read_steps``.
    """
    scene = find_scene(settings)
    armature = find_object(settings, settings.armature, "character")
    if settings.furniture is None:
        return {}
    names = (settings.root, settings.head, settings.hand_left, settings.hand_right)
    own = {armature, *armature.children_recursive, *(o for o in scene.objects if o.name_full in names)}
    depsgraph = context.evaluated_depsgraph_get()
    pieces = _Furniture(find_collection(settings.furniture), armature, own).pieces(depsgraph)
    _follow(depsgraph, pieces)
    found: dict[str, list[Mesh]] = defaultdict(list)
    for piece in pieces:
        found[piece.name].append(_solid(piece, metres_per_unit(scene)))
    return dict(found)


class _Furniture:
    """A collection's evaluated meshes, without the character and what is its ``own``."""

    def __init__(
        self, collection: bpy.types.Collection, armature: bpy.types.Object, own: set[bpy.types.Object],
    ) -> None:
        self.collection, self.armature, self.own = collection, armature, own
        self.members = set(collection.all_objects) - own

    def _deformed(self, candidate: bpy.types.Object) -> bool:
        """Whether the character's armature deforms it, as clothes are."""
        return any(m.type == "ARMATURE" and m.object == self.armature for m in candidate.modifiers)

    def meshes(self, depsgraph: bpy.types.Depsgraph) -> Iterator[bpy.types.DepsgraphObjectInstance]:
        """Every evaluated mesh that is furniture, instances among them."""
        for instance in depsgraph.object_instances:
            if instance.object.type != "MESH" or not (instance.is_instance or instance.show_self):
                continue
            owner, made_of = _owner(instance), instance.object.original
            if owner in self.members and owner.visible_get() and made_of not in self.own and not self._deformed(made_of):
                yield instance

    def pieces(self, depsgraph: bpy.types.Depsgraph) -> list[_Piece]:
        """The meshes with faces; instances of one mesh share its arrays."""
        shapes: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        pieces: list[_Piece] = []
        seen = False
        for instance in self.meshes(depsgraph):
            seen = True
            pointer = instance.object.data.as_pointer()
            if pointer not in shapes:
                shapes[pointer] = _geometry(instance.object)
            vertices, triangles = shapes[pointer]
            if len(triangles):
                source = None if instance.is_instance else instance.object.original
                pieces.append(_Piece(_key(instance), _owner(instance).name, source, vertices, triangles))
        name = self.collection.name
        if not seen:
            raise InputError(
                f"The furniture collection '{name}' has no visible mesh besides the character's own; fill it or choose none."
            )
        if not pieces:
            raise InputError(f"The meshes of the furniture collection '{name}' have no faces; give them some.")
        return pieces

    def deforming(self, context: bpy.types.Context, frames: range, pieces: list[_Piece]) -> tuple[str, ...]:
        """Warnings about meshes whose shape differs in the middle or at the end of the range."""
        shapes = {piece.key: piece for piece in pieces}
        changed: dict[str, None] = {}
        for frame in dict.fromkeys((frames[len(frames) // 2], frames[-1])):
            context.scene.frame_set(frame)
            for instance in self.meshes(context.evaluated_depsgraph_get()):
                piece = shapes.get(_key(instance))
                if piece is None:
                    continue
                vertices, _ = _geometry(instance.object)
                tolerance = 1e-3 * np.ptp(piece.vertices, axis=0).max()
                if vertices.shape != piece.vertices.shape or np.abs(vertices - piece.vertices).max() > tolerance:
                    changed[piece.name] = None
        return tuple(
            f"The shape of '{name}' changes during the shot; its shape at the first frame is used." for name in changed
        )


def _follow(depsgraph: bpy.types.Depsgraph, pieces: list[_Piece]) -> None:
    """Add this frame's matrices; what is gone or disabled by now stays where it was."""
    found: dict[tuple, np.ndarray] = {}
    if any(piece.source is None for piece in pieces):
        wanted = {piece.key for piece in pieces if piece.source is None}
        for instance in depsgraph.object_instances:
            if instance.is_instance and (key := _key(instance)) in wanted:
                found[key] = _array(instance.matrix_world)
    for piece in pieces:
        if piece.source is not None:
            found[piece.key] = _array(piece.source.evaluated_get(depsgraph).matrix_world)
        piece.matrices.append(found[piece.key] if piece.key in found else piece.matrices[-1])


def _solid(piece: _Piece, unit: float) -> Mesh:
    matrices = np.array(piece.matrices)
    matrices[:, :3] *= unit
    still = np.allclose(matrices, matrices[0], atol=1e-6)
    return Mesh(piece.vertices, piece.triangles, matrices[0] if still else matrices, piece.name)


def _rigid(matrices: np.ndarray, unit: float, what: str) -> np.ndarray:
    """Matrices (T, 4, 4) in metres and without scale; x is made to fit y and z."""
    if not np.isfinite(matrices).all():
        raise InputError(f"The {what} has a transform that is not a number; clear its transform or fix what drives it.")
    length = np.linalg.norm(matrices[:, :3, :3], axis=1, keepdims=True)
    if (length < 1e-9).any():
        raise InputError(f"The {what} is scaled to zero; give it a scale.")
    out = matrices.copy()
    out[:, :3, :3] /= length
    out[:, :3, 0] = np.cross(out[:, :3, 1], out[:, :3, 2])
    out[:, :3, 3] *= unit
    return out


def _is_turned(target: bpy.types.Object, local: np.ndarray) -> bool:
    """Whether a target's rotation is meant: keyed, or anywhere other than its parent's."""
    if any("rotation" in curve.data_path for curve in action_curves(target)):
        return True
    axes = local[:, :3, :3] / np.maximum(np.linalg.norm(local[:, :3, :3], axis=1, keepdims=True), 1e-9)
    return bool(np.abs(axes - np.eye(3)).max() > _TURNED)


def _upper_body_source(
    settings: Settings, armature: bpy.types.Object,
) -> tuple[bpy.types.Object | None, RigMap | None]:
    """The upper body's source, and which of its bones are which joints where it is no character of ours."""
    if settings.upper_body_source is None:
        return None, None
    source = find_object(settings, settings.upper_body_source, "upper body's source")
    if source.type != "ARMATURE" or source == armature:
        raise InputError(f"'{source.name}' cannot be the upper body's source; choose another armature.")
    if is_character(source):
        return source, None
    rig_map = map_of(source)
    required(source, rig_map)
    return source, rig_map


def _of_take(settings: Settings, full: np.ndarray, root: np.ndarray, size: float, fps: float) -> np.ndarray:
    """Upper body (T, 14, 3) of the chosen take, frame by frame of the scene, on this character's root and of its ``size``.

    ``InputError``: it is of another frame rate, or does not cover the frames that are ``full`` (T,).
    """
    action = find_action(settings.upper_body_take or "")
    take, _ = stored(action)
    if abs(take.fps - fps) > 1e-3:
        raise InputError(f"The take '{action.name}' has {take.fps:g} frames a second, the scene {fps:g}; generate it again.")
    at = np.arange(len(full)) + settings.frame_start - action.dafnet.frame_start
    if ((at < 0) | (at >= len(take)))[full].any():
        raise InputError(f"The take '{action.name}' does not cover the frames whose mode is FULL; choose a longer one.")
    at = np.clip(at, 0, len(take) - 1)
    path, _ = root_from_matrices(take.root[at])
    return _onto(root, fps, size / take.scale * to_root(path, take.joints[at][:, list(UPPER)]))


def _onto(root: np.ndarray, fps: float, local: np.ndarray) -> np.ndarray:
    """Points (T, N, 3) of a root's frames in the world, that root being this character's, ``root`` (T, 4, 4)."""
    return to_world(smoothed(root_from_matrices(root)[0], POSITION_SIGMA * fps / 30.0, YAW_SIGMA * fps / 30.0), local)


def _carried(
    source: bpy.types.Object, rig_map: RigMap | None, bones: np.ndarray, bodies: np.ndarray,
    unit: float, root: np.ndarray, size: float, fps: float,
) -> np.ndarray:
    """Upper body (T, 14, 3), world metres, on this character's ``root`` (T, 4, 4) and of its ``size``.

    ``bones`` (T, 22, 4, 4): the source's bones in its own space; ``bodies`` (T, 4, 4): its object's matrices; both in
    Blender units.
    """
    what = f"upper body's source '{source.name}'"
    there = np.array([rig_map is None or rig_map.place(name) is not None for name in JOINTS])
    if not np.isfinite(bones[:, there]).all() or not np.isfinite(bodies).all():
        raise InputError(f"The {what} has a transform that is not a number; clear its transform or fix what drives it.")
    if rig_map is None:
        joints = unit * (bodies[:, None] @ bones)[..., :3, 3]
    else:
        joints = unit * joints_of(source, rig_map, bodies, bones, size / unit)
    if rig_map is None and source.dafnet.root:
        frames = _rigid(bodies, unit, what)
        frames[:, :3, :3] = frames[:, :3, :3] @ FACING
        path, _ = root_from_matrices(frames)
    else:
        path = root_from_joints(joints, floor=float(unit * bodies[0, 2, 3]))
    offsets = joints[:, 1:] - joints[:, list(PARENTS[1:])]
    upper = [j - 1 for j in UPPER[1:]]
    lengths = np.linalg.norm(offsets[:, upper], axis=-1).mean(axis=0).sum()
    ratio = size * np.linalg.norm(OFFSETS[1:][upper], axis=-1).sum() / lengths
    return _onto(root, fps, ratio * to_root(path, joints[:, list(UPPER)]))
