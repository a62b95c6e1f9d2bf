"""Sending a character to a seat or to the 3D cursor: keys on the root, and the take that follows
them.
"""

from collections.abc import Callable, Generator
from time import sleep
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import character_and_goal
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing import (
    path_sources,
    root_keys,
    walking,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import running
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.view import DrawnOnce
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.scene_reader import read_scene
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.demo_room import build_room
from bl_ext.user_default.dafnet.dafnet_addon.blender.showcase.examples import add_example
from bl_ext.user_default.dafnet.dafnet_addon.core.conditions import shot_steps
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.progress import run_to_end
from bl_ext.user_default.dafnet.operators.walking import WalkOperator

from kit.stage import Stage, key


class Room(Stage):
    """A character of 1.6 m, and a chair that looks at it from 3 m away, at 24 frames a second."""

    def __init__(self) -> None:
        super().__init__(height=1.6, fps=24)
        self.own.furniture = None
        self.chair = self.box("Chair", (-0.22, 3.0, 0.0), (0.22, 3.44, 0.45))
        self.box("Back", (-0.22, 3.44, 0.0), (0.22, 3.48, 0.95), parent=self.chair)


@pytest.fixture
def room(blender: ModuleType) -> Room:
    return Room()


def test_sent_to_a_chair_the_character_sits_on_it(room: Room) -> None:
    room.scene.frame_set(7)
    room.select(room.chair)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=2.0) == {"FINISHED"}
    assert room.ann.dafnet.furniture == room.furniture, "it had none"
    assert room.scene.frame_current == 7 and room.scene.frame_end > 80
    first, last = room.place(7), room.place(room.scene.frame_end)
    assert np.allclose(first, 0.0, atol=1e-5)
    assert abs(last[0]) < 0.05 and 3.1 < last[1] < 3.35 and abs(np.cos(last[3]) + 1.0) < 0.01, (
        "it looks back"
    )
    assert np.allclose(room.place(room.scene.frame_end - 40), last, atol=1e-4), (
        "it rests for two seconds"
    )
    room.select(room.ann)
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    room.scene.frame_set(room.scene.frame_end)
    pelvis = room.ann.matrix_world @ room.ann.pose.bones["pelvis"].head
    assert abs(pelvis.z - (0.45 + 0.12 * 1.6 / 1.75)) < 0.1


def test_walks_go_on_from_the_last_key_and_leave_the_earlier_ones(room: Room) -> None:
    room.select(room.chair, room.ann)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    end = room.scene.frame_end
    before = [room.place(frame) for frame in range(1, end + 1)]
    room.scene.cursor.location = (2.0, 1.0, 0.0)
    room.select(room.ann)
    assert bpy.ops.dafnet.walk_to(goal="CURSOR", seconds=0.5) == {"FINISHED"}
    assert np.allclose([room.place(frame) for frame in range(1, end + 1)], before, atol=1e-3)
    assert np.allclose(room.place(room.scene.frame_end)[:2], (2.0, 1.0), atol=1e-3)
    path = np.array([room.place(frame) for frame in range(1, room.scene.frame_end + 1)])
    assert (
        np.abs(np.diff(path[:, :2], axis=0)).max() < 0.1
        and np.abs(np.diff(path[:, 3])).max() < 0.35
    )


def test_what_was_asked_for_once_is_not_done_to_the_next_piece(room: Room) -> None:
    """Buttons fill what they leave open from the last run, but for what is not saved."""
    for operator, goals in (
        (bpy.ops.dafnet.walk_to, {"goal"}),
        (bpy.ops.dafnet.walk_along_curve, set()),
        (bpy.ops.dafnet.walk_through_points, set()),
    ):
        properties = operator.get_rna_type().properties
        saved = {p.identifier for p in properties if not p.is_skip_save} - {"rna_type"}
        assert saved == goals, operator


def test_who_stands_close_before_the_seat_sits_down_on_it(room: Room) -> None:
    room.ann.location = room.root.location = (0.0, 2.64, 0.0)
    room.select(room.chair)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    assert 3.1 < room.place(room.scene.frame_end)[1] < 3.35


def test_what_cannot_be_walked_to_changes_nothing(room: Room) -> None:
    def refused(words: str, goal: str = "SEAT") -> None:
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.dafnet.walk_to(goal=goal)
        assert not room.root.animation_data or not room.root.animation_data.action
        assert room.scene.frame_end == 40

    room.select(room.ann)
    refused("Select one object to sit on")
    tower = room.box("Tower", (2.0, 2.0, 0.0), (2.5, 2.5, 1.2))
    room.ann.dafnet.furniture = room.furniture
    room.select(tower, room.ann)
    refused("'Tower' has no level surface")
    other = bpy.data.collections.new("Other")
    room.scene.collection.children.link(other)
    room.ann.dafnet.furniture = other
    other.objects.link(tower)
    room.select(room.chair, room.ann)
    refused("not in the character's furniture")
    room.ann.dafnet.furniture = room.furniture
    room.root.parent = tower
    refused("follows something")
    room.root.parent = None
    room.root.rotation_mode = "QUATERNION"
    refused("rotation mode")
    room.root.rotation_mode = "XYZ"
    room.scene.cursor.location = (0.0, 0.0, 0.0)
    refused("there already", goal="CURSOR")
    room.ann.dafnet.root = None
    refused("has no root")


def test_it_sits_on_a_chair_that_physics_has_dropped(room: Room) -> None:
    floor = room.box("Floor", (-5.0, -1.0, -0.2), (5.0, 6.0, 0.0))
    for each in (room.chair, *room.chair.children):
        bpy.data.objects.remove(each)
    stool = room.box("Stool", (-0.22, -0.22, -0.225), (0.22, 0.22, 0.225))
    stool.location = (0.0, 3.2, 1.6)
    bpy.ops.rigidbody.world_add()
    for made, kind in ((floor, "PASSIVE"), (stool, "ACTIVE")):
        room.select(made)
        bpy.ops.rigidbody.object_add()
        made.rigid_body.type, made.rigid_body.use_margin, made.rigid_body.collision_margin = (
            kind,
            True,
            0.0,
        )
    room.select(stool, room.ann)
    room.scene.frame_set(38)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    assert room.scene.frame_current == 38 and 2.9 < room.place(room.scene.frame_end)[1] < 3.5


def keyed(room: Room, frames: tuple[int, ...] = (1, 6)) -> list:
    """Two keys of the root at its place; its curves."""
    for frame in frames:
        for path in ("location", "rotation_euler"):
            room.root.keyframe_insert(path, frame=frame, group="Way")
    return action_curves(room.root)


def locked(room: Room) -> None:
    keyed(room)[0].lock = True


def in_a_locked_group(room: Room) -> None:
    keyed(room)[0].group.lock = True


def muted(room: Room) -> None:
    keyed(room)[5].mute = True


def in_a_muted_group(room: Room) -> None:
    keyed(room)[0].group.mute = True


def repeated(room: Room) -> None:
    keyed(room)[1].modifiers.new("CYCLES")


def sampled(room: Room) -> None:
    keyed(room)[0].convert_to_samples(1, 10)


def linked(room: Room) -> None:
    keyed(room)
    data = room.root.animation_data
    name, slots = data.action.name, hasattr(data, "action_slot")
    file = str(room.folder / "way.blend")
    bpy.data.libraries.write(file, {data.action})
    with bpy.data.libraries.load(file, link=True) as (_, wanted):
        wanted.actions = [name]
    data.action = wanted.actions[0]
    if slots:
        data.action_slot = data.action.slots[0]


def shared(room: Room) -> None:
    keyed(room)
    other = bpy.data.objects.new("Other", None)
    room.scene.collection.objects.link(other)
    mine, theirs = room.root.animation_data, other.animation_data_create()
    theirs.action = mine.action
    if hasattr(mine, "action_slot"):
        theirs.action_slot = mine.action_slot


def added_up(room: Room) -> None:
    keyed(room)
    room.root.animation_data.action_blend_type = "ADD"


def half(room: Room) -> None:
    keyed(room)
    room.root.animation_data.action_influence = 0.5


def in_tweak_mode(room: Room) -> None:
    keyed(room)
    data = room.root.animation_data
    data.nla_tracks.new().strips.new("Way", 1, data.action)
    data.action = None
    data.nla_tracks[0].select = data.nla_tracks[0].strips[0].select = True
    data.nla_tracks.active = data.nla_tracks[0]
    data.use_tweak_mode = True


def under_a_solo_track(room: Room) -> None:
    keyed(room)
    data = room.root.animation_data
    data.nla_tracks.new().strips.new("Way", 1, data.action)
    data.nla_tracks[0].is_solo = True


def with_delta_location(room: Room) -> None:
    room.root.delta_location.x = 1.0


def with_delta_rotation(room: Room) -> None:
    room.root.delta_rotation_euler.z = 1.0


def with_delta_scale(room: Room) -> None:
    room.root.delta_scale.y = -1.0


def with_keyed_delta(room: Room) -> None:
    room.root.keyframe_insert("delta_location", frame=1)
    room.root.delta_location.x = 1.0
    room.root.keyframe_insert("delta_location", frame=30)
    room.root.delta_location.x = 0.0


def driven(room: Room) -> None:
    room.root.driver_add("location", 1).driver.expression = "frame"


def pushed(room: Room) -> None:
    """A rigid body moves it, which no look at its keys tells."""
    ball = room.box("Ball", (0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    room.scene.collection.objects.link(ball)
    room.furniture.objects.unlink(ball)
    bpy.ops.rigidbody.world_add()
    room.select(ball)
    bpy.ops.rigidbody.object_add()
    room.ann.dafnet.root = room.root = ball
    bpy.context.view_layer.update()


def disabled(room: Room) -> None:
    room.root.hide_viewport = True


def in_an_excluded_collection(room: Room) -> None:
    kept = room.collection("Kept", room.scene.collection)
    for each in room.root.users_collection:
        each.objects.unlink(room.root)
    kept.objects.link(room.root)
    bpy.context.view_layer.layer_collection.children["Kept"].exclude = True


def animation(owner) -> tuple:
    """All that is keyed of an object, and where it is."""
    data = owner.animation_data
    curves = (
        ()
        if data is None or data.action is None
        else tuple(
            (
                c.data_path,
                c.array_index,
                c.mute,
                c.lock,
                [tuple(p.co) + tuple(p.handle_right) for p in c.keyframe_points],
            )
            for c in all_curves(data.action)
        )
    )
    place = (*owner.location, *owner.rotation_euler)
    named = (data.action and data.action.name, len(data.nla_tracks)) if data else None
    return curves, place, named


def all_curves(action) -> list:
    if hasattr(action, "layers"):
        return [
            c
            for layer in action.layers
            for strip in layer.strips
            for bag in strip.channelbags
            for c in bag.fcurves
        ]
    return list(action.fcurves)


@pytest.mark.parametrize(
    "way, words",
    [
        (locked, "locked curves"),
        (in_a_locked_group, "locked curves"),
        (muted, "muted curves"),
        (in_a_muted_group, "muted curves"),
        (repeated, "modifiers on curves"),
        (sampled, "sampled curves"),
        (linked, "linked action"),
        (shared, "shares its keys with 'Other'"),
        (added_up, "blending to Replace"),
        (half, "blending to Replace"),
        (in_tweak_mode, "tweak"),
        (under_a_solo_track, "solo"),
        (with_delta_location, "delta"),
        (with_delta_rotation, "delta"),
        (with_delta_scale, "delta"),
        (with_keyed_delta, "delta"),
        (driven, "drivers"),
        (disabled, "'Ann Root' or its collection is disabled in viewports"),
        (in_an_excluded_collection, "'Ann Root' or its collection is disabled in viewports"),
        (pushed, "Something other than its keys moves the root 'Ball'"),
    ],
)
@pytest.mark.parametrize("button", ["SEAT", "CURVE"])
def test_a_root_that_cannot_be_keyed_is_said_and_left_alone(
    room: Room, way, words: str, button: str, tmp_path
) -> None:
    room.folder = tmp_path
    way(room)
    if button == "CURVE":
        data = bpy.data.curves.new("Path", "CURVE")
        data.dimensions = "3D"
        data.splines.new("POLY").points.add(1)
        data.splines[0].points[0].co, data.splines[0].points[1].co = (
            (0.0, 0.0, 0.0, 1.0),
            (-2.0, 0.0, 0.0, 1.0),
        )
        curve = bpy.data.objects.new("Path", data)
        room.scene.collection.objects.link(curve)
    room.select(room.chair if button == "SEAT" else curve, room.ann)
    room.scene.frame_set(1)
    before, actions = animation(room.root), {action.name for action in bpy.data.actions}
    with pytest.raises(RuntimeError, match=words):
        if button == "SEAT":
            bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0)
        else:
            bpy.ops.dafnet.walk_along_curve()
    assert (
        animation(room.root) == before and {action.name for action in bpy.data.actions} == actions
    )
    assert (
        room.scene.frame_current == 1
        and room.scene.frame_end == 40
        and room.ann.dafnet.furniture is None
    )


def hidden(room: Room) -> None:
    room.root.hide_set(True)


def with_locked_transforms(room: Room) -> None:
    room.root.lock_location = room.root.lock_rotation = (True, True, True)


def with_an_old_parent_inverse(room: Room) -> None:
    room.root.matrix_parent_inverse[0][3] = 5.0


def where_only_needed_keys_are_wanted(room: Room) -> None:
    bpy.context.preferences.edit.use_keyframe_insert_needed = True


def with_an_active_keying_set(room: Room) -> None:
    room.scene.keying_sets.new(idname="Sizes", name="Sizes").paths.add(room.root, "scale")


def over_nla_strips(room: Room) -> None:
    """An older way lies below; the new keys are on top of it."""
    room.root.location.x = 2.0
    keyed(room, (1, 90))
    data = room.root.animation_data
    data.nla_tracks.new().strips.new("Way", 1, data.action)
    data.action = None
    room.root.location.x = 0.0


def with_muted_extras(room: Room) -> None:
    keyed(room)[0].modifiers.new("NOISE").mute = True
    room.root.driver_add("location", 2).mute = True


@pytest.mark.parametrize(
    "way",
    [
        hidden,
        with_locked_transforms,
        with_an_old_parent_inverse,
        where_only_needed_keys_are_wanted,
        with_an_active_keying_set,
        over_nla_strips,
        with_muted_extras,
    ],
)
def test_what_does_not_move_the_root_does_not_keep_it_from_the_seat(room: Room, way) -> None:
    way(room)
    room.select(room.chair, room.ann)
    try:
        assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    finally:
        bpy.context.preferences.edit.use_keyframe_insert_needed = False
    room.scene.frame_set(room.scene.frame_end)
    place = room.root.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation
    assert abs(place.x) < 0.05 and 3.1 < place.y < 3.35


def test_what_fails_while_it_is_keyed_leaves_the_root_as_it_was(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also its action where that is an NLA strip as well, and a place that has no keys."""
    keys = root_keys
    keyed(room)
    data = room.root.animation_data
    data.action.use_fake_user = True
    data.nla_tracks.new().strips.new("Way", 1, data.action)
    data.nla_tracks[0].mute = True
    room.root.location = (0.25, 0.0, 0.0)
    before = animation(room.root)
    with pytest.raises(ZeroDivisionError), keys.unchanged_on_failure(room.root):
        room.root.location.x = 5.0
        room.root.keyframe_insert("location", frame=50)
        room.root.keyframe_insert("scale", frame=50)
        raise ZeroDivisionError
    assert animation(room.root) == before and len(bpy.data.actions) == 1
    assert data.nla_tracks[0].strips[0].action == data.action and data.action.use_fake_user
    room.scene.frame_set(6)
    assert room.root.location.x == pytest.approx(0.0), "it plays"


def test_an_action_whose_slot_is_missing_gets_one(room: Room) -> None:
    keyed(room)
    data = room.root.animation_data
    if hasattr(data, "action_slot"):
        data.action_slot = None
    room.select(room.chair, room.ann)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    assert room.place(room.scene.frame_end)[1] > 3.0


def test_the_panel_offers_the_selected_seat(room: Room) -> None:
    room.select(room.chair)
    assert character_and_goal(bpy.context) == (room.ann, room.chair)
    room.select(room.ann, room.chair)
    assert character_and_goal(bpy.context) == (room.ann, room.chair)
    room.select(room.ann)
    assert character_and_goal(bpy.context) == (room.ann, None)
    bpy.ops.dafnet.add_character(name="Bob")
    room.select(room.chair)
    assert character_and_goal(bpy.context)[0].name == "Bob", "who was added last"


def _table(room: Room, near: float) -> None:
    """A table before the chair, its nearest edge at y = ``near``, its far one 0.7 m from there,
    towards the character.
    """
    room.box("Table", (-0.7, near - 0.7, 0.70), (0.7, near, 0.73))


def test_a_chair_under_a_table_is_refused_before_anything_is_keyed(room: Room) -> None:
    room.ann.location = room.root.location = (2.5, 2.0, 0.0)
    for near in (3.3, 3.0):
        _table(room, near)
        room.select(room.chair)
        with pytest.raises(
            RuntimeError, match=r"'Table' stands where one .* 'Chair'; pull 'Chair' out"
        ):
            bpy.ops.dafnet.walk_to(goal="SEAT")
        assert (
            not room.root.animation_data
            and room.ann.dafnet.furniture is None
            and room.scene.frame_end == 40
        )
        bpy.data.objects.remove(bpy.data.objects["Table"])
    _table(room, 2.9)
    assert walking.walk(bpy.context, room.ann, room.chair).warnings == (), "from the side"
    room.root.animation_data_clear()
    bpy.data.objects.remove(bpy.data.objects["Table"])
    _table(room, 2.5)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    assert walking.walk(bpy.context, room.ann, None).warnings == ()


def test_what_a_walk_leads_through_is_said(room: Room) -> None:
    room.ann.dafnet.furniture = room.furniture
    _table(room, 2.0)
    room.scene.cursor.location = (0.0, 1.7, 0.0)
    (warning,) = walking.walk(bpy.context, room.ann, None).warnings
    assert "leads through furniture, 'Table' from frame" in warning
    room.root.animation_data_clear()
    curve = bpy.data.curves.new("Line", "CURVE")
    curve.dimensions = "3D"
    points = curve.splines.new("POLY").points
    points.add(1)
    points[0].co, points[1].co = (0.0, 0.0, 0.0, 1.0), (0.0, 2.6, 0.0, 1.0)
    line = bpy.data.objects.new("Line", curve)
    room.scene.collection.objects.link(line)
    (warning,) = path_sources.along_curve(bpy.context, room.ann, line).warnings
    assert "'Table' from frame" in warning


@pytest.mark.parametrize("kind", ["DESK", "WHITEBOARD", "SOFA", "BED"])
def test_examples_lead_through_nothing(blender, kind: str) -> None:
    armature = add_example(blender.context, kind)
    read = read_scene(blender.context, settings_of(armature, blender.context.scene))
    shot = run_to_end(shot_steps(read.scene, read.controls))
    assert not [warning for warning in shot.warnings if "runs through" in warning]


def test_the_demo_leads_through_nothing(blender) -> None:
    room = build_room(blender.context)
    read = read_scene(blender.context, settings_of(room.armature, blender.context.scene))
    shot = run_to_end(shot_steps(read.scene, read.controls))
    assert not [warning for warning in shot.warnings if "runs through" in warning]


def test_scenes_of_the_wrong_unit_and_far_goals_are_refused_in_a_sentence(room: Room) -> None:
    def refused(words: str, goal: str) -> None:
        with pytest.raises(RuntimeError, match=words):
            bpy.ops.dafnet.walk_to(goal=goal)
        assert not room.root.animation_data

    room.ann.dafnet.furniture = room.furniture
    room.scene.cursor.location = (700.0, 700.0, 0.0)
    room.select(room.ann)
    refused("The goal is 990 m away: is the scene's unit right?", "CURSOR")
    for scale, words in ((100.0, "'Chair' is 95 m across"), (0.01, "'Chair' is 0.0095 m across")):
        room.chair.scale = (scale, scale, scale)
        room.select(room.chair, room.ann)
        refused(f"{words}: is its unit right?", "SEAT")
    room.scene.cursor.location = (0.05, 0.0, 0.0)
    refused("The scene is 0.0095 m across: is its unit right?", "CURSOR")


def _curve(room: Room, *corners: tuple[float, float, float]):
    data = bpy.data.curves.new("Path", "CURVE")
    data.dimensions = "3D"
    points = data.splines.new("POLY").points
    points.add(len(corners) - 1)
    for point, corner in zip(points, corners, strict=True):
        point.co = (*corner, 1.0)
    curve = bpy.data.objects.new("Path", data)
    return room.put(curve, room.scene.collection)


def _walks(room: Room) -> dict[str, Callable[[], Generator[float, None, Any]]]:
    """A job of each kind."""
    point, ball = room.empty("Point", (2.0, 1.0, 0.0)), room.empty("Ball")
    curve = _curve(room, (2.0, 0.0, 0.0), (2.0, 2.0, 0.0))
    key(ball, "location", (1, (0.0, 0.0, 0.0)), (60, (3.0, 0.0, 0.0)))
    room.scene.cursor.location = (3.0, 0.0, 0.0)
    context, ann = bpy.context, room.ann
    return {
        "seat": lambda: walking.walk.steps(context, ann, room.chair, 1.0),
        "cursor": lambda: walking.walk.steps(context, ann, None, 1.0),
        "curve": lambda: path_sources.along_curve.steps(context, ann, curve),
        "points": lambda: path_sources.through_points.steps(context, ann, [point], to_cursor=True),
        "object": lambda: path_sources.along_object.steps(context, ann, ball),
    }


def _everything(room: Room) -> tuple:
    range_of = (room.scene.frame_start, room.scene.frame_end)
    return room.state(), animation(room.root), range_of, room.own.furniture


@pytest.mark.parametrize("kind", ["seat", "cursor", "curve", "points", "object"])
def test_a_walk_that_is_stopped_anywhere_changes_nothing(room: Room, kind: str) -> None:
    keyed(room)
    job = _walks(room)[kind]
    room.scene.frame_set(4)
    if kind != "seat":
        room.ann.dafnet.furniture = room.furniture
    before, steps, shares = _everything(room), 0, []
    while True:
        steps_on = job()
        try:
            for _ in range(steps + 1):
                share = next(steps_on)
        except StopIteration as done:
            assert done.value.last > 6
            break
        shares.append(share)
        steps_on.close()
        assert _everything(room) == before
        steps += 1
    assert steps > 5 and shares == sorted(shares) and shares[-1] <= 1.0
    assert animation(room.root) != before[1]


def test_what_is_deleted_while_a_way_is_looked_for(room: Room) -> None:
    steps_on = _walks(room)["seat"]()
    while next(steps_on) < 0.3:
        pass
    bpy.data.objects.remove(room.root)
    with pytest.raises(InputError, match="'Ann Root' is not in the scene"):
        while True:
            next(steps_on)


def test_esc_ends_a_walk_and_leaves_the_scene_as_it_was(room: Room) -> None:
    """The operators' own steps, events and reports; only a window has the handler that is left out
    here.
    """
    job = _walks(room)["seat"]
    room.scene.frame_set(1)

    class Walks(WalkOperator):
        seconds_before_modal, slowness = 0.0, 0.02

        def __init__(self) -> None:
            self.said: list[str] = []

        def steps(self, _context) -> Generator[float, None, Any]:
            steps = job()
            try:
                while True:
                    share = next(steps)
                    sleep(self.slowness)
                    yield share
            except StopIteration as done:
                return done.value
            finally:
                steps.close()

        def report(self, _kind: set[str], words: str) -> None:
            self.said.append(words)

        def _listen(self, context) -> None:
            self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
            self._running, self._view = running.begin_job(), DrawnOnce()

        def event(self, kind: str) -> set[str]:
            return self.modal(bpy.context, SimpleNamespace(type=kind))

    before = _everything(room)
    walks = Walks()
    assert walks.invoke(bpy.context, None) == {"RUNNING_MODAL"}
    for _ in range(3):
        assert walks.event("TIMER") == {"RUNNING_MODAL"}
    assert running.running_job().progress > 0.0
    assert not bpy.ops.dafnet.walk_to.poll(), "one at a time"
    assert walks.event("G") == {"RUNNING_MODAL"} and walks.event("MOUSEMOVE") == {"PASS_THROUGH"}
    assert walks.event("ESC") == {"CANCELLED"}
    assert walks.said == ["Cancelled; the scene is as it was"]
    assert running.running_job() is None and _everything(room) == before

    assert walks.invoke(bpy.context, None) == {"RUNNING_MODAL"}
    while (ended := walks.event("TIMER")) == {"RUNNING_MODAL"}:
        pass
    assert ended == {"FINISHED"} and walks.said[1].startswith("Keyed the root from frame 1 to")
    assert running.running_job() is None and animation(room.root) != before[1]

    room.root.animation_data_clear()
    room.root.location = (0.0, 0.0, 0.0)
    Walks.seconds_before_modal, Walks.slowness = 600.0, 0.0
    assert walks.invoke(bpy.context, None) == {"FINISHED"}, "what is quick is done at once"


@pytest.mark.parametrize("kind", ["cursor", "curve", "points", "object"])
def test_a_walk_among_furniture_of_another_unit_asks_for_it(room: Room, kind: str) -> None:
    room.ann.dafnet.furniture = room.furniture
    job = _walks(room)[kind]
    sentence = "across: is its unit right? It looks "
    assert not any(sentence in warning for warning in run_to_end(job()).warnings)
    remedy = "multiply its Unit Scale, or all of it, by"
    for scale, size, said in (
        (100.0, "The scene is 95 m ", f"modelled in centimetres; {remedy} 0.01."),
        (0.01, "The scene is 0.0095 m ", f"100 times too small; {remedy} 100."),
    ):
        room.chair.scale = (scale, scale, scale)
        room.chair.location = (200.0, 0.0, 0.0) if scale > 1.0 else (0.0, 0.0, 0.0)
        room.root.animation_data_clear()
        room.root.location = (0.0, 0.0, 0.0)
        (warning,) = run_to_end(job()).warnings
        assert warning == f"{size}{sentence}{said}"
    tower = room.box("Tower", (4.0, 4.0, 0.0), (30.0, 30.0, 60.0))
    room.chair.scale, room.chair.location = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    room.root.animation_data_clear()
    room.root.location = (0.0, 0.0, 0.0)
    assert tower.dimensions.z == 60.0
    assert not any(sentence in warning for warning in run_to_end(job()).warnings), "a city, a chair"
