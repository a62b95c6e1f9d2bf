"""A bake that fails between its first and its last write leaves the file as it was, wherever and
however it fails.
"""

import linecache
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from types import FrameType, ModuleType
from typing import Any

import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon import load_weights
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import create_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.core.draws import Draw
from bl_ext.user_default.dafnet.dafnet_addon.core.generate import takes_steps
from bl_ext.user_default.dafnet.dafnet_addon.core.progress import run_to_end
from bl_ext.user_default.dafnet.dafnet_addon.core.solids import Scene
from bl_ext.user_default.dafnet.dafnet_addon.core.take import Controls

Place = tuple[str, int]
"""A line of the add-on's code, and how often it had run before."""


class _Injected(Exception):
    """No error of the add-on's, as of a full memory or a fault in the code."""


def _plain(value: Any) -> object:
    if isinstance(value, str | int | float | bytes | set | None):
        return value
    return (
        value.name_full
        if hasattr(value, "name_full")
        else repr(value[:])
        if hasattr(value, "__getitem__")
        else repr(value)
    )


def _told(struct: Any) -> dict[str, object]:
    """All the values that Blender tells of a thing."""
    if struct is None:
        return {}
    return {name: _plain(getattr(struct, name)) for name in _names(type(struct))}


@cache
def _names(kind: type) -> list[str]:
    known = kind.bl_rna.properties  # type: ignore[attr-defined]
    kinds = {each.identifier: each.type for each in known}
    return [
        name
        for name, kind in kinds.items()
        if kind not in ("COLLECTION", "POINTER") and name != "use_nodes"
    ]


def everything(bpy: ModuleType, armature: Any) -> dict[str, object]:
    """What must be as it was: the armature, what it plays and lists, every action and its keys, the
    scene.
    """
    bpy.context.view_layer.update()
    data, own = armature.animation_data, armature.dafnet
    return {
        "armature": _told(armature),
        "data": _told(data),
        "plays": data and data.action and data.action.name,
        "slot": getattr(data, "action_slot", None) and data.action_slot.identifier,
        "bones": [
            (bone.rotation_mode, *bone.matrix_basis, dict(bone.items()))
            for bone in armature.pose.bones
        ],
        "knee": _told(armature.pose.bones["left_knee"]),
        "rows": [row.action and row.action.name for row in own.takes],
        "settings": _told(own),
        "actions": {
            action.name: (_told(action), _told(action.dafnet), list(action.keys()))
            for action in bpy.data.actions
        },
        "keys": [
            (
                curve.data_path,
                curve.array_index,
                [tuple(point.co) for point in curve.keyframe_points],
            )
            for curve in action_curves(armature)
        ],
        "scene": _told(bpy.context.scene),
    }


@contextmanager
def _traced(visit: Callable[[Place, str], None]) -> Iterator[None]:
    """Call ``visit`` before every line of the add-on that writes a bake; what it raises, the line
    is as if it raised.
    """
    writing = {
        "job.py": {"bake_steps"},
        "baker.py": None,
        "takes.py": None,
        "curves.py": None,
        "compat.py": {"new_action", "add", "assign_action"},
    }
    seen: dict[str, int] = {}

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        file = frame.f_code.co_filename.replace("\\", "/")
        name = file.rsplit("/", 1)[-1]
        if "/dafnet_addon/blender/" not in file or name not in writing:
            return None
        if writing[name] is not None and frame.f_code.co_name not in writing[name]:
            return None
        if event == "line":
            line = f"{name}:{frame.f_lineno}"
            seen[line] = seen.get(line, 0) + 1
            visit((line, seen[line]), linecache.getline(frame.f_code.co_filename, frame.f_lineno))
        return trace

    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(None)


def _nothing(bpy: ModuleType, armature: Any) -> None:
    """A character as it was added."""


def _played(bpy: ModuleType, armature: Any) -> None:
    """A character that plays the animator's own action in part, with a keyed mode and a bone posed
    by hand.
    """
    armature.dafnet.keyframe_insert("mode", frame=1)
    armature.animation_data.action_influence = 0.5
    armature.animation_data.action_blend_type = "ADD"
    bone = armature.pose.bones["left_knee"]
    bone.rotation_mode, bone.rotation_euler, bone.location, bone["mine"] = (
        "XZY",
        (0.1, 0.2, 0.3),
        (0, 0, 0.1),
        3,
    )
    armature.location = (1, 2, 3)


def _listed(bpy: ModuleType, armature: Any) -> None:
    """A character that has takes, of which it plays none."""
    bpy.context.scene.frame_end = 3
    armature.dafnet.root.location = (0.0, 0.1, 0.0)
    armature.dafnet.take_count = 2
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    armature.animation_data.action = None


@pytest.mark.parametrize("prepared", [_nothing, _played, _listed])
def test_a_failure_at_any_write_leaves_the_file_as_it_was(
    blender: ModuleType,
    prepared: Callable[[ModuleType, Any], None],
) -> None:
    armature = create_character(blender.context, "Ann")
    prepared(blender, armature)
    controls = Controls(30.0, np.tile(np.eye(4), (3, 1, 1)))
    draws = [Draw(seed) for seed in range(2)]
    made = run_to_end(takes_steps(Scene(), controls, load_weights(), draws))
    settings = job.settings_of(armature, blender.context.scene)

    def bake() -> None:
        for _ in job.bake_steps(settings, made, controls, whole=True):
            blender.context.view_layer.update()

    before = everything(blender, armature)
    places: dict[str, int] = {}
    finished = False

    def note(place: Place, code: str) -> None:
        nonlocal finished
        if not finished:
            places[place[0]] = place[1]
        finished = finished or "undo.pop_all()" in code

    with _traced(note):
        bake()
    assert finished and everything(blender, armature) != before
    armature.name = "Other"
    armature = create_character(blender.context, "Ann")
    prepared(blender, armature)
    settings = job.settings_of(armature, blender.context.scene)
    before = everything(blender, armature)
    assert len(places) > 60 and {line.split(":")[0] for line in places} >= {
        "job.py",
        "baker.py",
        "takes.py",
        "compat.py",
    }
    for line, times in places.items():
        for at in {1, times}:

            def fail(place: Place, _: str, wanted: Place = (line, at)) -> None:
                if place == wanted:
                    raise _Injected

            with pytest.raises(_Injected), _traced(fail):
                bake()
            after = everything(blender, armature)
            assert {key: after[key] for key in after if after[key] != before[key]} == {}, (
                f"{line}, visit {at}"
            )
