"""Bakes takes without a window: opens a file, generates its character's motion, and saves another
file.
"""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...core.errors import InputError
from ...core.files import (
    require_replaceable,
    require_writable,
    save_text,
    whole_file,
    whole_folder,
)
from ...core.progress import run_to_end
from ...core.wishes import Wishes
from ...director.tasks import Task
from ..character.armature import is_character
from ..character.properties import ensure_registered
from ..delivery.deliver import deliver
from ..delivery.onto_rig import onto_rig, rig_named
from ..delivery.people import Played
from ..directing.surroundings import find_furniture
from ..directing.tasks import Assignment, Directed, direct
from . import job

if TYPE_CHECKING:
    from ...core.weights import Weights

__all__ = ["DELIVERED", "Written", "bake_takes", "open_file", "save_scene"]

_GENERATED = 0.5
"""Progress once the takes are generated, where more is to be done with them."""


DELIVERED = "delivered.json"
"""What says, in the folder beside a scene, that it is an earlier run's."""


@dataclass(frozen=True)
class Written:
    """What a bake has written: the scene ``file``, with what ``result`` says, and where there were
    wishes the ``folder`` beside it; ``directed``: what its tasks became.
    """

    file: Path
    result: job.Result
    folder: Path | None = None
    directed: Directed | None = None


def bake_takes(
    file: Path | None,
    output: Path | None,
    *,
    scene: str | None = None,
    character: str | None = None,
    changes: dict[str, Any] | None = None,
    tasks: Sequence[Task] = (),
    already_there: bool = False,
    find: bool = False,
    wishes: Wishes = Wishes(),  # noqa: B008  nothing changes it
    takes: int = 1,
    weights: "Weights | None" = None,
    device: str | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Written:
    """Bake this many ``takes`` of one character and save; the first one plays, the others are
    Actions in the file.

    ``file`` None stands for the file that is open, ``output`` None for the file itself. ``scene``
    is needed where another one is active in the file, ``character`` names the armature where the
    scene has several. ``changes`` override the character's own settings (fields of ``Settings``).
    Each further take has the next seed, and temperature 1 where none is set. ``device``: None runs
    the network on NumPy, else on that torch device.

    ``tasks`` are planned and keyed first (``directing.tasks``), from where the root stands or with
    ``already_there`` from where the first one is done; ``find``: the furniture along the root's
    path is found as by *Find Furniture*. ``wishes``: the takes are put onto a rig, and what is
    delivered is written into a folder beside the scene's file, of its name.

    Whatever ``progress`` raises, until the new file is whole, leaves everything as it was. Raises
    InputError where a file cannot be opened or written, or there is nothing to bake onto.
    """
    ensure_registered()
    source = file or (Path(bpy.data.filepath) if bpy.data.filepath else None)
    if output is None and source is None:
        raise InputError("The scene was never saved; name an output.")

    written = output or source
    assert written is not None
    if written.suffix != ".blend":
        raise InputError(f"The output '{written}' must end in .blend.")

    require_writable(written)
    if output is not None and source is not None and _same(output, source):
        raise InputError(
            f"'{output}' is the scene's own file; give the output another name, or use --in-place."
        )

    if file is not None:
        _open(file)

    progress(0.0)
    warnings = tuple(_warnings_about_file(in_place=output is None))
    for library in bpy.data.libraries:
        if _same(written, Path(bpy.path.abspath(library.filepath))):
            raise InputError(
                f"'{written}' is a library of the scene; give the output another name."
            )

    folder = written.with_suffix("") if wishes.anything else None
    if folder is not None:
        require_replaceable(folder, DELIVERED)

    chosen, changes = _scene(scene), dict(changes or {})
    with _active(chosen):
        armature = _character(chosen, character)
        rig = rig_named(chosen, wishes.rig) if wishes.rig else None
        directed = None
        if tasks:
            assigned = Assignment(armature, tasks, already_there)
            (directed,) = direct(bpy.context, [assigned])
            warnings += directed.warnings
            changes = {"frame_start": directed.first, "frame_end": directed.last} | changes
        if find:
            warnings += find_furniture(bpy.context, armature).warnings

        settings = job.settings_of(armature, chosen, **{"take_count": takes, **changes})
        generated = _GENERATED if wishes.anything or rig else 1.0
        result = run_to_end(
            job.steps(bpy.context, settings, weights, device=device),
            lambda share: progress(generated * share),
        )
        person = Played(armature, result.takes, result.actions, directed.plan if directed else None)
        if rig is not None:
            person, said = onto_rig(bpy.context, person, rig)
            warnings += said

        if folder is None:
            save_scene(written, lambda: progress(1.0))
        else:
            with whole_folder(folder, DELIVERED) as part:
                warnings += run_to_end(
                    deliver.steps(chosen, [person], part, wishes),
                    lambda share: progress(generated + (1.0 - generated) * share),
                )
                listed = sorted(
                    each.relative_to(part).as_posix() for each in part.rglob("*") if each.is_file()
                )
                listing = {"scene": written.name, "files": listed}
                save_text(part / DELIVERED, json.dumps(listing, indent=1, ensure_ascii=False))
                save_scene(written, lambda: progress(1.0))

    result = replace(result, warnings=warnings + result.warnings)
    return Written(written, result, folder, directed)


def save_scene(file: Path, last: Callable[[], None] = lambda: None, **options: Any) -> None:
    """Save a copy of the scene in one step, before which ``last`` is called. ``options``: of
    Blender's own saving.

    ``InputError`` where Blender cannot write it.
    """
    with whole_file(file) as part:
        try:
            bpy.ops.wm.save_as_mainfile(filepath=str(part), copy=True, **options)
        except RuntimeError as error:
            raise InputError(
                f"Blender cannot write '{file}'; choose a folder that has room and may be written "
                "to."
            ) from error
        last()


def _same(one: Path, other: Path) -> bool:
    """Whether both are one file, by whatever names."""
    try:
        return one.samefile(other)
    except OSError:
        return os.path.realpath(one) == os.path.realpath(other)


def open_file(file: Path) -> tuple[str, ...]:
    """Open a file, and say what is wrong with it. ``InputError`` where it cannot be opened."""
    _open(file)
    return tuple(_warnings_about_file(in_place=False))


def _open(file: Path) -> None:
    """Open a file. Its scripts run only if Blender's preferences allow that, which by default they
    do not.
    """
    if not file.is_file():
        raise InputError(f"There is no file '{file}'; check its path.")

    try:
        bpy.ops.wm.open_mainfile(filepath=str(file.resolve()))
    except RuntimeError as error:
        raise InputError(
            f"'{file}' cannot be opened by Blender {bpy.app.version_string}; save it again with "
            "this Blender or an older one."
        ) from error


def _warnings_about_file(in_place: bool) -> Iterator[str]:
    """Warnings about the open file. ``InputError`` where overwriting it would lose a part of it."""
    if bpy.data.version[:2] > bpy.app.version[:2]:
        newer = (
            f"The file was saved by Blender {bpy.data.version[0]}.{bpy.data.version[1]}, which is "
            "newer than this one"
        )

        if in_place:
            raise InputError(f"{newer}; bake it with that Blender, or name an output.")
        yield (
            f"{newer}, so parts of it may be missing from the output; bake it with that Blender."
        )

    for library in bpy.data.libraries:
        if library.is_missing:
            yield (
                f"The library '{library.filepath}' is missing, and so is what the scene links "
                "from it; put it back."
            )

    if bpy.app.autoexec_fail:
        yield (
            f"A script in the file did not run ({bpy.app.autoexec_fail_message}), so whatever it "
            "moves stands still; allow Python scripts in Blender's preferences if you trust the "
            "file."
        )


def _scene(name: str | None) -> bpy.types.Scene:
    """The scene of this name, or the active one."""
    if name is None:
        return bpy.context.scene
    for scene in bpy.data.scenes:
        if name in (scene.name, scene.name_full):
            return scene
    names = ", ".join(f"'{scene.name}'" for scene in bpy.data.scenes)
    raise InputError(f"The file has no scene '{name}'; choose one of {names} with --scene.")


def _active(scene: bpy.types.Scene) -> AbstractContextManager[object]:
    """A block in which the scene is the active one; which one is active in the file stays."""
    if scene == bpy.context.scene:
        return nullcontext()
    return bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0])


def _hint_at_other_scenes(scene: bpy.types.Scene, named: str | None) -> str:
    """What to do where another scene has the armature that is ``named``, or for None any character;
    empty where none has.
    """
    for other in bpy.data.scenes:
        armatures = [ob for ob in other.objects if ob.type == "ARMATURE" and other != scene]
        for armature in armatures:
            if named in (armature.name, armature.name_full) or (
                named is None and is_character(armature)
            ):
                return (
                    f"the scene '{other.name}' has '{armature.name}': give --scene '{other.name}'"
                )

    return ""


def _character(scene: bpy.types.Scene, name: str | None) -> bpy.types.Object:
    """The armature to bake onto: the one named, else the only one of the scene that is a DAFNet
    character.
    """
    armatures = [ob for ob in scene.objects if ob.type == "ARMATURE"]
    if name is not None:
        named = [ob for ob in armatures if name in (ob.name, ob.name_full)]
        if not named:
            to_do = (
                _hint_at_other_scenes(scene, name) or "give --character the name of one that it has"
            )
            raise InputError(f"The scene '{scene.name}' has no armature '{name}'; {to_do}.")
        return named[0]

    characters = [ob for ob in armatures if is_character(ob)]
    directed = [ob for ob in characters if ob.dafnet.root is not None] or characters
    if not directed:
        to_do = (
            _hint_at_other_scenes(scene, None)
            or "add one in Blender with Add Character and save the file"
        )
        raise InputError(f"The scene '{scene.name}' has no character; {to_do}.")

    if len(directed) > 1:
        names = ", ".join(f"'{ob.name}'" for ob in directed)
        raise InputError(
            f"The scene has several characters; choose one of {names} with --character."
        )

    return directed[0]
