"""Users' own rooms and characters: .blend, .glb, folders of pieces, casts of rigs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.populating.populate import SCENE, populate
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError

from kit import humanoids
from kit.stage import FACES, Stage, bone_heads, box_corners

SITS = [{"sit_on": "Seat*", "seconds": 1}]


def opened(blender: Any, folder: Path) -> Any:
    blender.ops.wm.open_mainfile(filepath=str(folder / SCENE))
    return blender.context.scene


def saved(blender: Any, file: Path) -> Path:
    blender.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    return file


def seat(blender: Any, name: str, x: float = 0.0) -> Any:
    """A block with a back that looks along -y."""
    mesh = blender.data.meshes.new(name)
    block, back = ((-0.25, -0.25, 0.0), (0.25, 0.25, 0.45)), ((-0.25, 0.2, 0.45), (0.25, 0.25, 0.9))
    corners = [*box_corners(*block), *box_corners(*back)]
    faces = [*FACES, *(tuple(8 + v for v in face) for face in FACES)]
    mesh.from_pydata(corners, [], faces)
    made = blender.data.objects.new(name, mesh)
    made.location.x = x
    blender.context.scene.collection.objects.link(made)
    return made


def test_a_room_of_a_blend_file_with_a_character_of_its_own(blender: Any, tmp_path: Path) -> None:
    stage = Stage(fps=30, frames=(11, 40), furnished=False)
    seat(blender, "Seat", 2.0)
    stage.walk((11, -1.0), (40, 0.0))
    room = saved(blender, tmp_path / "room.blend")
    people = [{"tasks": SITS}, {"character": "Ann"}]
    made = populate({"room": str(room), "people": people, "seconds": 1}, tmp_path / "out")

    scene = opened(blender, tmp_path / "out")
    assert (scene.frame_start, scene.frame_end, scene.render.fps) == (11, 40, 30)
    assert [person["armature"] for person in made.people] == ["Person", "Ann"]
    assert str(room) in made.inputs
    ann, sitter = blender.data.objects["Ann"], blender.data.objects["Person"]
    assert np.linalg.norm(bone_heads(ann, 40, ["pelvis"])[0, :2]) < 0.25
    assert np.linalg.norm(bone_heads(sitter, 40, ["pelvis"])[0, :2] - (2.0, 0.0)) < 0.2


def test_a_character_of_the_room_does_tasks(blender: Any, tmp_path: Path) -> None:
    Stage(fps=30, frames=(1, 30), furnished=False, height=1.6)
    seat(blender, "Seat", 2.0)
    room = saved(blender, tmp_path / "room.blend")
    people = [{"character": "Ann", "tasks": SITS}]
    made = populate({"room": str(room), "people": people, "seconds": 1}, tmp_path / "out")
    assert made.people[0]["height"] == pytest.approx(1.6, abs=0.01)
    opened(blender, tmp_path / "out")
    pelvis = bone_heads(blender.data.objects["Ann"], 30, ["pelvis"])[0]
    assert np.linalg.norm(pelvis[:2] - (2.0, 0.0)) < 0.2


def test_pieces_of_a_folder_are_set_side_by_side(blender: Any, tmp_path: Path) -> None:
    folder = tmp_path / "pieces"
    folder.mkdir()
    seat(blender, "Thing")
    saved(blender, folder / "Seat A.blend")
    blender.ops.export_scene.gltf(filepath=str(folder / "Seat B.glb"))
    shot = {"room": str(folder), "people": [{"count": 2, "tasks": SITS}], "seconds": 1}
    made = populate(shot, tmp_path / "out")

    opened(blender, tmp_path / "out")
    seats = sorted(person["tasks"][0]["seat"] for person in made.people)
    assert seats == ["Seat A", "Seat B"] and len(made.inputs) == 2
    places = [np.array(blender.data.objects[name].matrix_world.translation) for name in seats]
    assert np.linalg.norm(places[0] - places[1]) > 1.0


def test_a_cast_plays_at_its_own_height(blender: Any, tmp_path: Path) -> None:
    seat(blender, "Seat.1", 0.0)
    seat(blender, "Seat.2", 1.5)
    room = tmp_path / "room.glb"
    blender.ops.export_scene.gltf(filepath=str(room))
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    humanoids.mixamo(blender)
    hero = saved(blender, tmp_path / "hero.blend")

    shot = {
        "room": str(room),
        "cast": {"files": [str(hero)]},
        "people": [{"count": 2, "tasks": SITS}],
        "seconds": 1,
        "takes": 2,
    }
    made = populate(shot, tmp_path / "out")
    scene = opened(blender, tmp_path / "out")
    armatures = [each for each in scene.objects if each.type == "ARMATURE"]
    assert len(armatures) == 2 and not any("Double" in each.name for each in scene.objects)
    assert str(hero) in made.inputs
    for person in made.people:
        rig = blender.data.objects[person["armature"]]
        assert len(person["actions"]) == 2
        assert rig.animation_data.action.name == person["actions"][0]
        place = np.array(blender.data.objects[person["tasks"][0]["seat"]].matrix_world.translation)
        hips = bone_heads(rig, 30, ["mixamorig:LeftUpLeg", "mixamorig:RightUpLeg"]).mean(axis=0)
        assert np.linalg.norm(hips[:2] - place[:2]) < 0.2
        assert 0.35 < hips[2] < 0.75


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ({"room": "no.blend"}, "There is no room 'no.blend'"),
        ({"room": "{}/broken.blend"}, "'.*broken.blend' cannot be opened by Blender"),
        ({"room": "{}/broken.glb"}, "'broken.glb' of the room cannot be read"),
        ({"room": "{}/words.txt"}, "'words.txt' of the room is not one of"),
        ({"room": "{}/empty"}, "has no pieces of furniture"),
        ({"cast": {"files": ["gone.blend"]}}, "'gone.blend' cannot be read"),
        ({"people": [{"character": "Ann"}]}, "The room has no armature 'Ann'.*none"),
    ],
)
def test_rooms_and_casts_that_cannot_be_used(
    blender: Any, tmp_path: Path, words: dict[str, Any], says: str
) -> None:
    for name in ("broken.blend", "broken.glb", "words.txt"):
        (tmp_path / name).write_text("nothing", encoding="utf-8")
    (tmp_path / "empty").mkdir()
    shot = {"room": "cafe", "people": [{"tasks": SITS}], **words}
    shot["room"] = shot["room"].format(tmp_path)
    with pytest.raises(InputError, match=says) as refused:
        populate(shot, tmp_path / "out")
    assert "\n" not in str(refused.value) and not (tmp_path / "out").exists()
