"""``dafnet bench wanted`` says what is missed first, and counts postures as an eye would."""

import importlib.util

import numpy as np
import pytest

if not importlib.util.find_spec("torch"):
    pytest.skip("needs torch", allow_module_level=True)

from benchmarks.wanted import Wanted, postures

pytestmark = pytest.mark.torch


def test_what_is_wanted_is_met_within_its_bounds() -> None:
    assert Wanted("share", 92.0, "58 clips", least=92.0).met
    assert not Wanted("share", 91.9, "58 clips", least=92.0).met
    assert not Wanted("error", 3.1, "58 clips", most=3.0).met
    assert Wanted("life", 0.5, "58 clips", 0.5, 1.5).met
    assert not Wanted("life", float("nan"), "no clips", 0.5, 1.5).met
    row = Wanted("life", 0.4567, "58 clips", 0.5, 1.5, (0.4, 0.5)).cells()
    assert row == ("life", "0.457", "0.4 to 0.5", "0.5 to 1.5", "no", "58 clips")
    assert Wanted("error", 2.0, "58 clips", most=3.0).cells()[3] == "≤ 3"


def test_postures_are_as_many_as_differ_from_each_other() -> None:
    heads, level = np.zeros((8, 3)), np.zeros(8)
    assert postures(heads, level) == 1
    heads[3:, 0] = 0.09
    assert postures(heads, level) == 1, "heads 9 cm apart"
    heads[3:, 0] = 0.11
    assert postures(heads, level) == 2
    assert postures(np.zeros((8, 3)), np.array([0, 0, 0, 9, 9, 12, 12, 22.0])) == 3
    # a row of heads, each 6 cm from the next one: every other one counts
    row = np.arange(8)[:, None] * (0.06, 0.0, 0.0)
    assert postures(row, level) == 4
