"""What a root path leads through: named where it does, no word where people walk and sit as they
may.
"""

import json

import numpy as np
import pytest

from dafnet_addon import Box, Controls, Mesh, Scene
from dafnet_addon.core.conditions import shot_steps
from dafnet_addon.core.distance import prepared
from dafnet_addon.core.passage import met_along, passages, seats_along
from dafnet_addon.core.paths import Route, Stop, facing, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.solids import BOX_TRIANGLES
from dafnet_addon.director.seats import NoSeat, seat_of
from dafnet_addon.director.walks import walk_to
from kit.places import LIBRARY


def block(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Box:
    a, b = np.array(low), np.array(high)
    return Box((a + b) / 2, (b - a) / 2, name=name)


def as_mesh(box: Box) -> Mesh:
    corners = (
        np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * box.half_size
        + box.center
    )
    return Mesh(corners, BOX_TRIANGLES, name=box.name)


def chair(height: float = 0.45, arms: bool = False) -> list[Box]:
    """It looks along +y; one sits over its origin."""
    parts = [
        ((-0.22, -0.22, height - 0.05), (0.22, 0.22, height)),
        ((-0.22, -0.26, height), (0.22, -0.22, height + 0.45)),
    ]
    if arms:
        parts += [((x, -0.22, height), (x + 0.05, 0.15, height + 0.2)) for x in (-0.27, 0.22)]
    return [block("Chair", low, high) for low, high in parts]


def desk(edge: float, top: float = 0.74) -> list[Box]:
    """Before the chair, its near edge at y = ``edge``."""
    legs = [
        block("Desk", (x, y, 0.0), (x + 0.05, y + 0.05, top))
        for x in (-0.7, 0.65)
        for y in (edge, edge + 0.6)
    ]
    return [block("Desk", (-0.7, edge, top - 0.03), (0.7, edge + 0.68, top)), *legs]


def comes(side: float = 2.5) -> Route:
    return route(
        Stop((side, -0.8), facing((-side, 0.6)), 0.3), Stop((0.0, 0.0), 0.0, 2.0, seated=True)
    )


def said(solids: list[Box] | list[Mesh], walked: Route) -> list[str]:
    shot = run_to_end(shot_steps(Scene(tuple(solids)), Controls(30.0, walked.path.matrices())))
    return [warning for warning in shot.warnings if "runs through" in warning]


@pytest.mark.parametrize("make", [lambda box: box, as_mesh], ids=["boxes", "meshes"])
@pytest.mark.parametrize("edge", [-0.15, 0.0, 0.15, 0.3])
def test_a_desk_over_or_before_the_chair_is_named_with_its_time(make, edge: float) -> None:
    walked = comes()
    solids = [make(box) for box in chair() + desk(edge)]
    (warning,) = said(solids, walked)
    assert (
        "'Desk'" in warning
        and "'Chair'" not in warning
        and warning.endswith("move the path or the furniture.")
    )
    met = met_along(Scene(tuple(solids)), walked.path, 30.0)
    assert {each.name for each in met} == {"Desk"}
    y = walked.path.position[:, 1]
    under = np.flatnonzero((y > edge) & (np.abs(walked.path.position[:, 0]) < 0.7))
    assert abs(met[0].start - under[0]) < 6 and f"from {met[0].start / 30:.1f}"[:-2] in warning


@pytest.mark.parametrize("height", [0.35, 0.45, 0.55, 0.65, 0.75, 0.84])
@pytest.mark.parametrize("make", [lambda box: box, as_mesh], ids=["boxes", "meshes"])
def test_chairs_stools_and_armchairs_are_sat_on_without_a_word(make, height: float) -> None:
    leaving = route(
        Stop((0.5, 3.0), np.pi, 0.3),
        Stop((0.0, 0.0), 0.0, 2.0, seated=True),
        (1.5, 1.2),
        Stop((3.0, 0.0), 0.0, 1.0),
    )
    for walked in (comes(), comes(-2.5), leaving):
        for solids in (chair(height), chair(height, arms=True), chair(height)[:1]):
            assert said([make(box) for box in solids], walked) == []


def test_a_chair_at_a_desk_with_room_and_a_sofa_with_cushions_are_no_hindrance() -> None:
    assert said(chair() + desk(0.75), comes()) == []
    sofa = [
        block("Sofa", (-1.0, -0.35, 0.1), (1.0, 0.35, 0.32)),
        block("Sofa", (-1.0, -0.5, 0.1), (1.0, -0.35, 0.8)),
        block("Cushion", (-0.5, -0.3, 0.32), (0.5, 0.35, 0.5)),
        block("Pillow", (0.3, -0.3, 0.5), (0.6, -0.2, 0.8)),
    ]
    assert said(sofa, comes()) == [] == said([as_mesh(box) for box in sofa], comes())
    bar = block("Chair", (-0.2, -0.02, 0.2), (0.2, 0.02, 0.24))
    assert said([*chair(), bar], comes()) == [], "a cross-bar under the seat"


def test_on_a_bed_one_may_lie_down_far_from_where_one_sat() -> None:
    bed = [block("Bed", (-1.0, -1.2, 0.2), (1.0, 0.3, 0.5))]
    sits = comes()
    lies = np.concatenate(
        [
            sits.path.position,
            sits.path.position[-1] - np.linspace(0.0, 0.7, 90)[:, None] * (0.0, 1.0, 0.0),
        ]
    )
    path = RootPath(lies, np.concatenate([sits.path.yaw, np.full(90, sits.path.yaw[-1])]))
    assert said(bed, Route(path, ())) == []


@pytest.mark.parametrize(
    "solid",
    [
        block("Table", (-0.5, -0.5, 0.70), (0.5, 0.5, 0.73)),
        block("Bench", (-0.5, -0.5, 0.0), (0.5, 0.5, 0.55)),
        block("Cupboard", (-0.3, -0.3, 0.0), (0.3, 0.3, 1.9)),
        block("Rail", (-0.5, -0.03, 1.0), (0.5, 0.03, 1.05)),
    ],
    ids=lambda box: box.name,
)
def test_who_walks_through_something_is_told(solid: Box) -> None:
    walked = route(Stop((0.0, -2.0), 0.0, 0.2), Stop((0.0, 2.0), 0.0, 0.2))
    for each in (solid, as_mesh(solid)):
        (warning,) = said([each], walked)
        assert f"'{solid.name}'" in warning
    aside = route(Stop((0.9, -2.0), 0.0, 0.2), Stop((0.9, 2.0), 0.0, 0.2))
    assert said([solid], aside) == []


def test_a_sheet_without_thickness_is_met_and_several_pieces_are_one_sentence() -> None:
    walked = route(Stop((0.0, -2.0), 0.0, 0.2), Stop((0.0, 6.0), 0.0, 0.2))
    sheets = [
        Mesh(
            np.array([(x, y, z) for x in (-1.0, 1.0) for z in (0.0, 2.0)]),
            np.array([(0, 1, 2), (1, 3, 2)]),
            name=f"Wall {k}",
        )
        for k, y in enumerate((0.0, 1.0, 2.0, 3.0, 4.0))
    ]
    (warning,) = said(sheets, walked)
    assert "'Wall 0'" in warning and "'Wall 2'" in warning and "and 2 more" in warning


def test_a_seat_that_rides_along_is_sat_on() -> None:
    path = RootPath(np.c_[np.linspace(0.0, 4.0, 120), np.zeros((120, 2))], np.zeros(120))
    seat = block("Trolley", (-0.22, -0.22, 0.5), (0.22, 0.22, 0.62))
    moving = Box(
        seat.center + path.position, seat.half_size, np.tile(np.eye(3), (120, 1, 1)), "Trolley"
    )
    assert passages(Scene((moving,)), path, 30.0, seats_along(Scene((moving,)), path, 30.0)) == ()
    standing = Box(seat.center + np.array([2.0, 0.0, 0.0]), seat.half_size, name="Stool")
    met = passages(Scene((standing,)), path, 30.0, seats_along(Scene((standing,)), path, 30.0))
    assert [each.name for each in met] == ["Stool"]


@pytest.mark.furniture
def test_real_seats_are_sat_on_without_a_word() -> None:
    index = json.loads((LIBRARY / "index.json").read_text(encoding="utf-8"))
    met: set[str] = set()
    tried = 0
    for piece in index["pieces"]:
        if piece["kind"] not in {"armchair", "bench", "chair", "sofa", "stool", "toilet"}:
            continue
        arrays = np.load(LIBRARY / f"{piece['name']}.npz")
        mesh = Mesh(arrays["vertices"].astype(float), arrays["triangles"], name=piece["name"])
        scene, _ = prepared(Scene((mesh,)), 0.0)
        try:
            spot = seat_of([mesh], np.array((2.5, -1.5)), name=piece["name"])
        except NoSeat:
            assert piece["name"] in {"armchair_007", "armchair_015"}, (
                "a lounger, 13 cm over the ground, and one with a footstool before it"
            )
            continue
        seat = Stop((float(spot.position[0]), float(spot.position[1])), spot.yaw, 2.0, seated=True)
        path = walk_to([mesh], Stop((2.5, -1.5), 0.0, 0.3), seat).path
        met |= {each.name for each in passages(scene, path, 30.0, seats_along(scene, path, 30.0))}
        tried += 1
    assert tried > 60
    assert not met
