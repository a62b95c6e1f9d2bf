"""Tasks become keys in Blender: the root's path, targets, influences and the mode say what was
planned, can be edited, and edits are not lost.
"""

from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.tasks import Assignment, direct
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.root import yaw_of
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import TARGETS
from bl_ext.user_default.dafnet.dafnet_addon.director.tasks import (
    LookAt,
    Reach,
    SitOn,
    StandUp,
    WriteOn,
)

from kit.stage import Stage, keys_of


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    """Ann before a stool, a board and a lamp."""
    stage = Stage(frames=(1, 60))
    stage.seat("Stool", location=(1.0, 1.5, 0.0))
    stage.box("Board", (-0.9, 2.4, 0.9), (0.9, 2.44, 1.9))
    stage.empty("Lamp", (-2.0, 1.0, 1.4))
    return stage


TASKS = (SitOn("Stool", seconds=1), LookAt("Lamp"), StandUp(), WriteOn("Board", seconds=2))


def test_keys_say_what_was_planned(stage: Stage) -> None:
    (done,) = direct(bpy.context, [Assignment(stage.ann, TASKS)])
    plan = done.plan
    assert (done.first, done.last) == (1, len(plan)) and stage.scene.frame_end == len(plan)
    assert done.kept == () and done.extended
    read = stage.read().controls
    asked = plan.controls()

    off = np.linalg.norm(read.root[:, :3, 3] - asked.root[:, :3, 3], axis=1)
    turn = yaw_of(read.root[:, :2, 1]) - yaw_of(asked.root[:, :2, 1])
    assert off.max() < 0.02 and np.abs(np.angle(np.exp(1j * turn))).max() < np.radians(3)
    assert read.mode == asked.mode

    counts = plan.targets.influences["hand_right"] > 0.0
    np.testing.assert_allclose(
        read.hand_right_influence, plan.targets.influences["hand_right"], atol=0.1
    )
    off = np.linalg.norm(read.hand_right[counts] - asked.hand_right[counts], axis=1)
    assert off.max() < 0.03 and np.median(off) < 0.005
    assert not read.hand_left_influence.any(), "the plan leaves it free"

    looks = plan.targets.influences["head"] > 0.0
    assert asked.head is None and np.isnan(read.head[looks]).all(), "it only turns"
    angle = np.einsum("tij,tij->t", read.head_rotation[looks], asked.head_rotation[looks])
    assert np.degrees(np.arccos(np.clip((angle - 1) / 2, -1, 1))).max() < 3.0


def test_a_lean_is_keyed_for_as_long_as_one_sits_so(stage: Stage) -> None:
    stage.seat("Bench", location=(-1.5, 1.5, 0.0))
    tasks = [SitOn("Stool", seconds=2, lean=15), SitOn("Bench", seconds=2)]
    (done,) = direct(bpy.context, [Assignment(stage.ann, tasks)])
    keys = keys_of(stage.ann)[("dafnet.lean", 0)]
    assert 2 <= len(keys) <= 4
    first, second = done.plan.timeline
    read = stage.read().controls
    assert np.allclose(read.lean, done.plan.controls().lean, atol=1e-3)
    assert np.allclose(read.lean[first.start : second.start], 15.0, atol=1e-3)
    assert not read.lean[second.there :].any()
    # Planned anew without one, from frames in which she leant.
    stage.scene.frame_set(stage.scene.frame_start + first.there + 5)
    assert stage.own.lean != 0.0
    direct(bpy.context, [Assignment(stage.ann, [SitOn("Stool")])])
    assert ("dafnet.lean", 0) not in keys_of(stage.ann)
    assert stage.read().controls.lean is None


def test_a_plan_without_hands_leaves_them_as_free_as_they_were(stage: Stage) -> None:
    """Of an earlier plan that led them no influence stays, which would hold later ones back."""
    direct(bpy.context, [Assignment(stage.ann, TASKS)])
    assert ("dafnet.hand_left_influence", 0) in keys_of(stage.ann)
    stage.scene.frame_set(stage.scene.frame_end)
    direct(bpy.context, [Assignment(stage.ann, [SitOn("Stool", seconds=2)])])
    assert {path for path, _ in keys_of(stage.ann)} == {"dafnet.mode"}
    assert [getattr(stage.own, f"{role}_influence") for role in TARGETS] == [1.0] * len(TARGETS)


def test_who_cannot_be_keyed_leaves_the_others_as_they_were(stage: Stage) -> None:
    """Of two the second's head is parented, so that it takes no keys; the first has no root."""
    assert bpy.ops.dafnet.add_character(name="Bob") == {"FINISHED"}
    bob = bpy.context.object
    bob.dafnet.root.location.x = 2.0
    bob.dafnet.head.parent = stage.empty("Holder")
    bpy.data.objects.remove(stage.own.root)
    before = stage.state()
    people = [Assignment(each, [LookAt("Lamp", seconds=2)]) for each in (stage.ann, bob)]
    with pytest.raises(InputError, match="parent"):
        direct(bpy.context, people)
    assert stage.state() == before and not keys_of(stage.ann) and not stage.own.planned
    bob.dafnet.root.hide_viewport = True
    with pytest.raises(InputError, match="'Bob Root' or its collection is disabled in viewports"):
        direct(bpy.context, people)


def test_keys_are_few_enough_to_edit(stage: Stage) -> None:
    (done,) = direct(bpy.context, [Assignment(stage.ann, TASKS)])
    seconds = len(done.plan) / 24
    for values in keys_of(stage.root).values():
        assert len(values) <= 14 * seconds
    modes = keys_of(stage.ann)[("dafnet.mode", 0)]
    assert len(modes) == 1 + sum(
        a != b for a, b in zip(done.plan.targets.mode, done.plan.targets.mode[1:], strict=False)
    )


def test_planned_again_the_keys_are_new_and_edits_are_kept(stage: Stage) -> None:
    direct(bpy.context, [Assignment(stage.ann, TASKS)])
    before = {action.name for action in bpy.data.actions}
    (again,) = direct(bpy.context, [Assignment(stage.ann, [SitOn("Stool", seconds=2)])])
    assert again.kept == () and {action.name for action in bpy.data.actions} == before
    assert stage.read().controls.root[-1, 1, 3] > 1.0
    last = max(values[:, 0].max() for values in keys_of(stage.root).values())
    assert last == again.last, "nothing is left of the longer plan"

    stage.stand(30, 5.0, 5.0)
    edited = keys_of(stage.root)
    (third,) = direct(bpy.context, [Assignment(stage.ann, [SitOn("Stool")])])
    assert len(third.kept) == 2 and all(name.endswith("before tasks") for name in third.kept)
    kept = bpy.data.actions[third.kept[0]]
    assert kept.use_fake_user
    stage.root.animation_data.action = kept
    if hasattr(kept, "slots"):
        stage.root.animation_data.action_slot = kept.slots[0]
    for path, values in edited.items():
        np.testing.assert_array_equal(keys_of(stage.root)[path], values)


def test_who_is_there_already_and_those_who_stand_round(stage: Stage) -> None:
    stage.scene.cursor.location = (1.0, 1.5, 0.0)
    assert bpy.ops.dafnet.add_character(name="Bea") == {"FINISHED"}
    bea = bpy.context.object
    stage.select(stage.ann)
    with pytest.raises(InputError, match="'Ann': Task 1, 'sit on Stool'"):
        direct(bpy.context, [Assignment(stage.ann, [SitOn("Stool")])])
    assert not keys_of(stage.root)

    bea.dafnet.root.location.x = -3.0
    ann, other = direct(
        bpy.context,
        [
            Assignment(stage.ann, [SitOn("Stool", seconds=1)], already_there=True),
            Assignment(bea, [WriteOn("Board", seconds=1)]),
        ],
    )
    np.testing.assert_allclose(stage.place(1)[:2], (1.0, 1.5), atol=0.2)
    assert ann.plan.timeline[0].there <= 1 and other.name == "Bea"
    assert bea.dafnet.furniture is not None and "Board" in bea.dafnet.furniture.objects


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (lambda ann: setattr(ann.dafnet.root, "parent", ann), "follows something"),
        (lambda ann: ann.dafnet.hand_right.constraints.new("COPY_LOCATION"), "follows something"),
    ],
)
def test_what_cannot_be_keyed_is_refused_and_nothing_changes(
    stage: Stage, broken: Any, said: str
) -> None:
    broken(stage.ann)
    before = stage.state()
    with pytest.raises(InputError, match=said):
        direct(bpy.context, [Assignment(stage.ann, [Reach("Board", hand="right")])])
    assert stage.state() == before


def test_missing_targets_are_added(stage: Stage, tmp_path: Path) -> None:
    hand = stage.own.hand_right
    stage.own.hand_right = None
    bpy.data.objects.remove(hand)
    direct(bpy.context, [Assignment(stage.ann, [WriteOn("Board")])])
    assert keys_of(stage.own.hand_right)
