"""Paths for all tests, and what is skipped where something is missing.

Folders mirror the packages. Tests of the core need NumPy alone; those of the Blender side are in
``blender``, whose own conftest starts it.
"""

import importlib.util
import os
import signal
import sys
import tempfile
from pathlib import Path

import pytest

TESTS = Path(__file__).absolute().parent
for folder in (TESTS.parent, TESTS):  # the package, and what tests share
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

from kit.datasets import small_dataset  # noqa: E402 - found only now
from kit.places import FURNITURE, LIBRARY, MOCAP  # noqa: E402

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

_NEEDS = {
    "torch": (bool(importlib.util.find_spec("torch")), "torch"),
    "mocap": (any(MOCAP.glob("*.npz")), f"the motion capture in {MOCAP}"),
    "furniture": (LIBRARY.is_dir(), f"the pieces of furniture in {FURNITURE}"),
}


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    """A small training set of swaying bodies, each window at a height of its own that the sensor
    shows.
    """
    return small_dataset(tmp_path / "dataset")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs something that is not here."""
    for marker, (there, what) in _NEEDS.items():
        if not there and item.get_closest_marker(marker):
            pytest.skip(f"needs {what}")
