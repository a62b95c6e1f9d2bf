"""The list of tasks in the panel: added, moved and removed, planned in one step for all who are
selected, and generated for all of them, each with a seed of its own.
"""

from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.task_rows import (
    TaskRow,
    fields_of,
    tasks_of,
)
from bl_ext.user_default.dafnet.dafnet_addon.core.draws import Draw
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.director.tasks import (
    VERBS,
    Reach,
    SitOn,
    StandUp,
    WalkTo,
    WorkAt,
    options,
)
from bl_ext.user_default.dafnet.panels.tasks import DAFNET_PT_tasks

from kit.panels import drawn_by
from kit.stage import Stage, bone_heads, keys_of


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    stage = Stage(frames=(1, 40))
    stage.seat("Stool", location=(0.8, 1.2, 0.0))
    stage.seat("Stool.001", location=(-0.8, 1.2, 0.0))
    stage.select(stage.ann)
    return stage


def add(own: Any, verb: str, **values: Any) -> Any:
    assert bpy.ops.dafnet.add_task(verb=verb) == {"FINISHED"}
    row = own.tasks[own.active_task]
    for name, value in values.items():
        setattr(row, name, value)
    return row


def test_every_word_of_the_vocabulary_is_in_the_list() -> None:
    verbs = [item[0] for item in TaskRow.__annotations__["verb"].keywords["items"]]
    assert [verb.lower() for verb in verbs] == [*VERBS]


@pytest.mark.parametrize("verb", VERBS)
def test_rows_say_all_that_tasks_can(stage: Stage, verb: str) -> None:
    row = add(stage.own, verb.upper(), about="Stool", at_place=True, turned=True)
    shown = {*fields_of(row)}
    named = {option.name for option in options(VERBS[verb])}
    spelt = {"where": "about", "what": "about", "on": "about", "at": "about", "line": "about"}
    spelt |= {"near": "place", "facing": "turned"}
    assert {spelt.get(name, name) for name in named} <= shown
    words = drawn_by(DAFNET_PT_tasks, bpy.context).words()
    assert shown <= {*words} and "dafnet.plan_tasks" in words
    (task,) = tasks_of(stage.ann, 1.0)
    assert type(task) is VERBS[verb]


def test_rows_become_tasks(stage: Stage) -> None:
    own = stage.own
    add(own, "WALK_TO", at_place=True, place=(100.0, 200.0, 0.0), turned=True, facing=np.pi / 2)
    add(own, "SIT_ON", about="Stool.*", choose="RANDOM", seconds=2.0)
    add(own, "WORK_AT", about="Desk", how="WRITING", hand="LEFT", at_place=True, place=(1, 2, 3))
    add(own, "REACH", about="Lamp")
    add(own, "STAND_UP")
    assert tasks_of(stage.ann, 0.01) == (
        WalkTo((1.0, 2.0, 0.0), facing=90.0),
        SitOn("Stool.*", seconds=2.0, choose="random"),
        WorkAt("Desk", how="writing", hand="left", near=(0.01, 0.02, 0.03)),
        Reach("Lamp"),
        StandUp(0.5),
    )


def test_the_list_can_be_sorted(stage: Stage) -> None:
    own = stage.own
    for name in ("A", "B", "C"):
        add(own, "SIT_ON", about=name)
    assert bpy.ops.dafnet.move_task(direction="UP") == {"FINISHED"}
    assert bpy.ops.dafnet.move_task(direction="UP") == {"FINISHED"}
    assert bpy.ops.dafnet.move_task(direction="UP") == {"FINISHED"}
    assert [row.about for row in own.tasks] == ["C", "A", "B"] and own.active_task == 0
    assert bpy.ops.dafnet.remove_task() == {"FINISHED"}
    assert bpy.ops.dafnet.move_task(direction="DOWN") == {"FINISHED"}
    assert [row.about for row in own.tasks] == ["B", "A"] and own.active_task == 1


def test_what_is_missing_is_said_with_its_number(stage: Stage) -> None:
    with pytest.raises(InputError, match="'Ann' has no tasks"):
        tasks_of(stage.ann, 1.0)
    add(stage.own, "STAND_UP")
    add(stage.own, "SIT_ON")
    with pytest.raises(RuntimeError, match="'Ann': task 2 cannot be used: the 'on' of 'sit_on'"):
        bpy.ops.dafnet.plan_tasks()
    assert not keys_of(stage.root)


def test_all_who_are_selected_are_planned_and_generated(stage: Stage) -> None:
    scene = stage.scene
    scene.cursor.location = (0.0, -1.5, 0.0)
    assert bpy.ops.dafnet.add_character(name="Bea", height=1.6) == {"FINISHED"}
    bea = bpy.context.object
    for character in (stage.ann, bea):
        stage.select(character)
        add(character.dafnet, "SIT_ON", about="Stool.*", seconds=1.0)
        character.dafnet.temperature = 1.0
    stage.select(stage.ann, bea)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.dafnet.plan_tasks() == {"FINISHED"}
    places = [np.array(bone.location)[:2] for bone in (stage.root, bea.dafnet.root)]
    scene.frame_set(scene.frame_end)
    ends = [np.array(o.location)[:2] for o in (stage.root, bea.dafnet.root)]
    assert np.linalg.norm(ends[0] - ends[1]) > 1.2, "nobody takes the other's seat"
    assert len(places) == 2

    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    seeds = [o.animation_data.action.dafnet.seed for o in (stage.ann, bea)]
    # Who would stay standing is drawn anew, with a seed that follows from the own one.
    for own, seed in enumerate(seeds):
        assert seed in {Draw(own).other(k).seed for k in range(4)}
    assert bea.dafnet.seed == 1
    for character in (stage.ann, bea):
        (pelvis,) = bone_heads(character, scene.frame_end, ["pelvis"])
        assert pelvis[2] < 0.75, "both sit"

    # One who cannot be generated keeps all others as they were.
    bea.dafnet.root = None
    before = {action.name for action in bpy.data.actions}
    played = stage.ann.animation_data.action.name
    with pytest.raises(RuntimeError, match="has no root"):
        bpy.ops.dafnet.generate()
    assert {action.name for action in bpy.data.actions} == before
    assert stage.ann.animation_data.action.name == played and len(stage.own.takes) == 1


def test_one_undo_takes_a_plan_back(stage: Stage) -> None:
    add(stage.own, "SIT_ON", about="Stool")
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.dafnet.plan_tasks() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="planned")
    assert keys_of(bpy.data.objects["Ann"].dafnet.root)
    bpy.ops.ed.undo()
    ann = bpy.data.objects["Ann"]
    assert not keys_of(ann.dafnet.root) and not keys_of(ann) and len(ann.dafnet.tasks) == 1
    assert bpy.context.scene.frame_end == 40
