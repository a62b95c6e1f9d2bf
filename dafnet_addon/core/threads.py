"""Keeps NumPy's matrix library to one thread where the matrices are small.

Frame by frame the sampler multiplies vectors of a few hundred values; handing those to several threads costs more than it
saves, and a hundred times more where another program keeps the cores busy. The library that does this everywhere,
threadpoolctl, is not in Blender, so the two calls it would make to OpenBLAS are made here. Where NumPy brings another
library, or it cannot be reached, nothing is changed.
"""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np

__all__ = ["one_thread"]

_NAMES = ("scipy_openblas_{}_num_threads64_", "scipy_openblas_{}_num_threads", "openblas_{}_num_threads64_",
          "openblas_{}_num_threads")


@cache
def _openblas() -> tuple[Callable[[], int], Callable[[int], None]] | None:
    """OpenBLAS' own getter and setter of its number of threads, from the library that NumPy has loaded."""
    core = getattr(np, "_core", None) or np.core
    try:
        library = ctypes.CDLL(core._multiarray_umath.__file__)
    except OSError:
        return None
    for name in _NAMES:
        if hasattr(library, name.format("get")) and hasattr(library, name.format("set")):
            return getattr(library, name.format("get")), getattr(library, name.format("set"))
    return None


@contextmanager
def one_thread() -> Iterator[None]:
    """Within this context NumPy multiplies matrices on one thread; afterwards on as many as before."""
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
