"""Operators: what the buttons do, that they do the same as the Python API, and that failure changes
nothing.
"""

from types import ModuleType

import numpy as np
import pytest

from kit.panels import drawn_by


class Shot:
    """A character before a chair, its root walking for a second."""

    def __init__(self, bpy: ModuleType, addon) -> None:
        self.bpy, self.addon = bpy, addon
        self.scene = bpy.context.scene
        self.scene.render.fps = 24
        self.scene.frame_start, self.scene.frame_end = 1, 24
        assert bpy.ops.dafnet.add_character(name="Ann", height=1.7) == {"FINISHED"}
        self.ann = bpy.context.object
        furniture = bpy.data.collections.new("Furniture")
        self.scene.collection.children.link(furniture)
        mesh = bpy.data.meshes.new("Chair")
        corners = [(x, y, z) for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (0, 0.45)]
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        mesh.from_pydata(corners, [], faces)
        chair = bpy.data.objects.new("Chair", mesh)
        chair.location = (0, 1.5, 0)
        furniture.objects.link(chair)
        self.ann.dafnet.furniture = furniture
        root = self.ann.dafnet.root
        for frame, y in ((1, 0.0), (24, 0.9)):
            root.location.y = y
            root.keyframe_insert("location", frame=frame)
        self.scene.frame_set(5)

    def settings(self, **overrides):
        return self.addon("dafnet_addon.blender.job").settings_of(self.ann, self.scene, **overrides)

    def keys(self) -> dict[tuple[str, int], np.ndarray]:
        curves = self.addon("dafnet_addon.blender.compat").action_curves(self.ann)
        return {
            (c.data_path, c.array_index): np.array([p.co for p in c.keyframe_points])
            for c in curves
        }

    def state(self) -> dict[str, object]:
        """What must not change when something fails."""
        self.bpy.context.view_layer.update()
        return {
            "actions": sorted(action.name for action in self.bpy.data.actions),
            "objects": sorted(o.name for o in self.bpy.data.objects),
            "meshes": sorted(m.name for m in self.bpy.data.meshes),
            "playing": [
                o.name
                for o in self.bpy.data.objects
                if o.animation_data and o.animation_data.action
            ],
            "frame": (self.scene.frame_current, self.scene.frame_subframe, self.scene.render.fps),
            "places": {
                o.name: tuple(v for row in o.matrix_world for v in row) for o in self.scene.objects
            },
            "pose": [tuple(b.rotation_quaternion) for b in self.ann.pose.bones],
        }


@pytest.fixture
def shot(blender, addon) -> Shot:
    return Shot(blender, addon)


def test_generate_bakes_a_take_that_plays(shot: Shot) -> None:
    assert shot.bpy.ops.dafnet.generate() == {"FINISHED"}
    keys = shot.keys()
    assert keys["location", 0][:, 0].tolist() == list(range(1, 25))
    assert shot.scene.frame_current == 5 and shot.scene.render.fps == 24
    first, last = (_heads(shot, frame) for frame in (1, 24))
    assert 0.6 < (last - first)[0, 1] < 1.2, "the pelvis goes with the root"
    assert np.isfinite(last).all() and 1.3 < last[15, 2] < 1.7
    before = shot.ann.animation_data.action
    assert shot.bpy.ops.dafnet.generate() == {"FINISHED"}
    assert (
        before.use_fake_user
        and before.name in shot.bpy.data.actions
        and shot.ann.animation_data.action != before
    )


def test_operator_and_api_give_the_same_keys(shot: Shot, addon) -> None:
    """The button, the job and the three stages by hand are one path."""
    api = addon("dafnet_addon")
    weights = api.load_weights()
    shot.ann.dafnet.seed, shot.ann.dafnet.temperature = 3, 0.5
    shot.bpy.ops.dafnet.generate()
    button = shot.keys()
    addon("dafnet_addon.blender.job").run(shot.bpy.context, shot.settings(), weights)
    job = shot.keys()
    read = addon("dafnet_addon.blender.scene_reader").read_scene(shot.bpy.context, shot.settings())
    take = api.generate(
        read.scene, read.controls, weights, seed=3, temperature=0.5, clean_up=api.CleanUp(1.0, 1.0)
    )
    addon("dafnet_addon.blender.baker").bake(take, shot.ann, 1, "By hand")
    by_hand = shot.keys()
    assert button.keys() == job.keys() == by_hand.keys() and len(button) == 6 + 3 + 22 * 4
    for name in button:
        assert np.array_equal(button[name], job[name]) and np.array_equal(
            button[name], by_hand[name]
        )
    assert np.abs(take.joints[9] - _heads(shot, 10)).max() < 1e-3


def test_the_job_tells_progress_seconds_and_warnings(shot: Shot, addon) -> None:
    job = addon("dafnet_addon.blender.job")
    shot.ann.dafnet.furniture = None
    steps = job.steps(shot.bpy.context, shot.settings())
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


def test_cancelling_anywhere_leaves_the_scene_as_it_was(shot: Shot, addon) -> None:
    before = shot.state()
    job = addon("dafnet_addon.blender.job")
    for until in (0.05, 0.2, 0.6, 0.9):
        steps = job.steps(shot.bpy.context, shot.settings())
        while next(steps) < until:
            pass
        steps.close()
        assert shot.state() == before


def test_what_is_deleted_while_it_runs(shot: Shot, addon) -> None:
    job = addon("dafnet_addon.blender.job")
    steps = job.steps(shot.bpy.context, shot.settings())
    while next(steps) < 0.3:
        pass
    shot.bpy.ops.object.select_all(action="DESELECT")
    shot.ann.select_set(True)
    shot.bpy.ops.object.delete()
    actions = [action.name for action in shot.bpy.data.actions]
    with pytest.raises(
        addon("dafnet_addon.core.errors").InputError, match="'Ann' is not in the scene"
    ):
        for _ in steps:
            pass
    assert [action.name for action in shot.bpy.data.actions] == actions


def test_errors_are_reported_and_change_nothing(shot: Shot, tmp_path) -> None:
    def fails(match: str) -> None:
        before = shot.state()
        with pytest.raises(RuntimeError, match=match):
            shot.bpy.ops.dafnet.generate()
        assert shot.state() == before

    own = shot.ann.dafnet
    furniture, own.furniture = own.furniture, shot.bpy.data.collections.new("Empty")
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
    preferences = shot.bpy.context.preferences.addons["bl_ext.user_default.dafnet"].preferences
    preferences.weights = str(tmp_path / "gone.safetensors")
    try:
        fails("gone.safetensors")
    finally:
        preferences.weights = ""


def test_buttons_say_what_is_missing(shot: Shot) -> None:
    generate, add = shot.bpy.ops.dafnet.generate, shot.bpy.ops.dafnet.add_character
    for belongs in (shot.ann, shot.ann.dafnet.root, shot.ann.dafnet.head, shot.ann.children[0]):
        shot.bpy.context.view_layer.objects.active = belongs
        assert generate.poll()
    shot.bpy.context.view_layer.objects.active = shot.ann.dafnet.furniture.objects[0]
    assert not generate.poll()
    shot.bpy.context.view_layer.objects.active = shot.ann
    shot.bpy.ops.object.mode_set(mode="POSE")
    assert generate.poll() and not add.poll()
    shot.bpy.ops.object.mode_set(mode="EDIT")
    assert not generate.poll()
    shot.bpy.ops.object.mode_set(mode="OBJECT")
    shot.ann.dafnet.root = None
    assert not generate.poll()


def test_one_undo_step(shot: Shot) -> None:
    shot.bpy.ops.ed.undo_push(message="Before")
    assert shot.bpy.ops.dafnet.generate("EXEC_DEFAULT", True) == {"FINISHED"}
    assert shot.bpy.data.objects["Ann"].animation_data.action
    shot.bpy.ops.ed.undo()
    data = shot.bpy.data.objects["Ann"].animation_data
    assert data is None or data.action is None
    shot.bpy.ops.ed.redo()
    assert shot.bpy.data.objects["Ann"].animation_data.action


def test_the_panel_draws(shot: Shot, addon) -> None:
    """In each of its states."""
    panel = addon("panels.main").DAFNET_PT_character
    running = addon("dafnet_addon.blender.running")

    def drawn() -> list[str]:
        return drawn_by(panel, shot.bpy.context).words()

    shot.ann.dafnet.mode = "FREE"
    free = drawn()
    assert "root" in free and "dafnet.generate" in free and "head" not in free
    shot.ann.dafnet.mode = "EE"
    assert {"head", "hand_left", "hand_right"} <= set(drawn())
    shot.ann.dafnet.mode = "FULL"
    assert "upper_body_source" in drawn() and "head" not in drawn()
    shot.ann.dafnet.keyframe_insert("mode", frame=1)
    assert {"upper_body_source", "head"} <= set(drawn())
    running.begin_job().progress = 0.5
    try:
        assert (
            "50 %, 0 s left" in drawn()
            and "dafnet.cancel" in drawn()
            and "dafnet.generate" not in drawn()
        )
        assert not shot.bpy.ops.dafnet.generate.poll()
    finally:
        running.end_job()
    shot.bpy.context.view_layer.objects.active = None
    assert "dafnet.add_character" in drawn() and "root" not in drawn()


def _heads(shot: Shot, frame: int) -> np.ndarray:
    shot.scene.frame_set(frame)
    evaluated = shot.ann.evaluated_get(shot.bpy.context.evaluated_depsgraph_get())
    names = shot.addon("dafnet_addon.core.skeleton").JOINTS
    return np.array([evaluated.matrix_world @ evaluated.pose.bones[name].head for name in names])
