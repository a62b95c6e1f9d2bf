"""The examples in docstrings of the public API are true."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize(
    "name",
    [
        "dafnet_addon",
        "dafnet_addon.core.paths",
        "dafnet_addon.director",
        "dafnet_addon.director.planner",
    ],
)
def test_examples_are_true(name: str) -> None:
    found = doctest.testmod(importlib.import_module(name))
    assert found.attempted > 1 and not found.failed
