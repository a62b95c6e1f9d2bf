"""A take where a shot ends: as a strip of the NLA, as an asset, as a file for another program."""

from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import takes_of
from mathutils import Vector

from kit.delivered import glb
from kit.stage import Stage, bone_heads, key


@pytest.fixture
def stage(blender: ModuleType) -> Stage:
    """Ann, who walks a metre, with two takes; the second one is chosen and plays."""
    stage = Stage(fps=30, frames=(5, 35), furnished=False)
    stage.walk((5, 0.0), (35, 1.0))
    stage.own.take_count = 2
    bpy.ops.dafnet.generate()
    bpy.ops.dafnet.play_take(index=1)
    return stage


def test_a_take_becomes_a_strip_that_plays_as_it_did(stage: Stage) -> None:
    first, second = takes_of(stage.ann)
    before, data = stage.played(), stage.ann.animation_data
    actions = len(bpy.data.actions)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.dafnet.take_to_nla() == {"FINISHED"}
    (track,) = data.nla_tracks
    (strip,) = track.strips
    assert strip.action == second and data.action is None
    assert (strip.frame_start, strip.frame_end, strip.influence) == (5, 35, 1.0)
    assert len(bpy.data.actions) == actions and takes_of(stage.ann) == [first, second]
    assert np.abs(stage.played() - before).max() < 1e-5
    with pytest.raises(RuntimeError, match=r"is on the track .Ann take\.001. already"):
        bpy.ops.dafnet.take_to_nla()

    stage.own.active_take = 0
    bpy.ops.dafnet.take_to_nla()
    assert [track.name for track in data.nla_tracks] == ["Ann take.001", "Ann take"]
    assert np.abs(stage.played() - before).max() > 1e-3, "the upper one plays"


def test_a_strip_is_one_undo_step(stage: Stage) -> None:
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.dafnet.take_to_nla()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    data = bpy.data.objects["Ann"].animation_data
    assert not data.nla_tracks and data.action.name == "Ann take.001"


def test_a_take_becomes_an_asset_with_tags_and_a_picture(stage: Stage) -> None:
    action = takes_of(stage.ann)[1]
    catalog = "11111111-2222-3333-4444-555555555555"
    action.asset_mark()
    action.asset_data.catalog_id = catalog
    action.asset_data.tags.new("mine")
    assert bpy.ops.dafnet.mark_take() == {"FINISHED"}
    asset = action.asset_data
    assert asset.catalog_id == catalog
    assert {tag.name for tag in asset.tags} >= {"mine", "DAFNet", "FREE"}
    tags = len(asset.tags)
    bpy.ops.dafnet.mark_take()
    assert len(asset.tags) == tags, "marked twice is marked once"
    pixels = np.array(action.preview.image_pixels_float).reshape(256, 256, 4)
    bright = pixels[..., 0] > 0.5
    assert 100 < bright.sum() < 0.2 * bright.size, "a figure on an empty ground"
    assert takes_of(stage.ann)[0].asset_data is None


def test_a_linked_take_is_not_marked(stage: Stage, tmp_path: Path) -> None:
    path = str(tmp_path / "takes.blend")
    bpy.data.libraries.write(path, {takes_of(stage.ann)[1]}, fake_user=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.actions = ["Ann take.001"]
    stage.own.takes[1].action = wanted.actions[0]
    with pytest.raises(RuntimeError, match=r"The take .* is linked; make it local to mark it"):
        bpy.ops.dafnet.mark_take()


@pytest.mark.parametrize("kind", ["fbx", "gltf"])
def test_export_writes_the_chosen_take_alone(stage: Stage, tmp_path: Path, kind: str) -> None:
    assert len(bpy.data.actions) > 2, "the root's and another take's"
    before = stage.state()
    folder = str(tmp_path)
    assert bpy.ops.dafnet.export_take(directory=folder, kind=kind) == {"FINISHED"}
    assert stage.state() == before, "nothing of the scene has changed"
    (file,) = tmp_path.iterdir()
    assert file.stem == "Ann_take_001"
    if kind == "gltf":
        assert len(glb(file)["animations"]) == 1
    with pytest.raises(RuntimeError, match=r"is there already; tick Overwrite"):
        bpy.ops.dafnet.export_take(directory=folder, kind=kind)
    assert bpy.ops.dafnet.export_take(directory=folder, kind=kind, overwrite=True) == {"FINISHED"}
    with pytest.raises(RuntimeError, match="There is no folder"):
        bpy.ops.dafnet.export_take(directory=str(tmp_path / "none"), kind=kind)


def test_what_is_looked_at_turns_the_head_and_leaves_the_body(stage: Stage) -> None:
    lamp = stage.empty("Lamp", (-3.0, 1.5, 1.6))
    stage.own.take_count = 1
    bpy.ops.dafnet.generate()
    plain = stage.played()
    stage.own.look_at = lamp
    bpy.ops.dafnet.generate()
    looking = stage.played()
    assert np.abs(looking - plain)[:, [0, 7, 8, 10, 11]].max() < 1e-4, "pelvis and feet"
    assert np.linalg.norm(looking - plain, axis=-1)[:, 15].max() < 0.1, "the head is not dragged"

    def ahead_off(frame: int) -> float:
        """Degrees between where the face looks and the lamp."""
        stage.scene.frame_set(frame)
        shown = stage.ann.evaluated_get(bpy.context.evaluated_depsgraph_get())
        turn = (shown.matrix_world @ shown.pose.bones["head"].matrix).to_3x3()
        ahead = turn @ stage.ann.data.bones["head"].matrix_local.to_3x3().inverted()
        eye = Vector(bone_heads(stage.ann, frame, ["head"])[0])
        return float(np.degrees((ahead @ Vector((0, -1, 0))).angle(lamp.location - eye)))

    assert ahead_off(30) < 12.0
    stage.own.look_at_influence = 0.0
    bpy.ops.dafnet.generate()
    assert np.abs(stage.played() - plain).max() < 1e-5
    assert ahead_off(30) > 30.0
    lamp.parent = stage.ann
    with pytest.raises(RuntimeError, match=r"The target of Look At 'Lamp' follows the character"):
        bpy.ops.dafnet.generate()


def test_who_sits_leans_as_the_keys_say(blender: ModuleType) -> None:
    stage = Stage(fps=30)
    stool = stage.seat("Stool", location=(0.0, 1.6, 0.0))
    stage.select(stool, stage.ann)
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=4.0) == {"FINISHED"}
    bpy.ops.dafnet.generate()
    last = stage.own.walks[0].last
    leant = []
    for _ in range(2):
        pelvis, neck = bone_heads(stage.ann, last - 15, ["pelvis", "neck"])
        trunk = neck - pelvis
        leant.append((pelvis, trunk, np.degrees(np.arctan2(trunk[1], trunk[2]))))
        key(stage.own, "lean", (last - 70, 0.0), (last - 60, np.radians(15.0)))
        bpy.ops.dafnet.generate()
    (before, _, upright), (after, _, back) = leant
    assert np.allclose(before, after, atol=1e-4), "the pelvis stays"
    assert abs(abs(back - upright) - 15.0) < 3.0
    words = [finding.word for finding in takes_of(stage.ann)[-1].dafnet.verdict]
    assert "sits" in words
    assert stage.read().controls.lean.max() == pytest.approx(15.0, abs=1e-3)
