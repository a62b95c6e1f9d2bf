"""People who are sent to seats in rooms as they are arranged: at tables, in rows, before a bar."""

from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import InputError, Mesh
from dafnet_addon.core.paths import Route, Stop
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import forward_of
from dafnet_addon.director.approach import Tucked, walk_to_seat
from dafnet_addon.director.places import before_a_top
from dafnet_addon.director.room import Room
from dafnet_addon.director.seats import SeatPlace, seats_of
from kit.arranged import SCENES, Arranged, Asked, Place, asked_of
from kit.marks import cuts, nearest_mark

pytestmark = [pytest.mark.furniture, pytest.mark.slow]


def _seats(room: Room, asked: Asked, start: Place) -> list[SeatPlace]:
    own = room.pieces()[asked.name]
    near = None if asked.near is None else np.array(asked.near)
    seats = seats_of(own.solids, np.array(start), 0.0, asked.name, near)
    if near is None and not seats[0].back:
        top = run_to_end(before_a_top(room, own, seats[0]))
        seats = seats if top is None else seats_of(own.solids, top, 0.0, asked.name)
    return seats


def _sent(made: Arranged, asked: Asked, start: Place) -> tuple[Room, Route, SeatPlace, float]:
    """Send somebody to a seat, which is pulled out where it is tucked under something; by how
    much.
    """
    room = made.room()
    seats, here = _seats(room, asked, start), Stop(start, 0.0, 0.2)
    try:
        route, seat = walk_to_seat(room, room.pieces()[asked.name], here, seats)
        return room, route, seat, 0.0
    except Tucked as error:
        offset = -error.out * forward_of(seats[0].yaw)
        shift = np.eye(4)
        shift[:2, 3] = offset
        room = Room(
            tuple(
                replace(solid, matrix=shift @ solid.matrix)
                if isinstance(solid, Mesh) and solid.name == asked.name
                else solid
                for solid in made.solids
            )
        )
        moved = replace(seats[0], position=seats[0].position + offset)
        route, seat = walk_to_seat(room, room.pieces()[asked.name], here, [moved])
        return room, route, replace(seat, position=seat.position - offset), error.out


@pytest.mark.parametrize("name", SCENES)
def test_everybody_comes_to_his_seat_through_nothing(name: str) -> None:
    made = SCENES[name]()
    for asked, start in asked_of(made):
        room, route, seat, out = _sent(made, asked, start)
        points = np.concatenate(list(run_to_end(room.surfaces()).values()))
        off = nearest_mark(seat, asked.marks)
        assert off.right, (asked.name, start, off)
        there = replace(seat, position=seat.position - out * forward_of(seat.yaw))
        assert cuts(points, route.path, there) == 0, (asked.name, start)
        if "dining" in name:
            least, most = {"55": (0.0, 0.1), "30": (0.2, 0.4), "12": (0.35, 0.55)}[name[8:10]]
            assert least <= out <= most, "a tucked chair is pulled out as far as one needs"


def test_a_tucked_chair_says_what_stands_over_it_and_how_far_it_has_to_come_out() -> None:
    made = SCENES["dining, 12 cm out"]()
    room, asked = made.room(), made.asked[0]
    seats = _seats(room, asked, made.starts[0])
    with pytest.raises(Tucked, match=r"'Table' stands where .* pull 'Chair 0' out by \d+ cm"):
        walk_to_seat(room, room.pieces()[asked.name], Stop(made.starts[0], 0.0), seats)


def test_who_cannot_come_to_a_seat_is_told_before_anything_is_made() -> None:
    made = SCENES["toilet"]()
    made.box("Door", (-0.65, -1.35, 0.0), (0.65, -1.3, 2.2))
    room, asked = made.room(), made.asked[0]
    seats = _seats(room, asked, made.starts[0])
    with pytest.raises(InputError, match=r"no way between the furniture|stands where one comes"):
        walk_to_seat(room, room.pieces()[asked.name], Stop(made.starts[0], 0.0), seats)
