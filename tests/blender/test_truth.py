"""Ground truth says what Blender shows: joints, their places in pictures and whether they are seen,
tasks, contacts, penetration; masks and depth agree with it, and nothing of the scene is changed.
"""

import json
import runpy
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.settings import settings_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.people import Played
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import job
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS
from bl_ext.user_default.dafnet.dafnet_addon.director.planner import plan_tasks
from bl_ext.user_default.dafnet.dafnet_addon.director.room import Room
from bl_ext.user_default.dafnet.dafnet_addon.director.tasks import Wait
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

from kit.delivered import Shot, numbers_in
from kit.messages import one_sentence
from kit.places import ROOT
from kit.stage import bone_heads

OUTSIDE, HIDDEN, SEEN = 0, 1, 2


@pytest.fixture
def shot(blender: ModuleType) -> Shot:
    return Shot()


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_joints_and_root_are_those_that_play_in_metres(
    blender: ModuleType, tmp_path: Path, unit: float
) -> None:
    shot = Shot(unit=unit)
    known = shot.truth(tmp_path)
    assert known["frames"].tolist() == list(range(5, 18)) and [*known["joint_names"]] == [*JOINTS]
    for k in (0, 12):
        shown = bone_heads(shot.stage.ann, int(known["frames"][k])) * unit
        np.testing.assert_allclose(known["joints"][k], shown, atol=1e-5)
    np.testing.assert_allclose(known["root"], shot.ann.takes[0].root)
    np.testing.assert_allclose(known["seconds"], known["frames"] / 24)
    nose, left_ear, right_ear = (known["coco"][:, k] for k in (0, 3, 4))
    assert (nose[:, 1] > known["joints"][:, JOINTS.index("head"), 1] + 0.05).all(), "looks along +y"
    assert (left_ear[:, 0] < right_ear[:, 0]).all() and known["coco_estimated"].sum() == 5


def test_an_edited_pose_is_what_is_told(shot: Shot, tmp_path: Path) -> None:
    before = shot.truth(tmp_path / "before")["joints"]
    constraint = shot.stage.ann.pose.bones["left_wrist"].constraints.new("COPY_LOCATION")
    constraint.target = shot.stage.empty("Handle", (-0.3, 0.4, 1.3))
    after = shot.truth(tmp_path / "after")["joints"]
    wrist = JOINTS.index("left_wrist")
    np.testing.assert_allclose(after[:, wrist], np.tile((-0.3, 0.4, 1.3), (13, 1)), atol=1e-5)
    np.testing.assert_allclose(np.delete(after, wrist, 1), np.delete(before, wrist, 1), atol=1e-5)


@pytest.mark.parametrize(
    "lens",
    [
        {"lens": 35.0, "shift_x": 0.1, "shift_y": -0.07},
        {"sensor_fit": "VERTICAL", "lens": 24.0},
        {"type": "ORTHO", "ortho_scale": 4.0, "shift_x": 0.05},
    ],
    ids=lambda lens: next(iter(lens)),
)
def test_pictures_are_where_blender_has_them(
    blender: ModuleType, tmp_path: Path, lens: dict[str, Any]
) -> None:
    shot = Shot()
    bpy.data.objects.remove(shot.camera)
    camera = shot.add_camera("Odd", (2.0, -2.5, 1.8), (0.0, 0.3, 0.9), **lens)
    camera.scale = (2.0, 2.0, 2.0)
    shot.scene.render.resolution_percentage = 50
    known = shot.truth(tmp_path, every=4)
    assert known["camera_frames"].tolist() == [5, 9, 13, 17]
    for k, frame in enumerate(known["camera_frames"]):
        heads = bone_heads(shot.stage.ann, int(frame))
        there = [world_to_camera_view(shot.scene, camera, Vector(head)) for head in heads]
        expected = np.array([(80 * x, 60 * (1.0 - y)) for x, y, _ in there])
        np.testing.assert_allclose(known["joints_2d"][0, k], expected, atol=0.01)

    scene = json.loads((tmp_path / "truth" / "take_1" / "scene.json").read_text(encoding="utf-8"))
    (told,) = scene["cameras"]
    assert (told["width"], told["height"]) == (80, 60)
    if lens.get("type") == "ORTHO":
        assert told["intrinsics"][0][0][0] is None
        return
    joints = np.column_stack([known["joints"][4], np.ones(22)])
    there = joints @ np.transpose(told["world_to_camera"][1])
    flat = there[:, :3] @ np.transpose(told["intrinsics"][1])
    np.testing.assert_allclose(flat[:, :2] / flat[:, 2:], known["joints_2d"][0, 1], atol=0.02)


def test_what_stands_before_hides(shot: Shot, tmp_path: Path) -> None:
    legs = [JOINTS.index(name) for name in ("left_knee", "right_knee", "left_ankle", "right_foot")]
    right_arm = [JOINTS.index(name) for name in ("right_shoulder", "right_elbow", "right_wrist")]
    free = shot.truth(tmp_path / "free")["joints_seen"][0]
    assert (free[:, right_arm] == SEEN).all() and (free[:, JOINTS.index("head")] == SEEN).all()
    assert (free[:, JOINTS.index("left_elbow")] == HIDDEN).any(), "behind the trunk"

    wall = shot.stage.box("Wall", (1.5, -3.0, 0.0), (1.6, 3.0, 0.95), shot.scene.collection)
    walled = shot.truth(tmp_path / "walled")["joints_seen"][0]
    assert (walled[:, legs] == HIDDEN).all() and (walled[:, right_arm[0]] == SEEN).all()

    wall.hide_render = True
    np.testing.assert_array_equal(shot.truth(tmp_path / "cut")["joints_seen"][0], free)

    shot.camera.location.x = -20.0
    shot.camera.rotation_euler = (0.0, 0.0, 0.0)
    away = shot.truth(tmp_path / "away")
    assert not away["joints_seen"].any() and not away["coco_seen"].any()


def test_one_hides_another_and_each_is_told_alone(shot: Shot, tmp_path: Path) -> None:
    alone = shot.truth(tmp_path / "alone")
    shot.scene.cursor.location = (1.2, 0.25, 0.0)
    assert bpy.ops.dafnet.add_character(name="Bea", height=1.9) == {"FINISHED"}
    bea = bpy.context.object
    shot.stage.select(shot.stage.ann)
    settings = settings_of(bea, shot.scene, frame_start=8, frame_end=12, furniture=None)
    result = job.run(bpy.context, settings)
    other = Played(bea, result.takes, result.actions)

    both = shot.truth(tmp_path / "both", shot.ann, other)
    np.testing.assert_allclose(both["joints"], alone["joints"], atol=1e-6)
    now = slice(3, 8)
    seen, shown = (np.sum(known["joints_seen"][0, now] == SEEN) for known in (both, alone))
    assert seen < 0.5 * shown, "Bea stands before her"
    assert (both["joints_seen"] <= alone["joints_seen"]).all()

    with np.load(tmp_path / "both" / "truth" / "take_1" / "Bea.npz") as known:
        assert known["frames"].tolist() == [8, 9, 10, 11, 12] and known["joints"].shape[0] == 5
        seen = known["joints_seen"][0]
        assert (seen[now] == SEEN).sum() > 20 and not seen[:3].any() and not seen[8:].any()
        assert np.isnan(known["joints_2d"][0, :3]).all()
    scene = json.loads(
        (tmp_path / "both" / "truth" / "take_1" / "scene.json").read_text(encoding="utf-8")
    )
    assert [person["height"] for person in scene["people"]] == [1.75, 1.9]
    assert [scene["objects"][k] for k in ("1", "2")] == ["Ann", "Bea"]


def test_contacts_and_depths_are_told_by_piece(shot: Shot, tmp_path: Path) -> None:
    known = shot.truth(tmp_path / "beside")
    assert [*known["contact_names"][:2]] == ["left_foot", "right_foot"]
    feet, toes = known["contacts"][:, :2], known["joints"][:, [10, 11]]
    assert feet[0].all() and not feet[-1].all(), "she stands, and then walks"
    assert (toes[feet][:, 2] < 0.055).all()
    assert not known["contacts"][:, 2].any() and [*known["piece_names"]] == ["Stool"]
    assert known["penetration"].max() == 0.0

    # A beam through the pelvis, 20 cm thick: bones are 10 cm deep in it, at most.
    shot.stage.box("Beam", (-2.0, 0.15, 0.85), (2.0, 0.35, 1.05))
    inside = shot.truth(tmp_path / "inside")
    assert [*inside["piece_names"]] == ["Beam", "Stool"]
    assert 5.0 < inside["penetration"][:, 0].max() <= 10.5 and not inside["penetration"][:, 1].any()

    shot.stage.own.furniture = None
    np.testing.assert_allclose(shot.truth(tmp_path)["penetration"], inside["penetration"])


def test_tasks_have_the_scene_s_frames(shot: Shot, tmp_path: Path) -> None:
    plan = plan_tasks(Room(), [Wait(0.25), Wait(0.3)], start=(0, 0), fps=24)
    ann = Played(shot.ann.armature, shot.ann.takes, shot.ann.actions, plan)
    known = shot.truth(tmp_path, ann)
    first, second = plan.timeline
    assert known["task_frames"].tolist() == [
        [5 + each.start, 5 + each.there, 5 + each.stop] for each in (first, second)
    ]
    assert [json.loads(words) for words in known["tasks"]] == [{"wait": 0.25}, {"wait": 0.3}]
    assert known["task"][0] == (0 if first.start == 0 else -1) and known["task"][-2] == 1
    told = json.loads((tmp_path / "truth" / "take_1" / "Ann.json").read_text(encoding="utf-8"))
    assert told["tasks"] == [{"wait": 0.25}, {"wait": 0.3}] and told.keys() == known.keys()
    np.testing.assert_allclose(told["joints"], known["joints"], atol=1e-5)


def test_each_take_is_told_and_the_scene_stays_as_it_was(
    blender: ModuleType, tmp_path: Path
) -> None:
    shot = Shot(takes=2)
    before = shot.stage.state()
    shot.deliver(tmp_path, truth=True, render=("frames", "masks"), every=6)
    assert shot.stage.state() == before
    assert [image.name for image in bpy.data.images] == [] and len(bpy.data.scenes) == 1
    one, two = (np.load(tmp_path / "truth" / f"take_{k}" / "Ann.npz")["joints"] for k in (1, 2))
    assert np.abs(one - two).max() > 0.01
    np.testing.assert_allclose(two, shot.ann.takes[1].joints, atol=1e-4)


def test_masks_depth_and_keypoints_agree(shot: Shot, tmp_path: Path) -> None:
    shot.scene.render.engine = "CYCLES"
    shot.scene.cycles.samples = 1
    known = shot.truth(tmp_path, every=6, render=("frames", "masks", "depth"))
    folder = tmp_path / "frames" / "take_1" / "Side"
    scene = json.loads((tmp_path / "truth" / "take_1" / "scene.json").read_text(encoding="utf-8"))
    assert scene["objects"]["1"] == "Ann" and "Stool" in scene["objects"].values()
    coco = json.loads((folder / "keypoints.json").read_text(encoding="utf-8"))
    assert [image["file_name"] for image in coco["images"]] == ["0005.png", "0011.png", "0017.png"]
    stool = next(int(k) for k, name in scene["objects"].items() if name == "Stool")

    for k, frame in enumerate(known["camera_frames"]):
        assert (folder / f"{frame:04d}.png").is_file()
        mask = numbers_in(folder / f"{frame:04d}_mask.png")
        depth = numbers_in(folder / f"{frame:04d}_depth.png")
        assert mask.shape == (120, 160) and set(np.unique(mask)) == {0, 1, stool}

        trunk = [JOINTS.index(name) for name in ("pelvis", "spine2", "spine3", "head")]
        columns, rows = known["joints_2d"][0, k, trunk].astype(int).T
        assert (mask[rows, columns] == 1).all(), "Ann is where she is in this very frame"
        ahead = 3.5 - known["joints"][frame - 5, trunk, 0]
        before = ahead - depth[rows, columns] / 1000.0
        assert ((before > 0.0) & (before < 0.3)).all(), "skin and arm lie before the joints"
        assert (depth[mask == 0] == 0).all()

        (told,) = [each for each in coco["annotations"] if each["image_id"] == k + 1]
        left, top, width, height = told["bbox"]
        rows, columns = np.nonzero(mask == 1)
        assert (left, top) == (columns.min(), rows.min()) and told["area"] == (mask == 1).sum()
        assert (left + width, top + height) == (columns.max() + 1, rows.max() + 1)
        points = np.reshape(told["keypoints"], (17, 3))
        np.testing.assert_array_equal(points[:, 2], known["coco_seen"][0, k])
        there = points[:, 2] > OUTSIDE
        np.testing.assert_allclose(points[there, :2], known["coco_2d"][0, k][there], atol=0.01)


def test_cameras_of_nearly_one_name_have_folders_of_their_own(shot: Shot, tmp_path: Path) -> None:
    """Where upper and lower case are one, too, and where a name is a device's."""
    for name in ("side", "Side.", "aux"):
        camera = bpy.data.objects.new(name, bpy.data.objects["Side"].data)
        camera.matrix_world = bpy.data.objects["Side"].matrix_world
        shot.scene.collection.objects.link(camera)
    shot.scene.render.engine = "CYCLES"
    shot.scene.cycles.samples = 1
    shot.truth(tmp_path, every=50, render=("masks",))
    folders = [folder.name for folder in (tmp_path / "frames" / "take_1").iterdir()]
    assert len({name.lower() for name in folders}) == 4 and "aux" not in folders


def test_the_example_draws_it_over_a_frame(shot: Shot, tmp_path: Path) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    shot.scene.render.engine = "CYCLES"
    shot.scene.cycles.samples = 1
    shot.deliver(tmp_path, truth=True, render=("frames",), every=6)
    draw = runpy.run_path(str(ROOT / "examples" / "read_truth.py"))["main"]
    (said,) = draw(tmp_path, tmp_path / "drawn.png", 11)
    assert said.startswith("Ann: without a task; touches ") and said.endswith("joints seen")
    frame = pyplot.imread(tmp_path / "frames" / "take_1" / "Side" / "0011.png")
    drawn = pyplot.imread(tmp_path / "drawn.png")[::2, ::2, :3]
    blue = drawn[..., 2] - drawn[..., 0] > 0.4
    assert drawn.shape[:2] == frame.shape[:2] and 50 < blue.sum() < 1500, "a stick figure"
    rows, columns = np.nonzero(blue)
    assert np.ptp(rows) > 30 and np.ptp(columns) < 60


def test_what_cannot_be_delivered_is_said(shot: Shot, tmp_path: Path) -> None:
    bpy.data.objects.remove(shot.camera)
    (said,) = shot.deliver(tmp_path, render=("frames",))
    assert said == "The scene 'Scene' has no camera, so nothing is rendered; add one."
    camera = shot.add_camera("Round", (3, 0, 1), (0, 0, 1))
    camera.data.type = "PANO"
    said = shot.deliver(tmp_path, truth=True)[0]
    assert said.startswith("The camera 'Round' is panoramic")
    with pytest.raises(InputError) as raised:
        shot.deliver(tmp_path, Played(shot.stage.ann, shot.ann.takes, []), truth=True)
    one_sentence(raised)
