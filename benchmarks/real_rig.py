"""A character's armature as its rest pose is told in a file."""

import json
from pathlib import Path

import bpy
from mathutils import Matrix

__all__ = ["real_rig"]


def real_rig(file: Path) -> bpy.types.Object:
    """An armature in the open scene, of a JSON file of ``bones``, each with ``name``, ``parent``,
    ``head``, ``tail``, ``z_axis`` and ``connected``; ``object_matrix``; ``rotation_mode``.
    """
    told = json.loads(file.read_text(encoding="utf-8"))
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
