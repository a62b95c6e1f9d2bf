"""Seats that furniture says itself where they are: glTF's OMI_seat, read from a file, sat on, and
written again.
"""

import base64
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.directing.tasks import Assignment, direct
from bl_ext.user_default.dafnet.dafnet_addon.blender.populating.surroundings import room_of
from bl_ext.user_default.dafnet.dafnet_addon.blender.scene.marked_seats import marked_on
from bl_ext.user_default.dafnet.dafnet_addon.director.tasks import SitOn

from kit.stage import Stage

_SEAT = {"back": [0.0, 0.45, -0.22], "foot": [0.0, 0.0, 0.2], "knee": [0.0, 0.45, 0.2]}


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    made = Stage(height=1.75, furnished=False)
    made.scene.cursor.location = (0.0, -9.0, 0.0)
    return made


def _file(folder: Path, seat: dict[str, Any]) -> Path:
    """A glTF file of a cube of 0.44 m a side without a back, on which nothing tells the facing; a
    node over it says where one sits.
    """
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (0, 1) for z in (-1, 1)], float)
    corners *= (0.22, 0.45, 0.22)
    faces = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6]
    faces += [0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]
    points, indices = corners.astype("<f4").tobytes(), np.array(faces, "<u2").tobytes()
    data = base64.b64encode(points + indices).decode()
    made = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["OMI_seat"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "name": "Block",
                "children": [1],
                "translation": [0.5, 0.0, -3.0],
                "extensions": {"OMI_seat": seat},
            },
            {"name": "Block Mesh", "mesh": 0},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 8,
                "type": "VEC3",
                "min": corners.min(axis=0).tolist(),
                "max": corners.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": 5123, "count": len(faces), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [
            {
                "byteLength": len(points) + len(indices),
                "uri": f"data:application/octet-stream;base64,{data}",
            }
        ],
    }
    file = folder / "block.gltf"
    file.write_text(json.dumps(made), encoding="utf-8")
    return file


def _sent(stage: Stage, seat: Any, **given: Any) -> np.ndarray:
    stage.select(seat)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.0, **given) == {"FINISHED"}
    return stage.place(stage.scene.frame_end)


@pytest.mark.parametrize("aside", [0.0, 90.0, 180.0])
def test_who_is_sent_to_furniture_that_says_where_one_sits_sits_there(stage, tmp_path, aside):
    """The block is the same from all sides; the way that one faces is the file's."""
    turn = np.radians(aside)
    spin = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    seat = {name: (spin @ point).tolist() for name, point in _SEAT.items()}
    assert bpy.ops.import_scene.gltf(filepath=str(_file(tmp_path, seat))) == {"FINISHED"}
    mesh = bpy.data.objects["Block Mesh"]
    place = _sent(stage, mesh)
    ahead = spin @ (0.0, 0.0, 1.0)
    expected = np.arctan2(-ahead[0], -ahead[2])  # of a way (x, −z) in Blender
    assert np.cos(place[3] - expected) > 0.99
    np.testing.assert_allclose(place[:2], (0.5, 3.0), atol=0.05)
    (marked,) = room_of(bpy.context).marked["Block Mesh"]
    np.testing.assert_allclose(marked.back[2], 0.45, atol=1e-6)


def test_seats_go_into_a_file_and_come_back(stage, tmp_path) -> None:
    bpy.ops.import_scene.gltf(filepath=str(_file(tmp_path, {**_SEAT, "angle": 1.9})))
    chair = stage.box("Chair", (-0.2, -0.2, 0.0), (0.2, 0.2, 0.44), location=(-1.0, 2.0, 0.0))
    stage.box("Chair Back", (-0.2, 0.2, 0.0), (0.2, 0.24, 0.95), parent=chair)
    bpy.context.view_layer.update()
    place = _sent(stage, chair, mark_seat=True)
    file = tmp_path / "out.gltf"
    for each in bpy.data.objects:
        each.select_set(each.name.startswith(("Block", "Chair")))
    bpy.ops.export_scene.gltf(filepath=str(file), export_format="GLTF_SEPARATE", use_selection=True)
    written = json.loads(file.read_text(encoding="utf-8"))
    assert "OMI_seat" in written["extensionsUsed"]
    assert "OMI_seat" not in written.get("extensionsRequired", [])
    seats = {
        node["name"]: node["extensions"]["OMI_seat"]
        for node in written["nodes"]
        if "OMI_seat" in node.get("extensions", {})
    }
    assert set(seats) == {"Block", "Chair"}
    assert seats["Block"]["angle"] == pytest.approx(1.9)
    for name, point in _SEAT.items():
        np.testing.assert_allclose(seats["Block"][name], point, atol=1e-6)
    found = {name: np.array(point) for name, point in seats["Chair"].items()}
    assert found["back"][1] == pytest.approx(0.44, abs=0.01)
    assert found["knee"][2] == pytest.approx(0.2, abs=0.04) and found["foot"][1] < 0.01

    for name in ("Chair Back", "Chair"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.ops.import_scene.gltf(filepath=str(file))
    stage.root.animation_data_clear()
    stage.root.location, stage.own.furniture = (0.0, 0.0, 0.0), None
    again = _sent(stage, bpy.data.objects["Chair"])
    np.testing.assert_allclose(again[:2], place[:2], atol=0.02)
    assert np.cos(again[3] - place[3]) > 0.999


def test_what_is_no_seat_is_told_in_one_sentence(stage) -> None:
    chair = stage.box("Chair", (-0.2, 1.8, 0.0), (0.2, 2.2, 0.44))
    chair["OMI_seat"] = {"back": [0.0, 0.4], "knee": [0.0, 0.4, 0.3]}
    stage.select(chair)
    with pytest.raises(RuntimeError, match="'Chair': its OMI_seat needs back, foot and knee"):
        bpy.ops.dafnet.walk_to(goal="SEAT")
    assert not stage.root.animation_data


def test_what_is_no_seat_is_in_nobody_else_s_way(stage) -> None:
    stage.seat("Stool", location=(0.0, 2.0, 0.0))
    broken = stage.box("Broken", (2.8, 1.8, 0.0), (3.2, 2.2, 0.44))
    broken["OMI_seat"] = {"back": "here"}
    bpy.context.view_layer.update()
    assert not room_of(bpy.context).marked
    row = stage.own.tasks.add()
    row.verb, row.about = "SIT_ON", "Stool"
    assert bpy.ops.dafnet.plan_tasks() == {"FINISHED"}
    (done,) = direct(bpy.context, [Assignment(stage.ann, [SitOn("Stool")])])
    assert not done.warnings
    (done,) = direct(bpy.context, [Assignment(stage.ann, [SitOn("Broken")])])
    assert "'Broken': its OMI_seat needs back" in done.warnings[0], "it is said"
    assert "as it is shaped" in done.warnings[0]
    stage.select(broken)
    with pytest.raises(RuntimeError, match="'Broken': its OMI_seat needs back"):
        bpy.ops.dafnet.walk_to(goal="SEAT")


@pytest.mark.parametrize("wrong", [{"id": 2**80}, {"back": [0.0, None, 1.0]}])
def test_what_no_property_can_hold_is_left_out_of_an_import(stage, tmp_path, wrong) -> None:
    file = _file(tmp_path, wrong)
    assert bpy.ops.import_scene.gltf(filepath=str(file)) == {"FINISHED"}
    assert bpy.data.objects["Block"].get("OMI_seat") is None
    assert "Block Mesh" in bpy.data.objects


@pytest.mark.parametrize("pull_out", ["MOVED", "KEYED"])
@pytest.mark.parametrize("carried", [False, True])
def test_a_seat_that_is_pulled_out_is_marked_where_one_sits_then(stage, pull_out, carried) -> None:
    chair = stage.box("Chair", (-0.22, 3.0, 0.0), (0.22, 3.44, 0.45))
    stage.box("Back", (-0.22, 3.44, 0.0), (0.22, 3.48, 0.95), parent=chair)
    stage.box("Table", (-0.7, 2.6, 0.70), (0.7, 3.3, 0.73))
    if carried:
        chair.parent = stage.empty("Chair Set")
    stage.ann.location = stage.root.location = (2.5, 2.0, 0.0)
    bpy.context.view_layer.update()
    place = _sent(stage, chair, pull_out=pull_out, mark_seat=True)
    stage.scene.frame_set(stage.scene.frame_end)
    (marked,) = marked_on([chair], 1.0)
    np.testing.assert_allclose(marked.place().position, place[:2], atol=0.02)
    assert place[1] > 3.3, "it was pulled out"


def test_a_seat_that_is_flat_by_its_scale_is_refused_before_it_is_marked(stage) -> None:
    chair = stage.box("Chair", (-0.22, 1.8, 0.0), (0.22, 2.24, 0.45), location=(0.0, 0.0, 0.45))
    chair.scale.z = 0.0
    bpy.context.view_layer.update()
    stage.select(chair)
    with pytest.raises(RuntimeError, match="'Chair' has a scale of 0"):
        bpy.ops.dafnet.walk_to(goal="SEAT", mark_seat=True)
    assert not stage.root.animation_data and stage.own.furniture is None
    assert _sent(stage, chair)[1] > 1.5, "it can be sat on"
