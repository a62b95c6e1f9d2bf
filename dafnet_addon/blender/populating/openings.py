"""The room of a shot as the open scene: one of ours, a .blend, a .glb, or a folder of pieces."""

from pathlib import Path

import bpy

from ...core.errors import InputError
from ...core.text import nearest_known, printable
from ...director.shots import Shot
from ..character.properties import ensure_registered
from ..pipeline.batch import open_file
from ..showcase.rooms import FPS, ROOMS, build

__all__ = ["open_room"]


def open_room(shot: Shot) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Open the shot's room in place of what is open.

    Returns the files that it came from, and sentences for the user. Raises InputError where there
    is no such room, or it cannot be opened.
    """
    path = shot.path(shot.room)
    if shot.room in ROOMS and not path.exists():
        _empty()
        build(bpy.context.scene, shot.room)
        return (), ()

    if not path.exists():
        raise InputError(
            f"There is no room '{printable(shot.room, 100)}': no file or folder of that path, and "
            f"of ours {nearest_known(shot.room, ROOMS)}"
        )
    if path.suffix.lower() == ".blend":
        warnings = open_file(path)
        ensure_registered()
        return (path, *_libraries()), warnings

    raise InputError(f"The room '{path}' is not a .blend file; save it as one.")


def _empty() -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    ensure_registered()
    render = bpy.context.scene.render
    render.fps, render.fps_base = FPS, 1.0


def _libraries() -> list[Path]:
    return [Path(bpy.path.abspath(library.filepath)) for library in bpy.data.libraries]
