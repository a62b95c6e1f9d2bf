"""Objects of files, added to the open scene."""

from pathlib import Path

import bpy

from ...core.errors import InputError

__all__ = ["READ", "added_objects"]

READ = (".blend", ".glb", ".gltf", ".fbx", ".obj")
"""Endings of the files that can be added."""


def added_objects(
    context: bpy.types.Context, file: Path, collection: bpy.types.Collection, what: str
) -> list[bpy.types.Object]:
    """Add all objects of a file to a collection: those of a .blend's active scene, or what is
    imported. ``what``: what the file belongs to, for refusals.

    Raises InputError where the file is missing, broken or of another kind.
    """
    if not file.is_file():
        raise InputError(f"There is no file '{file}' of {what}; check its path.")
    ending = file.suffix.lower()
    if ending not in READ:
        raise InputError(
            f"'{file.name}' of {what} is not one of {', '.join(READ)}; save it as one of these."
        )

    before = set(bpy.data.objects)
    try:
        if ending == ".blend":
            _append(file, collection)
        else:
            _import(file, ending)
    except (RuntimeError, OSError) as error:
        raise InputError(
            f"'{file.name}' of {what} cannot be read by Blender {bpy.app.version_string}; save it "
            "again."
        ) from error

    added = [each for each in bpy.data.objects if each not in before]
    if ending != ".blend":
        for each in added:
            for other in list(each.users_collection):
                other.objects.unlink(each)
            collection.objects.link(each)
    if not added:
        raise InputError(f"'{file.name}' of {what} has no objects; choose another file.")
    return added


def _append(file: Path, collection: bpy.types.Collection) -> None:
    with bpy.data.libraries.load(str(file), link=False) as (there, taken):
        taken.scenes = there.scenes[:1]
    for scene in taken.scenes:
        for each in scene.collection.all_objects:
            if each.name not in collection.objects:
                collection.objects.link(each)
        bpy.data.scenes.remove(scene)


def _import(file: Path, ending: str) -> None:
    if ending in (".glb", ".gltf"):
        bpy.ops.import_scene.gltf(filepath=str(file))
    elif ending == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(file))
    else:
        bpy.ops.wm.obj_import(filepath=str(file))
