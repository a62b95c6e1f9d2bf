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
from collections.abc import Iterator
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


@pytest.fixture(scope="session")
def extension() -> Iterator[str]:
    """Name of the enabled extension's package."""
    bpy = pytest.importorskip("bpy")
    import addon_utils

    link = Path(bpy.utils.user_resource("EXTENSIONS", path="user_default", create=True), "dafnet")
    if not link.exists():
        link.symlink_to(ROOT, target_is_directory=True)
    addon_utils.extensions_refresh(ensure_wheels=True)
    assert bpy.ops.preferences.addon_enable(module=EXTENSION) == {"FINISHED"}
    _state["enabled"] = True
    yield EXTENSION
    addon_utils.disable(EXTENSION)


@pytest.fixture
def blender(extension: str) -> ModuleType:
    """The module ``bpy`` with an empty scene and the extension enabled."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy


@pytest.fixture
def addon(extension: str):
    """Import a module of the extension by its path in the repository, as
    ``addon("dafnet_addon.blender.baker")``.
    """
    return lambda name: importlib.import_module(f"{extension}.{name}")


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """A small training set of swaying bodies, each window at a height of its own that the sensor
    shows.
    """
    from kit.datasets import small_dataset

    return small_dataset(tmp_path / "dataset")


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
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
