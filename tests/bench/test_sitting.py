"""Who is sent to a seat sits on it: as high as it carries one, and not inside of it."""

from typing import Any

import numpy as np
import pytest

from benchmarks import sitting
from benchmarks.made_seats import KINDS, made_seat
from dafnet_addon import CleanUp, Controls, Scene, generate, load_weights
from dafnet_addon.core.series import MODEL_FPS
from kit.places import LIBRARY

_ROW = {"height": 0.0, "place": 0.0, "turn": 0.0, "inside": {}, "told": []}


@pytest.mark.parametrize("name", KINDS)
def test_people_sit_on_top_of_what_is_made(name: str) -> None:
    for seed in range(3):
        made = made_seat(name, seed)
        again = made_seat(name, seed)
        np.testing.assert_array_equal(made.mesh.vertices, again.mesh.vertices)
        lowest, highest = made.mesh.vertices[:, 2].min(), made.mesh.vertices[:, 2].max()
        assert lowest > -0.01 and made.marks
        for mark in made.marks:
            assert 0.25 < 0.01 * mark["top"] < highest + 1e-6


@pytest.mark.parametrize(
    ("found", "fault"),
    [
        ({"height": -4.5}, "height"),
        ({"place": 11.0}, "place"),
        ({"turn": 25.0}, "turn"),
        ({"inside": {"shin": 3.0}}, "shin inside"),
    ],
)
def test_each_way_to_sit_badly_is_a_fault(found: dict[str, Any], fault: str) -> None:
    assert sitting.faults_of(_ROW) == []
    assert sitting.faults_of({**_ROW, **found}) == [fault]
    assert sitting.faults_of({"refused": "…", "agreed": False}) == ["refused"]
    assert sitting.faults_of({"refused": "…", "agreed": True}) == []


def _of(name: str) -> sitting.Situation:
    library = LIBRARY if LIBRARY.is_dir() and "_" in name else None
    (found,) = (each for each in sitting.situations(library) if each.name == name)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param("armchair_010 front", marks=pytest.mark.furniture),
        pytest.param("sofa_012 behind", marks=pytest.mark.furniture),
        "sofa 1 front",
    ],
)
def test_feet_stand_where_shins_have_room_before_a_sofa(name: str) -> None:
    asked, weights = _of(name), load_weights()
    solids, route, _ = asked.send()
    controls = Controls(fps=MODEL_FPS, root=route.path.matrices())
    scene = Scene(tuple(solids))
    hovers = generate(scene, controls, weights, clean_up=CleanUp(feet=1.0, reach=1.0))
    assert sitting._inside(hovers.joints, scene).keys() & {"shin", "foot"}, "it is the case"
    row, _, _ = sitting.row_of(asked, weights)
    assert not row["inside"] and not row["told"], row
    assert sitting.faults_of(row) == []


@pytest.mark.slow
def test_on_seats_that_nothing_was_tuned_on() -> None:
    report, summary = sitting.measure(None, lambda _: None, seeds=(7,))
    found = report["all"]
    assert found["sent"] == 2 * len(KINDS)
    assert found["right"] >= 80.0 and found["within 4 cm"] >= 95.0, summary
    assert found["foot inside"] == found["trunk inside"] == 0.0, summary
    assert found["shin inside"] <= 10.0, summary
