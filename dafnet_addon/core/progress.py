"""Long jobs are generators that yield their progress in [0, 1] and return their result."""

from collections.abc import Callable, Generator
from typing import TypeVar

__all__ = ["drained", "within"]

_T = TypeVar("_T")


def drained(
    steps: Generator[float, None, _T], progress: Callable[[float], None] = lambda share: None
) -> _T:
    """Run a job to its end and give its result; ``progress`` is called with every share done."""
    while True:
        try:
            progress(next(steps))
        except StopIteration as done:
            return done.value


def within(
    steps: Generator[float, None, _T], low: float, high: float
) -> Generator[float, None, _T]:
    """A job as the part from ``low`` to ``high`` of a longer one; closing the longer one closes
    it.
    """
    while True:
        try:
            share = next(steps)
        except StopIteration as done:
            return done.value
        yield low + (high - low) * share
