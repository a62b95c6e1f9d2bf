"""A task of many items, shared out over the machine's cores."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

from ..core.threads import cores

__all__ = ["map_in_processes"]


def _do_nothing() -> None:
    pass


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

    with ProcessPoolExecutor(processes, get_context("spawn"), start) as pool:
        for done, result in enumerate(pool.map(task, items)):
            progress((done + 1) / len(items))
            yield result
