"""The director: seats found on meshes and scans, ways round furniture, and that who is sent to a
seat sits on it.
"""

from itertools import pairwise
from time import process_time

import numpy as np
import pytest

from dafnet_addon import Box, Controls, InputError, Mesh, Scene, generate, load_weights
from dafnet_addon.core.passage import met_along
from dafnet_addon.core.paths import Stop
from dafnet_addon.core.rotations import rotate, yaw_matrix
from dafnet_addon.core.skeleton import SEAT_TO_PELVIS
from dafnet_addon.director.seats import on_a_seat, seat_of
from dafnet_addon.director.surfaces import height_field, surface_points
from dafnet_addon.director.walks import unit_doubt, walk_to, way_round
from kit.places import FURNITURE


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Box:
    a, b = np.array(low), np.array(high)
    return Box((a + b) / 2, (b - a) / 2)


def _turned(boxes: list[Box], angle: float, place: tuple[float, float]) -> list[Box]:
    turn = yaw_matrix(np.array(angle))
    return [Box(rotate(turn, b.center) + np.array([*place, 0.0]), b.half_size, turn) for b in boxes]


def _chair(height: float = 0.45, arms: bool = False) -> list[Box]:
    """A chair that looks along +y: its seat, its back at y = -0.22, perhaps arms."""
    boxes = [_box((-0.22, -0.22, height - 0.05), (0.22, 0.22, height))]
    boxes.append(_box((-0.22, -0.26, height), (0.22, -0.22, height + 0.4)))
    if arms:
        boxes += [_box((x, -0.22, height), (x + 0.05, 0.15, height + 0.2)) for x in (-0.27, 0.22)]
    return boxes


def test_surface_points_are_dense_and_on_the_surface():
    block = _box((0.0, 0.0, 0.0), (0.5, 0.3, 0.4))
    points = surface_points([block], 0.05)
    assert ((points >= -1e-9) & (points <= np.array([0.5, 0.3, 0.4]) + 1e-9)).all()
    top = points[points[:, 2] > 0.399, :2]
    grid = np.stack(np.meshgrid(np.linspace(0, 0.5, 20), np.linspace(0, 0.3, 20)), -1).reshape(
        -1, 2
    )
    assert np.linalg.norm(grid[:, None] - top, axis=-1).min(1).max() < 0.05
    assert surface_points([], 0.05).shape == (0, 3)
    field = height_field(points, np.zeros(2), np.array([1.0, 1.0]), 0.05)
    assert np.isclose(field.top[2, 2], 0.4) and np.isneginf(field.top[-1, -1])


@pytest.mark.parametrize("angle", [0.0, 0.6, np.pi / 2, -2.5])
@pytest.mark.parametrize("arms", [False, True])
def test_one_sits_before_a_back_and_looks_away_from_it(angle, arms):
    found = seat_of(_turned(_chair(0.43, arms), angle, (2.0, -1.0)), towards=np.zeros(2))
    assert found.back and abs(found.height - 0.43) < 0.01
    assert abs(np.angle(np.exp(1j * (found.yaw - angle)))) < 0.05
    local = rotate(yaw_matrix(np.array(-angle)), np.array([*(found.position - [2.0, -1.0]), 0.0]))
    assert abs(local[0]) < 0.04 and -0.08 < local[1] < 0.05


@pytest.mark.slow
def test_stools_and_benches_are_sat_on_from_where_one_comes():
    stool = [_box((-0.2, -0.2, 0.55), (0.2, 0.2, 0.6))]
    for towards, yaw in (((3.0, 0.3), -np.pi / 2), ((0.2, 3.0), 0.0)):
        found = seat_of(stool, np.array(towards))
        assert (
            not found.back and abs(found.yaw - yaw) < 0.05 and np.linalg.norm(found.position) < 0.05
        )
    bench = [_box((-1.0, -0.25, 0.35), (1.0, 0.25, 0.4))]
    found = seat_of(bench, np.array([5.0, 2.0]))
    assert abs(found.yaw) < 0.05 and abs(found.position[0]) < 0.05, (
        "one looks across a bench, not along it"
    )
    beside = seat_of(bench, np.array([5.0, 2.0]), near=np.array([0.9, 0.0]))
    assert 0.6 < beside.position[0] < 0.75
    stand = seat_of([_box((-60.0, -20.0, 0.0), (60.0, 20.0, 0.45))], np.array([0.0, 40.0]))
    assert abs(stand.position[1] - 19.78) < 0.1 and abs(stand.yaw) < 0.05, "however wide"
    bed = [_box((-1.0, -0.8, 0.2), (1.0, 0.8, 0.5))]
    assert seat_of(bed, np.array([0.0, 4.0])).position[1] > 0.5, "on a bed's edge"


def test_one_sits_on_a_beds_edge_and_not_on_its_pillow():
    mattress = _box((-0.5, -1.0, 0.1), (0.5, 1.0, 0.5))
    boards = [_box((-0.5, 1.0, 0.0), (0.5, 1.05, 1.1)), _box((-0.5, -1.05, 0.0), (0.5, -1.0, 0.8))]
    for towards in ((4.0, 1.0), (-4.0, 0.0), (1.0, -4.0)):
        found = seat_of([mattress, *boards], np.array(towards))
        ahead = np.array([-np.sin(found.yaw), np.cos(found.yaw)])
        assert abs(ahead[1]) < 0.05 and ahead @ towards > 0, "on a long edge, towards where one is"
        assert abs(found.position @ ahead + found.edge - 0.5) < 0.03 and found.edge < 0.25
        assert not found.back and abs(found.height - 0.5) < 0.01
    open_end = seat_of([mattress, boards[0]], np.array([0.3, -4.0]))
    assert abs(np.sin(open_end.yaw)) > 0.99 and abs(open_end.position[1]) < 0.2, (
        "nor across its end"
    )


def test_a_sofas_long_part_is_no_bed():
    seat = [_box((-1.2, -0.35, 0.0), (1.2, 0.35, 0.42)), _box((0.5, -1.3, 0.0), (1.2, -0.35, 0.42))]
    back = _box((-1.2, 0.35, 0.0), (1.2, 0.5, 0.85))
    found = seat_of([*seat, back], np.array([0.0, -4.0]))
    assert found.back and np.cos(found.yaw - np.pi) > 0.99
    assert found.position[0] < 0.5 and 0.3 < found.edge < 0.38, "the shins hang before the edge"


def test_who_rests_over_a_seat_sits():
    chair = _chair()
    assert on_a_seat(chair, np.array([0.0, 0.0])) and not on_a_seat(chair, np.array([0.0, 0.6]))
    assert not on_a_seat([_box((-1, -1, 0.9), (1, 1, 1.0))], np.zeros(2)) and not on_a_seat(
        [], np.zeros(2)
    )


def test_what_nobody_can_sit_on_is_refused():
    shelf = [_box((-0.4, -0.15, 0.0), (0.4, 0.15, 1.2))]
    with pytest.raises(InputError, match="'Shelf' has no level surface"):
        seat_of(shelf, np.zeros(2), name="Shelf")
    with pytest.raises(InputError, match="no level surface"):
        seat_of([_box((-0.2, -0.2, -0.1), (0.2, 0.2, 0.0))], np.zeros(2))


@pytest.mark.furniture
@pytest.mark.parametrize(("scan", "height"), [("sofa_03", 0.50), ("painted_wooden_stool", 0.58)])
def test_seats_of_real_furniture(scan, height):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.load(FURNITURE / f"{scan}.glb", force="mesh")
    up = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    found = seat_of([Mesh(mesh.vertices, mesh.faces, up, scan)], np.array([0.0, -3.0]))
    assert abs(found.height - height) < 0.08
    assert np.linalg.norm(found.position - (up[:3, :3] @ mesh.bounds.mean(0))[:2]) < 0.45
    if scan == "sofa_03":
        assert found.back and np.cos(found.yaw - np.pi) > 0.95, "the scan's front is its +z, our -y"


def test_ways_go_round_furniture():
    wall = surface_points([_box((-0.1, -1.5, 0.0), (0.1, 1.5, 1.0))], 0.05)
    start, goal = np.array([-1.5, 0.0]), np.array([1.5, 0.0])
    via = way_round(wall, start, goal)
    points = np.array([start, *via, goal])
    dense = np.concatenate(
        [a + np.linspace(0, 1, 50)[:, None] * (b - a) for a, b in pairwise(points)]
    )
    away = np.linalg.norm(np.maximum(np.abs(dense) - [0.1, 1.5], 0.0), axis=1)
    assert away.min() > 0.2 and np.linalg.norm(np.diff(points, axis=0), axis=1).sum() < 5.2
    assert way_round(np.zeros((0, 3)), start, goal) == []
    rug, lamp = (surface_points([_box((-1, -1, z), (1, 1, z + 0.02))], 0.05) for z in (0.0, 2.0))
    assert way_round(np.concatenate([rug, lamp]), start, goal) == []
    ring = [_box((-3, y, 0), (3, y + 0.1, 1)) for y in (-3.0, 3.0)] + [
        _box((x, -3, 0), (x + 0.1, 3, 1)) for x in (-3.0, 3.0)
    ]
    with pytest.raises(InputError, match="no way"):
        way_round(surface_points(ring, 0.05), np.zeros(2), np.array([5.0, 0.0]))
    with pytest.raises(InputError, match="already"):
        walk_to([], Stop((0.0, 0.0), 0.0), Stop((0.1, 0.0), 0.0))


def test_points_are_only_made_where_they_are_asked_for():
    chair, wall = _turned(_chair(), 0.4, (1.0, 0.5)), [_box((-400.0, 3.0, 0.0), (400.0, 3.1, 3.0))]
    low, high = np.array([0.5, 0.0]), np.array([1.5, 1.0])
    far = _turned(_chair(), 0.0, (9.0, 9.0))
    found = surface_points([*chair, *wall, *far], 0.05, (low, high))
    assert len(found) and np.array_equal(found, surface_points(chair, 0.05))
    assert surface_points(
        [*wall, Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))], 0.05, (low, high)
    ).shape == (0, 3)


@pytest.mark.slow
def test_far_ways_are_found_or_refused_in_seconds():
    start, goal = np.zeros(2), np.array([90.0, 60.0])
    started = process_time()
    assert len(way_round(np.zeros((0, 3)), start, goal)) <= 8
    ring = [_box((89, y, 0), (91.1, y + 0.1, 1)) for y in (59.0, 61.0)]
    ring += [_box((x, 59, 0), (x + 0.1, 61, 1)) for x in (89.0, 91.0)]
    for here, there in ((start, goal), (goal, start)):
        with pytest.raises(InputError, match="no way between the furniture"):
            way_round(surface_points(ring, 0.05), here, there)
    with pytest.raises(InputError, match="1,000 m away: is the scene's unit right"):
        walk_to(ring, Stop((0.0, 0.0), 0.0), Stop((1000.0, 0.0), 0.0))
    assert process_time() - started < 20.0, (
        "of the processor; a tenth of it where nothing else runs"
    )
    room = [_box((-0.02, -0.02, 0.0), (0.02, 0.02, 0.01))]
    with pytest.raises(InputError, match=r"The scene is 0\.04 m across: is its unit right"):
        walk_to(room, Stop((0.0, 0.0), 0.0), Stop((0.03, 0.0), 0.0))


@pytest.mark.slow
def test_a_hard_search_is_a_job_of_short_steps():
    """Over 100 m of floor full of furniture; of the processor's time, so whatever else runs."""
    rng = np.random.default_rng(0)
    places, sizes = rng.uniform(0.0, 100.0, (2600, 2)), rng.uniform(0.3, 1.6, (2600, 2))
    room = [
        _box((x - w / 2, y - d / 2, 0.0), (x + w / 2, y + d / 2, 1.0))
        for (x, y), (w, d) in zip(places, sizes, strict=True)
        if min(np.hypot(x, y), np.hypot(x - 97.0, y - 97.0)) > 2.5
    ]
    runs = []
    for _ in range(2):  # a pause of the collector's or the machine's hits no step twice
        job = walk_to.steps(room, Stop((0.0, 0.0), 0.0), Stop((97.0, 97.0), 0.0, 1.0))
        shares, seconds, found = [], [process_time()], None
        while found is None:
            try:
                shares.append(next(job))
            except StopIteration as done:
                found = done.value
            seconds.append(process_time())
        assert shares == sorted(shares) and shares[0] >= 0.0 and shares[-1] <= 1.0
        runs.append(np.diff(seconds))
    steps = np.minimum(*runs)
    assert steps.max() < 0.1 * steps.sum(), "no step is a tenth of it"
    at_once = walk_to(room, Stop((0.0, 0.0), 0.0), Stop((97.0, 97.0), 0.0, 1.0))
    assert np.array_equal(found.path.position, at_once.path.position)


def _scaled(boxes: list[Box], factor: float) -> list[Box]:
    return [Box(factor * box.center, factor * box.half_size) for box in boxes]


def test_a_scene_of_another_unit_is_doubted_by_what_stands_near():
    chair, table = _chair(), [_box((1.0, 1.0, 0.0), (2.0, 1.8, 0.75))]
    rug, wall = [_box((-3, -3, 0.0), (3, 3, 0.01))], [_box((-3, 3.0, 0.0), (3, 3.1, 2.5))]
    room, way = [*chair, *table, *rug, *wall], [np.zeros(2), np.array([3.0, 0.0])]
    assert (
        unit_doubt(room, way) is None
        and unit_doubt([], way) is None
        and unit_doubt(rug, way) is None
    )
    assert "is 610 m across: is its unit right?" in str(unit_doubt(_scaled(room, 100.0), way))
    assert "modelled in centimetres" in str(unit_doubt(_scaled(room, 100.0), way))
    assert "modelled in millimetres" in str(unit_doubt(_scaled(room, 1000.0), way))
    assert "100 times too small" in str(unit_doubt(_scaled(room, 0.01), way))
    assert "is 1,220 m across" in str(unit_doubt(_scaled(room, 100.0), way, size=2.0))
    assert "is 0.061 m across: is its unit right?" in str(unit_doubt(_scaled(room, 0.01), way))

    towers = [_box((x, 4.0, 0.0), (x + 30.0, 40.0, 90.0)) for x in (-60.0, -20.0, 20.0)]
    assert "is its unit right" in str(unit_doubt(towers, way))
    bench = [_box((1.0, 1.0, 0.0), (3.0, 1.4, 0.45))]
    assert unit_doubt([*towers, *bench], way) is None, "a city with a street bench"
    far = [_box((900.0, 0.0, 0.0), (902.0, 0.4, 0.45))]
    assert unit_doubt(far, way) is None, "nothing stands near"
    assert "is its unit right" in str(unit_doubt([*towers, *far], way))
    hall = [_box((-30.0, -30.0, -0.1), (30.0, 30.0, 8.0))]
    assert unit_doubt(hall, way) is None


def test_where_there_is_no_way_in_a_scene_of_another_unit_that_is_said():
    leg, goal = [_box((-1.0, -1.0, 0.0), (1.0, 1.0, 45.0))], Stop((5.0, 0.0), 0.0)
    with pytest.raises(InputError, match="is 85 m across: is its unit right"):
        walk_to([*_scaled(_chair(), 100.0), *leg], Stop((0.0, 0.0), 0.0), goal)


def test_who_starts_inside_furniture_is_led_out_of_it():
    solid = [_box((-0.6, -0.6, 0.0), (0.6, 0.6, 1.0))]
    walked = walk_to(solid, Stop((0.0, 0.0), 0.0), Stop((3.0, 0.0), 0.0))
    (met,) = met_along(Scene(solid), walked.path, 30.0, end=())
    outside = np.flatnonzero(np.abs(walked.path.position[:, :2]).max(axis=1) > 0.65)
    assert met.start == 0 and abs(met.stop - 1 - outside[0]) < 8 and (np.diff(outside) == 1).all()
    sea = surface_points([_box((-9.0, -9.0, 0.0), (9.0, 9.0, 0.5))], 0.05)
    with pytest.raises(InputError, match="no way"):
        way_round(sea, np.zeros(2), np.array([1.0, 1.0]))


def test_who_is_sent_to_a_chair_behind_a_table_sits_on_it():
    chair = _turned(_chair(), np.pi, (0.0, 0.0))
    table = [
        _box((-0.8, 1.4, 0.70), (0.8, 2.0, 0.75)),
        *(_box((x, 1.5, 0), (x + 0.05, 1.9, 0.7)) for x in (-0.7, 0.65)),
    ]
    found = seat_of(chair, towards=np.array([0.0, 4.0]))
    way = walk_to(
        [*chair, *table],
        Stop((0.0, 4.0), np.pi, 0.5),
        Stop(tuple(found.position), found.yaw, 3.0, seated=True),
    )
    assert np.abs(np.diff(way.path.position, axis=0)).max() < 0.08
    inside = (np.abs(way.path.position[:, 0]) < 0.8) & (np.abs(way.path.position[:, 1] - 1.7) < 0.3)
    assert not inside.any()
    take = generate(Scene([*chair, *table]), Controls(30.0, way.path.matrices()), load_weights())
    assert abs(take.joints[-20, 0, 2] - found.height - SEAT_TO_PELVIS) < 0.08
