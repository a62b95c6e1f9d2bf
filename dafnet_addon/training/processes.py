"""A task of many items, shared out over the machine's cores."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from typing import Any

from ..core.threads import cores

__all__ = ["map_in_processes", "new_processes"]


def _do_nothing() -> None:
    pass


def new_processes(processes: int, start: Callable[[], None] = _do_nothing) -> ProcessPoolExecutor:
    """So many new processes, each of which first calls ``start``, and none of which outlives this
    one, be it killed.
    """
    return ProcessPoolExecutor(processes, get_context("spawn"), _begin, (start,))


def _begin(start: Callable[[], None]) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(128 + signal.SIGTERM)


def map_in_processes(
    task: Callable[[Any], Any],
    items: Sequence[Any],
    processes: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
    start: Callable[[], None] = _do_nothing,
) -> Iterator[Any]:
    """``task`` of each item, in order, in ``processes`` (None: one for each core), each of which
    first calls ``start``.

    Where one is enough, it is the process that calls, which saves the cost of a new one.
    """
    processes = max(1, min(processes or cores(), len(items)))
    if processes == 1:
        start()
        for done, item in enumerate(items):
            result = task(item)
            progress((done + 1) / len(items))
            yield result
        return

    with new_processes(processes, start) as pool:
        for done, result in enumerate(pool.map(task, items)):
            progress((done + 1) / len(items))
            yield result
