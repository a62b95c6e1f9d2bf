"""Walks made anew from what they were made for: after a seat or the character was moved, or in
another manner.

Keys that were edited since are never lost: a copy of their action is kept.
"""

from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

import bpy

from ...core.errors import InputError
from ...core.progress import stepwise, within
from ..character.armature import is_character, metres_per_unit
from ..character.settings import settings_of
from ..character.standing import moved_by_hand, pose_by_keys
from ..character.walk_rows import BED, CURVE, OBJECT, POINTS, SEAT, Asked, asked_in, manner_of
from ..scene.lookup import object_named
from .lying import lie_on
from .made_walks import edited_from, walks_kept_on_failure
from .path_sources import along_curve, along_object, through_points
from .root_keys import first_key, keep_copy, keyable_root, last_key, unchanged_on_failure
from .seat_pieces import moved_back, top_of
from .walking import Beginning, Walk, walk

__all__ = ["redo_walks"]

_TAIL = " before redo"
"""What the names of actions that are kept end with."""


@stepwise
def redo_walks(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    index: int = 0,
    replace_edited: bool = False,
) -> Generator[float, None, Walk]:
    """Make the walk of a row (``Object.dafnet.walks``) anew, and then those after it: the chosen
    one in the manner that the character's settings say, others as they were made.

    The first walk begins where the character has been moved by hand, if it was; any other where the
    one before it ends. ``replace_edited``: also where keys were edited since, of which a copy is
    kept then. ``InputError``: keys were edited, a goal is gone, or a walk cannot be made. Then, or
    if the job is closed, nothing is changed.
    """
    scene, own = context.scene, armature.dafnet
    if not 0 <= index < len(own.walks):
        raise InputError(f"'{armature.name}' has no walk to make anew; send it somewhere first.")
    root = keyable_root(settings_of(armature, scene, mode="FREE"))
    edited = edited_from(armature, index)
    if edited and not replace_edited:
        raise InputError(
            "Keys of this walk, or after it, were edited since it was made; let them be replaced "
            "(a copy of the action is kept), or go on by hand."
        )

    rows = list(own.walks)[index:]
    asked, first, last = [asked_in(row) for row in rows], rows[0].first, rows[-1].last
    if index == own.active_walk:
        asked[0] = replace(asked[0], manner=manner_of(own))
    for each in asked:
        _require_goals(scene, each)
    begins = _beginning(scene, armature, root, index)
    made: list[Walk] = []
    with ExitStack() as undo:
        undo.enter_context(_unchanged_on_failure(scene, armature, asked))
        undo.enter_context(unchanged_on_failure(root))
        copied = keep_copy(root, _TAIL) if edited else None
        if copied is not None:
            undo.enter_context(_removed_on_failure(copied))
        for k, each in enumerate(asked):
            if each.by_keys and (top := _pulled(scene, each)) is not None:
                moved_back(top, scene.frame_current_final)
                context.view_layer.update()
            job = _made(context, armature, each, begins)
            made.append((yield from within(job, k / len(asked), (k + 1) / len(asked))))
            begins = Beginning(made[-1].last)
        _follow_range(scene, armature, last, made[-1].last)

    own.active_walk = min(index, len(own.walks) - 1)
    kept = [f"Your keys are kept in '{copied.name}'."] if copied is not None else []
    told = tuple(dict.fromkeys(warning for each in made for warning in each.warnings))
    return replace(made[-1], first=first, warnings=(*kept, *told))


def _made(
    context: bpy.types.Context, armature: bpy.types.Object, asked: Asked, begins: Beginning
) -> Generator[float, None, Walk]:
    """Key one walk, from there on."""
    scene, manner = context.scene, asked.manner
    goal = object_named(scene, asked.goal)
    if asked.kind == BED:
        return lie_on.steps(context, armature, goal, manner.seconds)
    if asked.kind == OBJECT:
        return along_object.steps(context, armature, goal)
    if asked.kind == CURVE:
        return along_curve.steps(
            context,
            armature,
            goal,
            speed=manner.speed,
            seconds=manner.seconds,
            gets_up=manner.gets_up,
            keep_facing=asked.keep_facing,
            backwards=asked.backwards,
            begins=begins,
        )
    if asked.kind == POINTS:
        return through_points.steps(
            context,
            armature,
            [object_named(scene, name) for name in asked.points],
            speed=manner.speed,
            seconds=manner.seconds,
            gets_up=manner.gets_up,
            to_cursor=asked.place is not None,
            place=asked.place,
            begins=begins,
        )
    return walk.steps(
        context,
        armature,
        goal,
        manner.seconds,
        manner.speed,
        asked.tables,
        asked.pull_out,
        sits_down=manner.sits_down,
        gets_up=manner.gets_up,
        place=asked.place,
        begins=begins,
        by_keys=asked.by_keys,
    )


def _pulled(scene: bpy.types.Scene, asked: Asked) -> bpy.types.Object | None:
    """The piece that a walk pulls out, if it does."""
    seat = object_named(scene, asked.goal) if asked.kind == SEAT and asked.pull_out else None
    return None if seat is None else top_of(seat)


def _require_goals(scene: bpy.types.Scene, asked: Asked) -> None:
    """``InputError`` where what a walk was made for is no longer in the scene."""
    wanted = (asked.goal,) if asked.kind in (SEAT, BED, CURVE, OBJECT) else asked.points
    if any(object_named(scene, name) is None for name in wanted):
        raise InputError(
            "What this walk leads to is no longer in the scene; choose another Goal for it, or "
            "send the character anew."
        )


def _beginning(
    scene: bpy.types.Scene, armature: bpy.types.Object, root: bpy.types.Object, index: int
) -> Beginning:
    """Where the walk of a row begins."""
    first = armature.dafnet.walks[index].first
    begun = first_key(root)
    if index > 0 or begun is None or begun < first:
        return Beginning(first)
    moved = moved_by_hand(scene, armature, root, metres_per_unit(scene))
    return Beginning(first, moved.applied(pose_by_keys(root, first)) if moved else None)


def _follow_range(
    scene: bpy.types.Scene, armature: bpy.types.Object, before: int, after: int
) -> None:
    """Let a range that ended with the last walk end with it again, or where another character's
    keys end that has the same range.
    """
    own = armature.dafnet
    owner = scene if own.use_scene_range else own
    if owner.frame_end != before or after <= owner.frame_start:
        return
    if own.use_scene_range:
        for other in scene.objects:
            if other != armature and is_character(other) and other.dafnet.use_scene_range:
                ends = last_key(other.dafnet.root) if other.dafnet.root is not None else None
                after = max(after, min(before, ends or after))
    owner.frame_end = after


@contextmanager
def _unchanged_on_failure(
    scene: bpy.types.Scene, armature: bpy.types.Object, asked: list[Asked]
) -> Iterator[None]:
    """A block that makes walks: if it fails, what they change besides keys is as it was."""
    own: Any = armature.dafnet
    ends = scene.frame_end, own.frame_end
    furniture = own.furniture
    tops = [top for each in asked if (top := _pulled(scene, each)) is not None]
    places = [(top, top.matrix_world.copy()) for top in tops]
    with walks_kept_on_failure(scene, armature), ExitStack() as undo:
        try:
            for top in dict.fromkeys(tops):
                undo.enter_context(unchanged_on_failure(top))
            yield
        except BaseException:
            scene.frame_end, own.frame_end = ends
            own.furniture = furniture
            for piece, matrix in places:
                piece.matrix_world = matrix
            raise


@contextmanager
def _removed_on_failure(action: bpy.types.Action) -> Iterator[None]:
    try:
        yield
    except BaseException:
        bpy.data.actions.remove(action)
        raise
