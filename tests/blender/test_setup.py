"""From an empty scene to a take: root paths from curves, objects and points, furniture found,
targets, and the examples.
"""

from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default import dafnet
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.walk_rows import asked_in
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing import path_sources
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.path_sources import (
    along_curve,
    through_points,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.surroundings import find_furniture
from bl_ext.user_default.dafnet.panels import CLASSES, setup
from bl_ext.user_default.dafnet.panels.setup import add_menu
from mathutils import Vector

from kit.panels import drawn_by
from kit.stage import Stage


class Set(Stage):
    """A character of 1.75 m at the origin of an empty scene of 30 frames a second."""

    def __init__(self) -> None:
        super().__init__(fps=30, furnished=False)

    def curve(
        self, points: list[tuple[float, float, float]], kind: str = "POLY", name: str = "Path"
    ) -> Any:
        data = bpy.data.curves.new(name, "CURVE")
        data.dimensions = "3D"
        spline = data.splines.new(kind)
        if kind == "BEZIER":
            spline.bezier_points.add(len(points) - 1)
            for point, place in zip(spline.bezier_points, points, strict=True):
                point.co, point.handle_left_type, point.handle_right_type = place, "AUTO", "AUTO"
        else:
            spline.points.add(len(points) - 1)
            for point, place in zip(spline.points, points, strict=True):
                point.co = (*place, 1.0)
            spline.use_endpoint_u = True
        return self.put(bpy.data.objects.new(name, data))


@pytest.fixture
def stage(blender: ModuleType) -> Set:
    return Set()


@pytest.mark.parametrize("kind", ["POLY", "BEZIER", "NURBS"])
def test_a_curve_is_walked_along_on_the_floor(stage: Set, kind: str) -> None:
    curve = stage.curve([(1.0, 0.0, 0.3), (1.0, 2.0, 0.9), (1.0, 4.0, 0.3)], kind)
    stage.scene.frame_set(11)
    stage.select(curve)
    assert bpy.ops.dafnet.walk_along_curve(speed=1.2, seconds=1.0) == {"FINISHED"}
    assert stage.scene.frame_current == 11
    end = stage.scene.frame_end
    assert abs((end - 10) / 30 - (4.0 / 1.2 + 0.6 * (1 / 1.4 + 1 / 1.2) + 1.0)) < 0.3, (
        "the curve rises, the floor does not"
    )
    path = stage.path(11, end)
    assert np.allclose(path[0], (1, 0, 0, 0), atol=1e-3) and np.allclose(
        path[-1], (1, 4, 0, 0), atol=1e-3
    )
    assert np.abs(path[:, [0, 2, 3]] - (1, 0, 0)).max() < 0.01 and np.diff(path[:, 1]).min() > -1e-3


def test_a_curve_with_a_bevel_and_a_transform_counts_as_its_line(stage: Set) -> None:
    curve = stage.curve([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)])
    curve.data.bevel_depth, curve.rotation_euler = 0.05, (0.0, 0.0, np.pi / 2)
    before = len(bpy.data.objects), len(bpy.data.curves)
    stage.select(stage.ann, curve)
    assert bpy.ops.dafnet.walk_along_curve(backwards=True, keep_facing=True) == {"FINISHED"}
    path = stage.path(1, stage.scene.frame_end)
    assert np.allclose(path[0], (0, 3, 0, 0), atol=1e-3) and np.allclose(
        path[-1], 0.0, atol=1e-3
    ), "it goes backwards"
    assert (len(bpy.data.objects), len(bpy.data.curves)) == before


def test_what_was_keyed_before_the_start_stays_and_what_comes_after_goes(stage: Set) -> None:
    for frame, x in ((1, 0.0), (13, 0.4), (30, 1.0), (60, 5.0)):
        stage.stand(frame, x, 0.1 * x, 0.2 * x)
    before = stage.path(1, 40)
    stage.scene.frame_set(40)
    stage.select(stage.ann, stage.curve([(3.0, 2.0, 0.0), (3.0, 6.0, 0.0)]))
    assert bpy.ops.dafnet.walk_along_curve() == {"FINISHED"}
    assert np.allclose(stage.path(1, 40), before, atol=1e-4)
    path = stage.path(40, stage.scene.frame_end)
    assert np.allclose(path[-1, :2], (3.0, 6.0), atol=1e-3)
    assert (
        np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1).max() < 0.06
        and np.abs(np.diff(path[:, 3])).max() < 0.12
    )
    near = np.linalg.norm(path[:, :2] - (3.0, 2.0), axis=1).min()
    assert near < 0.2, "first it goes to the curve"


def test_an_object_that_has_only_places_becomes_a_root(stage: Set) -> None:
    mover = stage.empty("Mover", (0.0, 0.0, 1.0))
    for frame, x, y in (
        (20, 0.0, 0.0),
        (50, 0.0, 0.0),
        (140, 3.0, 0.0),
        (200, 3.0, 0.0),
        (290, 3.0, 3.0),
    ):
        mover.location = (x, y, 1.4)
        mover.keyframe_insert("location", frame=frame)
    stage.stand(5, 0.0, -1.0, 0.3)
    stage.select(mover)
    assert bpy.ops.dafnet.root_from_object() == {"FINISHED"}
    assert stage.scene.frame_end == 290 and np.allclose(stage.place(5), (0, -1, 0, 0.3), atol=1e-5)
    assert np.allclose(stage.place(19), (0, -1, 0, 0.3), atol=1e-4), "it rests where it was"
    path = stage.path(20, 290)
    assert np.allclose(path[[0, -1], :3], [(0, 0, 0), (3, 3, 0)], atol=0.02)
    assert (
        abs(path[75, 3] + np.pi / 2) < 0.1
        and abs(path[-10, 3]) < 0.1
        and np.abs(np.diff(path[:, 3])).max() * 30 < 3.0
    )
    assert np.ptp(path[135:165, :2], axis=0).max() < 0.02, "it stands"


def test_selected_empties_are_walked_through_in_the_order_of_their_names(stage: Set) -> None:
    points = [
        stage.empty(name, place)
        for name, place in (
            ("Point.10", (-2.0, 3.0, 0.0)),
            ("Point.2", (2.0, 3.0, 1.0)),
            ("Point.1", (2.0, 0.5, 0.0)),
        )
    ]
    furniture = bpy.data.collections.new("Furniture")
    stage.scene.collection.children.link(furniture)
    block = stage.box("Block", (-0.4, 2.5, 0.0), (0.4, 3.4, 1.0))
    furniture.objects.link(block)
    stage.ann.dafnet.furniture = furniture
    stage.select(stage.ann, *points)
    assert bpy.ops.dafnet.walk_through_points(speed=1.3, seconds=0.5) == {"FINISHED"}
    path = stage.path(1, stage.scene.frame_end)
    nearest = [
        np.linalg.norm(path[:, :2] - p, axis=1) for p in ((2.0, 0.5), (2.0, 3.0), (-2.0, 3.0))
    ]
    times = [int(np.argmin(d)) for d in nearest]
    assert max(d.min() for d in nearest) < 0.3 and times == sorted(times)
    speed = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1) * 30
    assert speed[times[0] - 5 : times[1] + 5].min() > 0.25, "no rests"
    inside = np.maximum(np.abs(path[:, :2] - (0.0, 2.95)) - (0.4, 0.45), 0.0)
    assert np.linalg.norm(inside, axis=1).min() > 0.2
    stage.select(stage.ann)
    stage.scene.cursor.location = (-2.0, 0.0, 0.0)
    assert bpy.ops.dafnet.walk_through_points() == {"FINISHED"}
    assert np.allclose(stage.place(stage.scene.frame_end)[:2], (-2.0, 0.0), atol=1e-3), (
        "none is selected: the cursor"
    )
    start, stage.scene.cursor.location = stage.scene.frame_end, (-2.0, -3.0, 0.0)
    stage.select(stage.ann, points[2])
    assert bpy.ops.dafnet.walk_through_points(to_cursor=True) == {"FINISHED"}
    path = stage.path(start, stage.scene.frame_end)
    assert np.linalg.norm(path[:, :2] - (2.0, 0.5), axis=1).min() < 0.4 and np.allclose(
        path[-1, :2], (-2, -3), atol=1e-3
    )


def test_what_cannot_be_walked_changes_nothing(stage: Set, tmp_path: Path) -> None:
    short, line = (
        stage.curve([(0.0, 0.0, 0.0), (0.2, 0.0, 0.0)], name="Short"),
        stage.curve([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]),
    )
    still = stage.empty("Still", (1.0, 0.0, 0.0))
    still.keyframe_insert("location", frame=1)

    def refused(words: str, operator: Any) -> None:
        with pytest.raises(RuntimeError, match=words):
            operator()
        assert not stage.root.animation_data or not stage.root.animation_data.action
        assert stage.scene.frame_end == 40

    stage.select(short)
    refused("Short' is only 0.20 m long", bpy.ops.dafnet.walk_along_curve)
    with pytest.raises(Exception, match="is not a curve"):
        along_curve(bpy.context, stage.ann, still)
    stage.select(still)
    refused("hardly moves", bpy.ops.dafnet.root_from_object)
    assert not bpy.ops.dafnet.walk_along_curve.poll()
    stage.select(line)
    assert bpy.ops.dafnet.walk_along_curve.poll() and not bpy.ops.dafnet.root_from_object.poll()
    stage.root.parent = still
    refused("follows something", bpy.ops.dafnet.walk_along_curve)
    stage.root.parent = None
    library = str(tmp_path / "roots.blend")
    bpy.data.libraries.write(library, {bpy.data.objects.new("Far Root", None)})
    bpy.data.objects.remove(bpy.data.objects["Far Root"])
    with bpy.data.libraries.load(library, link=True) as (_, linked):
        linked.objects = ["Far Root"]
    stage.ann.dafnet.root = stage.put(linked.objects[0])
    refused("'Far Root' is linked", bpy.ops.dafnet.walk_along_curve)
    stage.ann.dafnet.root = None
    assert not any(
        getattr(bpy.ops.dafnet, name).poll()
        for name in ("walk_along_curve", "find_furniture", "add_targets")
    )
    for o in list(stage.scene.objects):
        if o.type == "ARMATURE":
            bpy.data.objects.remove(o)
    assert (
        not bpy.ops.dafnet.walk_along_curve.poll() and not bpy.ops.dafnet.walk_through_points.poll()
    ), "no character"


def test_what_fails_once_a_walk_is_keyed_changes_nothing(
    stage: Set, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = stage.empty("A", (0.0, 2.0, 0.0)), stage.empty("B", (2.0, 2.0, 0.0))
    stage.select(stage.ann, first)
    assert bpy.ops.dafnet.walk_through_points() == {"FINISHED"}
    stage.select(stage.ann, first, second)
    stage.ann.location.x = 1.0

    def state() -> tuple[Any, ...]:
        own = stage.own
        rows = [(asked_in(row), row.first, row.last, row.digest) for row in own.walks]
        return stage.state(), rows, own.active_walk, tuple(own.stood), stage.scene.frame_end

    def fails(*_given: Any) -> bool:
        raise ZeroDivisionError

    before = state()
    monkeypatch.setattr(path_sources, "extend_range", fails)
    with pytest.raises(ZeroDivisionError):
        through_points(bpy.context, stage.ann, [second, first])
    assert state() == before


def test_a_generated_walk_keeps_to_the_curve(stage: Set) -> None:
    stage.select(
        stage.ann,
        stage.curve([(0.0, 0.0, 0.0), (1.5, 1.5, 0.0), (0.0, 3.0, 0.0), (1.5, 5.0, 0.0)], "BEZIER"),
    )
    assert bpy.ops.dafnet.walk_along_curve() == {"FINISHED"}
    stage.select(stage.ann)
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    sliding = stage.ann.dafnet.takes[0].action.dafnet.sliding
    off = []
    for frame in range(1, stage.scene.frame_end + 1, 5):
        root = stage.place(frame)
        off.append(
            np.linalg.norm(
                np.array(stage.ann.matrix_world @ stage.ann.pose.bones["pelvis"].head)[:2]
                - root[:2]
            )
        )
    assert np.mean(off) < 0.05 and max(off) < 0.1, "a pelvis sways about its root"
    stage.root.animation_data_clear()
    stage.root.location, stage.root.rotation_euler, stage.scene.frame_end = (0, 0, 0), (0, 0, 0), 40
    stage.scene.frame_set(1)
    points = [
        stage.empty(f"Point {k}", place)
        for k, place in enumerate([(1.5, 1.5, 0), (0, 3, 0), (1.5, 5, 0)])
    ]
    stage.select(stage.ann, *points)
    assert bpy.ops.dafnet.walk_through_points(seconds=1.0) == {"FINISHED"}
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    assert sliding < 1.25 * stage.ann.dafnet.takes[1].action.dafnet.sliding, (
        "feet slide as on any other walk"
    )


def test_find_furniture_takes_what_stands_beside_the_path(stage: Set) -> None:
    stage.stand(1, 0.0, 0.0)
    stage.stand(40, 0.0, 3.0)
    near = [
        stage.box("Chair", (0.8, 1.0, 0.0), (1.3, 1.5, 0.5)),
        stage.box("Shelf", (-1.6, 2.8, 0.0), (-1.2, 3.4, 1.9)),
    ]
    stage.box("Floor", (-9.0, -9.0, -0.1), (9.0, 9.0, 0.0))
    stage.box("Lamp", (0.0, 1.0, 2.3), (0.3, 1.3, 2.5))
    stage.box("Far", (3.0, 1.0, 0.0), (3.4, 1.4, 1.0))
    hidden = stage.box("Hidden", (0.5, 2.0, 0.0), (0.9, 2.4, 0.6))
    bpy.context.view_layer.update()
    hidden.hide_set(True)
    stage.scene.cursor.location = (0.6, 0.6, 0.0)
    bpy.ops.dafnet.add_character(name="Bob")
    stage.select(stage.ann)
    found = find_furniture(bpy.context, stage.ann)
    assert found.names == ("Chair", "Shelf") and {o.name for o in found.collection.objects} == {
        "Chair",
        "Shelf",
    }
    assert (
        stage.ann.dafnet.furniture == found.collection and found.collection.name == "Ann Furniture"
    )
    assert all(stage.scene.collection in o.users_collection for o in near), "linked, not moved"
    for words in (
        "Hidden near the path, so ignored: 'Hidden'",
        "does not see: 'Shelf'.",
    ):
        assert any(words in sentence for sentence in found.warnings), words
    bpy.data.objects["Far"].location.x = -1.6
    assert bpy.ops.dafnet.find_furniture() == {"FINISHED"}
    assert {o.name for o in found.collection.objects} == {"Chair", "Shelf", "Far"}, (
        "the same collection again"
    )
    stage.root.animation_data_clear()
    stage.root.location = (40.0, 0.0, 0.0)
    with pytest.raises(RuntimeError, match="No visible mesh lies within"):
        bpy.ops.dafnet.find_furniture()
    assert len(found.collection.objects) == 3 and len(bpy.data.collections) == 3


def test_missing_targets_are_added_where_head_and_hands_are(stage: Set) -> None:
    assert not bpy.ops.dafnet.add_targets.poll(), "it has all"
    stage.ann.dafnet.hand_right = None
    bpy.data.objects.remove(stage.ann.dafnet.head)
    stage.ann.pose.bones["right_shoulder"].rotation_quaternion = (0.9, 0.3, 0.2, 0.1)
    stage.ann.location.x = 2.0
    kept = stage.ann.dafnet.hand_left
    assert bpy.ops.dafnet.add_targets() == {"FINISHED"}
    own = stage.ann.dafnet
    assert own.hand_left == kept and own.head is not None
    for bone, target in (("right_wrist", own.hand_right), ("head", own.head)):
        assert (
            target.location - stage.ann.matrix_world @ stage.ann.pose.bones[bone].head
        ).length < 1e-5
        assert target.name in stage.ann.users_collection[0].objects


def test_foot_targets_are_added_where_the_feet_are(stage: Set) -> None:
    own = stage.ann.dafnet
    stage.ann.location.x = 2.0
    assert bpy.ops.dafnet.add_foot_targets() == {"FINISHED"}
    for bone, target in (("left_ankle", own.foot_left), ("right_ankle", own.foot_right)):
        place = stage.ann.matrix_world @ stage.ann.pose.bones[bone].head
        assert (target.location - place).length < 1e-5
    assert not bpy.ops.dafnet.add_foot_targets.poll(), "it has both"
    with pytest.raises(RuntimeError, match="already have targets"):
        bpy.ops.dafnet.add_foot_targets()


def test_a_missing_root_is_added_where_the_character_stands(stage: Set) -> None:
    assert not bpy.ops.dafnet.add_root.poll(), "it has one"
    bpy.data.objects.remove(stage.ann.dafnet.root)
    bpy.context.view_layer.objects.active = stage.ann
    stage.ann.location, stage.ann.rotation_euler.z = (1.0, 2.0, 0.0), np.pi + 0.5
    assert bpy.ops.dafnet.add_root() == {"FINISHED"}
    root = stage.ann.dafnet.root
    assert (
        root.location - stage.ann.location
    ).length < 1e-6 and root.rotation_euler.z == pytest.approx(0.5)
    assert bpy.ops.dafnet.generate.poll() and not bpy.ops.dafnet.add_root.poll()


def joints(stage: Any, character: Any, frames: range, name: str) -> np.ndarray:
    found = []
    for frame in frames:
        stage.scene.frame_set(frame)
        found.append(np.array(character.matrix_world @ character.pose.bones[name].head))
    return np.array(found)


@pytest.fixture
def bare(blender: ModuleType) -> Set:
    """An empty scene with its cursor off the middle, at 24 frames a second."""
    made = Set()
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    made.scene = blender.context.scene
    made.scene.cursor.location = (3.0, -2.0, 0.5)
    return made


MIDDLE = np.array([3.0, -2.0, 0.5])


def example(stage: Set, kind: str) -> Any:
    """Add and generate it; its character."""
    assert bpy.ops.dafnet.add_example(kind=kind) == {"FINISHED"}
    made = bpy.context.object
    assert tuple(stage.scene.cursor.location) == tuple(MIDDLE) and stage.scene.frame_end > 250
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    return made


def test_the_desk_example_sits_and_writes(bare: Set) -> None:
    made, end = example(bare, "DESK"), bare.scene.frame_end
    pelvis = joints(bare, made, range(end - 60, end + 1, 10), "pelvis") - MIDDLE
    assert np.abs(pelvis[:, :2]).max() < 0.05 and np.abs(pelvis[:, 2] - 0.57).max() < 0.05
    hand = joints(bare, made, range(end - 60, end + 1, 3), "right_wrist") - MIDDLE
    assert np.abs(hand[:, 2] - 0.785).max() < 0.04 and np.ptp(hand[:, 0]) > 0.08, (
        "over the desk, along a line"
    )
    assert {o.name for o in made.dafnet.furniture.objects} == {"Chair", "Desk"}
    assert made.dafnet.takes[0].action.dafnet.collisions < 1.0


def test_the_whiteboard_example_writes_at_the_board(bare: Set) -> None:
    made = example(bare, "WHITEBOARD")
    writes = []
    for frame in range(1, bare.scene.frame_end + 1, 2):
        bare.scene.frame_set(frame)
        if made.dafnet.mode == "EE":
            writes.append(
                (
                    np.array(made.matrix_world @ made.pose.bones["right_wrist"].head) - MIDDLE,
                    np.array(made.dafnet.hand_right.matrix_world.translation) - MIDDLE,
                )
            )
    hand, asked = np.array(writes)[8:-8].transpose(1, 0, 2)
    assert np.linalg.norm(hand - asked, axis=1).mean() < 0.02 and len(hand) > 50
    assert (
        (np.abs(hand[:, 1] - 0.36) < 0.1).all()
        and np.ptp(hand[:, 0]) > 0.25
        and np.ptp(hand[:, 2]) > 0.12
    )
    assert made.dafnet.mode == "FREE" and made.dafnet.head_influence == 0.0
    assert made.dafnet.takes[0].action.dafnet.collisions < 0.5


def test_the_sofa_example_sits_and_gets_up(bare: Set) -> None:
    made = example(bare, "SOFA")
    height = joints(bare, made, range(1, bare.scene.frame_end + 1, 4), "pelvis")[:, 2] - MIDDLE[2]
    assert (
        height[0] > 0.8
        and height[-1] > 0.8
        and 0.42 < height.min() < 0.6
        and (height < 0.62).sum() * 4 > 60
    )


def test_the_bed_example_lies_down(bare: Set) -> None:
    made, end = example(bare, "BED"), bare.scene.frame_end
    head, pelvis, left, right = (
        joints(bare, made, range(end - 40, end + 1, 10), name) - MIDDLE
        for name in ("head", "pelvis", "left_ankle", "right_ankle")
    )
    assert np.abs(pelvis - (0.0, -0.3, 0.47)).max() < 0.08, "1 cm over the mattress"
    assert (head[:, 0] > 0.5).all() and (head[:, 2] < 0.72).all(), "on the pillow"
    for ankle in (left, right):
        assert (ankle[:, 0] < -0.6).all() and (ankle[:, 2] > 0.46).all(), "the legs are on the bed"
    for side in ("left", "right"):
        knee, ankle = (
            joints(bare, made, range(90, end + 1), f"{side}_{name}") - MIDDLE
            for name in ("knee", "ankle")
        )
        shin = knee + np.linspace(0.0, 1.0, 9)[:, None, None] * (ankle - knee)
        inside = (
            (shin[..., 1] < 0.12)
            & (shin[..., 1] > -0.72)
            & (shin[..., 2] < 0.42)
            & (shin[..., 2] > 0.15)
        )
        assert not inside.any(), "and came onto it, not through it"


def test_examples_keep_the_scene_s_units(bare: Set) -> None:
    bare.scene.unit_settings.scale_length = 0.01
    bare.scene.cursor.location = MIDDLE * 100
    assert bpy.ops.dafnet.add_example(kind="SOFA") == {"FINISHED"}
    sofa = bpy.data.objects["Sofa"]
    assert abs(sofa.dimensions.x - 197) < 3 and np.allclose(
        sofa.location, MIDDLE * 100 - (40.5, 0, 0), atol=1e-3
    )
    root = bpy.context.object.dafnet.root
    assert np.allclose(root.location, MIDDLE * 100 + (-170, 220, 0), atol=1e-2)


@pytest.mark.parametrize("kind", ["DESK", "WHITEBOARD", "SOFA", "BED"])
def test_an_example_stands_beside_what_is_there(bare: Set, kind: str) -> None:
    bare.scene.cursor.location = (0.0, 0.0, 0.0)
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    cube = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(size=30.0)
    assert bpy.ops.dafnet.add_example(kind=kind) == {"FINISHED"}
    made = bpy.context.object
    assert tuple(bare.scene.cursor.location) == (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    for piece in made.dafnet.furniture.objects:
        corners = np.array([piece.matrix_world @ Vector(corner) for corner in piece.bound_box])
        low, high = corners.min(axis=0), corners.max(axis=0)
        assert (low[:2] > 1.0).any() or (high[:2] < -1.0).any(), piece.name
    bare.root = made.dafnet.root
    path = bare.path(1, bare.scene.frame_end)[:, :2]
    assert np.abs(path).max(axis=1).min() > 1.0 + 0.2, "nor is the cube in the way"
    assert np.abs(path).max() < 6.0 and cube.location.length == 0.0


def test_each_is_one_step_to_undo(stage: Set) -> None:

    def state() -> tuple[list[str], int, bool, str]:
        ann = bpy.data.objects["Ann"]
        root, furniture = ann.dafnet.root, ann.dafnet.furniture
        keyed = bool(root.animation_data and root.animation_data.action)
        return (
            sorted(o.name for o in bpy.data.objects),
            bpy.context.scene.frame_end,
            keyed,
            furniture.name if furniture else "",
        )

    def undone(operator: Any, **arguments: Any) -> None:
        bpy.ops.ed.undo_push(message="before")
        before = state()
        assert operator("EXEC_DEFAULT", True, **arguments) == {"FINISHED"}
        assert state() != before
        bpy.ops.ed.undo()
        assert state() == before

    stage.box("Crate", (0.6, 1.0, 0.0), (1.0, 1.4, 0.5))
    stage.select(stage.ann, stage.curve([(0.0, 0.0, 0.0), (0.0, 4.0, 0.0)]))
    undone(bpy.ops.dafnet.walk_along_curve)
    undone(bpy.ops.dafnet.find_furniture)
    undone(bpy.ops.dafnet.add_example, kind="BED")


def test_the_menu_and_the_panel_are_there(stage: Set) -> None:
    panels = setup
    drawn = bpy.types.VIEW3D_MT_add._dyn_ui_initialize()
    assert drawn.count(panels.add_menu) == 1
    children = [cls.bl_idname for cls in CLASSES if getattr(cls, "bl_parent_id", "")]
    below = ["DAFNET_PT_setup", "DAFNET_PT_walks", "DAFNET_PT_softness", "DAFNET_PT_tasks"]
    assert children[:4] == below
    stage.select(stage.empty("Other", (0, 0, 0)))
    assert panels.DAFNET_PT_setup.poll(bpy.context), "the only character is meant"

    curve = stage.curve([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)])
    stage.select(stage.ann, curve, stage.empty("One", (0, 0, 0)), stage.empty("Two", (1, 0, 0)))
    assert {
        "Walk along Path",
        "Walk through 2 Points",
        "Sit on Selected",
        "DAFNET_MT_walk",
    } <= set(drawn_by(panels.DAFNET_PT_setup, bpy.context).words())
    stage.select(stage.ann)
    words = drawn_by(panels.DAFNET_PT_setup, bpy.context).words()
    assert "dafnet.walk_along_curve" not in words, "it is in the menu while no curve is selected"
    assert drawn_by(panels.DAFNET_MT_walk, bpy.context).words() == [
        "dafnet.walk_along_curve",
        "dafnet.walk_through_points",
        "dafnet.root_from_object",
    ]
    added = drawn_by(panels.DAFNET_MT_add, bpy.context).words()
    assert added.count("dafnet.add_example") == 4
    assert {"Character", "Chair and Desk", "Bed"} <= set(added)


def test_the_menu_is_gone_after_unregister(stage: Set) -> None:
    dafnet.unregister()
    try:
        assert add_menu not in bpy.types.VIEW3D_MT_add._dyn_ui_initialize()
        assert not hasattr(bpy.types, "DAFNET_PT_setup")
    finally:
        dafnet.register()
    assert bpy.types.VIEW3D_MT_add._dyn_ui_initialize().count(add_menu) == 1
