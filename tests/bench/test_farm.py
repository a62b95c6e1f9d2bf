"""The sheet of figures for a farm: its simulation, and what it says."""

import argparse

import pytest

from benchmarks.farm import Costs, sheet, simulated
from dafnet_addon.core.errors import InputError

GIVEN = {"shots": 1000, "machines": [1, 10], "cores": 4, "memory": 3.0, "killed": 0.0}


def test_shots_that_all_take_the_same() -> None:
    assert simulated([10.0], shots=6, slots=3, killed=0.0) == (20.0, 60.0)
    assert simulated([10.0], shots=7, slots=3, killed=0.0) == (30.0, 70.0)
    assert simulated([10.0], shots=1, slots=50, killed=0.0) == (10.0, 10.0)


def test_what_is_killed_is_made_again() -> None:
    seconds, spent = simulated([10.0], shots=2000, slots=10, killed=0.2)
    assert 2200.0 < seconds < 2300.0, "a quarter more attempts, half as long each"
    assert spent <= 10 * seconds


def test_many_machines_take_as_long_as_the_longest_shot() -> None:
    seconds, _ = simulated([1.0, 100.0], shots=100, slots=100, killed=0.0)
    assert seconds == 100.0


def test_the_sheet_says_how_many_fit_a_machine() -> None:
    costs = Costs(seconds=(8.0, 12.0), disk=(5.0, 7.0), memory=1000.0)
    said = sheet(costs, argparse.Namespace(**GIVEN))
    assert "10.0 s of a core each (8.0 to 12.0)" in said and "3 at once" in said
    one, ten = ([each.strip() for each in line.split("|")] for line in said.splitlines()[-2:])
    assert one[1] == "1" and one[4:6] == ["3.0", "6"] and ten[4:6] == ["3.0", "6"]
    assert 0.8 < float(one[3]) < 1.1
    with pytest.raises(InputError, match="more --memory"):
        sheet(costs, argparse.Namespace(**{**GIVEN, "memory": 0.5}))
