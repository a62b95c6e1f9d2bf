"""How many cores there are to work on; and one thread for NumPy's matrix library, where the
matrices are small.

Frame by frame the sampler multiplies vectors of a few hundred values; handing those to several
threads costs more than it saves, and a hundred times more where another program keeps the cores
busy. The library that does this everywhere, threadpoolctl, is not in Blender, so the two calls it
would make to OpenBLAS are made here. Where NumPy brings another library, or it cannot be reached,
nothing is changed.
"""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

__all__ = ["cores", "one_thread"]

_QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""What a container is given on Linux: microseconds of processor in so many microseconds, or "max".
"""

_NAMES = (
    "scipy_openblas_{}_num_threads64_",
    "scipy_openblas_{}_num_threads",
    "openblas_{}_num_threads64_",
    "openblas_{}_num_threads",
)


def cores() -> int:
    """How many cores this process may use: of those it is bound to, no more than its container is
    given; at least one.
    """
    bound = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    try:
        given, period = map(int, _QUOTA.read_text(encoding="utf-8").split())
    except (OSError, ValueError):  # another system, or no quota
        return bound
    return max(1, min(bound, given // period))


@cache
def _openblas() -> tuple[Callable[[], int], Callable[[int], None]] | None:
    """OpenBLAS' own getter and setter of its number of threads, from the library that NumPy has
    loaded.
    """
    core = getattr(np, "_core", None) or np.core
    try:
        library = ctypes.CDLL(core._multiarray_umath.__file__)
    except (OSError, AttributeError):
        return None

    for name in _NAMES:
        if hasattr(library, name.format("get")) and hasattr(library, name.format("set")):
            return getattr(library, name.format("get")), getattr(library, name.format("set"))

    return None


@contextmanager
def one_thread() -> Iterator[None]:
    """Within this context NumPy multiplies matrices on one thread; afterwards on as many as
    before.
    """
    found = _openblas()
    if found is None:
        yield
        return

    get, put = found
    before = get()
    put(1)
    try:
        yield
    finally:
        put(before)
