"""What the tests of the animator's own rigs share. Blender is imported by those that ask for it."""

import importlib
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest


@pytest.fixture(scope="module")
def takes() -> dict[str, Any]:
    """The takes that are baked onto rigs, by what is done in them."""
    made: dict[str, Any] = importlib.import_module("kit.rig_stage").made_takes()
    return made


@pytest.fixture(scope="module", autouse=True)
def without_rigify_afterwards() -> Iterator[None]:
    """Rigs are built with Rigify, which other tests do without."""
    yield
    addon_utils = importlib.import_module("addon_utils")
    if addon_utils.check("rigify")[1]:
        addon_utils.disable("rigify")


@pytest.fixture
def stage(blender: ModuleType, takes: dict[str, Any]) -> Any:
    """A character beside whom a rig can be built."""
    return importlib.import_module("kit.rig_stage").RigStage(takes)
