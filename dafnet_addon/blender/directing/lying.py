"""A character lies down on a bed: one task, planned and keyed."""

from collections.abc import Generator

import bpy

from ...core.progress import stepwise
from ...core.skeleton import TARGETS
from ...director.tasks import LieOn
from ..character.walk_rows import BED, Asked, Manner
from .made_walks import edited_from, intact_walks, note_walk
from .plan_keys import plan_edited
from .root_keys import MOVES, keys_within
from .seat_pieces import top_of
from .tasks import Assignment, direct
from .walking import Walk

__all__ = ["lie_on", "lying_replaces"]


@stepwise
def lie_on(
    context: bpy.types.Context, armature: bpy.types.Object, bed: bpy.types.Object, seconds: float
) -> Generator[float, None, Walk]:
    """Let the character walk to ``bed`` from where it is at the start of its range, lie down there
    and stay for some ``seconds``; see ``tasks.direct``.
    """
    whole, goal = top_of(bed), bed.name_full
    name = (whole if whole.type == "MESH" else bed).name
    intact = intact_walks(armature)
    (done,) = yield from direct.steps(context, [Assignment(armature, [LieOn(name, seconds)])])
    kept = ", ".join(f"'{action}'" for action in done.kept)
    warnings = (*done.warnings, *((f"Your keys are kept in {kept}.",) if kept else ()))
    asked = Asked(BED, Manner(seconds=seconds), goal)
    left = intact[: len(armature.dafnet.walks)]
    note_walk(context.scene, armature, asked, first=done.first, last=done.last, intact=left)
    return Walk(done.first, done.last, done.extended, warnings)


def lying_replaces(scene: bpy.types.Scene, armature: bpy.types.Object) -> bool:
    """Whether lying down would take the place of keys that are not those of walks as they were
    made.
    """
    own = armature.dafnet
    first = scene.frame_start if own.use_scene_range else own.frame_start
    if not plan_edited(armature, first):
        return False
    targets = [target for role in TARGETS if (target := getattr(own, role)) is not None]
    return (
        not len(own.walks)
        or edited_from(armature, 0)
        or any(any(keys_within(each, MOVES, first)) for each in targets)
    )
