"""A trial of *Bake to Rig* without a window: a character as large as a real one's rig is sent to a
seat, and what she does there is baked.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...core.skeleton import JOINTS
from ...core.solids import BOX_CORNERS, BOX_TRIANGLES, Box, Mesh
from ...core.text import read_json
from ...core.touching import touches
from ..character.armature import character_scale, create_character
from ..character.properties import ensure_registered
from ..directing.walking import walk
from ..pipeline import job
from ..rig.baker import bake_onto_rig
from ..rig.detection import detect_map
from ..rig.doubts import doubts
from ..rig.sizing import size_as_rig

__all__ = ["RigTrial", "furnish", "real_rig", "sent_and_baked"]

_FPS = 30
_SECONDS = 1.5
_NOWHERE = (0.0, -99.0)  # where the 3D cursor says nothing about a seat


@dataclass(frozen=True)
class RigTrial:
    """The joints (T, 22, 3) of the character (``ours``) and of the rig (``theirs``), NaN where it
    has none, as Blender plays them; how far (T, 4) limbs are ``held``; how far contacts are off
    (``errors``: see ``baker.Baked``); what the bake (``said``) and the take's ``verdict`` say.
    """

    ours: np.ndarray
    theirs: np.ndarray
    held: np.ndarray
    errors: dict[str, tuple[float, float]]
    said: tuple[str, ...]
    verdict: tuple[str, ...]


def real_rig(file: Path) -> bpy.types.Object:
    """A character's armature as its rest pose is told in a JSON file: ``bones``, each with
    ``name``, ``parent``, ``head``, ``tail``, ``z_axis`` and ``connected``; ``object_matrix``;
    ``rotation_mode``.
    """
    told = read_json(file.read_text(encoding="utf-8"))
    armature = bpy.data.objects.new(file.stem, bpy.data.armatures.new(file.stem))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in told["bones"]:
        edit = armature.data.edit_bones.new(bone["name"])
        edit.head, edit.tail = bone["head"], bone["tail"]
        edit.align_roll(bone["z_axis"])
        if bone["parent"]:
            edit.parent = armature.data.edit_bones[bone["parent"]]
            edit.use_connect = bool(bone["connected"])
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.matrix_world = Matrix(told["object_matrix"])
    for bone in armature.pose.bones:
        bone.rotation_mode = told["rotation_mode"]
    return armature


def furnish(solids: Sequence[Any]) -> None:
    """Put boxes and meshes into the open scene, as objects of their names; also those of another
    copy of this package.
    """
    for solid in solids:
        if hasattr(solid, "half_size"):
            points, faces, matrix = BOX_CORNERS * solid.half_size, BOX_TRIANGLES, solid.matrices()
        else:
            points, faces, matrix = solid.vertices, solid.triangles, solid.matrix
        mesh = bpy.data.meshes.new(solid.name)
        mesh.from_pydata(np.asarray(points).tolist(), [], np.asarray(faces).tolist())
        each = bpy.data.objects.new(solid.name, mesh)
        each.matrix_world = Matrix(np.asarray(matrix).tolist())
        bpy.context.scene.collection.objects.link(each)
    bpy.context.view_layer.update()


def sent_and_baked(
    solids: Sequence[Box | Mesh],
    seat: str,
    near: tuple[float, float] | None,
    start: tuple[float, float],
    file: Path,
) -> RigTrial:
    """Send a character from ``start`` to a ``seat`` among solids, to a place ``near`` on it if one
    is given, and bake what she does there onto the rig of a ``file``, in a new scene. Raises
    InputError where *Sit on Selected* refuses.
    """
    ensure_registered()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    context, scene = bpy.context, bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = _FPS, 1, 2
    furnish(solids)
    rig = real_rig(file)
    rig_map = detect_map(rig)
    character = create_character(context, "Ann")
    size_as_rig(context, character, rig, rig_map)
    character.dafnet.root.location = (*start, 0.0)
    scene.cursor.location = (*(near or _NOWHERE), 0.0)
    walk(context, character, bpy.data.objects[seat], _SECONDS, pull_out=True)
    take = job.run(context, job.settings_of(character, scene)).take
    baked = bake_onto_rig(context, character, rig, rig_map)

    frames = range(scene.frame_start, scene.frame_end + 1)
    ours = _played(character, list(JOINTS), frames)
    now = touches(ours / character_scale(character, 1.0), float(_FPS))
    return RigTrial(
        ours=ours,
        theirs=_played(rig, [rig_map.place(name) for name in JOINTS], frames),
        held=np.maximum(now, take.touches),
        errors=baked.errors,
        said=tuple(doubts(baked)),
        verdict=tuple(each.text for each in take.verdict if not each.good),
    )


def _played(armature: bpy.types.Object, bones: Sequence[str | None], frames: range) -> np.ndarray:
    """Where (T, N, 3) bones begin, world, as Blender plays them; NaN where there is none."""
    found = np.full((len(frames), len(bones), 3), np.nan)
    for k, frame in enumerate(frames):
        bpy.context.scene.frame_set(frame)
        shown = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        for j, bone in enumerate(bones):
            if bone is not None:
                found[k, j] = shown.matrix_world @ shown.pose.bones[bone].head
    return found
