"""Files for other programs: one for each person and take, with one clean action.

What Blender plays is put onto a copy of the armature in a scene of its own, in metres: no
constraints, no drivers, no strips, no other actions, the bones that deform and those above them.
The copy stands at the world's origin, and what carries it through the room is a bone.
"""

import shutil
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import addon_utils
import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import InputError
from ...core.files import whole_file
from ...core.rotations import continuous_signs, quaternion_from_matrix
from ...core.skeleton import JOINTS, PELVIS
from ...core.take import Take
from ...core.wishes import EXPORTED
from ..character.armature import is_character, metres_per_unit
from ..compat import assign_action, new_action
from ..pipeline.baker import key_curves
from ..rig.maps import with_bone_names_of
from ..rig.properties import map_of
from ..rig.reading import pose_matrices, rigid_parts
from .people import Played, facing_of, file_names, playing

__all__ = ["ENDINGS", "export_steps"]

_ROOT = "root"
"""The bone that carries the body where the armature has none for that."""
_ROOT_LENGTH = 0.2  # of the way from it to the hips at rest
_SAME = 1e-6  # by which places and sizes of bones may differ from rest without being keyed
ENDINGS = {"fbx": ".fbx", "gltf": ".glb", "usd": ".usdc", "bvh": ".bvh"}
"""Of the files of each format."""
_ADD_ONS = {"fbx": "io_scene_fbx", "gltf": "io_scene_gltf2", "bvh": "io_anim_bvh"}
"""What has to be enabled in Blender for a format; USD is always there."""


@dataclass(frozen=True)
class _Recording:
    """World matrices of the object (T, 4, 4), and of ``bones`` in its space (T, N, 4, 4); Blender
    units.
    """

    bones: tuple[str, ...]
    bodies: np.ndarray
    poses: np.ndarray


def export_steps(
    context: bpy.types.Context,
    people: Sequence[Played],
    number: int,
    *,
    kinds: Sequence[str],
    root_motion: str,
    folder: Path,
    names: Sequence[str] | None = None,
) -> Generator[float, None, tuple[str, ...]]:
    """Write a take of everybody: ``kinds`` are some of ``wishes.EXPORTED``, ``root_motion`` bone or
    hips; ``names``: of the files, without endings, else people's own. A job that yields its
    progress.

    Raises InputError where Blender lacks the exporter or cannot write.
    """
    unit = metres_per_unit(context.scene)
    with playing(context.scene, people, number):
        recordings = yield from _record(context, people, number)

    with ExitStack() as undo:
        for kind in kinds:
            undo.enter_context(_enabled(kind))
        named = names or file_names(people)
        for k, (person, name) in enumerate(zip(people, named, strict=True)):
            frames, take = person.frames(number), person.takes[number]
            title = f"{person.name} take {number + 1}"
            with _stage(context.scene, title, frames) as stage, ExitStack() as copies:
                copied = _copy(stage, person, unit=unit, root_motion=root_motion, undo=copies)
                copied.play(recordings[k], take, frames, unit)
                for kind in kinds:
                    _write(stage, copied.armature, kind, folder / f"{name}{ENDINGS[kind]}")
            yield 0.3 + 0.7 * (k + 1) / len(people)
    return ()


def _record(
    context: bpy.types.Context, people: Sequence[Played], number: int
) -> Generator[float, None, list[_Recording]]:
    """Play a take, and note where all bones are."""
    names = [tuple(person.armature.data.bones.keys()) for person in people]
    spans = [person.frames(number) for person in people]
    frames = range(min(span.start for span in spans), max(span.stop for span in spans))
    seen: list[list[list[np.ndarray]]] = [[] for _ in people]
    for t, frame in enumerate(frames):
        context.scene.frame_set(frame)
        depsgraph = context.evaluated_depsgraph_get()
        for k, person in enumerate(people):
            if frame in spans[k]:
                shown = person.armature.evaluated_get(depsgraph)
                poses = pose_matrices(shown, [*names[k]])
                seen[k].append([np.array(shown.matrix_world, float), *poses])
        yield 0.3 * t / len(frames)

    found = [np.array(noted) for noted in seen]
    return [_Recording(names[k], each[:, 0], each[:, 1:]) for k, each in enumerate(found)]


@contextmanager
def _enabled(kind: str) -> Iterator[None]:
    """A block in which Blender can write a format."""
    add_on = _ADD_ONS.get(kind)
    if add_on is None or addon_utils.check(add_on)[1]:
        yield
        return
    if addon_utils.enable(add_on) is None:
        raise InputError(f"Blender cannot write {kind}; enable the add-on '{add_on}' in it.")
    try:
        yield
    finally:
        addon_utils.disable(add_on)


@contextmanager
def _stage(scene: bpy.types.Scene, name: str, frames: range) -> Iterator[bpy.types.Scene]:
    """A block with an empty scene, the active one within, of the same rate, in metres; with all
    that is made in it removed afterwards.
    """
    kinds = ("objects", "armatures", "actions", "meshes", "collections", "scenes")
    before = {kind: {*getattr(bpy.data, kind)} for kind in kinds}
    stage = bpy.data.scenes.new(name)
    try:
        stage.render.fps, stage.render.fps_base = scene.render.fps, scene.render.fps_base
        stage.frame_start, stage.frame_end = frames.start, frames.stop - 1
        with bpy.context.temp_override(scene=stage, view_layer=stage.view_layers[0]):
            yield stage
    finally:
        for kind in kinds:
            for made in {*getattr(bpy.data, kind)} - before[kind]:
                getattr(bpy.data, kind).remove(made)


class _Copied:
    """A bare copy of somebody's armature at the world's origin, in metres. ``root``: the bone that
    carries it over the floor, None where its hips do; ``above``: the bones over the hips, which
    then stay. ``facing`` (3, 3): the canonical frame's axes in its space.
    """

    def __init__(
        self,
        armature: bpy.types.Object,
        *,
        root: str | None,
        above: Sequence[str],
        facing: np.ndarray,
    ) -> None:
        self.armature = armature
        self._root = root
        self._above = above
        self._facing = facing

    def play(self, recording: _Recording, take: Take, frames: range, unit: float) -> None:
        """Key what was recorded; ``unit``: metres of a Blender unit."""
        turned, _ = rigid_parts(recording.bodies, f"armature '{self.armature.name}'")
        places = (recording.bodies[:, None] @ recording.poses)[..., :3, 3] * unit
        axes = turned[:, None] @ recording.poses[..., :3, :3]
        index = {name: k for k, name in enumerate(recording.bones)}

        bones = self.armature.data.bones
        rest = {bone.name: np.array(bone.matrix_local, float) for bone in bones}
        poses: dict[str, np.ndarray] = {}
        for name in rest:
            poses[name] = np.tile(rest[name], (len(frames), 1, 1))
            if name in index and name not in self._above:
                poses[name][:, :3, :3] = axes[:, index[name]]
                poses[name][:, :3, 3] = places[:, index[name]]
        if self._root:
            carried = take.root.astype(float)
            carried[:, :3, :3] = carried[:, :3, :3] @ self._facing.T
            poses[self._root] = carried @ rest[self._root]

        action, add_curve = new_action(self.armature, bpy.context.scene.name)
        times = np.array(frames, float)
        for bone in bones:
            local, still = poses[bone.name], rest[bone.name]
            if bone.parent:
                local = np.linalg.inv(poses[bone.parent.name]) @ local
                still = np.linalg.inv(rest[bone.parent.name]) @ still
            _key(add_curve, bone.name, np.linalg.inv(still) @ local, times)
        for posed in self.armature.pose.bones:
            posed.rotation_mode = "QUATERNION"
        assign_action(self.armature, action)
        bpy.context.scene.frame_set(frames.start)


def _copy(
    stage: bpy.types.Scene, person: Played, *, unit: float, root_motion: str, undo: ExitStack
) -> _Copied:
    """A person's bones that deform, or are above those that do, and her meshes, on the stage; by
    their own names until ``undo``. ``unit``: metres of a Blender unit.
    """
    armature = person.armature
    _, scale = rigid_parts(np.array(armature.matrix_world)[None], f"armature '{armature.name}'")
    size = scale * unit
    meshes = [o for o in person.meshes() if o.type == "MESH" and not o.hide_render]
    hips, above = _hips(armature)
    kept = _kept_bones(armature, [hips, *(mesh.parent_bone for mesh in meshes)])

    copy = bpy.data.objects.new(armature.name, bpy.data.armatures.new(armature.name))
    stage.collection.objects.link(copy)
    root = (above[-1] if above else _ROOT) if root_motion == "bone" else None
    view_layer = bpy.context.view_layer
    view_layer.objects.active = copy
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in kept:
        made = copy.data.edit_bones.new(bone.name)
        made.head, made.tail = size * bone.head_local, size * bone.tail_local
        made.align_roll(bone.matrix_local.to_3x3().col[2])
        made.use_deform = bone.use_deform
        made.parent = copy.data.edit_bones.get(bone.parent.name) if bone.parent else None
    if root == _ROOT:
        made = copy.data.edit_bones.new(_ROOT)
        length = size * _ROOT_LENGTH * armature.data.bones[hips].head_local.length
        made.head, made.tail = (0.0, 0.0, 0.0), (0.0, length, 0.0)
        made.use_deform = False
        for bone in copy.data.edit_bones:
            if bone.parent is None and bone.name != _ROOT:
                bone.parent = made
    bpy.ops.object.editmode_toggle()  # ``mode_set`` would ask the active scene what is edited

    pairs = {armature: copy, **{mesh: _copy_mesh(stage, mesh) for mesh in meshes}}
    for mesh in meshes:
        dressed = pairs[mesh]
        dressed.parent = pairs.get(mesh.parent, copy)
        if mesh.parent not in pairs:
            dressed.matrix_basis = armature.matrix_world.inverted_safe() @ mesh.matrix_world
            dressed.matrix_parent_inverse = Matrix.Scale(size, 4)
        elif mesh.parent == armature:
            dressed.matrix_parent_inverse = Matrix.Scale(size, 4) @ mesh.matrix_parent_inverse
        for modifier in dressed.modifiers:
            if modifier.type == "ARMATURE" and modifier.object == armature:
                modifier.object = copy
    for original, copied in pairs.items():
        _lend_name(original, copied, undo)

    return _Copied(
        copy,
        root=root,
        above=[] if root_motion == "bone" else above,
        facing=facing_of(armature),
    )


def _hips(armature: bpy.types.Object) -> tuple[str, list[str]]:
    """The bone of the hips, and those above it, the uppermost last."""
    bones = armature.data.bones
    name = JOINTS[PELVIS]
    if not is_character(armature):
        rig_map = with_bone_names_of(map_of(armature), bones.keys())
        name = rig_map.joints.get(name) or str(rig_map.place(name))
    return name, [bone.name for bone in bones[name].parent_recursive]


def _kept_bones(armature: bpy.types.Object, needed: Sequence[str]) -> list[bpy.types.Bone]:
    """The bones that deform, those that are ``needed``, and all above them; parents first."""
    bones = armature.data.bones
    wanted = {bone.name for bone in bones if bone.use_deform} | {*needed}
    kept = {
        each.name
        for bone in bones
        if bone.name in wanted
        for each in (bone, *bone.parent_recursive)
    }
    found = [bone for bone in bones if bone.name in kept]
    return sorted(found, key=lambda bone: len(bone.parent_recursive))


def _copy_mesh(stage: bpy.types.Scene, mesh: bpy.types.Object) -> bpy.types.Object:
    copy = mesh.copy()
    copy.animation_data_clear()
    copy.constraints.clear()
    copy.hide_select = copy.hide_viewport = False
    stage.collection.objects.link(copy)
    return copy


def _lend_name(original: bpy.types.Object, copy: bpy.types.Object, undo: ExitStack) -> None:
    """Give a copy the name of what it is a copy of, until ``undo``."""
    name = original.name
    if original.library is None:
        undo.callback(setattr, original, "name", name)
        original.name = f"{name[:40]} (original)"
    undo.callback(setattr, copy, "name", f"{name[:40]} (copy)")
    copy.name = name


def _key(add_curve: Any, bone: str, basis: np.ndarray, times: np.ndarray) -> None:
    """Key a bone's own transform (T, 4, 4): its rotation, and place and size where they change."""
    path = f'pose.bones["{bpy.utils.escape_identifier(bone)}"].'
    size = np.linalg.norm(basis[:, :3, :3], axis=1)
    turns = continuous_signs(quaternion_from_matrix(basis[:, :3, :3] / size[:, None]))
    place = basis[:, :3, 3]
    key_curves(add_curve, path + "rotation_quaternion", bone, frames=times, values=turns)
    if np.abs(place).max() > _SAME:
        key_curves(add_curve, path + "location", bone, frames=times, values=place)
    if np.abs(size - 1.0).max() > 1e3 * _SAME:
        key_curves(add_curve, path + "scale", bone, frames=times, values=size)


def _write(stage: bpy.types.Scene, armature: bpy.types.Object, kind: str, file: Path) -> None:
    """Write all that is on the stage; by way of another file, since exporters insist on their
    endings.
    """
    layer = stage.view_layers[0]
    for each in stage.objects:
        each.select_set(True, view_layer=layer)
    layer.objects.active = armature
    with (
        TemporaryDirectory() as folder,
        bpy.context.temp_override(
            scene=stage,
            view_layer=layer,
            active_object=armature,
            object=armature,
            selected_objects=list(stage.objects),
        ),
    ):
        written = Path(folder, file.name)
        try:
            _WRITERS[kind](str(written), stage)
        except RuntimeError as error:
            raise InputError(
                f"Blender cannot write '{file.name}': {str(error).strip()}; see to it there."
            ) from error
        with whole_file(file) as part:
            shutil.copyfile(written, part)


def _write_fbx(file: str, _stage: bpy.types.Scene) -> None:
    bpy.ops.export_scene.fbx(
        filepath=file,
        check_existing=False,
        object_types={"ARMATURE", "MESH"},
        use_mesh_modifiers=True,
        add_leaf_bones=False,
        bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False,
        bake_anim_simplify_factor=0.0,
    )


def _write_gltf(file: str, stage: bpy.types.Scene) -> None:
    # Blender multiplies with what it should divide by; with its inverse the seconds are right.
    stage.render.fps_base = 1.0 / stage.render.fps_base
    try:
        _write_glb(file, stage.name)
    finally:
        stage.render.fps_base = 1.0 / stage.render.fps_base


def _write_glb(file: str, title: str) -> None:
    bpy.ops.export_scene.gltf(
        filepath=file,
        check_existing=False,
        export_format="GLB",
        use_active_scene=True,
        export_animation_mode="ACTIVE_ACTIONS",
        export_anim_single_armature=False,  # it would take all actions of the file
        export_nla_strips_merged_animation_name=title,
        export_optimize_animation_size=False,
        export_frame_range=True,
    )


def _write_usd(file: str, _stage: bpy.types.Scene) -> None:
    bpy.ops.wm.usd_export(
        filepath=file,
        check_existing=False,
        export_animation=True,
        export_armatures=True,
        evaluation_mode="RENDER",
    )


def _write_bvh(file: str, stage: bpy.types.Scene) -> None:
    bpy.ops.export_anim.bvh(
        filepath=file,
        check_existing=False,
        frame_start=stage.frame_start,
        frame_end=stage.frame_end,
        root_transform_only=False,
    )


_WRITERS: dict[str, Callable[[str, bpy.types.Scene], None]] = {
    "fbx": _write_fbx,
    "gltf": _write_gltf,
    "usd": _write_usd,
    "bvh": _write_bvh,
}
assert _WRITERS.keys() == {*EXPORTED} == ENDINGS.keys()
