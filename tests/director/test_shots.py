"""Shots: what a file can say, what is drawn of it, and what is said of what cannot be."""

import json
from pathlib import Path
from typing import Any

import pytest

from dafnet_addon import InputError
from dafnet_addon.core.tables import read_tables
from dafnet_addon.director.shots import Shot, drawn, shot_of
from dafnet_addon.director.tasks import SitOn, StandUp

SITS = {"sit_on": "Chair.*", "seconds": 4}


def shot(*people: dict[str, Any], **words: Any) -> Shot:
    return shot_of({"room": "cafe", "people": list(people) or [{"tasks": [SITS]}], **words})


def test_a_file_says_what_tables_say(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(
        'room = "cafe"\nseed = 7\ntakes = 2\ntruth = true\nrender = ["depth", "frames"]\n'
        '[cast]\nfiles = ["hero.blend"]\n'
        "[[people]]\ncount = 3\nheight = [1.5, 1.9]\nstart = [1, 2]\n"
        'tasks = [{ sit_on = "Chair.*", seconds = 4 }, { stand_up = 1 }]\n',
        encoding="utf-8",
    )
    found = shot_of(read_tables(tmp_path / "a.toml", "shots"), tmp_path)
    (group,) = found.people
    assert (found.room, found.seed, found.takes, found.cast) == ("cafe", 7, 2, ("hero.blend",))
    assert found.wishes.truth and found.wishes.render == ("frames", "depth")
    assert group.tasks == ((SitOn("Chair.*", seconds=4.0), StandUp(1.0)),)
    assert found.path("hero.blend") == tmp_path / "hero.blend"

    (tmp_path / "a.json").write_text(json.dumps(dict(found.words)), encoding="utf-8")
    assert shot_of(read_tables(tmp_path / "a.json", "shots"), tmp_path) == found


def test_what_is_drawn_for_somebody_does_not_depend_on_those_after_him() -> None:
    group = {"count": 3, "height": [1.5, 1.9], "begins": [0, 9], "tasks": [[SITS], [{"wait": 1}]]}
    alone, more = drawn(shot(group)), drawn(shot({**group, "count": 5}, group))
    assert alone == more[:3]
    assert drawn(shot(group)) == alone and drawn(shot(group, seed=1)) != alone
    assert len({each.name for each in more}) == len(more) == 8
    assert len({each.seed for each in more}) == 8
    assert all(1.5 <= each.height <= 1.9 and 0.0 <= each.begins <= 9.0 for each in more)


def test_takes_have_seeds_that_more_takes_do_not_change() -> None:
    one, three = drawn(shot())[0], drawn(shot(takes=3))[0]
    assert three.take_seeds[:1] == one.take_seeds and len(set(three.take_seeds)) == 3


def test_tasks_are_drawn_by_their_shares() -> None:
    tasks = [[SITS], [{"wait": 1}]]
    people = drawn(shot({"count": 400, "tasks": tasks, "shares": [3, 1]}))
    sitting = sum(isinstance(each.tasks[0], SitOn) for each in people)
    assert 0.7 < sitting / 400 < 0.8
    people = drawn(shot({"count": 50, "tasks": tasks, "shares": [0, 1]}))
    assert not any(isinstance(each.tasks[0], SitOn) for each in people)


@pytest.mark.parametrize(
    ("people", "words", "says"),
    [
        ({}, {"rooom": "x"}, "does not know 'rooom'; did you mean 'room'?"),
        ({}, {"room": 3}, 'has no room; write room = "cafe"'),
        ({}, {"people": []}, r"has no people; write \[\[people\]\]"),
        ({}, {"seconds": -1}, "'seconds' is -1; give a number from 0.1"),
        ({}, {"seed": "a"}, "The seed is a"),
        ({}, {"fewer": 1}, "'fewer' is 1; write true or false"),
        ({}, {"cast": {"file": "x"}}, "The cast does not know 'file'; did you mean 'files'?"),
        ({}, {"cast": {"files": [1]}}, "not paths"),
        ({}, {"rig": "Armature"}, "name the rig's file in the cast"),
        ({}, {"render": "framse"}, "did you mean 'frames'?"),
        ({"taks": []}, {}, "A group of people does not know 'taks'; did you mean 'tasks'?"),
        ({"tasks": [{"sit_om": "x"}]}, {}, "did you mean 'sit_on'?"),
        ({"tasks": []}, {}, "are not a list of tables"),
        ({"tasks": None}, {}, "has no tasks"),
        ({"count": 0}, {}, "a count that is 0"),
        ({"count": 2000}, {}, "a count that is 2000"),
        ({"height": [1.9, 1.5]}, {}, "put the smaller number first"),
        ({"height": [1, 2, 3]}, {}, "a 'height' of 3 numbers"),
        ({"height": "tall"}, {}, "a 'height' that is tall"),
        ({"start": [1]}, {}, "a start that is not a place"),
        ({"heading": "north"}, {}, "a heading that is north"),
        ({"tasks": [[SITS]], "shares": [1, 2]}, {}, "1 lists of tasks, but not as many shares"),
        ({"tasks": [[SITS]], "shares": [0]}, {}, "shares that are all 0"),
        ({"character": "Ann", "count": 2}, {}, "'Ann' 2 times; leave the count out"),
        ({"character": "Ann", "height": 1.8}, {}, "leave the height out"),
        ({"character": 3}, {}, "a character that is 3"),
    ],
)
def test_what_cannot_be_is_said_in_a_sentence(
    people: dict[str, Any], words: dict[str, Any], says: str
) -> None:
    with pytest.raises(InputError, match=says) as refused:
        shot({"tasks": [SITS], **people}, **words)
    sentence = str(refused.value)
    assert sentence.endswith((".", "?")) and "\n" not in sentence


def test_too_many_people_are_counted() -> None:
    with pytest.raises(InputError, match="The shot has 2,000 people; 1,000 are the most in one"):
        shot({"count": 1000, "tasks": [SITS]}, {"count": 1000, "tasks": [SITS]})
