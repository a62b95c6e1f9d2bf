"""Takes that hover over seats or sink into them come to rest where those carry a body, as the
benchmark measures it.
"""

import runpy

import pytest

from dafnet_addon.core.draws import Draw
from kit.places import LIBRARY, ROOT

REST = runpy.run_path(str(ROOT / "benchmarks" / "rest.py"))


def test_what_the_benchmark_calls_right_is_where_the_piece_carries_one() -> None:
    stool, *_ = REST["made_pieces"]()
    weights = REST["load_weights"](None)
    over = [-0.08, 0.1]
    rows = list(REST["rests_of"](stool, weights, (Draw(),), over))
    assert [row["over"] for row in rows] == over
    for row in rows:
        top = stool.surface + row["raised"]
        raised = REST["_raised"](stool.solids[0], row["raised"])
        assert raised.center[2] + raised.half_size[2] == pytest.approx(top)
        assert abs(row["error"]) <= 0.015


@pytest.mark.slow
def test_on_seats_of_every_kind_made_of_boxes() -> None:
    report, summary = REST["measure"](
        None, lambda _: None, over=[-0.1, 0.05, 0.14], draws=(Draw(seed=1, temperature=1.0),)
    )
    found = report["all"]
    assert found["takes"] > 15, summary
    assert found["within_1.5_cm"] == found["knees_as_people"] == found["jerk_right"] == 100, summary
    assert found["feet_stay"] == 100, summary
    assert found["thighs_in_cm"] < 2.0 and found["trunk_in_cm"] == 0.0, summary


@pytest.mark.slow
@pytest.mark.furniture
@pytest.mark.parametrize("name", ["armchair_004", "bench_001", "chair_005", "sofa_003"])
def test_on_real_pieces(name: str) -> None:
    library = pytest.importorskip("dafnet_addon.data.furnish.library")
    (piece,) = (each for each in library.read_library(LIBRARY)[0] if each.name == name)
    placed = REST["real_piece"](piece)
    weights = REST["load_weights"](None)
    for row in REST["rests_of"](placed, weights, (Draw(),), [-0.1, 0.1]):
        assert abs(row["error"]) <= 0.015 and row["jerk"] <= 1.1, row
