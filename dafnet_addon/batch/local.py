"""Shots are made on this machine, several at once."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from queue import Empty, SimpleQueue

from .making import Order, Outcome, Processes, make

__all__ = ["TICK", "Workers", "local_workers"]

Workers = Callable[[Iterable[Order]], Iterator[Outcome | None]]
"""Makes shots and gives what became of each as soon as it is known; None every ``TICK`` meanwhile,
so that the caller can stop.
"""
TICK = 0.5  # seconds


@contextmanager
def local_workers(count: int) -> Iterator[Workers]:
    """As many at once; when the block ends so do all processes."""
    processes = Processes()

    def outcomes(orders: Iterable[Order]) -> Iterator[Outcome | None]:
        results: SimpleQueue[Future[Outcome]] = SimpleQueue()
        waiting = 0
        for order in orders:
            pool.submit(make, order, processes).add_done_callback(results.put)
            waiting += 1
        while waiting:
            try:
                done = results.get(timeout=TICK)
            except Empty:
                yield None
            else:
                waiting -= 1
                yield done.result()

    with ThreadPoolExecutor(count) as pool:
        try:
            yield outcomes
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            processes.end()
