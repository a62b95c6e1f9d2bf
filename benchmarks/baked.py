"""Does what people do in rooms arrive on a real character's rig? Every take of the arranged rooms,
made as the panel makes it and baked.

    dafnet bench baked LIBRARY RIG.json [ROOM …]

The character is made as large as the rig, sent to each seat that is asked for from both places,
generated with the defaults, and baked. What is asked: in every frame a limb that holds on to
nothing, and the trunk, lie within 6 degrees of the character's, elbows and knees as bent; a hand
that holds on to something is within 2 cm of where the character's is, or of its place on the rig's
own thigh, and so are pelvis, head and feet of where they were to lie. Who is refused is told.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.arranged import SCENES, Arranged, Asked, asked_of
from dafnet_addon import InputError, Mesh
from dafnet_addon.core.limb_errors import limb_errors
from dafnet_addon.core.skeleton import JOINTS, LIMBS
from dafnet_addon.core.solids import BOX_CORNERS, BOX_TRIANGLES

if TYPE_CHECKING:
    import bpy

__all__ = ["furnish", "main", "sent_and_baked"]

_TURNED, _OFF = 6.0, 2.0  # degrees, cm
_FPS = 30


def furnish(made: Arranged) -> None:
    """Put a room's solids into the open scene."""
    import bpy
    from mathutils import Matrix

    for solid in made.solids:
        if isinstance(solid, Mesh):
            points, faces, matrix = solid.vertices, solid.triangles, solid.matrix
        else:
            points, faces, matrix = BOX_CORNERS * solid.half_size, BOX_TRIANGLES, solid.matrices()
        mesh = bpy.data.meshes.new(solid.name)
        mesh.from_pydata(np.asarray(points).tolist(), [], np.asarray(faces).tolist())
        each = bpy.data.objects.new(solid.name, mesh)
        each.matrix_world = Matrix(np.asarray(matrix).tolist())
        bpy.context.scene.collection.objects.link(each)
    bpy.context.view_layer.update()


def sent_and_baked(
    made: Arranged, asked: Asked, start: tuple[float, float], file: Path
) -> dict[str, Any]:
    """Send a character as large as a rig to a seat and bake what she does there, in a new file:
    degrees by which free limbs differ, cm by which contacts do, and what bake and verdict say.
    """
    import bpy

    from benchmarks.real_rig import real_rig
    from dafnet_addon.blender.character.armature import character_scale, create_character
    from dafnet_addon.blender.character.properties import ensure_registered
    from dafnet_addon.blender.character.takes import stored_take
    from dafnet_addon.blender.directing.walking import walk
    from dafnet_addon.blender.pipeline import job
    from dafnet_addon.blender.rig.baker import bake_onto_rig
    from dafnet_addon.blender.rig.detection import detect_map
    from dafnet_addon.blender.rig.doubts import doubts
    from dafnet_addon.blender.rig.sizing import size_as_rig
    from dafnet_addon.core.touching import touches

    ensure_registered()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    context, scene = bpy.context, bpy.context.scene
    scene.render.fps = _FPS
    scene.frame_start, scene.frame_end = 1, 10
    furnish(made)
    rig = real_rig(file)
    rig_map = detect_map(rig)
    character = create_character(context, "Ann")
    size_as_rig(context, character, rig, rig_map)
    character.dafnet.root.location = (*start, 0.0)
    scene.cursor.location = (*(asked.near or (0.0, -99.0)), 0.0)
    walk(context, character, bpy.data.objects[asked.name], 1.5, pull_out=True)
    result = job.run(context, job.settings_of(character, scene))
    baked = bake_onto_rig(context, character, rig, rig_map)

    frames = range(scene.frame_start, scene.frame_end + 1)
    ours, theirs = (
        _played(character, list(JOINTS), frames),
        _played(rig, [rig_map.place(name) for name in JOINTS], frames),
    )
    size = character_scale(character, 1.0)
    known = stored_take(result.action)[0].touches
    floor = np.zeros(len(frames))
    held = np.maximum(touches(ours / size, float(_FPS), floor), known[: len(frames)])
    free = {name: held[:, k] == 0.0 for k, name in enumerate(LIMBS)}
    angles = {}
    for limb, off in limb_errors(theirs, ours).items():
        where = free.get(limb.replace(" ", "_"), np.ones(len(frames), bool))
        angles[limb] = float(off[where].max(initial=0.0))
    return {
        "angles": {name: round(value, 1) for name, value in angles.items()},
        "contacts": {part: round(100.0 * most, 1) for part, (_, most) in baked.errors.items()},
        "said": list(doubts(baked)),
        "verdict": [each.text for each in result.take.verdict if not each.good],
    }


def _played(armature: "bpy.types.Object", bones: Sequence[str | None], frames: range) -> np.ndarray:
    """Where (T, 22, 3) bones begin, world, as Blender plays them; NaN where there is none."""
    import bpy

    found = np.full((len(frames), len(bones), 3), np.nan)
    for k, frame in enumerate(frames):
        bpy.context.scene.frame_set(frame)
        shown = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        for j, bone in enumerate(bones):
            if bone is not None:
                found[k, j] = shown.matrix_world @ shown.pose.bones[bone].head
    return found


def faults_of(row: dict[str, Any]) -> list[str]:
    """What of a take is off on the rig."""
    faults = [limb for limb, off in row.get("angles", {}).items() if off > _TURNED]
    return faults + [part for part, off in row.get("contacts", {}).items() if off > _OFF]


def main(arguments: Sequence[str]) -> str:
    """Bake every take of the rooms; a line for each that is off or refused, and a summary."""
    parser = argparse.ArgumentParser("dafnet bench baked", description=__doc__)
    parser.add_argument("library", type=Path)
    parser.add_argument("rig", type=Path, help="a rest pose (benchmarks.real_rig)")
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help="only these; all if left out")
    options = parser.parse_args(arguments)
    rows = []
    for room in options.rooms or SCENES:
        made = SCENES[room](options.library)
        for asked, start in asked_of(made):
            row: dict[str, Any] = {"name": f"{room}: {asked.name} from {start}"}
            try:
                row |= sent_and_baked(made, asked, start, options.rig)
            except InputError as error:
                row["refused"] = str(error)
            rows.append(row)

    baked = [row for row in rows if "angles" in row]
    lines = [
        f"{row['name']}: {row.get('refused') or ', '.join(faults_of(row))}"
        for row in rows
        if "refused" in row or faults_of(row)
    ]
    worst = [
        f"{part} {max(row[kind].get(part, 0.0) for row in baked):.1f}"
        for kind in ("angles", "contacts")
        for part in dict.fromkeys(each for row in baked for each in row[kind])
    ]
    right = sum(not faults_of(row) for row in baked)
    lines.append(
        f"{len(rows)} sent, {len(baked)} baked, {right} right; the most: {', '.join(worst)}"
    )
    return "\n".join(lines)
