"""Tasks: what can be said, in Python and as plain data, and what is said of what cannot."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon import InputError
from dafnet_addon.director.room import Room, meant
from dafnet_addon.director.task_lists import plain_tasks, read_task_file, tasks_from
from dafnet_addon.director.tasks import (
    VERBS,
    LieOn,
    LookAt,
    Reach,
    SitOn,
    StandUp,
    Wait,
    WalkAlong,
    WalkTo,
    WorkAt,
    WriteOn,
    options,
    said,
)
from kit.rooms import chair, office

TOML = """
tasks = [
    { walk_to = [1.5, -2], facing = "Lamp" },
    { walk_along = "Path", speed = 0.8 },
    { sit_on = "Chair.*", seconds = 4, choose = "random" },
    { work_at = "Desk", how = "writing", hand = "left" },
    { stand_up = 1 },
    { write_on = "Whiteboard", near = [0.5, 3] },
    { reach = [2, 0, 1.1], hand = "left" },
    { look_at = "Lamp" },
    { lie_on = "Bed", seconds = 3 },
    { wait = 2.5 },
]
"""
TASKS = (
    WalkTo((1.5, -2.0), facing="Lamp"),
    WalkAlong("Path", speed=0.8),
    SitOn("Chair.*", seconds=4.0, choose="random"),
    WorkAt("Desk", how="writing", hand="left"),
    StandUp(1.0),
    WriteOn("Whiteboard", near=(0.5, 3.0)),
    Reach((2.0, 0.0, 1.1), hand="left"),
    LookAt("Lamp"),
    LieOn("Bed", seconds=3.0),
    Wait(2.5),
)


def test_a_file_says_what_python_says(tmp_path: Path) -> None:
    assert tasks_from(tomllib.loads(TOML)["tasks"]) == TASKS
    assert {type(task) for task in TASKS} == set(VERBS.values()), "every verb"
    for name, text in (("a.toml", TOML), ("a.json", json.dumps({"tasks": plain_tasks(TASKS)}))):
        (tmp_path / name).write_text(text, encoding="utf-8")
        assert read_task_file(tmp_path / name) == TASKS


def test_plain_data_leaves_out_what_is_as_it_is_by_default() -> None:
    assert plain_tasks([SitOn("Chair"), StandUp(), Wait(1)]) == [
        {"sit_on": "Chair"},
        {"stand_up": 0.5},
        {"wait": 1.0},
    ]


def test_a_list_in_a_panel_can_be_made_of_the_options() -> None:
    """Each is named, has a default but for what the verb is about, and means the same anywhere."""
    for kind in VERBS.values():
        about, *others = options(kind)
        assert about.name and all(hasattr(kind, option.name) for option in others)


def test_tasks_are_told_in_words() -> None:
    assert [said(task) for task in TASKS] == [
        "walk to (1.5, -2)",
        "walk along Path",
        "sit on Chair.*",
        "work at Desk",
        "stand up",
        "write on Whiteboard",
        "reach (2, 0, 1.1)",
        "look at Lamp",
        "lie on Bed",
        "wait 2.5 s",
    ]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({}, "not a list of tables"),
        ([], "not a list of tables"),
        (["sit_on"], "Task 1 is not a table with a verb"),
        ([{"sit_onn": "Chair"}], "'sit_onn'; did you mean 'sit_on'?"),
        ([{"wait": 1}, {"sit_on": "A", "secnds": 3}], "Task 2, 'sit_on', .*mean 'seconds'?"),
        ([{"sit_on": "A", "wait": 3}], "both 'sit_on' and 'wait'; make two tasks"),
        ([{"sit_on": "A", "hand": "left"}], "does not know 'hand'; known are"),
        ([{"sit_on": 3}], "'on' of 'sit_on' is 3; give the name"),
        ([{"sit_on": " "}], "give the name"),
        ([{"sit_on": "A", "seconds": -1}], "-1; give a number from 0 to 3600 seconds"),
        ([{"stand_up": True}], "is True; give a number"),
        ([{"work_at": "A", "how": "typin"}], "'typin'; did you mean 'typing'?"),
        ([{"reach": "A", "hand": "both"}], "'both'; known are 'left', 'right'"),
        ([{"walk_to": [1]}], "not a place; give two numbers"),
        ([{"walk_to": [1, "x"]}], "not a place; give two numbers"),
        ([{"look_at": [1, 2]}], "not a place; give three numbers"),
        ([{"walk_to": [1, float("nan")]}], "not a place"),
        ([{"walk_along": [[1, 2]]}], "not a line; give at least two places"),
        ([{"walk_to": "A", "facing": 400}], "from -360 to 360 degrees"),
        ([{"sit_on": "A", "lean": 60}], "from -20 to 35 degrees"),
        ([{"walk_to": "A", "speed": 9}], "from 0.4 to 2.5 metres a second"),
    ],
)
def test_what_cannot_be_is_said_with_the_nearest_known(data: object, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        tasks_from(data)
    assert str(caught.value).count("\n") == 0


def test_files_of_something_else_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "tasks.toml"
    for text, words in (
        ("tasks = [", "is not TOML"),
        ("task = []", "has no 'tasks'"),
        ("tasks = []\ntaks = 1", "does not know 'taks'; did you mean 'tasks'?"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_task_file(file)
    with pytest.raises(InputError, match="cannot be read"):
        read_task_file(tmp_path / "none.toml")


def test_names_patterns_and_groups_mean_furniture() -> None:
    room = office()
    assert [piece.name for piece in room.named("Chair")] == ["Chair"]
    assert [piece.name for piece in room.named("Chair.*")] == ["Chair", "Chair.001", "Chair.002"]
    assert [piece.name for piece in room.named("*board")] == ["Whiteboard"]
    assert [piece.name for piece in room.named("Seats")] == ["Chair.001", "Chair.002"]
    assert len(room.named("Chair")[0].solids) == 2, "seat and back are one piece"
    assert meant("Chair[1]", ["Chair[1]", "Chair1"]) == ["Chair[1]"], "a name before a pattern"
    with pytest.raises(InputError, match=r"'Chiar' is not the name of any furniture.*mean 'Chair'"):
        room.named("Chiar")
    (lamp,) = room.things("Lamp")
    assert np.array_equal(lamp, (2.0, -2.0, 1.5))


def test_parts_belong_to_their_piece() -> None:
    seat, back = chair("Seat")[0], chair("Back")[1]
    room = Room([seat, back], parts={"Back": "Seat"})
    assert list(room.pieces()) == ["Seat"] and len(room.named("Seat")[0].solids) == 2
