"""Furniture libraries, their pieces as distance grids, and real pieces fitted to motion."""

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.occupancy import distance, occupancy
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.skeleton import SEAT_TO_PELVIS
from dafnet_addon.core.solids import Scene
from dafnet_addon.data.furnish.flesh import GIVES, PROBES, Furnishing, clearance, sunk
from dafnet_addon.data.furnish.library import Piece, kind_of, read_library
from dafnet_addon.data.furnish.real_pieces import (
    LIES_OVER,
    bed_shape_for,
    desk_shape_for,
    seat_shape_for,
)
from dafnet_addon.data.furnish.shapes import (
    FARTHEST,
    PELVIS_OVER,
    STRETCH,
    ShapeBank,
    bank_of,
    shapes_of,
)
from dafnet_addon.data.motion.interactions import Interaction
from dafnet_addon.data.motion.rests import Rest
from kit.places import LIBRARY

trimesh = pytest.importorskip("trimesh")
Size = tuple[float, float, float]


def _chair(width: float = 0.46) -> "trimesh.Trimesh":
    """A chair with its front to −y: a thin seat 0.45 m high on four legs, and a back of two
    bars.
    """

    def part(
        size: tuple[float, float, float], middle: tuple[float, float, float]
    ) -> "trimesh.Trimesh":
        made = trimesh.creation.box(size)
        made.apply_translation(middle)
        return made

    legs = [
        part((0.04, 0.04, 0.42), (x * (width / 2 - 0.02), y, 0.21))
        for x in (-1, 1)
        for y in (-0.2, 0.2)
    ]
    seat = part((width, 0.46, 0.03), (0, 0, 0.435))
    back = [part((width, 0.03, 0.08), (0, 0.215, z)) for z in (0.6, 0.8)]
    posts = [part((0.03, 0.03, 0.45), (x * (width / 2 - 0.02), 0.215, 0.62)) for x in (-1, 1)]
    return trimesh.util.concatenate([seat, *legs, *back, *posts])


def _piece(kind: str = "chair", name: str = "one") -> Piece:
    mesh = _chair()
    return Piece(
        name=name,
        kind=kind,
        title=kind,
        maker="anna",
        source="made",
        licence="CC0-1.0",
        vertices=np.asarray(mesh.vertices, float),
        triangles=np.asarray(mesh.faces, np.int64),
    )


def _of_mesh(kind: str, mesh: "trimesh.Trimesh", name: str = "") -> Piece:
    return replace(
        _piece(kind, name or kind),
        vertices=np.asarray(mesh.vertices, float),
        triangles=np.asarray(mesh.faces, np.int64),
    )


def _made(kind: str, parts: list[tuple[Size, Size]], name: str = "") -> Piece:
    """A piece of boxes: size and middle of each."""
    boxes = [trimesh.creation.box(size) for size, _ in parts]
    for box, (_, middle) in zip(boxes, parts, strict=True):
        box.apply_translation(middle)
    return _of_mesh(kind, trimesh.util.concatenate(boxes), name)


@pytest.fixture(scope="module")
def bank() -> ShapeBank:
    return bank_of([_piece()], factors=(0.9, 1.0))


def test_loose_meshes_are_read_with_what_is_stated_of_them(tmp_path: Path) -> None:
    mesh = _chair()
    mesh.apply_scale(100.0)
    mesh.export(tmp_path / "high chair.obj")
    mesh.export(tmp_path / "secret.obj")
    stated = {"high*.obj": {"licence": "CC0-1.0", "maker": "anna", "unit": 0.01, "up": "z"}}
    (tmp_path / "pieces.json").write_text(json.dumps(stated), encoding="utf-8")
    pieces, left_out = read_library(tmp_path)
    assert [(p.name, p.kind, p.maker, p.licence) for p in pieces] == [
        ("high chair", "chair", "anna", "CC0-1.0")
    ]
    assert np.allclose(
        np.ptp(pieces[0].vertices, axis=0), np.ptp(_chair().vertices, axis=0), atol=1e-6
    )
    assert left_out == ["'secret.obj' states no licence"]


def test_a_sweet_home_library_is_read_at_the_size_that_it_states(tmp_path: Path) -> None:
    mesh = _chair()
    # Their models have y up and the front to +z.
    mesh.vertices = mesh.vertices @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)
    catalogue = (
        "id=test\nlicense=CC0-1.0\nprovider=somebody\n"
        "name#1=Chair\nmodel#1=/a/chair.obj\nwidth#1=50\ndepth#1=45\nheight#1=90\ncreator#1=anna\n"
        "name#2=Lamp\nmodel#2=/a/lamp.obj\nwidth#2=50\ndepth#2=45\nheight#2=90\n"
        "name#3=Gone sofa\nmodel#3=/a/gone.obj\nwidth#3=50\ndepth#3=45\nheight#3=90\n"
    )
    with zipfile.ZipFile(tmp_path / "test.sh3f", "w") as archive:
        archive.writestr("PluginFurnitureCatalog.properties", catalogue)
        archive.writestr("a/chair.obj", mesh.export(file_type="obj"))
    pieces, left_out = read_library(tmp_path)
    assert [(p.title, p.kind, p.maker, p.licence, p.source) for p in pieces] == [
        ("Chair", "chair", "anna", "CC0-1.0", "test")
    ]
    vertices = pieces[0].vertices
    assert np.allclose(vertices.min(0), (-0.25, -0.225, 0.0)) and np.allclose(
        vertices.max(0), (0.25, 0.225, 0.9)
    )
    high = vertices[vertices[:, 2] > 0.6]
    assert high[:, 1].min() > 0.1, "the back is behind"
    assert len(left_out) == 1 and "Gone sofa" in left_out[0]


@pytest.mark.parametrize(
    ("title", "kind"),
    [
        ("Corner sofa", "sofa"),
        ("Armchair ottoman", "armchair"),
        ("Piano bench", "bench"),
        ("Bookcase", "shelf"),
        ("Lamp", ""),
    ],
)
def test_titles_tell_kinds(title: str, kind: str) -> None:
    assert kind_of(title) == kind


def test_what_is_no_library_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no furniture"):
        read_library(tmp_path)
    (tmp_path / "index.json").write_text("[1]", encoding="utf-8")
    with pytest.raises(InputError, match="does not list pieces"):
        read_library(tmp_path)
    (tmp_path / "index.json").unlink()
    (tmp_path / "broken.sh3f").write_bytes(b"PK")
    with pytest.raises(InputError, match="cannot be read"):
        read_library(tmp_path)


def test_one_sits_on_a_chair_where_and_as_high_as_it_carries(bank: ShapeBank) -> None:
    for shape in bank.shapes:
        (seat,) = shape.seats
        assert abs(seat.height - 0.45 * shape.factor) < 0.01
        assert abs(seat.pelvis - seat.height - PELVIS_OVER["chair"]) < 1e-9
        assert abs(np.cos(seat.yaw) + 1.0) < 1e-6 and np.abs(seat.position).max() < 0.1
        assert abs(seat.position[1] - seat.edge + 0.23) < 0.04, "the front edge lies at −0.23"


def test_one_sits_on_a_stool_from_every_side_and_on_a_bed_where_its_boards_leave_room() -> None:
    block = _made("stool", [((0.4, 0.4, 0.45), (0.0, 0.0, 0.225))])
    (stool,) = shapes_of(block, factors=(1.0,))
    assert sorted(round(float(np.cos(seat.yaw))) for seat in stool.seats) == [-1, 0, 0, 1]
    parts = [
        ((1.0, 2.0, 0.5), (0.0, 0.0, 0.25)),
        ((1.0, 0.05, 1.0), (0.0, 1.0, 0.5)),
        ((1.0, 0.05, 0.7), (0.0, -1.0, 0.35)),
    ]
    low, high = shapes_of(_made("bed", parts), factors=(0.9, 1.1))
    for bed, height in ((low, 0.45), (high, 0.55)):
        assert len(bed.seats) == 2
        for seat in bed.seats:
            assert abs(seat.height - height) < 0.01 and abs(np.cos(seat.yaw)) < 0.05
            ahead = np.array([-np.sin(seat.yaw), np.cos(seat.yaw)])
            assert abs(seat.position @ ahead + seat.edge - 0.5) < 0.04, "on its long edges"


def test_the_surface_is_that_under_the_hips() -> None:
    """A seat that falls towards its back carries the pelvis lower than it is on the whole."""
    slope = trimesh.creation.box((0.5, 0.5, 0.04))
    slope.apply_transform(trimesh.transformations.rotation_matrix(np.radians(-9), (1, 0, 0)))
    slope.apply_translation((0.0, 0.0, 0.42))
    back = trimesh.creation.box((0.5, 0.04, 0.5))
    back.apply_translation((0.0, 0.25, 0.62))
    (shape,) = shapes_of(_of_mesh("chair", trimesh.util.concatenate([slope, back])), factors=(1.0,))
    (seat,) = shape.seats
    under = 0.44 - np.tan(np.radians(9)) * seat.position[1]
    assert abs(seat.height - under) < 0.012 and seat.position[1] > -0.1


def test_nobody_sits_on_what_is_too_narrow_or_carries_nothing() -> None:
    fan = _made("table", [((0.24, 0.27, 0.4), (0.0, 0.0, 0.2))])
    assert not shapes_of(fan, factors=(1.0,))[0].seats
    rails = [((0.04, 0.5, 0.04), (x, 0.0, 0.43)) for x in (-0.23, 0.23)]
    rails += [((0.5, 0.04, 0.04), (0.0, y, 0.43)) for y in (-0.23, 0.23)]
    assert not shapes_of(_made("chair", rails), factors=(1.0,))[0].seats


def test_a_bank_is_kept(bank: ShapeBank, tmp_path: Path) -> None:
    bank.write(tmp_path / "bank.npz")
    again = ShapeBank.read(tmp_path / "bank.npz")
    for one, two in zip(bank.shapes, again.shapes, strict=True):
        assert (
            (one.values == two.values).all() and one.name == two.name and one.factor == two.factor
        )
        assert [seat.height for seat in one.seats] == [seat.height for seat in two.seats]
        assert (one.seats[0].position == two.seats[0].position).all()
    with np.load(tmp_path / "bank.npz") as arrays:
        np.savez(tmp_path / "old.npz", **{**arrays, "seats": np.zeros((2, 6))})
    with pytest.raises(InputError, match="make the dataset anew"):
        ShapeBank.read(tmp_path / "old.npz")


def test_distances_are_those_of_the_mesh(bank: ShapeBank) -> None:
    rng = np.random.default_rng(0)
    row = np.array([[1, 0.4, -0.2, 0.7, 1.0]])
    points = rng.uniform((-0.1, -0.7, 0.06), (0.9, 0.3, 1.0), (3000, 3))
    c, s = np.cos(0.7), np.sin(0.7)
    local = (points - (0.4, -0.2, 0.0)) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    mesh = _chair()
    exact = -trimesh.proximity.signed_distance(mesh, local)
    found = bank.distances(row, points)
    near = (np.abs(exact) < 0.07) & (exact > 0)
    error = np.abs(found - exact)[near]
    assert near.sum() > 300 and np.median(error) < 0.001 and np.quantile(error, 0.99) < 0.008
    assert (found[exact > FARTHEST + 0.01] > FARTHEST - 0.01).all()


def test_the_sensor_sees_placed_shapes_as_the_core_sees_their_meshes(bank: ShapeBank) -> None:
    rows = np.array([[0, 0.3, 0.5, 0.4, 1.0], [1, -0.6, 0.2, 2.0, 1.04]])
    angle = np.linspace(0, 3, 12)
    path = RootPath(np.c_[np.cos(angle), np.sin(angle), np.zeros(12)] * 0.5, angle)
    ours = bank.occupancy(rows, path)
    core = occupancy(Scene(tuple(bank.meshes(rows))), path)
    # The one that is stretched, which the core measures on nodes of its own, may be off by 4 mm.
    assert ours.max() > 0.9 and np.abs(ours - core).max() < 0.06
    alike = bank.occupancy(rows[:1], path) - occupancy(Scene(tuple(bank.meshes(rows[:1]))), path)
    assert np.abs(alike).max() < 1e-3
    points = np.random.default_rng(1).uniform((-1, -1, 0.1), (1, 1, 1), (12, 50, 3))
    assert (
        np.abs(
            distance(Scene(tuple(bank.meshes(rows))), points, 0.0).clip(max=FARTHEST)
            - bank.distances(rows, points.reshape(-1, 3)).reshape(12, 50)
        ).max()
        < 0.005
    )


@pytest.mark.torch
def test_other_devices_see_the_same(bank: ShapeBank) -> None:
    import torch

    from dafnet_addon.data.furnish.shapes import ABSENT_SHAPE
    from dafnet_addon.training.placed_shapes import DeviceBank

    rows = np.stack(
        [
            [[0, 0.3, 0.5, 0.4, 1.0], [1, -0.6, 0.2, 2.0, 1.04]],
            [[1, 0.0, 0.1, 1.0, 0.97], ABSENT_SHAPE],
        ]
    )
    angle = np.linspace(0, 3, 12)
    root = np.stack([np.c_[0.5 * np.cos(angle), 0.5 * np.sin(angle), angle]] * 2)
    seen = (
        DeviceBank(bank, torch.device("cpu"))
        .occupancy(torch.from_numpy(rows).float(), torch.from_numpy(root).float())
        .numpy()
    )
    for window in (0, 1):
        path = RootPath(np.c_[root[window, :, :2], np.zeros(12)], root[window, :, 2])
        there = rows[window][rows[window][:, 0] >= 0]
        assert np.abs(seen[window] - bank.occupancy(there, path)).max() < 2e-3
    assert seen.max() > 0.9


def _free(height: float) -> np.ndarray:
    """Probes of a body of which nothing is near furniture."""
    return np.full((4, len(PROBES), 3), 50.0 + height)


def test_a_real_seat_carries_the_pelvis_as_high_as_it_rests(bank: ShapeBank) -> None:
    rng = np.random.default_rng(0)
    rest = Rest(0, 10, np.array([2.0, -1.0, 0.45 + PELVIS_OVER["chair"]]), 0.8)
    found = seat_shape_for(rng, bank, rest, _free(0.0))
    assert found is not None and len(found.shapes) == 1 and abs(found.shapes[0, 4] - 1.0) <= STRETCH
    under = np.array([rest.position - (0.0, 0.0, PELVIS_OVER["chair"] - 0.02)])
    assert abs(float(bank.distances(found.shapes, under)[0]) - 0.02) < 0.01, (
        "the seat's surface is where the piece says"
    )
    # Its back is behind the sitter, who faces 0.8.
    behind = 0.1 * np.array([np.sin(0.8), -np.cos(0.8), 0.0])
    back, front = bank.distances(found.shapes, rest.position + (0.0, 0.0, 0.15) + [behind, -behind])
    assert back < 0.06 and front > 0.1
    too_high = Rest(0, 10, np.array([0.0, 0.0, 0.9]), 0.0)
    assert seat_shape_for(rng, bank, too_high, _free(0.0)) is None


def test_no_real_seat_cuts_the_body(bank: ShapeBank) -> None:
    rest = Rest(0, 10, np.array([0.0, 0.0, 0.56]), 0.0)
    blocked = _free(0.0)
    # an ankle in the seat
    blocked[:, PROBES.index(("left_ankle", "left_foot", 0.0, 0.05))] = (0.0, -0.02, 0.44)
    assert seat_shape_for(np.random.default_rng(0), bank, rest, blocked) is None


def test_who_sinks_in_sinks_downwards_only() -> None:
    """A sofa's cushion gives way to who sits on it, and its back to nobody."""
    wall = Furnishing(boxes=np.array([[0.0, 0.3, 0.5, 0.5, 0.1, 0.5, 0.0]]))
    floor = Furnishing(boxes=np.array([[0.0, 0.0, 0.2, 0.5, 0.5, 0.2, 0.0]]))
    body = _free(0.0)
    hip = PROBES.index(("left_hip", "left_knee", 0.0, 0.08))
    body[:, hip] = (0.0, 0.16, 0.5)
    assert clearance(wall, body, GIVES, sunk(0.03)) == pytest.approx(0.04)
    body[:, hip] = (0.0, 0.22, 0.5)
    assert clearance(wall, body, GIVES, sunk(0.03)) < 0.0
    body[:, hip] = (0.0, 0.0, 0.41 - (SEAT_TO_PELVIS - 0.03))
    assert clearance(floor, body, GIVES, sunk(0.03)) == pytest.approx(0.01)
    assert clearance(floor, body, GIVES, sunk(0.14)) < 0.0


def test_what_is_easy_to_sit_on_does_not_take_the_place_of_what_is_not() -> None:
    """Two stools of a kind, on one of which the shins leave room only far forward on it."""
    deep = _made("stool", [((0.5, 0.7, 0.45), (0.0, 0.0, 0.225))], "deep")
    plain = _made("stool", [((0.3, 0.3, 0.45), (0.0, 0.0, 0.225))], "plain")
    stools = bank_of([deep, plain], factors=(1.0,))
    body = _free(0.0)
    for side in ("left", "right"):
        body[:, PROBES.index((f"{side}_knee", f"{side}_ankle", 0.5, 0.05))] = (0.0, 0.24, 0.25)
    rng = np.random.default_rng(0)
    rest = Rest(0, 10, np.array([0.0, 0.0, 0.59]), 0.0)
    found = [seat_shape_for(rng, stools, rest, body) for _ in range(60)]
    names = [stools.shapes[int(room.shapes[0, 0])].name for room in found if room is not None]
    assert len(names) == 60 and 18 <= names.count("deep") <= 42


def test_hands_work_on_a_real_desk() -> None:
    parts = [
        ((1.4, 0.7, 0.03), (0.0, 0.0, 0.735)),
        ((0.04, 0.7, 0.72), (-0.68, 0.0, 0.36)),
        ((0.04, 0.7, 0.72), (0.68, 0.0, 0.36)),
    ]
    desks = bank_of([_made("desk", parts)], factors=(0.88, 1.0))
    yaw, origin = 0.6, np.array([1.0, -2.0])
    away = np.array([-np.sin(yaw), np.cos(yaw)])
    hands = origin + np.array([[0.0], [0.12]]) * away
    for wrists in (0.70, 0.78):
        use = Interaction("desk", 0, 40, np.c_[hands, [wrists, wrists + 0.02]], yaw)
        room = desk_shape_for(np.random.default_rng(0), desks, use, _free(0.0))
        assert room is not None
        top = np.array([*hands.mean(0), wrists - 0.035])
        assert abs(float(desks.distances(room.shapes, top[None])[0])) < 0.03
        nearer = np.array([[*(hands[0] - 0.3 * away), wrists - 0.035]])
        assert float(desks.distances(room.shapes, nearer)[0]) > 0.05, "the body is before it"
    too_high = Interaction("desk", 0, 40, np.c_[hands, [1.1, 1.1]], yaw)
    assert desk_shape_for(np.random.default_rng(0), desks, too_high, _free(0.0)) is None


@pytest.mark.furniture
def test_one_lies_in_a_real_bed() -> None:
    pieces, left_out = read_library(LIBRARY)
    assert len(pieces) == 123 and not left_out
    beds = bank_of([p for p in pieces if p.name == "bed_001"], factors=(1.0,))
    seat = beds.shapes[0].seats[0]
    line = np.array([[0.0, -0.2, seat.height + LIES_OVER], [0.0, 0.2, seat.height + LIES_OVER]])
    found = bed_shape_for(
        np.random.default_rng(0), beds, Interaction("bed", 0, 30, line, 0.0), _free(0.0), []
    )
    assert found is not None
    along = np.array([[0.0, y, seat.height - 0.03] for y in (-0.9, -0.4, 0.0, 0.5)])
    assert (beds.distances(found.shapes, along) < 0.02).all(), "mattress all along the body"
