"""Which bones are which joints: detected by name, guessed, chosen by hand, kept as presets."""

import json
from dataclasses import fields
from pathlib import Path

import bpy
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.armature import is_character
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import detection, maps, properties
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.skeleton import JOINTS, LIMBS
from bl_ext.user_default.dafnet.panels.rig import DAFNET_PT_rig, DAFNET_UL_rig

from kit import humanoids
from kit.panels import Layout, drawn_by
from kit.rig_stage import RigStage

CENTIMETRE = 0.01


DETECTED = {
    "mixamo": ("Mixamo", 22),
    "rigify": ("Rigify", 21),
    "rigify_metarig": ("Rigify metarig", 22),
    "smpl_x": ("SMPL-X", 22),
    "unreal": ("Unreal mannequin (UE4)", 22),
    "vrm": ("VRM 1.0", 21),
}


@pytest.mark.parametrize("kind", DETECTED)
def test_conventions_are_detected(stage: RigStage, kind: str) -> None:
    rig = stage.build(kind)
    found = detection.detect_map(rig)
    assert (found.name, len(found.joints)) == DETECTED[kind]
    assert not is_character(rig)
    assert is_character(stage.ann)


@pytest.mark.parametrize("file", sorted(maps.map_files().values()), ids=lambda file: file.stem)
def test_a_map_that_ships_is_whole(file: Path) -> None:
    """It has every joint that is needed, and no name that would be passed over in silence."""
    told = json.loads(file.read_text(encoding="utf-8"))
    rig_map = maps.load_map(file)
    assert set(maps.NEEDED) <= rig_map.joints.keys() <= set(JOINTS)
    assert told["joints"] == rig_map.joints and told.get("places", {}) == rig_map.places
    assert told.keys() <= {field.name for field in fields(rig_map)}
    assert rig_map.name and rig_map.about and rig_map.known_by
    assert rig_map.limbs.keys() in (set(), set(LIMBS))


@pytest.mark.parametrize("prefix", ["", "mixamorig1:", "mixamorig_", "Mia:"])
def test_prefixes_do_not_matter(stage: RigStage, prefix: str) -> None:
    found = detection.detect_map(humanoids.mixamo(bpy, prefix=prefix))
    assert (found.name, len(found.joints)) == ("Mixamo", 22)
    assert found.joints["left_hip"] == f"{prefix}LeftUpLeg"


def test_five_spine_bones_of_unreal(stage: RigStage) -> None:
    rig = humanoids.unreal(bpy, spines=5)
    found = detection.detect_map(rig)
    assert found.name == "Unreal mannequin (UE5)" and found.joints["spine3"] == "spine_05"
    stage.play("write")
    stage.bake("unreal", rig)
    assert max(distances.mean() for distances in stage.errors("unreal", rig).values()) < CENTIMETRE


GUESSED = {
    "mixamorig:Hips": "hip_ctrl",
    "mixamorig:Spine": "spine_lower",
    "mixamorig:Spine1": "Spine-Mid",
    "mixamorig:Spine2": "Chest",
    "mixamorig:Neck": "neck",
    "mixamorig:Head": "Head",
    "Shoulder": "Clavicle_{}",
    "Arm": "UpperArm_{}",
    "ForeArm": "LowerArm_{}",
    "Hand": "hand.{}",
    "UpLeg": "{}_thigh",
    "Leg": "{}_shin",
    "Foot": "Foot{}",
    "ToeBase": "Toe.{}",
}


def test_names_of_no_convention_are_guessed(stage: RigStage) -> None:
    rig = humanoids.mixamo(bpy)
    meant = detection.detect_map(rig).joints
    new = {}
    for joint, bone in meant.items():
        for word, side in (("Left", "L"), ("Right", "R")):
            if word in bone:
                new[joint] = GUESSED[bone.split(word)[1]].format(side)
        new.setdefault(joint, GUESSED.get(bone, bone))
        rig.data.bones[bone].name = new[joint]
    new["left_ankle"], new["right_ankle"] = (
        rig.data.bones[new[f"{side}_ankle"]].name for side in ("left", "right")
    )
    found = detection.detect_map(rig)
    assert found.name == "Guessed"
    assert found.joints == new


@pytest.fixture
def user_maps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(maps, "user_folder", lambda create=False: tmp_path)
    return tmp_path


def test_presets_are_saved_and_found_again(stage: RigStage, user_maps: Path) -> None:
    """By the operators: detect, correct by hand, save; another rig of these names is then detected,
    and can load it.
    """
    rig = stage.build("odd")
    bpy.context.view_layer.objects.active = rig
    assert bpy.ops.dafnet.detect_rig() == {"FINISHED"}
    assert len(rig.dafnet_rig.rows) == 22
    for row in rig.dafnet_rig.rows:
        row.bone = humanoids.ODD.get(row.name, "")
    rig.dafnet_rig.root_bone = "Wurzel"
    assert bpy.ops.dafnet.save_rig_map(name="Otto's Rig") == {"FINISHED"}
    assert [file.suffix for file in user_maps.iterdir()] == [".json"]
    other = humanoids.odd(bpy)
    found = detection.detect_map(other)
    assert (found.name, found.joints, found.root) == ("Otto's Rig", humanoids.ODD, "Wurzel")
    key = next(key for key, name, _ in properties.presets(None, None) if name == "Otto's Rig")
    assert key.startswith("my_") and "mixamo" in {
        key for key, _, _ in properties.presets(None, None)
    }
    bpy.context.view_layer.objects.active = other
    assert bpy.ops.dafnet.load_rig_map(preset=key) == {"FINISHED"}
    assert properties.map_of(other).joints == humanoids.ODD
    (user_maps / "broken.json").write_text("{}", encoding="utf-8")
    assert detection.detect_map(other).name == "Otto's Rig"
    with pytest.raises(InputError, match=r"'broken\.json'"):
        maps.load_map(user_maps / "broken.json")


def test_the_panel_shows_a_row_for_each_joint(stage: RigStage) -> None:
    """And offers to bake; the list is there once bones were detected."""

    def called(layout: Layout) -> list[tuple[str, ...]]:
        return [
            (name, *(v for v in values if isinstance(v, str))) for name, values, _ in layout.calls
        ]

    rig = stage.build("vrm")
    bpy.context.view_layer.objects.active = rig
    drawn = called(drawn_by(DAFNET_PT_rig, bpy.context))
    assert ("operator", "dafnet.bake_to_rig") in drawn and not any(
        each[0] == "template_list" for each in drawn
    )
    bpy.ops.dafnet.detect_rig()
    rig.dafnet_rig.root_motion = "BONE"
    drawn = called(drawn_by(DAFNET_PT_rig, bpy.context))
    assert (
        any(each[0] == "template_list" for each in drawn)
        and ("prop_search", "root_bone", "bones") in drawn
    )
    rows = Layout()
    for row in rig.dafnet_rig.rows:
        DAFNET_UL_rig.draw_item(None, bpy.context, rows, rig.dafnet_rig, row, 0, None, "")
    assert called(rows).count(("prop_search", "bone", "bones")) == 22


def test_presets_lie_in_the_extensions_folder(stage: RigStage) -> None:
    folder = maps.user_folder(create=True)
    assert folder.is_dir() and "dafnet" in folder.parts and folder.name == "rig_maps"
    assert maps.load_map(maps.map_files()["mixamo"]).name == "Mixamo"


def test_a_corrected_row_of_rigify_keeps_the_rest(stage: RigStage) -> None:
    """A control chosen by hand replaces the preset's, with its place; IK stays for the other limbs'
    controls only.
    """
    rig = stage.build("rigify")
    properties.show_map(rig, detection.detect_map(rig))
    assert properties.map_of(rig) == detection.detect_map(rig)
    rig.dafnet_rig.rows["left_wrist"].bone = "hand_tweak.L"
    changed = properties.map_of(rig)
    assert (
        changed.place("left_wrist") == "hand_tweak.L"
        and changed.place("right_wrist") == "ORG-hand.R"
    )
    assert changed.limbs.keys() == {"right_arm", "left_leg", "right_leg"}
