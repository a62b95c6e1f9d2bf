"""*Sit on Selected* in scenes as people build them: pieces of several parts, a place by the cursor,
tucked chairs, tables, the user's own characters.
"""

from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import character_and_goal
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing import walking
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.furniture import furniture_now
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError

from kit.humanoids import mixamo
from kit.stage import Stage


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    made = Stage(height=1.75, furnished=False)
    made.scene.cursor.location = (0.0, -9.0, 0.0)
    return made


def _chair(stage: Stage, name: str, y: float, parent: object = None) -> object:
    """A chair that looks to -y."""
    made = stage.box(name, (-0.22, -0.22, 0.0), (0.22, 0.22, 0.45), location=(0.0, y, 0.0))
    stage.box(f"{name} Back", (-0.22, 0.22, 0.0), (0.22, 0.26, 0.95), parent=made)
    made.parent = parent
    bpy.context.view_layer.update()
    return made


def _sits(stage: Stage) -> np.ndarray:
    """Where (4,) the root rests at the end."""
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0) == {"FINISHED"}
    return stage.place(stage.scene.frame_end)


def test_a_chair_in_the_scenes_own_collection_works_and_brings_what_stands_around(stage) -> None:
    _chair(stage, "Chair", 3.0)
    stage.box("Shelf", (1.0, 2.0, 0.0), (1.4, 2.4, 1.0))
    stage.select(bpy.data.objects["Chair"])
    place = _sits(stage)
    assert abs(place[0]) < 0.03 and abs(place[1] - 3.0) < 0.06
    found = stage.own.furniture
    assert {"Chair", "Chair Back", "Shelf"} <= {o.name for o in found.objects}
    assert stage.body.name not in found.objects and stage.root.name not in found.objects
    assert found.name in stage.scene.collection.children


def test_a_refused_seat_leaves_no_collection_behind(stage) -> None:
    stage.box("Table", (-0.7, 2.0, 0.70), (0.7, 2.7, 0.74))
    stage.select(bpy.data.objects["Table"])
    before = set(bpy.data.collections)
    with pytest.raises(RuntimeError, match="'Table' is a table; choose a seat"):
        bpy.ops.dafnet.walk_to(goal="SEAT")
    assert set(bpy.data.collections) == before and stage.own.furniture is None
    assert not stage.root.animation_data
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0, tables=True) == {"FINISHED"}


def test_whichever_part_is_clicked_the_whole_piece_counts(stage) -> None:
    group = stage.empty("Group")
    chair = _chair(stage, "Chair", 3.0, group)
    for part in (bpy.data.objects["Chair Back"], chair, group):
        stage.root.animation_data_clear()
        stage.root.location = (0.0, 0.0, 0.0)
        stage.select(part)
        assert character_and_goal(bpy.context) == (stage.ann, part)
        place = _sits(stage)
        assert abs(place[1] - 3.0) < 0.06 and np.cos(place[3] - np.pi) > 0.99, part.name


def test_an_instance_of_a_collection_is_a_seat(stage) -> None:
    kept = stage.collection("Kept")
    stage.box("Seat", (-0.22, -0.22, 0.0), (0.22, 0.22, 0.45), kept)
    stage.box("Rest", (-0.22, 0.22, 0.0), (0.22, 0.26, 0.95), kept)
    instance = stage.empty("Instance", (0.5, 3.0, 0.0))
    instance.instance_type, instance.instance_collection = "COLLECTION", kept
    stage.select(instance)
    place = _sits(stage)
    assert abs(place[0] - 0.5) < 0.04 and abs(place[1] - 3.0) < 0.06


def test_the_cursor_says_where_on_a_bench_and_to_which_side(stage) -> None:
    stage.box("Bench", (-1.0, 2.8, 0.0), (1.0, 3.2, 0.45))
    stage.select(bpy.data.objects["Bench"])
    for x, y, yaw in ((0.5, 3.15, 0.0), (-0.6, 2.85, np.pi)):
        stage.root.animation_data_clear()
        stage.root.location = (0.0, 0.0, 0.0)
        stage.scene.cursor.location = (x, y, 0.5)
        place = _sits(stage)
        assert abs(place[0] - x) < 0.05 and np.cos(place[3] - yaw) > 0.99


def test_a_tucked_chair_is_pulled_out_on_request_and_undone_in_one_step(stage) -> None:
    chair = _chair(stage, "Chair", 3.0)
    stage.box("Table", (-0.7, 2.2, 0.70), (0.7, 2.95, 0.74))
    stage.select(chair)
    with pytest.raises(RuntimeError, match=r"'Table' stands .* pull 'Chair' out by \d+ cm"):
        bpy.ops.dafnet.walk_to(goal="SEAT")
    assert chair.location.y == 3.0 and not stage.root.animation_data
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0, pull_out="MOVED") == {"FINISHED"}
    out = bpy.data.objects["Chair"].location.y - 3.0
    assert 0.2 < out < 0.5
    place = stage.place(stage.scene.frame_end)
    assert abs(place[1] - 3.0 - out) < 0.06
    chair.lock_location[0] = True
    with pytest.raises(RuntimeError, match="'Chair' is linked, locked or constrained, or"):
        bpy.ops.dafnet.walk_to(goal="SEAT", pull_out="MOVED")


def test_a_tucked_chair_comes_out_by_keys_before_anybody_is_near(stage) -> None:
    chair = _chair(stage, "Chair", 3.0)
    stage.box("Table", (-0.7, 2.2, 0.70), (0.7, 2.95, 0.74))
    stage.select(chair)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0, pull_out="KEYED") == {"FINISHED"}
    sits = stage.scene.frame_end
    at, root = {}, {}
    for frame in range(1, sits + 1):
        stage.scene.frame_set(frame)
        at[frame], root[frame] = chair.matrix_world.translation.y, stage.place(frame)
    out = at[sits] - 3.0
    assert at[1] == 3.0 and 0.2 < out < 0.5 and abs(root[sits][1] - at[sits]) < 0.06
    moving = [frame for frame in at if frame > 1 and at[frame] != at[frame - 1]]
    assert 10 < len(moving) < 40 and moving[-1] < sits - 30
    for frame in moving:
        assert np.hypot(root[frame][0], root[frame][1] - at[frame]) > 0.9


def _driven(chair: Any) -> None:
    chair.driver_add("location", 1).driver.expression = "3.0"


def _in_strips(chair: Any) -> None:
    chair.keyframe_insert("location", frame=1)
    data = chair.animation_data
    data.nla_tracks.new().strips.new("Stands", 1, data.action)
    data.action = None


@pytest.mark.parametrize("moves", [_driven, _in_strips])
@pytest.mark.parametrize("by_keys", [False, True])
def test_a_chair_that_something_moves_is_not_pulled_out(stage, moves: Any, by_keys: bool) -> None:
    """Unless that is muted."""
    chair = _chair(stage, "Chair", 3.0)
    stage.box("Table", (-0.7, 2.2, 0.70), (0.7, 2.95, 0.74))
    moves(chair)
    bpy.context.view_layer.update()
    before = stage.state()
    with pytest.raises(InputError, match=r"'Chair' is linked, .* NLA strips or drivers"):
        walking.walk(bpy.context, stage.ann, chair, pull_out=True, by_keys=by_keys)
    assert stage.state() == before

    data = chair.animation_data
    for each in (*data.drivers, *data.nla_tracks):
        each.mute = True
    walking.walk(bpy.context, stage.ann, chair, pull_out=True, by_keys=by_keys)
    last = stage.scene.frame_end
    stage.scene.frame_set(last)
    assert 0.2 < chair.matrix_world.translation.y - 3.0 < 0.5


@pytest.mark.parametrize("by_keys", [False, True])
def test_what_fails_once_a_chair_is_pulled_out_changes_nothing(
    stage, monkeypatch: pytest.MonkeyPatch, by_keys: bool
) -> None:
    chair = _chair(stage, "Chair", 3.0)
    stage.box("Table", (-0.7, 2.2, 0.70), (0.7, 2.95, 0.74))
    stage.select(chair)

    def fails(*_given: object) -> bool:
        raise ZeroDivisionError

    def state() -> tuple[object, ...]:
        own = stage.own
        kept = set(bpy.data.collections), len(own.walks), tuple(own.stood), own.furniture
        return stage.state(), kept, [o.animation_data for o in (chair, stage.root)]

    stage.ann.location.z += 1e-3
    before = state()
    monkeypatch.setattr(walking, "extend_range", fails)
    with pytest.raises(ZeroDivisionError):
        walking.walk(bpy.context, stage.ann, chair, pull_out=True, by_keys=by_keys)
    assert state() == before


def test_people_lie_down_on_what_is_selected(stage) -> None:
    bed = stage.box("Bed", (-0.5, 2.0, 0.0), (0.5, 4.0, 0.45))
    stage.box("Headboard", (-0.5, 4.0, 0.0), (0.5, 4.06, 0.9), parent=bed)
    bpy.context.view_layer.update()
    stage.select(bed)
    assert bpy.ops.dafnet.lie_on(seconds=2.0) == {"FINISHED"}
    place = stage.place(stage.scene.frame_end)
    assert abs(place[0]) < 0.4 and 2.5 < place[1] < 3.5
    assert stage.own.head is not None, "the head is led to where it lies"
    stage.select(stage.ann)
    with pytest.raises(RuntimeError, match="Select one object to lie on"):
        bpy.ops.dafnet.lie_on()


def test_nobody_lies_on_a_stool(stage) -> None:
    stool = stage.box("Stool", (-0.2, 2.0, 0.0), (0.2, 2.4, 0.45))
    stage.select(stool)
    with pytest.raises(RuntimeError, match="Stool"):
        bpy.ops.dafnet.lie_on()
    assert not stage.root.animation_data


def test_ones_own_rigs_body_is_never_furniture(stage) -> None:
    collection = stage.collection("Set", stage.scene.collection)
    chair = stage.seat("Chair", collection, location=(0.0, 3.0, 0.0))
    rig = mixamo(bpy)
    body = stage.box("Hero", (-0.2, 1.0, 0.0), (0.2, 1.3, 1.7), collection)
    body.modifiers.new("Armature", "ARMATURE").object = rig
    stage.select(chair)
    _sits(stage)
    assert stage.own.furniture == collection
    found = furniture_now(bpy.context, settings_of(stage.ann, stage.scene))
    assert set(found) == {"Chair"}


def test_in_a_scene_in_centimetres_a_seat_is_the_same(blender: ModuleType) -> None:
    stage = Stage(height=1.75, unit=0.01, furnished=False)
    stage.scene.cursor.location = (0.0, -900.0, 0.0)
    stage.box("Chair", (-22, 278, 0), (22, 322, 45))
    stage.box("Back", (-22, 322, 0), (22, 326, 95), parent=bpy.data.objects["Chair"])
    bpy.context.view_layer.update()
    stage.select(bpy.data.objects["Chair"])
    walked = walking.walk(bpy.context, stage.ann, bpy.data.objects["Chair"], 1.0)
    place = stage.place(walked.last)
    assert abs(place[0]) < 3.0 and abs(place[1] - 300.0) < 6.0
