"""Paths for all tests, and a real Blender with the extension enabled for those that ask for it.

Core tests need NumPy alone. Tests of the Blender side use the fixture ``blender``, which enables
this working tree as an extension in a fresh user profile, and an empty scene for each test; they
are skipped where no ``bpy`` module is installed.
"""

import importlib
import importlib.util
import os
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

TESTS = Path(__file__).absolute().parent
for folder in (TESTS.parent, TESTS):  # the package, and what tests share
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

from kit.places import EXTENSION, ROOT  # noqa: E402 - found only now

if "bpy" not in sys.modules:
    os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="dafnet_tests_")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # Started in the background of a shell that ignores Ctrl-C for it: what is tested here is what
    # Ctrl-C does.
    signal.signal(signal.SIGINT, signal.default_int_handler)

if importlib.util.find_spec("hypothesis"):
    from hypothesis import HealthCheck, Phase, settings

    settings.register_profile(
        "tenth",
        max_examples=100,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.generate, Phase.shrink),
    )
    settings.register_profile("full", settings.get_profile("tenth"), max_examples=1000)
    settings.load_profile("tenth")

_state = {"enabled": False, "status": 0}


def enable_extension() -> None:
    """Enable this working tree as an extension, in the profile made above."""
    import bpy

    addon_utils = importlib.import_module("addon_utils")  # which is found once bpy is loaded
    link = Path(bpy.utils.user_resource("EXTENSIONS", path="user_default", create=True), "dafnet")
    if not link.exists():
        link.symlink_to(ROOT, target_is_directory=True)
    addon_utils.extensions_refresh(ensure_wheels=True)
    assert bpy.ops.preferences.addon_enable(module=EXTENSION) == {"FINISHED"}
    _state["enabled"] = True


if importlib.util.find_spec("bpy"):
    # Before any test is collected, so that tests import the very modules that Blender has loaded.
    enable_extension()


@pytest.fixture
def blender() -> ModuleType:
    """The module ``bpy`` with an empty scene and the extension enabled."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy


@pytest.fixture
def addon() -> Callable[[str], ModuleType]:
    """A module that Blender has loaded, by its path in the repository; new tests import it by its
    name.
    """
    pytest.importorskip("bpy")
    return lambda name: importlib.import_module(f"{EXTENSION}.{name}")


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """A small training set of swaying bodies, each window at a height of its own that the sensor
    shows.
    """
    from kit.datasets import small_dataset

    return small_dataset(tmp_path / "dataset")


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    if _state["enabled"]:
        importlib.import_module("addon_utils").disable(EXTENSION)
    _state["status"] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Blender may crash or hang when Python ends with its module loaded: leave at once, with
    pytest's own status.
    """
    if "bpy" in sys.modules and _state["enabled"]:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_state["status"])
