"""Operators: what the buttons do, that they do the same as the Python API, and that failure changes
nothing.
"""

from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet import dafnet_addon
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job, running
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.baker import bake
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.job import run
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.panels.main import DAFNET_PT_character, DAFNET_PT_shot

from kit.panels import drawn_by
from kit.stage import Stage, bone_heads, keys_of


@pytest.fixture
def shot(blender: ModuleType) -> Stage:
    """A character before a chair, its root walking for a second."""
    made = Stage(height=1.7, fps=24, frames=(1, 24))
    made.seat("Chair", location=(0, 1.5, 0))
    made.walk((1, 0.0), (24, 0.9))
    made.scene.frame_set(5)
    return made


def test_generate_bakes_a_take_that_plays(shot: Stage) -> None:
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    keys = keys_of(shot.ann)
    assert keys["location", 0][:, 0].tolist() == list(range(1, 25))
    assert shot.scene.frame_current == 5 and shot.scene.render.fps == 24
    first, last = (bone_heads(shot.ann, frame) for frame in (1, 24))
    assert 0.6 < (last - first)[0, 1] < 1.2, "the pelvis goes with the root"
    assert np.isfinite(last).all() and 1.3 < last[15, 2] < 1.7
    before = shot.ann.animation_data.action
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    assert (
        before.use_fake_user
        and before.name in bpy.data.actions
        and shot.ann.animation_data.action != before
    )


def test_operator_and_api_give_the_same_keys(shot: Stage) -> None:
    """The button, the job and the three stages by hand are one path."""
    api = dafnet_addon
    weights = api.load_weights()
    shot.ann.dafnet.seed, shot.ann.dafnet.temperature = 3, 0.5
    bpy.ops.dafnet.generate()
    button = keys_of(shot.ann)
    run(bpy.context, shot.settings(), weights)
    job = keys_of(shot.ann)
    read = read_scene(bpy.context, shot.settings())
    take = api.generate(
        read.scene, read.controls, weights, seed=3, temperature=0.5, clean_up=api.CleanUp(1.0, 1.0)
    )
    bake(take, shot.ann, 1, "By hand")
    by_hand = keys_of(shot.ann)
    assert button.keys() == job.keys() == by_hand.keys() and len(button) == 6 + 3 + 22 * 4
    for name in button:
        assert np.array_equal(button[name], job[name]) and np.array_equal(
            button[name], by_hand[name]
        )
    assert np.abs(take.joints[9] - bone_heads(shot.ann, 10)).max() < 1e-3


def test_the_job_tells_progress_seconds_and_warnings(shot: Stage) -> None:
    shot.ann.dafnet.furniture = None
    steps = job.steps(bpy.context, shot.settings())
    progress = []
    try:
        while True:
            progress.append(next(steps))
            assert shot.scene.frame_current == 5
    except StopIteration as done:
        result = done.value
    assert progress == sorted(progress) and progress[-1] == 1.0 and len(progress) > 4
    assert {"reading", "conditions", "sampling", "baking"} <= result.seconds.keys()
    assert any("no furniture" in warning for warning in result.warnings)
    assert result.action == shot.ann.animation_data.action and len(result.take) == 24


def test_cancelling_anywhere_leaves_the_scene_as_it_was(shot: Stage) -> None:
    before = shot.state()
    for until in (0.05, 0.2, 0.6, 0.9):
        steps = job.steps(bpy.context, shot.settings())
        while next(steps) < until:
            pass
        steps.close()
        assert shot.state() == before


def test_what_is_deleted_while_it_runs(shot: Stage) -> None:
    steps = job.steps(bpy.context, shot.settings())
    while next(steps) < 0.3:
        pass
    bpy.ops.object.select_all(action="DESELECT")
    shot.ann.select_set(True)
    bpy.ops.object.delete()
    actions = [action.name for action in bpy.data.actions]
    with pytest.raises(InputError, match="'Ann' is no longer in the scene"):
        for _ in steps:
            pass
    assert [action.name for action in bpy.data.actions] == actions


def test_errors_are_reported_and_change_nothing(shot: Stage, tmp_path) -> None:
    def fails(match: str) -> None:
        before = shot.state()
        with pytest.raises(RuntimeError, match=match):
            bpy.ops.dafnet.generate()
        assert shot.state() == before

    own = shot.ann.dafnet
    furniture, own.furniture = own.furniture, bpy.data.collections.new("Empty")
    fails("'Empty' has no visible mesh")
    own.furniture = furniture
    own.use_scene_range, own.frame_start, own.frame_end = False, 9, 2
    fails("before its start")
    own.use_scene_range = True
    shot.ann.parent = furniture.objects[0]
    fails("has a parent")
    shot.ann.parent = None
    own.mode = "FULL"
    fails("no source")
    own.mode = "FREE"
    preferences = bpy.context.preferences.addons["bl_ext.user_default.dafnet"].preferences
    preferences.weights = str(tmp_path / "gone.safetensors")
    try:
        fails("gone.safetensors")
    finally:
        preferences.weights = ""


def test_buttons_say_what_is_missing(shot: Stage) -> None:
    generate, add = bpy.ops.dafnet.generate, bpy.ops.dafnet.add_character
    for belongs in (shot.ann, shot.ann.dafnet.root, shot.ann.dafnet.head, shot.ann.children[0]):
        bpy.context.view_layer.objects.active = belongs
        assert generate.poll()
    bpy.context.view_layer.objects.active = shot.ann.dafnet.furniture.objects[0]
    assert generate.poll(), "the tab is still hers"
    bpy.context.view_layer.objects.active = shot.ann
    bpy.ops.object.mode_set(mode="POSE")
    assert generate.poll() and not add.poll()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not generate.poll()
    bpy.ops.object.mode_set(mode="OBJECT")
    shot.ann.dafnet.root = None
    assert not generate.poll()


def test_one_undo_step(shot: Stage) -> None:
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.dafnet.generate("EXEC_DEFAULT", True) == {"FINISHED"}
    assert bpy.data.objects["Ann"].animation_data.action
    bpy.ops.ed.undo()
    data = bpy.data.objects["Ann"].animation_data
    assert data is None or data.action is None
    bpy.ops.ed.redo()
    assert bpy.data.objects["Ann"].animation_data.action


def test_the_panel_draws(shot: Stage) -> None:
    """In each of its states."""

    def drawn() -> list[str]:
        return [
            word
            for panel in (DAFNET_PT_character, DAFNET_PT_shot)
            if getattr(panel, "poll", lambda _context: True)(bpy.context)
            for word in drawn_by(panel, bpy.context).words()
        ]

    shot.ann.dafnet.mode = "FREE"
    free = drawn()
    assert "root" in free and "dafnet.generate" in free and "head" not in free
    shot.ann.dafnet.mode = "EE"
    assert {"head", "hand_left", "hand_right", "foot_left", "foot_right"} <= set(drawn())
    shot.ann.dafnet.mode = "FULL"
    assert {"upper_body_source", "foot_left"} <= set(drawn()) and "head" not in drawn()
    shot.ann.dafnet.keyframe_insert("mode", frame=1)
    assert {"upper_body_source", "head"} <= set(drawn())
    running.begin_job().progress = 0.5
    try:
        assert (
            "50 %, 0 s left" in drawn()
            and "dafnet.cancel" in drawn()
            and "dafnet.generate" not in drawn()
        )
        assert not bpy.ops.dafnet.generate.poll()
    finally:
        running.end_job()
    bpy.context.view_layer.objects.active = None
    assert "root" in drawn(), "the tab is still hers"
    bpy.data.objects.remove(shot.ann)
    assert "dafnet.add_character" in drawn() and "root" not in drawn()
