"""Takes of a scene's character without a window: a file is opened, its character generated, another file written."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..core.errors import InputError
from ..core.progress import drained
from . import job
from .armature import is_character
from .properties import ensure_registered

if TYPE_CHECKING:
    from ..core.weights import Weights

__all__ = ["bake_takes"]

def bake_takes(
    file: Path | None, output: Path, *, character: str | None = None, changes: dict[str, Any] | None = None, takes: int = 1,
    weights: "Weights | None" = None, progress: Callable[[float], None] = lambda share: None,
) -> job.Result:
    """Bake ``takes`` takes of one character and save; the first plays, the others are Actions of the file too.

    ``file`` None stands for the file that is open, of which ``output`` then becomes a copy. ``character`` names the armature
    where the scene has several. ``changes`` overrule the character's own settings (fields of ``Settings``). Each further take
    has the next seed, and temperature 1 where none is set. Raises InputError where a file cannot be opened or written, or there
    is nothing to bake onto.
    """
    if output.is_dir():  # which some Blenders would move out of the way
        raise InputError(f"'{output}' is a folder; give the output another name.")
    ensure_registered()
    if file is not None:
        _open(file)
    scene = bpy.context.scene
    armature = _character(scene, character)
    output.parent.mkdir(parents=True, exist_ok=True)
    settings = job.settings_of(armature, scene, **{"take_count": takes, **(changes or {})})
    result = drained(job.steps(bpy.context, settings, weights), progress)
    _save(output, copy=file is None)
    return result


def _open(file: Path) -> None:
    if not file.is_file():
        raise InputError(f"There is no file '{file}'; check its path.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(file.resolve()))
    except RuntimeError as error:
        raise InputError(f"Blender cannot open '{file}'; save it again with this Blender or an older one.") from error


def _save(file: Path, copy: bool) -> None:
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(file.resolve()), copy=copy)
    except RuntimeError as error:
        raise InputError(f"Blender cannot write '{file}'; choose a folder that you may write to.") from error


def _character(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object:
    """The armature to bake onto: the one named, else the only one of the scene that is a DAFNet character."""
    armatures = [ob for ob in scene.objects if ob.type == "ARMATURE"]
    if name is not None:
        named = [ob for ob in armatures if name in (ob.name, ob.name_full)]
        if not named:
            raise InputError(f"The scene has no armature '{name}'; give --character the name of one that it has.")
        return named[0]
    characters = [ob for ob in armatures if is_character(ob)]
    directed = [ob for ob in characters if ob.dafnet.root is not None] or characters
    if not directed:
        raise InputError("The scene has no character; add one in Blender with Add Character and save the file.")
    if len(directed) > 1:
        names = ", ".join(f"'{ob.name}'" for ob in directed)
        raise InputError(f"The scene has several characters; choose one of {names} with --character.")
    return directed[0]
