"""Where the director lets people sit and lie on real furniture, beside where a person marks it."""

import numpy as np
import pytest

from benchmarks.marks import MARKS, measured, others, piece
from dafnet_addon import InputError, Mesh
from dafnet_addon.core.rotations import rotate, yaw_matrix
from dafnet_addon.director.beds import bed_of
from dafnet_addon.director.room import Piece
from dafnet_addon.director.seats import NoSeat, seat_of
from kit.places import LIBRARY

pytestmark = pytest.mark.furniture

_SEATS = {"armchair", "bed", "bench", "chair", "sofa", "stool", "toilet"}


def test_every_piece_that_one_can_sit_on_is_marked() -> None:
    assert not [name for name in others(LIBRARY) if name.split("_")[0] in _SEATS]
    for name, mark in MARKS.items():
        assert mark["seats"] or mark["refusal"], name
        assert piece(LIBRARY, name).vertices[:, 2].max() > 0.2


@pytest.mark.slow
def test_people_sit_where_a_person_marks_it_and_the_way_there_cuts_nothing() -> None:
    found = measured(LIBRARY, sorted(MARKS))
    wrong = {where: each for where, each in found.items() if not each.right}
    assert len(wrong) <= 0.03 * len(found), wrong
    refused = [where for where, each in found.items() if each.refused and not each.agreed]
    assert not refused, "nobody is refused whom a person would let sit"
    backs = [
        each.off
        for (name, _), each in found.items()
        if name.split("_")[0] in ("chair", "sofa", "toilet") and each.off
    ]
    assert np.mean([off.turn <= 20.0 for off in backs]) > 0.98, "nobody faces backwards"
    depths = np.abs([off.depth for off in backs])
    assert np.median(depths) < 4.0 and np.mean(depths < 10.0) > 0.98


@pytest.mark.parametrize("name", ["table_013", "table_011", "desk_003", "table_002"])
def test_tables_are_not_sat_on_unless_they_are_asked_for(name: str) -> None:
    table = piece(LIBRARY, name, "Piece" if name != "table_011" else "Coffee Table")
    with pytest.raises(NoSeat, match="is a table; choose a seat"):
        seat_of([table], np.array([0.0, -3.0]), name=table.name)
    asked = seat_of([table], np.array([0.0, -3.0]), name=table.name, tables=True)
    top = float(np.percentile(table.vertices[:, 2], 99))
    assert abs(asked.height - top) < 0.05 and not asked.back


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 180.0])
def test_nobody_sits_across_the_footstool_of_an_armchair(degrees: float) -> None:
    chair = piece(LIBRARY, "armchair_015", "Piece")
    turned = rotate(yaw_matrix(np.array(np.radians(degrees))), chair.vertices)
    with pytest.raises(NoSeat, match="The footrest of 'Piece' is where one comes to sit; take it"):
        seat_of([Mesh(turned, chair.triangles)], np.array([0.8, -3.2]), name="Piece")


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, mark in MARKS.items() if name.startswith("bed")])
def test_people_lie_along_the_beds_line_with_the_head_where_the_pillow_is(name: str) -> None:
    mesh: Mesh = piece(LIBRARY, name, "Bed")
    try:
        beds = bed_of(Piece("Bed", (mesh,)), np.array([2.6, -1.0]), 0.0)
    except InputError:
        assert "refusal" in MARKS[name]
        return
    off = []
    for mark in MARKS[name]["lies"]:
        head, feet = (np.array([np.mean(at) for at in mark[end]]) for end in ("head", "feet"))
        along = (feet - head) / np.linalg.norm(feet - head)
        turn = np.arccos(np.clip(along @ [-np.sin(beds[0].yaw), np.cos(beds[0].yaw)], -1, 1))
        off.append((float(turn), beds[0].position * 100.0, head, feet, along))
    turn, place, head, feet, along = min(off, key=lambda each: each[0])
    assert np.degrees(turn) < 20.0
    assert (place - head) @ along > 62.0 and (feet - place) @ along > 60.0, "head and feet on it"
