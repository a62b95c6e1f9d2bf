"""Walks know what they were made for and are made anew, and where a character stands that was taken
by the body.
"""

from contextlib import ExitStack
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.task_rows import tasks_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.walk_rows import title_of_walk
from bl_ext.user_default.dafnet.dafnet_addon.blender.compat import action_curves
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing import (
    made_walks,
    redo,
    root_keys,
    walking,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.lying import lying_replaces
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.plan_keys import plan_edited
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.tasks import Assignment, direct
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.director.tasks import SitOn
from bl_ext.user_default.dafnet.panels.setup import DAFNET_PT_setup, DAFNET_PT_walks

from kit.panels import drawn_by
from kit.stage import Stage, key, keys_of


class Room(Stage):
    """A character at the origin and a stool 3 m ahead of it."""

    def __init__(self) -> None:
        super().__init__(fps=30)
        self.stool = self.seat("Stool", location=(0.0, 3.0, 0.0))
        self.scene.cursor.location = (5.0, 5.0, 0.0)
        bpy.context.view_layer.update()

    def sit(self, **options: Any) -> None:
        self.select(self.stool, self.ann)
        assert bpy.ops.dafnet.walk_to(goal="SEAT", **options) == {"FINISHED"}

    def go(self, x: float, y: float, **options: Any) -> None:
        self.scene.cursor.location = (x, y, 0.0)
        assert bpy.ops.dafnet.walk_to(goal="CURSOR", **options) == {"FINISHED"}

    def end(self) -> np.ndarray:
        return self.place(self.own.walks[-1].last)

    def rows(self) -> list[tuple[str, int]]:
        return [(title_of_walk(row), row.first) for row in self.own.walks]


@pytest.fixture
def room(blender: ModuleType) -> Room:
    return Room()


def test_a_walk_is_made_again_to_where_the_seat_is_now(room: Room) -> None:
    room.sit(seconds=1.0)
    before = room.end()
    room.stool.location.x = 1.5
    room.stool.name = "Bar Stool"
    bpy.context.view_layer.update()
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    after = room.end()
    assert abs(after[0] - 1.5) < 0.1 and abs(before[0]) < 0.1
    assert room.rows() == [("Sit on Bar Stool", 1)]
    assert room.scene.frame_end == room.own.walks[0].last, "the range ends with it again"
    assert np.allclose(room.place(1), 0.0, atol=1e-5)


def test_the_range_stays_as_long_as_another_s_walk(room: Room) -> None:
    room.sit(seconds=8.0)
    end = room.scene.frame_end
    bpy.ops.dafnet.add_character(name="Bob")
    bob = bpy.data.objects["Bob"]
    bob.location = bob.dafnet.root.location = (-3.0, -3.0, 0.0)
    room.select(bob)
    room.scene.cursor.location = (-3.0, -1.0, 0.0)
    assert bpy.ops.dafnet.walk_to(goal="CURSOR", seconds=3.0) == {"FINISHED"}
    others = bob.dafnet.walks[0].last
    assert room.scene.frame_end == end > others
    room.select(room.ann)
    room.own.seconds, room.own.speed = 0.1, 1.6
    room.stool.location.y = 1.5
    bpy.context.view_layer.update()
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert room.own.walks[0].last < others
    assert room.scene.frame_end == others


def test_the_manner_is_one_place_s_and_is_kept_with_the_walk(room: Room) -> None:
    room.own.speed, room.own.seconds, room.own.sits_down = 0.8, 2.0, 2.6
    room.sit()
    row = room.own.walks[0]
    assert (row.speed, row.seconds, row.sits_down) == pytest.approx((0.8, 2.0, 2.6))
    slow = row.last
    room.own.speed, room.own.sits_down = 1.6, 0.8
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert room.own.walks[0].last < slow - 30
    assert room.own.walks[0].speed == pytest.approx(1.6), "it stays with the walk"
    room.go(2.0, 0.0, speed=1.2)
    assert room.own.speed == pytest.approx(1.2), "the place shows how the chosen walk is gone"
    room.own.active_walk = 0
    assert room.own.speed == pytest.approx(1.6)
    room.own.speed = 1.4
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert [each.speed for each in room.own.walks] == pytest.approx([1.4, 1.2]), "others keep it"


def test_what_is_asked_of_the_chosen_walk_outlasts_a_failure(room: Room) -> None:
    room.sit(seconds=1.0)
    room.own.speed = 1.7
    room.stool.location.z = 3.0
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError):
        bpy.ops.dafnet.redo_walk()
    assert room.own.speed == pytest.approx(1.7)
    assert room.own.walks[0].speed == pytest.approx(1.1), "as its keys were made"


def test_seconds_of_sitting_down_and_getting_up_are_those_of_the_path(room: Room) -> None:
    def backs(first: int, last: int) -> int:
        """Frames in which the root is within 25 cm of the seat, and moves."""
        path = room.path(first, last)[:, :2]
        seat = path[-1] if last == room.own.walks[0].last else path[0]
        near = np.linalg.norm(path - seat, axis=1)
        return int(((near < 0.25) & (near > 0.002)).sum())

    quick = slow = 0
    for seconds in (0.6, 2.4):
        room.root.animation_data_clear()
        room.own.walks.clear()
        room.root.location, room.root.rotation_euler = (0, 0, 0), (0, 0, 0)
        room.scene.frame_set(1)
        room.sit(seconds=0.5, sits_down=seconds)
        down = backs(1, room.own.walks[0].last)
        room.go(3.0, 0.0, gets_up=seconds)
        up = backs(room.own.walks[1].first, room.own.walks[1].last)
        quick, slow = (down + up, slow) if seconds < 1 else (quick, down + up)
    assert slow > 2 * quick


def test_those_after_it_are_made_again_as_well(room: Room) -> None:
    room.sit(seconds=1.0)
    room.go(3.0, 0.0, seconds=1.0)
    first = room.own.walks[0].last
    room.own.active_walk = 0
    room.own.seconds = 4.0
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert [title for title, _ in room.rows()] == ["Sit on Stool", "Walk to 3.0, 0.0"]
    assert room.own.walks[0].last == room.own.walks[1].first == first + 90
    assert np.allclose(room.end()[:2], (3.0, 0.0), atol=1e-3)
    room.own.active_walk = 1
    before = room.path(1, first + 90)
    room.own.walks[1].place = (2.0, 0.0, 0.0)
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert np.allclose(room.path(1, first + 90), before, atol=1e-3), "what is before it stays"
    assert np.allclose(room.end()[:2], (2.0, 0.0), atol=1e-3)


@pytest.mark.parametrize("taken", ["armature", "root"])
@pytest.mark.parametrize("played", [False, True])
def test_it_begins_where_the_character_was_moved_to(room: Room, taken: str, played: bool) -> None:
    room.sit(seconds=1.0)
    if played:
        assert bpy.ops.dafnet.generate() == {"FINISHED"}
    room.scene.frame_set(1)
    moved = room.ann if taken == "armature" else room.root
    moved.location.x += 2.0
    moved.rotation_euler.z += 0.5
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert np.allclose(room.place(1), (2.0, 0.0, 0.0, 0.5), atol=1e-3)
    assert abs(room.end()[0]) < 0.1, "to the same seat"


def test_a_character_taken_by_its_body_walks_from_where_it_stands(room: Room) -> None:
    room.ann.location.x -= 3.0
    room.go(0.0, 0.0)  # where its root is
    assert np.allclose(room.place(1)[:2], (-3.0, 0.0), atol=1e-4)
    assert np.allclose(room.end()[:2], (0.0, 0.0), atol=1e-3)


def test_a_character_taken_by_its_body_is_generated_where_it_stands(room: Room) -> None:
    room.ann.location.x -= 3.0
    room.scene.frame_end = 6
    room.select(room.ann)
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    assert room.ann.location.x == pytest.approx(-3.0, abs=1e-3)
    assert room.root.location.x == pytest.approx(-3.0, abs=1e-3)


def test_a_character_taken_by_its_body_lies_down_from_where_it_stands(room: Room) -> None:
    bed = room.box("Bed", (2.0, 3.0, 0.0), (3.6, 5.0, 0.45))
    room.ann.location.x = -2.0
    room.select(bed, room.ann)
    assert bpy.ops.dafnet.lie_on(seconds=1.0) == {"FINISHED"}
    assert np.allclose(room.place(1)[:2], (-2.0, 0.0), atol=1e-3)


def test_a_root_is_brought_along_only_by_what_is_done(room: Room) -> None:
    room.ann.location.x = -2.0
    row = room.own.tasks.add()
    row.verb, row.about = "SIT_ON", "Stool"
    bpy.context.view_layer.update()
    job = direct.steps(bpy.context, [Assignment(room.ann, tasks_of(room.ann, 1.0))])
    for _ in range(5):
        next(job)
    assert room.root.location.x == pytest.approx(-2.0)
    job.close()
    assert room.root.location.x == 0.0, "Esc"
    row.about = "Nothing"
    with pytest.raises(RuntimeError, match="Nothing"):
        bpy.ops.dafnet.plan_tasks()
    assert room.root.location.x == 0.0
    with pytest.raises(RuntimeError, match="Choose a take"):
        bpy.ops.dafnet.generate(task="ONWARD")
    assert room.root.location.x == 0.0
    assert not room.root.animation_data


def test_a_root_that_was_moved_counts_more_than_the_body(room: Room) -> None:
    room.ann.location.x, room.root.location.x = -3.0, 1.0
    room.go(0.0, 2.0)
    assert np.allclose(room.place(1)[:2], (1.0, 0.0), atol=1e-4)


def test_where_the_keys_end_is_said_with_its_frame(room: Room) -> None:
    room.go(0.0, 3.0 - 1.0)
    last = room.own.walks[0].last
    room.scene.frame_set(1)
    with pytest.raises(RuntimeError, match=f"end there already, at frame {last}.*Redo Walk"):
        bpy.ops.dafnet.walk_to(goal="CURSOR")
    room.sit(seconds=0.5)
    with pytest.raises(RuntimeError, match="end there already, at frame"):
        room.sit(seconds=0.5)
    assert len(room.own.walks) == 2


def test_edited_keys_are_asked_about_and_kept(room: Room) -> None:
    room.sit(seconds=1.0)
    keys = keys_of(room.root)
    curve = next(c for c in action_curves(room.root) if c.data_path == "location")
    curve.keyframe_points[4].co[1] += 0.3
    edited = keys_of(room.root)
    with pytest.raises(RuntimeError, match="were edited since"):
        bpy.ops.dafnet.redo_walk()
    assert all(np.array_equal(edited[name], now) for name, now in keys_of(room.root).items())
    assert bpy.ops.dafnet.redo_walk(replace_edited=True) == {"FINISHED"}
    for name, now in keys_of(room.root).items():
        assert np.allclose(now, keys[name], atol=1e-4), "as it was made"
    kept = [action for action in bpy.data.actions if action.name.endswith(" before redo")]
    assert len(kept) == 1 and kept[0].use_fake_user
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}, "nothing is edited now"


@pytest.mark.parametrize("setting", [{"interpolation": "CONSTANT"}, {"handle_left_type": "FREE"}])
def test_ways_between_keys_are_edits_as_well(room: Room, setting: dict[str, str]) -> None:
    room.sit(seconds=1.0)
    room.go(3.0, 0.0)
    for _ in range(2):
        assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
        assert made_walks.intact_walks(room.ann) == (True, True), "nobody has edited the first"
    curve = next(c for c in action_curves(room.root) if c.data_path == "location")
    for name, value in setting.items():
        setattr(curve.keyframe_points[4], name, value)
    assert made_walks.intact_walks(room.ann) == (False, True)
    room.own.active_walk = 0
    with pytest.raises(RuntimeError, match="were edited since"):
        bpy.ops.dafnet.redo_walk()


def test_keys_after_it_are_asked_about_and_the_one_it_begins_with_is_not(room: Room) -> None:
    room.sit(seconds=1.0)
    last = room.own.walks[0].last
    room.stand(1, 0.5, 0.0)
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert np.allclose(room.place(1), (0.5, 0.0, 0.0, 0.0), atol=1e-4)
    room.stand(last + 60, 0.5, 0.0)
    with pytest.raises(RuntimeError, match="were edited since"):
        bpy.ops.dafnet.redo_walk()


def test_what_cannot_be_made_again_changes_nothing(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    room.sit(seconds=1.0)
    room.go(3.0, 0.0)
    room.own.active_walk = 0

    def state() -> Any:
        rows = [(row.kind, row.goal, row.first, row.last, row.digest) for row in room.own.walks]
        keys = {name: values.tolist() for name, values in keys_of(room.root).items()}
        return rows, keys, room.scene.frame_end, room.own.active_walk, len(bpy.data.actions)

    before = state()
    room.own.walks[0].seconds = 5.0
    room.own.walks[1].place = (0.0, 400.0, 0.0)
    with pytest.raises(RuntimeError, match="m away"):
        bpy.ops.dafnet.redo_walk()
    assert state() == before, "nor the first of both"
    room.own.walks[1].place = (3.0, 0.0, 0.0)
    job = redo.redo_walks.steps(bpy.context, room.ann, 0)
    for _ in range(30):
        next(job)
    job.close()
    assert state() == before
    bpy.data.objects.remove(room.stool)
    with pytest.raises(RuntimeError, match="no longer in the scene"):
        bpy.ops.dafnet.redo_walk()
    with pytest.raises(InputError, match="no walk"):
        redo.redo_walks(bpy.context, room.ann, 7)


@pytest.mark.parametrize("edited", [False, True])
def test_what_fails_while_a_later_walk_is_keyed_changes_nothing(
    room: Room, monkeypatch: pytest.MonkeyPatch, edited: bool
) -> None:
    """Each walk is guarded by itself, and all of them together."""
    room.sit(seconds=1.0)
    room.go(3.0, 0.0)
    room.own.active_walk = 0
    if edited:
        curve = next(c for c in action_curves(room.root) if c.data_path == "location")
        curve.keyframe_points[4].co[1] += 0.3
    keys, name = keys_of(room.root), room.root.animation_data.action.name
    actions = {action.name for action in bpy.data.actions}
    made, key_route = [], walking.key_route

    def fails_at_the_second(*given: Any, **named: Any) -> None:
        made.append(key_route(*given, **named))
        if len(made) == 2:
            raise InputError("no more keys")

    monkeypatch.setattr(walking, "key_route", fails_at_the_second)
    room.own.walks[0].seconds = 5.0
    with pytest.raises(RuntimeError, match="no more keys"):
        bpy.ops.dafnet.redo_walk(replace_edited=edited)
    now = keys_of(room.root)
    assert now.keys() == keys.keys()
    assert all(np.array_equal(now[each], keys[each]) for each in keys)
    assert room.root.animation_data.action.name == name
    assert {action.name for action in bpy.data.actions} == actions
    monkeypatch.undo()
    assert bpy.ops.dafnet.redo_walk(replace_edited=edited) == {"FINISHED"}


def test_owners_of_one_action_are_guarded_one_by_one(room: Room) -> None:
    room.go(0.0, 2.0)
    action, other = room.root.animation_data.action, room.empty("Other")
    other.animation_data_create().action = action
    keys, actions = keys_of(room.root), {action.name for action in bpy.data.actions}
    with pytest.raises(InputError), ExitStack() as undo:
        for owner in (room.root, other):
            undo.enter_context(root_keys.unchanged_on_failure(owner))
        root_keys.remove_keys_from(room.root, 1)
        raise InputError("no keys")
    now = keys_of(room.root)
    assert now.keys() == keys.keys()
    assert all(np.array_equal(now[each], keys[each]) for each in keys)
    assert room.root.animation_data.action == other.animation_data.action
    assert {action.name for action in bpy.data.actions} == actions


def test_a_walk_that_takes_the_place_of_another_s_end_leaves_its_beginning(room: Room) -> None:
    room.go(0.0, 2.0, seconds=1.0)
    room.scene.frame_set(40)
    line = bpy.data.curves.new("Path", "CURVE")
    line.dimensions = "3D"
    spline = line.splines.new("POLY")
    spline.points.add(1)
    for point, place in zip(spline.points, ((2.0, 1.0, 0.0), (2.0, 4.0, 0.0)), strict=True):
        point.co = (*place, 1.0)
    path = room.put(bpy.data.objects.new("Path", line), room.scene.collection)
    room.select(path, room.ann)
    assert bpy.ops.dafnet.walk_along_curve(seconds=1.0) == {"FINISHED"}
    assert room.rows() == [("Walk to 0.0, 2.0", 1), ("Walk along Path", 40)]
    assert room.own.walks[0].last == 40
    path.location.x = 1.0
    bpy.context.view_layer.update()
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    assert np.allclose(room.end()[:2], (3.0, 4.0), atol=1e-2)


def test_points_and_moving_objects_are_made_again(room: Room) -> None:
    points = [room.empty("P1", (1.0, 1.0, 0.0)), room.empty("P2", (2.0, 1.0, 0.0))]
    room.select(room.ann, *points)
    assert bpy.ops.dafnet.walk_through_points(to_cursor=True) == {"FINISHED"}
    assert room.rows() == [("Walk through 3 points", 1)]
    points[1].location = (2.0, 2.0, 0.0)
    bpy.context.view_layer.update()
    room.scene.cursor.location = (0.0, 0.0, 0.0)
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    path = room.path(1, room.own.walks[0].last)
    assert np.linalg.norm(path[:, :2] - (2.0, 2.0), axis=1).min() < 0.3
    assert np.allclose(path[-1, :2], (5.0, 5.0), atol=1e-2), "the cursor as it was"


def test_a_plan_of_tasks_takes_the_place_of_walks(room: Room) -> None:
    room.go(0.0, 2.0)
    row = room.own.tasks.add()
    row.verb, row.about = "SIT_ON", "Stool"
    assert bpy.ops.dafnet.plan_tasks() == {"FINISHED"}
    assert not room.own.walks and not bpy.ops.dafnet.redo_walk.poll()


def test_the_chosen_walk_is_one_that_is_left(room: Room) -> None:
    room.go(0.0, 2.0)
    room.go(2.0, 2.0)
    assert room.own.active_walk == 1
    made_walks.forget_walks(room.ann, room.own.walks[1].first)
    assert (len(room.own.walks), room.own.active_walk) == (1, 0)
    assert not made_walks.edited_from(room.ann, 1), "of no walk"
    assert bpy.ops.dafnet.redo_walk(replace_edited=True) == {"FINISHED"}
    assert room.own.active_walk == 0


def test_a_plan_knows_whether_it_would_replace_edited_keys(room: Room) -> None:
    assert not plan_edited(room.ann, 1), "there are none"
    room.go(0.0, 2.0)
    assert plan_edited(room.ann, 1)
    row = room.own.tasks.add()
    row.verb, row.about = "SIT_ON", "Stool"
    assert bpy.ops.dafnet.plan_tasks() == {"FINISHED"}
    assert not plan_edited(room.ann, 1)
    next(iter(action_curves(room.root))).keyframe_points[2].co[1] += 0.2
    assert plan_edited(room.ann, 1)


def test_the_panel_shows_the_walk_s_fields_and_the_button(room: Room) -> None:
    assert not DAFNET_PT_walks.poll(bpy.context)
    assert {"speed", "seconds", "sits_down", "gets_up"} <= set(
        drawn_by(DAFNET_PT_setup, bpy.context).words()
    )
    room.sit(seconds=0.5)
    assert DAFNET_PT_walks.poll(bpy.context)
    assert drawn_by(DAFNET_PT_walks, bpy.context).words() == ["goal"]
    words = drawn_by(DAFNET_PT_setup, bpy.context).words()
    assert "dafnet.redo_walk" in words and words.count("speed") == 1
    room.go(2.0, 0.0)
    words = drawn_by(DAFNET_PT_walks, bpy.context).words()
    assert words[0] == "DAFNET_UL_walks" and "place" in words and "speed" not in words


@pytest.fixture
def tucked(room: Room) -> bpy.types.Object:
    """A chair under a table, on which one sits once it is pulled out by keys."""
    bpy.data.objects.remove(room.stool)
    chair = room.box("Chair", (-0.22, 0.0, 0.0), (0.22, 0.44, 0.45), location=(0.0, 3.0, 0.0))
    room.box("Back", (-0.22, 0.44, 0.0), (0.22, 0.48, 0.95), parent=chair)
    room.box("Table", (-0.7, 2.6, 0.70), (0.7, 3.3, 0.73))
    room.ann.location = room.root.location = (2.5, 2.0, 0.0)
    bpy.context.view_layer.update()
    room.select(chair, room.ann)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", pull_out="KEYED", seconds=1.0) == {"FINISHED"}
    return chair


def _at(chair: bpy.types.Object, frame: int) -> float:
    bpy.context.scene.frame_set(frame)
    return float(chair.matrix_world.translation.y)


def test_a_chair_that_comes_out_by_keys_does_so_again(room: Room, tucked: bpy.types.Object) -> None:
    last = room.own.walks[0].last
    before, after = _at(tucked, 1), _at(tucked, last)
    assert before == pytest.approx(3.0, abs=1e-4) and after > before + 0.1
    room.own.speed = 0.7
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    (row,) = room.own.walks
    assert row.last > last + 15 and row.by_keys
    assert _at(tucked, 1) == pytest.approx(before, abs=1e-4)
    assert _at(tucked, row.last) == pytest.approx(after, abs=1e-3)
    frames = {point.co[0] for curve in action_curves(tucked) for point in curve.keyframe_points}
    assert len(frames) == 2 and max(frames) > 15

    key(tucked, "location", (row.last + 20, (0.0, 3.0, 0.0)))
    keys = keys_of(tucked)
    with pytest.raises(RuntimeError, match="'Chair' has other keys of its location"):
        bpy.ops.dafnet.redo_walk()
    now = keys_of(tucked)
    assert all(np.array_equal(now[each], keys[each]) for each in keys)


def test_a_chair_that_came_out_is_as_it_was_where_its_walk_cannot_be_made(
    room: Room, tucked: bpy.types.Object, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_given: Any, **_named: Any) -> None:
        raise InputError("No keys.")

    keys, last = keys_of(tucked), room.own.walks[0].last
    out = _at(tucked, last)
    monkeypatch.setattr(walking, "key_route", fails)
    with pytest.raises(RuntimeError, match="No keys"):
        bpy.ops.dafnet.redo_walk()
    now = keys_of(tucked)
    assert now.keys() == keys.keys()
    assert all(np.array_equal(now[each], keys[each]) for each in keys)
    assert _at(tucked, 1) == pytest.approx(3.0, abs=1e-4)
    assert _at(tucked, last) == pytest.approx(out, abs=1e-4)


def test_of_a_linked_curve_and_one_of_the_file_the_right_one_is_meant(
    room: Room, tmp_path: Path
) -> None:
    def line(x: float) -> bpy.types.Object:
        data = bpy.data.curves.new("Path", "CURVE")
        data.dimensions = "3D"
        spline = data.splines.new("POLY")
        spline.points.add(1)
        for point, y in zip(spline.points, (1.0, 4.0), strict=True):
            point.co = (x, y, 0.0, 1.0)
        return bpy.data.objects.new("Path", data)

    far = line(3.0)
    bpy.data.libraries.write(str(tmp_path / "far.blend"), {far})
    bpy.data.objects.remove(far)
    with bpy.data.libraries.load(str(tmp_path / "far.blend"), link=True) as (_, linked):
        linked.objects = ["Path"]
    paths = [room.put(linked.objects[0], room.scene.collection)]
    paths.append(room.put(line(-3.0), room.scene.collection))
    assert {path.name for path in paths} == {"Path"}
    for path, x in zip(paths, (3.0, -3.0), strict=True):
        room.select(path, room.ann)
        room.scene.frame_set(1)
        assert bpy.ops.dafnet.walk_along_curve(seconds=1.0) == {"FINISHED"}
        assert room.own.walks[-1].goal == path
        for _ in range(2):
            assert np.allclose(room.end()[:2], (x, 4.0), atol=1e-2)
            assert bpy.ops.dafnet.redo_walk(replace_edited=True) == {"FINISHED"}


def test_lying_down_is_a_walk_that_is_made_again(room: Room) -> None:
    bed = room.box("Bed", (-0.7, 0.0, 0.0), (0.7, 2.0, 0.45), location=(2.0, 2.0, 0.0))
    bpy.context.view_layer.update()
    room.go(0.0, 1.0, seconds=0.5)
    room.select(bed, room.ann)
    assert not lying_replaces(room.scene, room.ann), "a walk as it was made is nobody's work"
    assert bpy.ops.dafnet.lie_on(seconds=2.0) == {"FINISHED"}
    assert room.rows() == [("Lie on Bed", 1)]
    assert not lying_replaces(room.scene, room.ann)
    before = room.end()
    bed.location.x = 3.0
    bpy.context.view_layer.update()
    room.own.seconds = 4.0
    assert bpy.ops.dafnet.redo_walk() == {"FINISHED"}
    (row,) = room.own.walks
    assert row.seconds == 4.0 and room.end()[0] > before[0] + 0.5
    next(iter(action_curves(room.root))).keyframe_points[2].co[1] += 0.2
    assert lying_replaces(room.scene, room.ann), "edited keys are asked about"
    with pytest.raises(RuntimeError, match="were edited"):
        bpy.ops.dafnet.redo_walk()


def test_a_job_that_is_closed_leaves_no_root_that_it_added(room: Room) -> None:
    bpy.data.objects.remove(room.root)
    names = {each.name for each in bpy.data.objects}
    job = direct.steps(bpy.context, [Assignment(room.ann, [SitOn("Stool")])])
    next(job)
    assert room.own.root is not None
    job.close()
    assert room.own.root is None and {each.name for each in bpy.data.objects} == names
    with pytest.raises(InputError):
        direct(bpy.context, [Assignment(room.ann, [SitOn("Nowhere")])])
    assert room.own.root is None and {each.name for each in bpy.data.objects} == names
