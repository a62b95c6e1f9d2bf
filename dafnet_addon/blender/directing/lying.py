"""A character lies down on a bed: one task, planned and keyed."""

from collections.abc import Generator

import bpy

from ...core.progress import stepwise
from ...director.tasks import LieOn
from .seat_pieces import top_of
from .tasks import Assignment, direct
from .walking import Walk

__all__ = ["lie_on"]


@stepwise
def lie_on(
    context: bpy.types.Context, armature: bpy.types.Object, bed: bpy.types.Object, seconds: float
) -> Generator[float, None, Walk]:
    """Let the character walk to ``bed`` from where it is at the start of its range, lie down there
    and stay for some ``seconds``; see ``tasks.direct``.
    """
    whole = top_of(bed)
    name = (whole if whole.type == "MESH" else bed).name
    (done,) = yield from direct.steps(context, [Assignment(armature, [LieOn(name, seconds)])])
    kept = ", ".join(f"'{action}'" for action in done.kept)
    warnings = (*done.warnings, *((f"Your keys are kept in {kept}.",) if kept else ()))
    return Walk(done.first, done.last, done.extended, warnings)
