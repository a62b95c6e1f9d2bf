"""What any attempt may take, whatever file or scene is handed in."""

import signal
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["TooLong", "bounded"]

SECONDS, MEGABYTES = 5.0, 200


class TooLong(BaseException):
    """The attempt took more than ``SECONDS`` of the processor's time, which a busy machine does not
    lengthen.
    """


@contextmanager
def bounded() -> Iterator[None]:
    """Fails where what is done within takes too long or too much memory."""

    def late(*_: object) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, late)
    tracemalloc.start()
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
        peak = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
    assert peak < MEGABYTES, f"{peak:.0f} MB"
