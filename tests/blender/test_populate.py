"""Rooms filled with people: the café from its file to the folder, and what is said of what cannot
be.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.populating.populate import SCENE, populate
from bl_ext.user_default.dafnet.dafnet_addon.core import drawing
from bl_ext.user_default.dafnet.dafnet_addon.core.draws import Draw
from bl_ext.user_default.dafnet.dafnet_addon.core.errors import InputError
from bl_ext.user_default.dafnet.dafnet_addon.core.manifest import MANIFEST, read_manifest

from kit.places import ROOT
from kit.stage import bone_heads

SITS = {"sit_on": "Chair.*", "seconds": 1}


def cafe(*people: dict[str, Any], **words: Any) -> dict[str, Any]:
    return {"room": "cafe", "seconds": 1, "people": list(people) or [{"tasks": [SITS]}], **words}


def test_people_sit_on_seats_of_their_own(blender: Any, tmp_path: Path) -> None:
    group = {"count": 3, "height": [1.55, 1.9], "tasks": [{**SITS, "choose": "random"}]}
    made = populate(cafe(group, seed=2), tmp_path / "out")

    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / SCENE))
    assert (blender.context.scene.frame_start, blender.context.scene.frame_end) == (1, 30)
    seats = [person["tasks"][0]["seat"] for person in made.people]
    assert len(set(seats)) == 3 and all(seat.startswith("Chair") for seat in seats)
    for person, seat in zip(made.people, seats, strict=True):
        armature = blender.data.objects[person["armature"]]
        assert armature.dafnet.furniture.name == "Furniture"
        assert armature.dafnet.root.animation_data.action is not None, "the plan can be edited"
        place = np.array(blender.data.objects[seat].location)
        pelvis = bone_heads(armature, 30, ["pelvis"])[0]
        assert np.linalg.norm(pelvis[:2] - place[:2]) < 0.15
        assert abs(pelvis[2] - 0.57) < 0.06


def test_the_same_shot_is_made_twice_and_another_seed_makes_another(
    blender: Any, tmp_path: Path
) -> None:
    made = [populate(cafe(seed=seed), tmp_path / name) for name, seed in (("a", 1), ("b", 1))]
    assert made[0].content == made[1].content and made[0].words == made[1].words
    assert read_manifest(tmp_path / "a").content == made[0].content
    other = populate(cafe(seed=2), tmp_path / "a")
    assert other.content != made[0].content and read_manifest(tmp_path / "a") == other


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ({"room": "caffe"}, "no room 'caffe'.*did you mean 'cafe'"),
        ({"people": [{"tasks": [{"sit_on": "Chiar"}]}]}, "Person: Task 1.*did you mean"),
        ({"people": [{"tasks": [{"stand_up": 1}]}]}, "nobody sits or lies there"),
        ({"people": [{"count": 9, "tasks": [SITS]}]}, "Person 9: .*are taken.*or write fewer"),
    ],
)
def test_what_cannot_be_leaves_nothing(
    blender: Any, tmp_path: Path, words: dict[str, Any], says: str
) -> None:
    with pytest.raises(InputError, match=says):
        populate(cafe(**words), tmp_path / "out")
    assert not list(tmp_path.iterdir())


def test_fewer_leaves_out_who_finds_no_place(blender: Any, tmp_path: Path) -> None:
    made = populate(cafe({"count": 9, "tasks": [SITS]}, fewer=True), tmp_path / "out")
    assert len(made.people) == 8
    assert any("Person 9" in warning and "taken" in warning for warning in made.warnings)


def test_what_is_not_ours_stays(blender: Any, tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("Dear", encoding="utf-8")
    with pytest.raises(InputError):
        populate(cafe(), tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["letter.txt"]


def test_ground_truth_lies_beside_the_scene(blender: Any, tmp_path: Path) -> None:
    words = cafe({"count": 2, "tasks": [{**SITS, "choose": "random"}]}, takes=2)
    made = populate(words, tmp_path / "out", changes={"truth": True, "every": 15})
    assert {each.name for each in (tmp_path / "out").iterdir()} == {SCENE, MANIFEST, "truth"}
    assert {each.name for each in (tmp_path / "out/truth").iterdir()} == {"take_1", "take_2"}
    for person in made.people:
        assert len(person["actions"]) == len(set(person["seeds"])) == 2
    assert len(made.content) == len(set(made.content.values())) == 4


def test_who_is_drawn_anew_is_listed_as_he_was_drawn(
    blender: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = populate(cafe(takes=2, temperature=1.0), tmp_path / "as asked").people[0]["seeds"]
    monkeypatch.setattr(drawing, "_stands", lambda take: take.draw.seed == asked[1])
    made = populate(cafe(takes=2, temperature=1.0), tmp_path / "out")
    (person,) = made.people
    other = Draw(asked[1]).other(1).seed
    assert person["seeds"] == [asked[0], other]
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "out" / SCENE))
    listed = [blender.data.actions[name].dafnet.seed for name in person["actions"]]
    assert listed == person["seeds"]
    (said,) = made.warnings
    assert said.startswith(f"{person['name']}, take 2: With seed {asked[1]} the character stays")


@pytest.mark.slow
def test_the_example_of_the_cafe(blender: Any, tmp_path: Path) -> None:
    made = populate(ROOT / "examples/cafe.toml", tmp_path / "out")
    assert {each.name for each in (tmp_path / "out").iterdir()} == {SCENE, MANIFEST}
    assert len(made.people) == 12 and not made.warnings
