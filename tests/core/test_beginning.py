"""How a shot begins where nobody says what was before: who is over a seat has sat down on it."""

import numpy as np
import pytest

from dafnet_addon import Box, Controls, Mesh, Scene, generate, load_weights
from dafnet_addon.core.beginning import PREROLL, Beginning, beginning_at
from dafnet_addon.core.conditions import Shot, shot_steps
from dafnet_addon.core.live import Lead, LiveBody, Surroundings
from dafnet_addon.core.occupancy import occupancy
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.sensor import SPHERES
from dafnet_addon.core.skeleton import PELVIS
from dafnet_addon.core.softness import OVER_HARD
from dafnet_addon.core.solids import BOX_CORNERS, BOX_TRIANGLES

HERE = RootPath(np.zeros((1, 3)), np.zeros(1))


def _box(low, high, name="Seat") -> Box:
    low, high = np.array(low, float), np.array(high, float)
    return Box((low + high) / 2, (high - low) / 2, name=name)


def _seat(top: float = 0.45, bottom: float = 0.0) -> Box:
    return _box((-0.22, -0.22, bottom), (0.22, 0.22, top))


TABLE = _box((-0.6, 0.25, 0.70), (0.6, 1.1, 0.74), "Table")


def _begun(*solids: Box | Mesh) -> Beginning:
    scene = Scene(solids)
    return beginning_at(scene, HERE, occupancy(scene, HERE)[0])


def _still(frames: int = 60, **more: object) -> Controls:
    root = RootPath(np.zeros((frames, 3)), np.zeros(frames)).matrices()
    return Controls(fps=30, root=root, **more)  # type: ignore[arg-type]


def _shot(scene: Scene, controls: Controls) -> Shot:
    return run_to_end(shot_steps(scene, controls))


def _came(begun: Beginning) -> bool:
    return bool(np.ptp(begun.path.position, axis=0).max() > 0.1)


def test_who_is_over_a_seat_came_to_it_from_in_front_and_sat_down():
    begun = _begun(_seat())
    assert len(begun.path) == len(begun.occupancy) == PREROLL
    forward = begun.path.position[:, 1]
    assert forward[0] > 0.25 and (np.diff(forward) < 1e-9).all()
    assert np.allclose(begun.path.position[begun.arrives + 6 :], 0.0, atol=1e-3)
    # at first the seat is behind him
    ahead = SPHERES[:, 1] > 0.1
    assert not begun.occupancy[0, ahead].any() and begun.occupancy[-1, ahead].any()


def test_he_turns_with_his_root():
    scene, there = Scene((_seat(),)), RootPath(np.zeros((1, 3)), np.array([np.pi / 2]))
    begun = beginning_at(scene, there, occupancy(scene, there)[0])
    assert begun.path.position[0, 0] < -0.25  # a yaw of 90 degrees looks along -x
    assert np.allclose(begun.path.position[:, 1], 0.0, atol=1e-9)


def test_a_table_was_drawn_up_afterwards():
    alone, at_table = _begun(_seat()), _begun(_seat(), TABLE)
    assert np.array_equal(alone.path.position, at_table.path.position)
    assert np.array_equal(alone.occupancy, at_table.occupancy)


def test_who_stands_with_the_calves_against_a_seat_stood_there():
    behind = _box((-0.22, -0.46, 0.0), (0.22, -0.02, 0.45))
    assert not _came(_begun(behind)) and not _begun(behind).occupancy.any()
    deeper = _box((-0.22, -0.38, 0.0), (0.22, 0.08, 0.45))
    assert _came(_begun(deeper)), "on its edge"


@pytest.mark.parametrize("top", np.arange(0.25, 0.9, 0.03))
def test_seats_of_every_height_are_seats_however_thin(top):
    assert _came(_begun(_seat(top, bottom=top - 0.04)))


def test_seats_of_slats_are_seats():
    slats = [
        _box((-0.3, y, 0.40), (0.3, y + 0.05, 0.43), f"Slat {y:.2f}")
        for y in np.arange(-0.22, 0.2, 0.08)
    ]
    assert _came(_begun(*slats))


def test_who_is_beside_furniture_stood_there_and_saw_nothing_of_it():
    begun = _begun(_box((-0.5, 0.2, 0.0), (0.5, 0.8, 0.74)))
    assert not _came(begun) and not begun.occupancy.any() and begun.arrives == 0


def test_where_the_piece_leaves_no_room_to_stand_he_always_sat():
    corners, triangles = [], []
    for k, box in enumerate((_seat(), TABLE)):
        corners.append(BOX_CORNERS * box.half_size + box.center)
        triangles.append(BOX_TRIANGLES + 8 * k)
    room = Mesh(np.concatenate(corners), np.concatenate(triangles), name="Room")
    begun = _begun(room)
    assert not _came(begun) and begun.arrives == 0
    assert np.array_equal(begun.occupancy[0], occupancy(Scene((room,)), HERE)[0])


def test_a_seat_that_drives_off_stood_where_it_is_at_first():
    drives = np.tile([0.0, 0.0, 0.225], (60, 1))
    drives[:, 1] += np.linspace(0.0, 3.0, 60)
    moving = Box(drives, np.array([0.22, 0.22, 0.225]), name="Seat")
    controls = Controls(fps=30, root=RootPath(drives * (1, 1, 0), np.zeros(60)).matrices())
    found = _shot(Scene((moving,)), controls).conditions.occupancy[:PREROLL]
    assert np.allclose(found, _begun(_seat()).occupancy, atol=0.02)


def test_nothing_is_asked_before_he_has_arrived():
    hand = np.tile([0.2, 0.4, 0.8], (60, 1))
    given = _shot(Scene((_seat(),)), _still(mode="EE", hand_right=hand)).conditions.given
    arrives = _begun(_seat()).arrives
    assert not given[:arrives].any() and given[arrives:].any(axis=1).all()


def test_what_was_before_is_as_it_is_said():
    stands = generate(Scene(), _still(), load_weights())
    told = _still(before=stands.joints, before_root=stands.root)
    shot = _shot(Scene((_seat(),)), told)
    assert np.allclose(shot.conditions.velocity[:PREROLL], 0.0)
    assert np.array_equal(shot.conditions.occupancy[0], shot.conditions.occupancy[PREROLL])


@pytest.mark.parametrize("table", [False, True])
def test_he_sits_where_the_seat_carries_him(table):
    weights = load_weights()
    for height in (0.40, 0.45, 0.50):
        scene = Scene((_seat(height), *([TABLE] if table else [])))
        take = generate(scene, _still(), weights)
        over = np.median(take.joints[15:, PELVIS, 2]) - height
        assert abs(over - OVER_HARD) < 0.07


def test_live_begins_so_as_well():
    weights = load_weights()
    sampler = Sampler(weights)
    body = LiveBody(sampler, Surroundings(Scene((_seat(),)), 0.0), Lead(np.zeros(3), 0.0))
    places = np.array([frame.position for frame in body.memory])
    assert places[0, 1] > 0.25 and np.allclose(places[-1], 0.0, atol=1e-3)
    assert abs(body.frame.joints[PELVIS, 2] - 0.45 - OVER_HARD) < 0.07
