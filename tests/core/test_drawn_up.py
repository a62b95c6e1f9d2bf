"""A table is drawn up to one who sits: while he sits down or gets up he has room."""

import numpy as np
import pytest

from dafnet_addon import Box, Controls, Mesh, Scene, load_weights
from dafnet_addon.core import drawing
from dafnet_addon.core.beginning import PREROLL
from dafnet_addon.core.conditions import shot_steps
from dafnet_addon.core.drawn_up import in_frames_of, seen_while_sitting_down
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.generate import takes_steps
from dafnet_addon.core.occupancy import occupancy
from dafnet_addon.core.passage import seats_along
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.sensor import SPHERES
from dafnet_addon.core.skeleton import PELVIS
from dafnet_addon.core.solids import BOX_CORNERS, BOX_TRIANGLES

AHEAD = (SPHERES[:, 1] > 0.2) & (SPHERES[:, 1] < 0.6) & (np.abs(SPHERES[:, 0]) < 0.3)
AT_TOP = AHEAD & (np.abs(SPHERES[:, 2] - 0.71) < 0.05)
"""Where who sits sees the top of the table before him."""


def _box(low, high, name) -> Box:
    low, high = np.array(low, float), np.array(high, float)
    return Box((low + high) / 2, (high - low) / 2, name=name)


SEAT = _box((-0.22, -0.22, 0.0), (0.22, 0.22, 0.45), "Chair")
BACK = _box((-0.22, -0.26, 0.45), (0.22, -0.22, 0.9), "Back")


def _table(edge: float) -> Box:
    return _box((-0.8, edge, 0.70), (0.8, edge + 0.8, 0.74), "Table")


CAME = route(
    Stop((-2.0, 0.3), -np.pi / 2, 0.5),
    Stop((0.0, 0.0), 0.0, 3.0, seated=True, before=0.3),
    Stop((2.0, 0.3), -np.pi / 2, 0.5),
)
REST = CAME.rests[1]


def _seen(*solids: Box) -> np.ndarray:
    scene, path = Scene(solids), CAME.path
    seats = seats_along(scene, path, 30.0)
    return seen_while_sitting_down(scene, path, seats, occupancy(scene, path))


def test_a_table_that_leaves_no_room_is_there_only_while_he_sits():
    seen = _seen(SEAT, BACK, _table(0.35))[:, AT_TOP].max(axis=1)
    assert not seen[REST.start - 40 : REST.start].any()
    assert (seen[REST.start + 30 : REST.stop - 30] > 0.5).all()
    assert not seen[REST.stop : REST.stop + 30].any()


def test_the_seat_itself_is_always_there():
    with_table, alone = _seen(SEAT, BACK, _table(0.35)), occupancy(Scene((SEAT,)), CAME.path)
    assert (with_table >= alone - 1e-6).all()


def test_a_table_that_leaves_room_is_there_all_along():
    scene = Scene((SEAT, BACK, _table(0.9)))
    everything = occupancy(scene, CAME.path)
    seats = seats_along(scene, CAME.path, 30.0)
    assert seen_while_sitting_down(scene, CAME.path, seats, everything) is everything


def test_of_a_room_in_one_mesh_what_is_before_the_seat_is_drawn_up():
    solids = (SEAT, BACK, _table(0.35))
    corners = np.concatenate([s.center + BOX_CORNERS * s.half_size for s in solids])
    triangles = np.concatenate([BOX_TRIANGLES + 8 * k for k in range(len(solids))])
    room = Mesh(vertices=corners, triangles=triangles, name="Room")
    seen, apart = (_seen(*each)[: REST.stop + 30] for each in ((room,), solids))
    before = slice(REST.start - 40, REST.start)
    everything = occupancy(Scene((room,)), CAME.path)
    assert seen[before, AT_TOP].sum() < 0.2 * everything[before, AT_TOP].sum()
    assert (seen[REST.start + 30 : REST.stop - 30, AT_TOP].max(axis=1) > 0.5).all()
    assert np.abs(seen - apart)[REST.start : REST.stop].mean() < 0.02, "the chair stays"


def test_a_bar_that_is_solid_to_the_floor_is_there_all_along():
    bar = _box((-0.8, 0.35, 0.0), (0.8, 1.15, 0.74), "Bar")
    scene = Scene((SEAT, BACK, bar))
    everything = occupancy(scene, CAME.path)
    seats = seats_along(scene, CAME.path, 30.0)
    assert seen_while_sitting_down(scene, CAME.path, seats, everything) is everything


def test_who_walks_by_without_sitting_sees_all():
    past = route(Stop((-2.0, 0.6), -np.pi / 2, 0.5), Stop((2.0, 0.6), -np.pi / 2, 0.5)).path
    scene = Scene((SEAT, BACK, _table(0.35)))
    everything = occupancy(scene, past)
    seats = seats_along(scene, past, 30.0)
    assert seen_while_sitting_down(scene, past, seats, everything) is everything


def test_what_moves_meanwhile_is_seen_where_it_is():
    along = np.tile([0.0, -1.0, 0.5], (len(CAME.path), 1))
    along[:, 0] = np.linspace(-2.0, 2.0, len(along))
    cart = Box(along, np.array([0.2, 0.2, 0.5]), name="Cart")
    seen, of_cart = _seen(SEAT, _table(0.35), cart), occupancy(Scene((cart,)), CAME.path)
    assert of_cart[REST.start - 30 : REST.start].any()
    assert (seen >= of_cart - 1e-6).all()


def test_who_goes_from_seat_to_seat_sees_the_table_of_neither():
    def place(x: float) -> tuple[Box, ...]:
        table = _box((x - 0.6, 0.35, 0.70), (x + 0.6, 1.15, 0.74), "Table")
        return _box((x - 0.22, -0.22, 0.0), (x + 0.22, 0.22, 0.45), "Chair"), table

    across = np.concatenate([np.zeros(40), np.linspace(0.0, 1.6, 62)[1:-1], np.full(60, 1.6)])
    path = RootPath(across[:, None] * np.eye(3)[0], np.zeros(len(across)))
    scene = Scene((*place(0.0), *place(1.6)))
    seats = seats_along(scene, path, 30.0)
    assert len(seats) == 2
    everything = occupancy(scene, path)
    both = seen_while_sitting_down(scene, path, seats, everything)
    apart = [seen_while_sitting_down(scene, path, [seat], everything) for seat in seats]
    assert np.array_equal(both, np.minimum(*apart))
    assert both[70].sum() < 0.9 * min(each[70].sum() for each in apart)


def test_a_solid_in_some_of_its_frames():
    center = np.arange(30.0).reshape(10, 3)
    moving = Box(center, np.ones(3), name="Cart")
    assert np.array_equal(in_frames_of(moving, slice(2, 5)).center, center[2:5])
    assert np.array_equal(in_frames_of(moving, 4).center, center[4])
    assert in_frames_of(SEAT, 4) is SEAT


@pytest.mark.parametrize("temperature", [0.0, 1.0])
def test_he_sits_down_at_a_table(temperature, monkeypatch):
    """Drawn once, with any seed."""
    monkeypatch.setattr(drawing, "_AGAIN", 0)
    scene = Scene((SEAT, BACK, _table(0.35)))
    draws = [Draw(seed, temperature=temperature) for seed in range(4 if temperature else 1)]
    controls = Controls(fps=30, root=CAME.path.matrices())
    for take in run_to_end(takes_steps(scene, controls, load_weights(), draws)):
        assert np.median(take.joints[REST.start + 15 : REST.stop, PELVIS, 2]) < 0.70


def test_the_network_is_told_so():
    scene = Scene((SEAT, BACK, _table(0.35)))
    shot = run_to_end(shot_steps(scene, Controls(fps=30, root=CAME.path.matrices())))
    told = shot.conditions.occupancy[PREROLL:]
    assert not told[REST.start, AT_TOP].any() and told[REST.start + 30, AT_TOP].any()


def test_frames_of_the_path_stay_as_they_are():
    path = RootPath(CAME.path.position.copy(), CAME.path.yaw.copy())
    scene = Scene((SEAT, _table(0.35)))
    everything = occupancy(scene, path)
    kept = everything.copy()
    seen_while_sitting_down(scene, path, seats_along(scene, path, 30.0), everything)
    assert np.array_equal(everything, kept)
