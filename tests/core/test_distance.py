"""Distance grids of clean, broken and real meshes, against exact distances."""

import tracemalloc
from time import process_time

import numpy as np
import pytest

from dafnet_addon.core import distance
from dafnet_addon.core.distance import build_grid, grid_of, prepared, rigid_split, scaled
from dafnet_addon.core.grid import BAND
from dafnet_addon.core.rotations import matrix_from_quaternion, yaw_matrix
from dafnet_addon.core.solids import BOX_TRIANGLES, Box, Mesh, Scene, box_distance

GROUND = np.array([0.0, 0.0, 1.0, 0.0])

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)

CUBE_FACES = {  # outward
    "left": (0, 1, 3, 2),
    "right": (4, 6, 7, 5),
    "front": (0, 4, 5, 1),
    "back": (2, 3, 7, 6),
    "bottom": (0, 2, 6, 4),
    "top": (1, 5, 7, 3),
}

BETWEEN_NODES = 0.012


def box_mesh(half, center=(0, 0, 0), without=()):
    quads = [q for name, q in CUBE_FACES.items() if name not in without]
    return CUBE * half + center, np.array(
        [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    )


def sphere_mesh(radius, rings=120, sectors=240):
    """About 57,000 triangles."""
    polar, turn = np.meshgrid(
        np.linspace(0, np.pi, rings + 1), np.arange(sectors) * 2 * np.pi / sectors, indexing="ij"
    )
    vertices = radius * np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1
    )
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij"))
    a, b = i * sectors + j, i * sectors + (j + 1) % sectors
    triangles = np.concatenate(
        [np.stack([a, a + sectors, b], 1), np.stack([b, a + sectors, b + sectors], 1)]
    )
    return vertices.reshape(-1, 3), triangles


def joined(*meshes):
    starts = np.cumsum([0] + [len(v) for v, _ in meshes[:-1]])
    triangles = [f + start for (_, f), start in zip(meshes, starts, strict=True)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(triangles)


def points_around(half, count=20000, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * (np.asarray(half) + 0.2)


def assert_like(grid, points, exact, tolerance=BETWEEN_NODES):
    found = grid.sample(points)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, np.clip(exact, -BAND, BAND), atol=tolerance)
    clear = np.abs(exact) > tolerance
    np.testing.assert_array_equal(found[clear] < 0, exact[clear] < 0)


def test_box_mesh_is_the_box():
    half = np.array([0.31, 0.42, 0.23])
    points = points_around(half)
    assert_like(build_grid(*box_mesh(half)), points, box_distance(points, half))


def test_nodes_are_exact():
    half = np.array([0.31, 0.42, 0.23])
    grid = build_grid(*box_mesh(half))
    nodes = grid.origin + grid.spacing * np.argwhere(np.ones(grid.values.shape))
    exact = np.clip(box_distance(nodes, half), -BAND, BAND)
    assert np.abs(np.abs(grid.values.ravel()) - np.abs(exact)).max() < 1e-5
    border = np.ones(grid.values.shape, bool)
    border[1:-1, 1:-1, 1:-1] = False
    assert (grid.values[border] == np.float32(BAND)).all()


def test_tens_of_thousands_of_triangles():
    points = points_around([0.5] * 3)
    vertices, triangles = sphere_mesh(0.5)
    assert len(triangles) > 50_000
    exact = np.linalg.norm(points, axis=-1) - 0.5
    measured = np.abs(exact) < 0.11  # the truncation is a corner of the field, too
    assert_like(build_grid(vertices, triangles), points[measured], exact[measured], 0.005)


def test_inverted_and_randomly_turned_faces_do_not_matter():
    half = np.array([0.3, 0.3, 0.3])
    vertices, triangles = box_mesh(half)
    triangles[::3] = triangles[::3, ::-1]
    points = points_around(half)
    assert_like(build_grid(vertices, triangles), points, box_distance(points, half))


def test_split_seams_and_doubled_faces_do_not_matter():
    half = np.array([0.3, 0.3, 0.3])
    vertices, triangles = box_mesh(half)
    soup = vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    doubled = joined(soup, (soup[0], soup[1][:, ::-1]))
    points = points_around(half)
    assert_like(build_grid(*doubled), points, box_distance(points, half))


def test_overlapping_loose_parts_unite():
    halves = np.array([[0.3, 0.2, 0.2], [0.15, 0.4, 0.1], [0.1, 0.1, 0.4]])
    centers = np.array([[0, 0, 0], [0.1, 0, 0.05], [0, 0, 0]])
    grid = build_grid(*joined(*(box_mesh(h, c) for h, c in zip(halves, centers, strict=True))))
    points = points_around([0.4, 0.4, 0.4])
    exact = np.min(
        [box_distance(points - c, h) for h, c in zip(halves, centers, strict=True)], axis=0
    )
    found = grid.sample(points)
    outside = exact > 0
    np.testing.assert_allclose(found[outside], np.minimum(exact[outside], BAND), atol=BETWEEN_NODES)
    assert (found[exact < -BETWEEN_NODES] <= BETWEEN_NODES).all()
    # 0 on the faces that lie inside another part
    assert (found[exact < -BETWEEN_NODES] < 0).mean() > 0.97


def test_single_sided_board_is_a_thin_shell():
    half = np.array([0.6, 0.4, 0.0])
    vertices = np.array([[-0.6, -0.4, 0], [0.6, -0.4, 0], [0.6, 0.4, 0], [-0.6, 0.4, 0]])
    grid = build_grid(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    points = points_around(half)
    assert (grid.values >= 0).all()
    assert_like(grid, points, box_distance(points, half))


def test_thin_table_top_is_not_lost_between_nodes():
    half = np.array([0.6, 0.4, 0.006])
    points = points_around(half)
    for lift in (0.0, 0.003, 0.007, 0.011):
        grid = build_grid(
            *joined(
                box_mesh(half, (0, 0, lift)), box_mesh([0.02, 0.02, 0.35], (0.3, 0.2, -0.36 + lift))
            )
        )
        outside = points[points[:, 2] > 0] + [0, 0, lift]
        assert_like(
            grid,
            outside,
            np.maximum(box_distance(outside - [0, 0, lift], half), -0.01),
            BETWEEN_NODES + 0.006,
        )


def test_box_without_a_bottom_is_solid():
    half = np.array([0.4, 0.3, 0.2])
    grid = build_grid(*box_mesh(half, without=["bottom"]))
    inside = points_around(half * 0.9 - 0.2)
    assert (grid.sample(inside) < 0).all()
    below = inside * [1, 1, 0] - [0, 0, 0.25]
    assert (grid.sample(below) > 0).all()


def test_curved_open_sheet_is_a_thin_shell():
    angle = np.linspace(0, np.pi, 40)
    bottom = np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), 0 * angle - 0.4], axis=-1)
    vertices = np.concatenate([bottom, bottom * [1, 1, -1]])
    k = np.arange(39)
    triangles = np.concatenate(
        [np.stack([k, k + 1, k + 40], 1), np.stack([k + 1, k + 41, k + 40], 1)]
    )
    assert (build_grid(vertices, triangles).values >= 0).all()


def test_room_in_one_mesh_is_not_full():
    room = box_mesh([4, 3, 1.3], (0, 0, 1.3))
    desk = box_mesh([0.5, 0.3, 0.4], (1, 1, 0.4))
    grid = build_grid(*joined((room[0], room[1][:, ::-1]), desk), GROUND)
    rng = np.random.default_rng(1)
    air = rng.uniform([-3.7, -2.7, 0.0], [0.0, 2.7, 2.3], (2000, 3))
    assert (grid.sample(air) > 0.14).all()  # down to the floor itself
    assert (
        grid.sample(rng.uniform([0.55, 0.75, 0.0], [1.45, 1.25, 0.75], (500, 3))) < grid.spacing / 2
    ).all()
    wall = np.stack(
        [rng.uniform(-3, 3, 500), np.full(500, -3.0), rng.uniform(0.3, 2, 500)], axis=-1
    )
    assert (grid.sample(wall) < grid.spacing / 2 + 1e-6).all()
    assert grid.spacing < 0.05 and grid.values.nbytes < 30e6


def test_building_with_thick_floor_and_walls():
    outer, inner = box_mesh([3, 3, 1.5], (0, 0, 1.2)), box_mesh([2.8, 2.8, 1.2], (0, 0, 1.2))
    grid = build_grid(*joined(outer, (inner[0], inner[1][:, ::-1])), GROUND)
    air = np.random.default_rng(1).uniform([-2.6, -2.6, 0.0], [2.6, 2.6, 2.2], (2000, 3))
    assert (grid.sample(air) > 0.14).all()


@pytest.mark.parametrize("bottom, top", [(0.0, 0.0), (0.0, 0.02), (-0.2, 0.0), (-0.2, 0.03)])
def test_floors_slabs_and_rugs_are_not_seen(bottom, top):
    floor = box_mesh([2, 2, (top - bottom) / 2], (0, 0, (top + bottom) / 2))
    stool = box_mesh([0.2, 0.2, 0.25], (1, 1, 0.25))
    grid = build_grid(*joined(floor, stool), GROUND)
    assert grid.sample(np.zeros(3)) == np.float32(BAND)
    assert (grid.sample(np.array([[1, 1, 0.0], [1, 1, 0.02], [1.1, 0.9, 0.4]])) < 0.011).all()
    assert build_grid(*floor, GROUND).sample(np.zeros(3)) == np.float32(BAND)
    # as a table top
    assert (
        build_grid(*floor, np.array([0, 0, 1, 0.5])).sample(np.array([0, 0, top])) < BETWEEN_NODES
    )


def test_solid_that_stands_on_the_floor_is_full_down_to_it():
    grid = build_grid(*box_mesh([0.4, 0.4, 0.2], (0, 0, 0.2)), GROUND)
    heights = np.linspace(0, 0.4, 50)
    assert (grid.sample(np.stack([0 * heights, 0 * heights, heights], axis=-1)) < 0.011).all()


def test_degenerate_meshes_give_an_empty_field():
    nothing = build_grid(np.zeros((0, 3)), np.zeros((0, 3), int))
    collapsed = build_grid(np.ones((3, 3)), np.array([[0, 1, 2], [0, 0, 1]]))
    for grid in (nothing, collapsed):
        assert (grid.sample(points_around([1, 1, 1], 100)) == np.float32(BAND)).all()
    line = build_grid(np.array([[0, 0, 0], [1.0, 0, 0], [0.5, 0, 0]]), np.array([[0, 1, 2]]))
    assert line.sample(np.array([0.5, 0.0, 0.1])) == pytest.approx(0.1, abs=BETWEEN_NODES)


def random_affine(seed, mirrored):
    rng = np.random.default_rng(seed)
    m = np.eye(4)
    m[:3, :3] = rng.normal(size=(3, 3))
    if (np.linalg.det(m) < 0) != mirrored:
        m[:, 0] *= -1
    m[:3, 3] = rng.normal(size=3)
    return m


@pytest.mark.parametrize("mirrored", [False, True])
def test_rigid_split_puts_a_matrix_together_again(mirrored):
    m = np.stack([random_affine(s, mirrored) for s in range(50)])
    rigid, linear = rigid_split(m)
    np.testing.assert_allclose(rigid[:, :3, :3] @ linear, m[:, :3, :3], atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(rigid[:, :3, :3]), 1.0)
    np.testing.assert_allclose(rigid[:, :, 3], m[:, :, 3])


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, -1, -1), (-1, 1, 1), (2, 0.5, -1), (1, 1, 0)])
def test_moving_object_keeps_one_linear_part(scale):
    turns = matrix_from_quaternion(np.random.default_rng(3).normal(size=(40, 4)))
    m = np.zeros((40, 4, 4))
    m[:, :3, :3], m[:, 3, 3] = turns @ np.diag(scale), 1
    rigid, linear = rigid_split(m)
    np.testing.assert_allclose(linear, np.broadcast_to(linear[0], linear.shape), atol=1e-9)
    np.testing.assert_allclose(rigid[:, :3, :3] @ linear, m[:, :3, :3], atol=1e-9)


@pytest.mark.parametrize("scale", [(1.5, 0.5, 1.0), (-1.0, 1.0, 1.0), (1.2, -0.7, 2.0)])
def test_scaled_and_mirrored_meshes(scale):
    wedge = CUBE.copy()
    wedge[[5, 7], 2] = -0.4  # no symmetry, so a mirror image would show
    triangles = box_mesh([1, 1, 1])[1]
    matrix = np.eye(4)
    matrix[:3, :3] = yaw_matrix(np.array(0.7)) @ np.diag(scale)
    matrix[:3, 3] = 3, -2, 1
    mesh = Mesh(0.3 * wedge, triangles, matrix)
    grid, rigid = grid_of(mesh, -10.0), rigid_split(matrix)[0]
    world = np.column_stack([mesh.vertices, np.ones(8)]) @ matrix.T
    direct = build_grid(world[:, :3], triangles)
    points = points_around([0.6, 0.6, 0.6], 5000) + matrix[:3, 3]
    local = (points - rigid[:3, 3]) @ rigid[:3, :3]
    np.testing.assert_allclose(grid.sample(local), direct.sample(points), atol=BETWEEN_NODES)


def test_grids_are_made_once_for_each_geometry_scale_and_floor():
    vertices, triangles = box_mesh([0.3, 0.3, 0.3])
    moved, larger = np.eye(4), np.diag([2.0, 2.0, 2.0, 1.0])
    moved[:3, :3], moved[:3, 3] = yaw_matrix(np.array(1.0)), (4, 5, 0)
    first = grid_of(Mesh(vertices, triangles), 0.0)
    assert grid_of(Mesh(vertices.copy(), triangles.copy(), moved), 0.0) is first
    assert grid_of(Mesh(vertices, triangles, larger), 0.0) is not first
    assert grid_of(Mesh(vertices, triangles), -0.3) is not first
    assert grid_of(Mesh(vertices * 1.001, triangles), 0.0) is not first
    own = build_grid(vertices, triangles)
    assert grid_of(Mesh(vertices, triangles, grid=own), 0.0) is own


def test_what_lies_higher_than_the_floor_shares_one_grid_at_any_height():
    half, places = np.array([0.1, 0.2, 0.15]), [(0, 0, 0.9), (1, 2, 1.3), (4, 0, 2.0)]
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[:, :3, 3] = places
    matrices[2, :3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    grids = [grid_of(Mesh(*box_mesh(half), matrix=matrix), 0.0) for matrix in matrices]
    assert grids[0] is grids[1] is grids[2]
    alone = build_grid(*box_mesh(half), np.array([0.0, 0.0, 1.0, 0.9]))
    assert np.array_equal(grids[0].values, alone.values) and np.array_equal(
        grids[0].origin, alone.origin
    )


def test_floor_is_measured_in_the_world():
    slab = Mesh(
        *box_mesh([1, 0.1, 1]),
        matrix=np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 4.9], [0, 0, 0, 1.0]]),
    )
    assert (grid_of(slab, 5.0).values == np.float32(BAND)).all()
    assert (grid_of(slab, 4.7).values < 0).any()


def test_moving_object_has_a_floor_only_while_it_rolls_on_it():
    plate = box_mesh([0.3, 0.3, 0.01], (0, 0, 0.01))
    rolling = np.stack([np.eye(4)] * 5)
    rolling[:, :2, 3] = np.arange(10).reshape(5, 2)
    lifted = rolling.copy()
    lifted[:, 2, 3] = np.arange(5)
    assert (grid_of(Mesh(*plate, matrix=rolling), 0.0).values == np.float32(BAND)).all()
    assert (grid_of(Mesh(*plate, matrix=lifted), 0.0).values < 0.01).any()


def test_warnings_say_what_is_not_seen_well():
    growing = np.stack([np.eye(4)] * 3)
    growing[2, :3, :3] *= 1.5
    stool = box_mesh([0.2, 0.2, 0.25], (0, 0, 0.25))
    hall = joined(box_mesh([20, 20, 5], (0, 0, 5)), stool)
    solids = [Mesh(*stool, matrix=growing, name="Balloon"), Mesh(*hall, name="Hall"), Mesh(*stool)]
    scene, warnings = prepared(Scene(solids), 0.0)
    assert len(warnings) == 2 and "Balloon" in warnings[0] and "Hall" in warnings[1]
    assert all(solid.grid is not None for solid in scene.solids)


def test_scaled_scene_keeps_its_grids():
    mesh = Mesh(*box_mesh([0.3, 0.4, 0.2]), matrix=random_affine(2, True))
    box = Box(np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3]))
    before, _ = prepared(Scene([mesh, box]), -5.0)
    after = scaled(before, 0.8)
    points = points_around([0.4, 0.4, 0.4], 2000)
    small, full = after.solids[0].grid.sample(0.8 * points), before.solids[0].grid.sample(points)
    np.testing.assert_allclose(small, 0.8 * full, atol=1e-5)
    np.testing.assert_allclose(
        rigid_split(after.solids[0].matrix)[0][:3, 3], 0.8 * mesh.matrix[:3, 3]
    )
    np.testing.assert_allclose(after.solids[1].center, [0.8, 1.6, 2.4])
    np.testing.assert_allclose(after.solids[1].half_size, [0.08, 0.16, 0.24])


@pytest.mark.slow
@pytest.mark.parametrize("side", [100.0, 4000.0])
def test_a_huge_slab_is_measured_coarsely_and_within_memory(side: float) -> None:
    corners = np.array([(x, y, z) for x in (0.0, side) for y in (0.0, side) for z in (0.0, 0.5)])
    tracemalloc.start()
    try:
        grid = build_grid(corners, BOX_TRIANGLES)
        assert tracemalloc.get_traced_memory()[1] < 200e6
    finally:
        tracemalloc.stop()
    over = np.array([side / 2, side / 2, 0.5 + BAND + 2 * grid.spacing])
    assert grid.sample(over) == pytest.approx(BAND, abs=1e-6)
    assert grid.values.size < 7_000_000 and np.isfinite(grid.values).all()


def _soup(count, across, spread):
    """Triangles anywhere, corners ``spread`` metres apart."""
    rng = np.random.default_rng(0)
    corners = rng.uniform(0, across, (count, 1, 3)) + rng.uniform(0, spread, (count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def _collinear():
    return np.c_[np.linspace(0, 1, 300), np.zeros((300, 2))], np.random.default_rng(0).integers(
        0, 300, (2000, 3)
    )


def _needles():
    ends = np.random.default_rng(0).normal(size=(3, 2000, 3)) + np.array([0.0, 0.0, 1e4])[
        :, None, None
    ] * (1, 0, 0)
    return ends.reshape(-1, 3), np.arange(6000).reshape(3, 2000).T


@pytest.mark.slow
@pytest.mark.parametrize(
    "mesh",
    [
        _collinear(),
        _needles(),
        _soup(20_000, 0.0, 100.0),
        _soup(200, 1e8, 1.0),
        _soup(50_000, 0.0, 3.0),
        (
            np.array([[0, 0, 0], [1e8, 0, 0], [1e8, 1e8, 0], [0, 1e8, 0]]),
            np.array([[0, 1, 2], [0, 2, 3]]),
        ),
        (np.array([[0, 0, 0], [1e8, 0, 0], [1e8, 1e-3, 0]]), np.array([[0, 1, 2]])),
        (np.zeros((5, 3)), np.array([[0, 1, 2]] * 9)),
        (box_mesh([0.3, 0.3, 0.3])[0] + 1e8, box_mesh([0.3, 0.3, 0.3])[1]),
    ],
    ids=[
        "collinear",
        "needles",
        "soup",
        "far apart",
        "dense",
        "sheet",
        "needle",
        "points",
        "far away",
    ],
)
def test_no_mesh_takes_long_or_much_memory(mesh):
    tracemalloc.start()
    started = process_time()
    grid = build_grid(*mesh)
    seconds, (_, peak) = process_time() - started, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert np.isfinite(grid.values).all() and grid.values.size <= 12_000_000
    assert peak < 200e6
    assert seconds < 20, "of the processor; a tenth of it where nothing else runs"


def test_of_a_vast_mesh_the_unit_is_asked_for():
    plane = (
        np.array([[-500, -500, 0.3], [500, -500, 0.3], [500, 500, 0.3], [-500, 500, 0.3]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    _, (warning,) = prepared(Scene([Mesh(*plane, name="Ground")]), 0.0)
    assert warning.startswith("'Ground' is 1,0") and "is its unit right?" in warning


def test_grids_are_kept_up_to_half_a_gigabyte(monkeypatch):
    monkeypatch.setattr(distance, "_cache", type(distance._cache)())
    meshes = [Mesh(*box_mesh([0.2, 0.2, 0.1 + 0.001 * k])) for k in range(80)]
    grids = [grid_of(mesh, -1.0) for mesh in meshes]
    assert all(grid_of(mesh, -1.0) is grid for mesh, grid in zip(meshes, grids, strict=True))
    monkeypatch.setattr(distance, "_CACHED_BYTES", 3 * grids[-1].values.nbytes)
    grid_of(Mesh(*box_mesh([0.1, 0.1, 0.1])), -1.0)
    assert 1 <= len(distance._cache) <= 4
