"""People who are sent to seats in rooms as they are arranged: at tables, in rows, before a bar."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.arranged import SCENES, asked_of, seats_asked, sent_to
from benchmarks.marks import cuts, nearest_mark
from dafnet_addon import InputError, Scene
from dafnet_addon.core.distance import scaled
from dafnet_addon.core.paths import Stop
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import forward_of
from dafnet_addon.director.approach import Tucked, walk_to_seat
from dafnet_addon.director.room import Room
from dafnet_addon.director.seats import seats_of
from kit.places import LIBRARY

pytestmark = [pytest.mark.furniture, pytest.mark.slow]


@pytest.mark.parametrize("name", SCENES)
def test_everybody_comes_to_his_seat_through_nothing(name: str) -> None:
    made = SCENES[name](LIBRARY)
    for asked, start in asked_of(made):
        room, route, seat, out = sent_to(made, asked, start)
        points = np.concatenate(list(run_to_end(room.surfaces()).values()))
        off = nearest_mark(seat, asked.marks)
        assert off.right, (asked.name, start, off)
        there = replace(seat, position=seat.position - out * forward_of(seat.yaw))
        assert cuts(points, route.path, there) == 0, (asked.name, start)
        if "dining" in name:
            least, most = {"55": (0.0, 0.1), "30": (0.2, 0.4), "12": (0.35, 0.55)}[name[8:10]]
            assert least <= out <= most, "a tucked chair is pulled out as far as one needs"


def test_a_tucked_chair_says_what_stands_over_it_and_how_far_it_has_to_come_out() -> None:
    made = SCENES["dining, 12 cm out"](LIBRARY)
    room, asked = made.room(), made.asked[0]
    seats = seats_asked(room, asked, made.starts[0])
    with pytest.raises(Tucked, match=r"'Table' stands where .* pull 'Chair 0' out by \d+ cm"):
        walk_to_seat(room, room.pieces()[asked.name], Stop(made.starts[0], 0.0), seats)


def test_who_cannot_come_to_a_seat_is_told_before_anything_is_made() -> None:
    made = SCENES["toilet"](LIBRARY)
    made.box("Door", (-0.65, -1.35, 0.0), (0.65, -1.3, 2.2))
    room, asked = made.room(), made.asked[0]
    seats = seats_asked(room, asked, made.starts[0])
    with pytest.raises(InputError, match=r"no way between the furniture|stands where one comes"):
        walk_to_seat(room, room.pieces()[asked.name], Stop(made.starts[0], 0.0), seats)


@pytest.mark.parametrize(
    ("name", "seat", "start", "said"),
    [
        ("car", "Seat Left", 1, "'Roof' is too low to stand under where one comes to sit on 'Seat"),
        ("stairs", "Stairs", 0, "Parts of 'Stairs' itself are in the way .* with the 3D cursor"),
    ],
)
def test_for_so_tall_a_person_it_is_said_what_does_not_help_either(
    name: str, seat: str, start: int, said: str
) -> None:
    """1.90 m: whose head meets the roof, and whose seat is a step that has to be climbed to; nobody
    is asked to pull those out.
    """
    made, size = SCENES[name](LIBRARY), 1.90 / 1.75
    room = Room(scaled(Scene(made.room().solids), 1.0 / size).solids)
    own, here = room.pieces()[seat], np.array(made.starts[start]) / size
    seats = seats_of(own.solids, here, 0.0, seat)
    with pytest.raises(InputError, match=said) as raised:
        walk_to_seat(room, own, Stop(tuple(here), 0.0), seats, size=size)
    assert not isinstance(raised.value, Tucked)
