"""Figures of the weights' report come out again where they are measured again."""

import pytest

from benchmarks.rerun import drawn, made_again
from dafnet_addon.core.weights import load_weights
from dafnet_addon.training.evaluation.clips import COLUMNS
from kit.places import MOCAP


def test_drawn_by_seed() -> None:
    rows = {
        "free_t0": {"clips": 3, "jerk": 1.5, "skate_cm": 0.2, "intervals": {}},
        "ee_t0": {"jerk": 2.0},
    }
    chosen = drawn(rows, 3, seed=1)
    assert sorted(chosen) == [("ee_t0", "jerk"), ("free_t0", "jerk"), ("free_t0", "skate_cm")]
    assert len({tuple(drawn(rows, 1, seed)) for seed in range(20)}) == 3


@pytest.mark.torch
@pytest.mark.mocap
@pytest.mark.slow
def test_a_row_made_again() -> None:
    rows = load_weights(None).says("held_out")
    row = "ee_t0_bodies_in_training"
    again = made_again(MOCAP, row)
    figures = [name for name in COLUMNS if isinstance(rows[row].get(name), float)]
    assert len(figures) > 8
    for name in figures:
        assert again[name] == pytest.approx(rows[row][name], rel=0.01, abs=1e-9), name
