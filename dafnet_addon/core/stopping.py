"""Ctrl-C and SIGTERM between two steps of a job, never within one.

Python makes Ctrl-C an exception wherever the interpreter happens to be. Inside Blender that may be
a driver, a handler or its own start, which print the exception and go on: the stop is lost, or what
it fell into is broken. A real Blender without a window takes Ctrl-C for itself.
"""

import os
import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType

__all__ = ["ENDS_WITH_STDIN", "Stop", "end_with_stdin"]

ENDS_WITH_STDIN = "DAFNET_ENDS_WITH_STDIN"
"""The variable of the environment that tells a process that its standard input is held open by
whoever started it.
"""

_SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGBREAK") if hasattr(signal, name)
]


class Stop:
    """Within the block a signal is remembered; then ``now`` raises KeyboardInterrupt with its
    number.

    A second signal does what it would without the block. Signals that the process was started to
    ignore stay ignored. In other threads than the main one Python cannot catch any: the block does
    nothing.
    """

    def __init__(self) -> None:
        self._asked: int | None = None
        self._before: dict[int, Callable[[int, FrameType | None], object] | int | None] = {}

    def __enter__(self) -> "Stop":
        if threading.current_thread() is threading.main_thread():
            for each in _SIGNALS:
                if signal.getsignal(each) is not signal.SIG_IGN:
                    self._before[each] = signal.signal(each, self._remember)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for each in list(self._before):
            self._give_back(each)

    def now(self) -> None:
        """Raise KeyboardInterrupt where the run was asked to stop."""
        if self._asked is not None:
            raise KeyboardInterrupt(self._asked)

    def _remember(self, number: int, _frame: FrameType | None) -> None:
        self._asked = number
        self._give_back(number)

    def _give_back(self, number: int) -> None:
        before = self._before.pop(number, None)
        signal.signal(number, signal.SIG_DFL if before is None else before)


def end_with_stdin() -> None:
    """End this process, wherever it is, as soon as its standard input is closed: whoever started it
    is gone, be it killed. Only where ``ENDS_WITH_STDIN`` asks for that; processes that this one
    starts are not asked.
    """
    if os.environ.pop(ENDS_WITH_STDIN, None):
        threading.Thread(target=_end_with_stdin, daemon=True).start()


def _end_with_stdin() -> None:
    while os.read(0, 1024):
        pass
    os._exit(128 + signal.SIGTERM)
