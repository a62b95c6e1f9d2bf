"""A plan of tasks as keys that can be edited: the root's path, the targets of head and hands, how
far they count, and the mode.

Keys that the user has made or edited are never lost: before they are replaced, a copy of their
action is kept.
"""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from hashlib import sha256

import bpy
import numpy as np
from mathutils import Matrix

from ...core.errors import InputError
from ...core.paths import Route
from ...core.series import runs
from ...core.skeleton import TARGETS
from ...director.plans import Plan
from ..character.targets import add_targets, missing_targets
from ..compat import action_curves, remove_curves
from .made_walks import forget_walks, walks_kept_on_failure
from .root_keys import (
    MOVES,
    keep_copy,
    key_route,
    keys_within,
    require_keyable,
    unchanged_on_failure,
)

__all__ = ["plan_edited", "plan_keyed"]

_A_SECOND = 10
"""How many keys a second what moves gets."""
_STILL = 1e-4
"""Metres, or a share, by which a value may change between frames and still stand."""
_TAIL = " before tasks"
"""What the names of actions that are kept end with."""


@contextmanager
def plan_keyed(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    plan: Plan,
    *,
    first: int,
    unit: float,
) -> Iterator[tuple[str, ...]]:
    """A block before which a plan is keyed from frame ``first`` on, in place of all keys there of
    the root, of the targets that it uses, of the influences, the lean and the mode; if the block
    fails, all is as it was before. ``unit``: metres of a Blender unit.

    Targets that are missing are added. Yields the names of the actions in which keys are kept that
    the user had made or edited. ``InputError``: something cannot be keyed; nothing is changed then.
    """
    own = armature.dafnet
    used = [role for role in TARGETS if role in plan.targets.influences]
    fps = plan.fps
    made: list[bpy.types.Object] = []
    copies: list[bpy.types.Action] = []
    with ExitStack() as undo:
        undo.enter_context(walks_kept_on_failure(context.scene, armature))
        undo.enter_context(_settings_kept_on_failure(armature))
        undo.callback(_remove, made, armature)
        if missing := missing_targets(context, armature, used):
            made += add_targets(context, armature, missing)
        owners = {"root": own.root, **{role: getattr(own, role) for role in used}}
        for role, owner in owners.items():
            require_keyable(owner, "root" if role == "root" else "target")

        if plan_edited(armature, first):
            undo.callback(_remove_actions, copies)
            copies += _copies([*owners.values(), armature], armature, first)
        for owner in (*owners.values(), armature):
            undo.enter_context(unchanged_on_failure(owner))

        for owner in owners.values():
            _clear(owner, MOVES, first)
        _clear_settings(armature, first)

        route = Route(plan.path, ())
        key_route(context, own.root, route, first=first, scale=1.0 / unit, fps=fps)
        for role in used:
            _key_target(owners[role], plan, role, first=first, unit=unit)
        _key_settings(armature, plan, first)
        own.planned = _digest(armature, first)
        forget_walks(armature, first)
        yield tuple(copy.name for copy in copies)
        made.clear()
        copies.clear()


def plan_edited(armature: bpy.types.Object, first: int) -> bool:
    """Whether a plan from frame ``first`` on would take the place of keys that the user has made or
    edited.
    """
    return _digest(armature, first) not in ("", armature.dafnet.planned)


@contextmanager
def _settings_kept_on_failure(armature: bpy.types.Object) -> Iterator[None]:
    """A block that keys settings: if it fails, their values are as they were."""
    own = armature.dafnet
    names = [*(path.removeprefix("dafnet.") for path in _settings(armature)), "planned"]
    kept = {name: getattr(own, name) for name in names}
    try:
        yield
    except BaseException:
        for name, value in kept.items():
            setattr(own, name, value)
        raise


def _remove(made: list[bpy.types.Object], armature: bpy.types.Object) -> None:
    """Remove the targets that were added."""
    for role in TARGETS:
        if getattr(armature.dafnet, role) in made:
            setattr(armature.dafnet, role, None)
    for each in made:
        bpy.data.objects.remove(each)


def _remove_actions(copies: list[bpy.types.Action]) -> None:
    for copy in copies:
        bpy.data.actions.remove(copy)


def _settings(armature: bpy.types.Object) -> tuple[str, ...]:
    """The data paths of the settings that a plan keys."""
    roles = [role for role in TARGETS if getattr(armature.dafnet, role) is not None]
    return (
        "dafnet.mode",
        "dafnet.head_follows",
        "dafnet.lean",
        *(f"dafnet.{role}_influence" for role in roles),
    )


def _clear(owner: bpy.types.Object, paths: Sequence[str], first: int) -> None:
    """Remove the keys of these data paths from frame ``first`` on."""
    for curve in action_curves(owner):
        if curve.data_path in paths:
            points = curve.keyframe_points
            for k in reversed(range(len(points))):
                if points[k].co[0] >= first:
                    points.remove(points[k], fast=True)
            curve.update()


def _clear_settings(armature: bpy.types.Object, first: int) -> None:
    """Remove the keys of the settings that a plan keys; one that has none left is as at first, so
    that nothing goes on with what was asked before.
    """
    keyed = {curve.data_path for curve in action_curves(armature)} & {*_settings(armature)}
    _clear(armature, [*keyed], first)
    for path in keyed:
        curves = [curve for curve in action_curves(armature) if curve.data_path == path]
        if not any(len(curve.keyframe_points) for curve in curves):
            remove_curves(armature, path)
            armature.dafnet.property_unset(path.removeprefix("dafnet."))


def _digest(armature: bpy.types.Object, first: int) -> str:
    """What tells the keys of a plan from others; "" where there are none."""
    own = armature.dafnet
    found = [*keys_within(armature, _settings(armature), first)]
    for role in ("root", *TARGETS):
        if (owner := getattr(own, role)) is not None:
            found += [role.encode() + each for each in keys_within(owner, MOVES, first)]
    return sha256(b"".join(sorted(found))).hexdigest() if found else ""


def _copies(
    owners: Sequence[bpy.types.Object], armature: bpy.types.Object, first: int
) -> Iterator[bpy.types.Action]:
    """Copies of the actions whose keys are about to be replaced."""
    for owner in owners:
        paths = _settings(armature) if owner == armature else MOVES
        if any(keys_within(owner, paths, first)):
            yield keep_copy(owner, _TAIL)


def _frames(values: np.ndarray, fps: float) -> list[int]:
    """The frames at which values (T, …) are keyed so that straight lines between them are right:
    about ten a second where they change, and the ends of where they stand.
    """
    flat = values.reshape(len(values), -1)
    changes = np.abs(np.diff(flat, axis=0)).max(axis=1, initial=0.0) > _STILL
    frames = {0, len(values) - 1}
    for start, stop in runs(changes):
        frames |= {*range(start, stop + 1, max(1, round(fps / _A_SECOND))), stop}
    return sorted(frames)


def _key_target(
    target: bpy.types.Object, plan: Plan, role: str, *, first: int, unit: float
) -> None:
    """Key where a target is, and for the head where it looks, while it counts."""
    count = plan.targets.influences[role] > 0.0
    places = plan.targets.places.get(role)
    turns = plan.targets.looks if role == "head" else None
    for start, stop in runs(count):
        span = slice(start, stop)
        if places is not None and (known := np.isfinite(places[span]).all(axis=1)).any():
            for k in _where(known, _frames(np.nan_to_num(places[span]), plan.fps)):
                target.location = places[start + k] / unit
                _insert(target, "location", first + start + k)
        if turns is not None and (known := np.isfinite(turns[span]).all(axis=(1, 2))).any():
            for k in _where(known, _frames(np.nan_to_num(turns[span]), plan.fps)):
                matrix = Matrix(turns[start + k].tolist())
                target.rotation_euler = matrix.to_euler("XYZ", target.rotation_euler)
                _insert(target, "rotation_euler", first + start + k)
    _straighten(target, MOVES, "LINEAR", first)


def _where(known: np.ndarray, frames: Sequence[int]) -> list[int]:
    """Those of the frames that are known, and the ends of what is."""
    ends = {k for start, stop in runs(known) for k in (start, stop - 1)}
    return sorted({k for k in frames if known[k]} | ends)


def _key_settings(armature: bpy.types.Object, plan: Plan, first: int) -> None:
    """Key the mode, how far targets count, and what of the head's does."""
    own, targets = armature.dafnet, plan.targets
    _key_words(armature, "mode", targets.mode, first)
    if (lean := plan.lean) is not None:
        for k in _frames(lean, plan.fps):
            own.lean = float(np.radians(lean[k]))
            _insert(armature, "dafnet.lean", first + k)
        _straighten(armature, ("dafnet.lean",), "LINEAR", first)
    if "EE" not in targets.mode:
        return

    for role in TARGETS:
        if getattr(own, role) is None:
            continue
        share = targets.influences.get(role, np.zeros(len(plan)))
        for k in _frames(share, plan.fps):
            setattr(own, f"{role}_influence", float(share[k]))
            _insert(armature, f"dafnet.{role}_influence", first + k)
        _straighten(armature, (f"dafnet.{role}_influence",), "LINEAR", first)

    if own.head is not None and "head" in targets.influences:
        _key_words(armature, "head_follows", _followed(plan), first)


def _followed(plan: Plan) -> list[str]:
    """What of the head's target counts in each frame."""
    nothing = np.zeros(len(plan), bool)
    places, turns = plan.targets.places.get("head"), plan.targets.looks
    placed = nothing if places is None else np.isfinite(places).all(axis=1)
    turned = nothing if turns is None else np.isfinite(turns).all(axis=(1, 2))
    words = np.where(placed & ~turned, "PLACE", np.where(turned & ~placed, "TURN", "ALL"))
    # Where neither counts what comes next is set already, so that nothing jumps.
    for start, stop in runs(~(placed | turned)):
        words[start:stop] = words[stop] if stop < len(words) else words[max(0, start - 1)]
    return [str(word) for word in words]


def _key_words(armature: bpy.types.Object, name: str, words: Sequence[str], first: int) -> None:
    """Key a setting that is a word at each of its changes."""
    for k, word in enumerate(words):
        if k == 0 or word != words[k - 1]:
            setattr(armature.dafnet, name, word)
            _insert(armature, f"dafnet.{name}", first + k)
    _straighten(armature, (f"dafnet.{name}",), "CONSTANT", first)


def _insert(owner: bpy.types.Object, path: str, frame: int) -> None:
    if not owner.keyframe_insert(path, frame=frame):
        raise InputError(f"'{owner.name}' cannot be keyed; unlock its action and curves.")


def _straighten(owner: bpy.types.Object, paths: Sequence[str], kind: str, first: int) -> None:
    for curve in action_curves(owner):
        if curve.data_path in paths:
            for point in curve.keyframe_points:
                if point.co[0] >= first:
                    point.interpolation = kind
            curve.update()
