"""Long jobs are generators that yield their progress in [0, 1] and return their result."""

from collections.abc import Callable, Generator
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, Protocol, TypeVar

__all__ = ["Stepwise", "run_to_end", "stepwise", "within"]

_T = TypeVar("_T")
_Given = ParamSpec("_Given")
_Result = TypeVar("_Result", covariant=True)


def run_to_end(
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


class Stepwise(Protocol[_Given, _Result]):
    """A job as a function, which runs it to its end."""

    @property
    def steps(self) -> Callable[_Given, Generator[float, None, _Result]]:
        """The job itself, which yields its progress on the way."""

    def __call__(self, *given: _Given.args, **named: _Given.kwargs) -> _Result: ...


def stepwise(
    job: Callable[_Given, Generator[float, None, _Result]],
) -> Stepwise[_Given, _Result]:
    """Make of a generator function a plain one, which gives the result at once; the generator
    stays there as its ``steps``.

        @stepwise
        def occupancy(scene, path): …

        occupancy(scene, path)                                       # the result
        yield from within(occupancy.steps(scene, path), 0.5, 1.0)    # within a longer job
    """

    @wraps(job)
    def at_once(*given: _Given.args, **named: _Given.kwargs) -> _Result:
        return run_to_end(job(*given, **named))

    shown: Any = at_once
    shown.steps = job
    _, _, result = signature(job).return_annotation.__args__
    shown.__signature__ = signature(job).replace(return_annotation=result)
    return shown
