"""What the sensor sees of boxes, meshes and moving furniture."""

import numpy as np
import pytest

from dafnet_addon.core.beginning import PREROLL
from dafnet_addon.core.conditions import shot_steps
from dafnet_addon.core.distance import prepared, scaled
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.grid import BAND
from dafnet_addon.core.occupancy import distance, occupancy, tops_under
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath, to_world
from dafnet_addon.core.rotations import rotate, transpose, yaw_matrix
from dafnet_addon.core.sensor import RADIUS, REACH, SPHERES, occupancy_of_distance
from dafnet_addon.core.solids import Box, Mesh, Scene, box_distance
from dafnet_addon.core.take import Controls

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])
GRID_ERROR = 0.18
"""1.3 cm between the nodes of a grid, in occupancy."""


def as_mesh(box):
    return Mesh(CUBE * box.half_size, TRIANGLES, box.matrices())


def walk(frames=40):
    t = np.linspace(0.0, 1.0, frames)
    position = np.stack([2.5 * t - 1.2, 0.4 * np.sin(4 * t), np.zeros(frames)], axis=1)
    return RootPath(position, 3.0 * t - 1.0)


def furniture():
    return [
        Box(
            np.array([0.5, 0.3, 0.25]),
            np.array([0.25, 0.3, 0.25]),
            yaw_matrix(np.array(0.6)),
            "stool",
        ),
        Box(np.array([-0.8, -0.5, 0.72]), np.array([0.6, 0.35, 0.02]), name="table top"),
        Box(np.array([1.5, 0.0, 1.0]), np.array([0.05, 1.5, 1.0]), name="wall"),
        Box(np.array([9.0, 9.0, 0.5]), np.array([0.5, 0.5, 0.5]), name="far away"),
    ]


def expected(boxes, path):
    centres = to_world(path, np.broadcast_to(SPHERES, (len(path), *SPHERES.shape)))
    found = [
        box_distance(rotate(transpose(box.rotation), centres - box.center), box.half_size)
        for box in boxes
    ]
    return occupancy_of_distance(np.min(found, axis=0))


def test_no_height_of_a_seat_looks_like_another():
    """Every centimetre is seen as one, between two layers of spheres as elsewhere."""
    over_it = RootPath(np.zeros((2, 3)), np.array([0.0, 0.1]))

    def seen(top):
        seat = Box(np.array([0.0, 0.0, top / 2]), np.array([0.25, 0.25, top / 2]))
        return occupancy(Scene((seat,)), over_it)[0]

    tops = [seen(top) for top in np.arange(0.25, 0.91, 0.01)]
    steps = np.abs(np.diff(tops, axis=0)).max(axis=1)
    assert steps.min() > 0.03


def test_boxes_are_exact():
    path = walk()
    found = occupancy(Scene(furniture()), path)
    assert found.shape == (40, 2640) and found.dtype == np.float32
    np.testing.assert_allclose(found, expected(furniture(), path), atol=1e-4)
    assert found.max() == 1.0 and 0.01 < (found > 0).mean() < 0.3


def test_meshes_see_what_their_boxes_see():
    path, boxes = walk(), furniture()
    from_meshes, exact = (
        occupancy(Scene([as_mesh(box) for box in boxes]), path),
        occupancy(Scene(boxes), path),
    )
    assert np.abs(from_meshes - exact).max() < GRID_ERROR
    assert np.abs(from_meshes - exact)[(from_meshes > 0) | (exact > 0)].mean() < 0.03


def test_an_empty_scene_is_empty():
    assert not occupancy(Scene(), walk()).any()
    assert (distance(Scene(), np.zeros((3, 5, 3)), 0.0) == BAND).all()


@pytest.mark.parametrize("make", [lambda box: box, as_mesh], ids=["box", "mesh"])
def test_furniture_that_moves_with_the_root_looks_as_if_both_stood(make):
    path = walk()
    box = furniture()[0]
    still = RootPath(np.broadcast_to(path.position[20], (40, 3)), np.full(40, path.yaw[20]))
    turn = path.rotation @ transpose(still.rotation)
    center = path.position + rotate(turn, box.center - still.position)
    moving = Box(center, box.half_size, turn @ box.rotation)
    before, after = occupancy(Scene([make(box)]), still), occupancy(Scene([make(moving)]), path)
    assert before.any()
    np.testing.assert_allclose(after, before, atol=1e-3)


def test_furniture_that_comes_is_seen_when_it_is_there():
    t = np.linspace(0.0, 1.0, 30)
    rolling = Box(np.stack([5 * t - 2.5, 0 * t, 0 * t + 0.4], axis=1), np.array([0.2, 0.2, 0.4]))
    still = RootPath(np.zeros((30, 3)), np.zeros(30))
    for solid in (rolling, as_mesh(rolling)):
        seen = occupancy(Scene([solid]), still).any(axis=1)
        np.testing.assert_array_equal(seen, np.abs(5 * t - 2.5) < 0.2 + REACH + RADIUS)


def test_floor_is_not_seen_and_follows_the_root_upstairs():
    slab = Box(np.array([0, 0, -0.1]), np.array([3.0, 3.0, 0.1]), name="slab")
    rug = Box(np.array([0, 0, 0.01]), np.array([0.5, 0.5, 0.01]), name="rug")
    step = Box(np.array([0.5, 0, 0.05]), np.array([0.2, 0.2, 0.05]), name="step")
    ground = walk(5)
    for make in (lambda box: box, as_mesh):
        assert not occupancy(Scene([make(slab), make(rug)]), ground).any()
        assert occupancy(Scene([make(slab), make(step)]), ground).any()
        upstairs = RootPath(ground.position + np.array([0, 0, 0.1]), ground.yaw)
        assert not occupancy(Scene([make(slab), make(step)]), upstairs).any()
        downstairs = RootPath(ground.position - np.array([0, 0, 0.5]), ground.yaw)
        assert occupancy(Scene([make(slab)]), downstairs).any()


def test_scaling_scene_and_path_scales_what_is_seen():
    path, boxes = walk(), furniture()
    large = RootPath(1.2 * path.position, path.yaw)
    for make in (lambda box: box, as_mesh):
        scene = Scene([make(box) for box in boxes])
        tall_world, _ = prepared(scaled(scene, 1.2), 0.0)
        found = occupancy(scaled(tall_world, 1 / 1.2), path)
        assert np.abs(found - occupancy(scene, path)).max() < GRID_ERROR
        assert np.abs(occupancy(tall_world, large) - found).max() > 0.5


@pytest.mark.parametrize("scale", [0.2, 0.5, 1.0, 2.05, 2.2, 3.0, 5.0, 10.0])
def test_a_character_of_any_size_sees_what_the_exact_boxes_are(scale):
    """The whole world grows with the character, so that all are told the same."""
    path, boxes = walk(), furniture()
    root = path.matrices()
    root[:, :3, 3] *= scale
    for make, tolerance in ((lambda box: box, 1e-4), (as_mesh, GRID_ERROR)):
        scene = scaled(Scene([make(box) for box in boxes]), scale)
        shot = run_to_end(shot_steps(scene, Controls(30.0, root, scale=scale)))
        exact = expected(boxes, shot.path)
        found = shot.conditions.occupancy[PREROLL:]
        assert np.abs(found - exact).max() < tolerance and found.max() == 1.0
        assert np.abs(found - exact)[exact > 0].mean() < 0.03
        points = np.random.default_rng(0).uniform([-1.5, -1.2, 0], [1.7, 1.2, 1.2], (40, 500, 3))
        apart = np.min(
            [box_distance((points - b.center) @ b.rotation, b.half_size) for b in boxes], axis=0
        )
        for measured in (shot.scene, shot.own_scene):
            # grids say no more of what is deeper inside
            near = np.maximum(distance(measured, points, 0.0), -BAND)
            np.testing.assert_allclose(near, np.clip(apart, -BAND, BAND), atol=0.013)


@pytest.mark.parametrize("scale", [0.2, 1.0, 4.0])
@pytest.mark.parametrize("make", [lambda box: box, as_mesh], ids=["box", "mesh"])
def test_the_own_scene_lies_where_furniture_is_at_the_own_frames(make, scale):
    fps, frames = 60.0, 81
    way = np.linspace(0.0, 1.0, frames)[:, None]
    moving = Box(
        scale * (np.array([0.6, -0.8, 0.4]) + way * (0.0, 1.6, 0.0)),
        scale * np.full(3, 0.3),
        np.eye(3),
        "trolley",
    )
    shot = run_to_end(
        shot_steps(
            Scene([make(moving)]), Controls(fps, np.tile(np.eye(4), (frames, 1, 1)), scale=scale)
        )
    )
    assert len(shot.own_path) == frames and len(shot.path) == 41
    points = np.array([0.6, 0.2, 0.4]) + np.zeros((frames, 1, 3))
    inside = np.where(distance(shot.own_scene, points, 0.0)[:, 0] < 0.0)[0]
    exact = np.where(box_distance(points[:, 0] - moving.center / scale, np.full(3, 0.3)) < 0.0)[0]
    assert abs(inside[0] - exact[0]) <= 1 and abs(inside[-1] - exact[-1]) <= 1


def test_frames_must_match():
    rolling = Box(np.zeros((7, 3)), np.ones(3), name="trolley")
    with pytest.raises(InputError, match=r"trolley.*7 frames"):
        occupancy(Scene([rolling]), walk(8))


def test_one_frame_is_enough():
    path = RootPath(np.zeros((1, 3)), np.zeros(1))
    np.testing.assert_allclose(
        occupancy(Scene(furniture()), path), expected(furniture(), path), atol=1e-4
    )


def test_distance_of_points_to_the_scene():
    boxes = furniture()
    points = np.random.default_rng(0).uniform([-1.5, -1.2, 0], [1.7, 1.2, 1.2], (4, 5000, 3))
    exact = np.min(
        [box_distance((points - b.center) @ b.rotation, b.half_size) for b in boxes], axis=0
    )
    np.testing.assert_allclose(
        distance(Scene(boxes), points, 0.0), np.minimum(exact, BAND), atol=1e-9
    )
    found = distance(Scene([as_mesh(box) for box in boxes]), points, np.zeros(4))
    np.testing.assert_allclose(found, np.clip(exact, -BAND, BAND), atol=0.013)
    assert (found < 0).any() and (found == BAND).any()


def test_far_points_are_free_however_small_the_world_was_made():
    stool = furniture()[0]
    scene, _ = prepared(Scene([as_mesh(stool)]), 0.0)
    points = np.random.default_rng(0).uniform([-1, -1, 0], [1, 1, 1], (1, 5000, 3))
    small = distance(scaled(scene, 0.5), points, 0.0)
    exact = box_distance((points - 0.5 * stool.center) @ stool.rotation, 0.5 * stool.half_size)
    assert (small[exact > 0.08] == BAND).mean() > 0.99
    near = exact < 0.07
    np.testing.assert_allclose(small[near], np.maximum(exact, -BAND / 2)[near], atol=0.013)


def _resting(places):
    return RootPath(np.array([[x, y, 0.0] for x, y in places], float), np.zeros(len(places)))


def test_tops_are_those_of_seats_whatever_they_are_made_of():
    # its top is at 0.465 m
    slab = Box(np.array([0.0, 0.0, 0.445]), np.array([0.22, 0.22, 0.02]), name="slab")
    path = _resting([(0.0, 0.0), (0.1, -0.05), (1.0, 0.0)])
    sheet = Mesh(
        np.array([(x, y, 0.52) for x in (-0.3, 0.3) for y in (-0.3, 0.3)]),
        np.array([(0, 1, 2), (1, 3, 2)]),
    )
    for solid, height, error in (
        (slab, 0.465, 1e-6),
        (as_mesh(slab), 0.465, 0.01),
        (sheet, 0.52, 0.015),
    ):
        scene, _ = prepared(Scene((solid,)), 0.0)
        tops = tops_under(scene, path)
        assert np.abs(tops[:2] - height).max() < error and np.isnan(tops[2])
    assert np.isnan(tops_under(Scene(), path)).all()


def test_tops_follow_a_moving_seat_and_an_upper_storey():
    path = RootPath(np.tile([0.0, 0.0, 3.0], (2, 1)), np.zeros(2))
    lift = Box(
        np.array([[0.0, 0.0, 3.2], [0.0, 0.0, 3.3]]),
        np.array([0.3, 0.3, 0.2]),
        np.tile(np.eye(3), (2, 1, 1)),
    )
    assert np.allclose(tops_under(Scene((lift,)), path), [3.4, 3.5])
    walls = Box(np.array([0.0, 0.0, 4.5]), np.array([0.5, 0.5, 1.5]), name="a pillar one stands in")
    assert (
        np.isnan(tops_under(Scene((walls,)), path)).all()
        or (tops_under(Scene((walls,)), path) > 3.85).all()
    )
