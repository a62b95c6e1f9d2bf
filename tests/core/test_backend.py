"""The array library that is asked for is there, or its absence is told in a sentence."""

import importlib.util
import sys

import pytest

from dafnet_addon.core.backend import Backend
from dafnet_addon.core.errors import InputError


def test_a_device_that_is_not_there_is_told_in_a_sentence() -> None:
    named = "no such device" if importlib.util.find_spec("torch") else "PyTorch is not installed"
    with pytest.raises(InputError) as told:
        Backend("no such device")
    assert named in str(told.value) and "\n" not in str(told.value)
    assert str(told.value).count(". ") == 0 and str(told.value).endswith(".")


def test_without_torch_numpy_still_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InputError, match="leave the device out"):
        Backend("cpu")
    assert Backend().array([1.0, 2.0]).sum() == 3.0
