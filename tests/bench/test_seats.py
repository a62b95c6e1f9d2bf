"""The shipped weights do what the product is for: they sit where there is a seat, and only
there.
"""

import numpy as np
import pytest

from benchmarks import seats
from dafnet_addon.core.solids import box_distance


@pytest.mark.parametrize("back", [False, True])
def test_the_benchmark_puts_its_seat_under_the_pelvis_and_nothing_in_the_way(back: bool) -> None:
    scene = seats.seat(0.5, back)
    highest = max(box.center[2] + box.half_size[2] for box in scene.solids)
    assert highest == pytest.approx(0.92 if back else 0.5)
    for way in seats.approaches().values():
        position = way.path.position + np.array([0, 0, 0.9])
        distance = np.min(
            [box_distance(position - box.center, box.half_size) for box in scene.solids], axis=0
        )
        assert distance[way.rests[-1].stop - 1] < 0.41
        assert distance[: way.rests[-1].start - 60].min() > 0.25, "the way leads through the seat"


@pytest.mark.slow
def test_sits_at_four_heights_from_three_sides_and_stands_elsewhere() -> None:
    report, summary = seats.measure(
        None, lambda _: None, heights=[0.38, 0.45, 0.54, 0.63], noise=[(0.0, 0)]
    )
    assert report["sits"] >= 0.8, summary
    assert report["largest_drop_without_seat"] < 0.12, summary
