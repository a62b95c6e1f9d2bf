"""A real Blender, in which this working tree is an extension, for the tests of this folder.

It is there before they are collected, so that they import the very modules that Blender has loaded,
by their names: ``from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import baker``.
Without the module ``bpy`` they are skipped.
"""

import importlib
import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from kit.places import EXTENSION, ROOT

_THERE = importlib.util.find_spec("bpy") is not None
_status = 0


def _enable() -> None:
    """In the profile that the tests have of their own."""
    import bpy

    addon_utils = importlib.import_module("addon_utils")  # which is found once bpy is loaded
    link = Path(bpy.utils.user_resource("EXTENSIONS", path="user_default", create=True), "dafnet")
    if not link.exists():
        link.symlink_to(ROOT, target_is_directory=True)
    addon_utils.extensions_refresh(ensure_wheels=True)
    assert bpy.ops.preferences.addon_enable(module=EXTENSION) == {"FINISHED"}


if _THERE:
    _enable()


class _WithoutBlender(pytest.Module):
    """A file that is not even read, since it imports what is not there."""

    def collect(self) -> list[pytest.Item]:
        pytest.skip("needs the module bpy", allow_module_level=True)


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module:
    """Every test here has the marker ``blender``."""
    kind = pytest.Module if _THERE else _WithoutBlender
    module = kind.from_parent(parent, path=module_path)
    module.add_marker("blender")
    return module


@pytest.fixture
def blender() -> ModuleType:
    """The module ``bpy`` with an empty scene, and nothing drawn over it."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    display: Any = importlib.import_module(f"{EXTENSION}.dafnet_addon.blender.overlay.display")
    for kind in display.switched_on():
        display.switch(kind, False)
    display._declined.clear()
    return bpy


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    global _status
    _status = int(exitstatus)
    if _THERE:
        importlib.import_module("addon_utils").disable(EXTENSION)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Blender may crash or hang when Python ends with its module loaded: leave at once, with
    pytest's own status.
    """
    if _THERE:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_status)
