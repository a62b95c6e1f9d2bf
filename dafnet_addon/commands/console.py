"""The terminal: results on standard output, progress and errors on standard error, either of which
may be closed, full or no longer read.
"""

import io
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import TextIO

from ..core.errors import InputError
from ..core.text import duration

__all__ = [
    "MAX_SHOWN",
    "ProgressBar",
    "claim_stdout",
    "complain",
    "escape_unprintable",
    "flush_streams",
    "open_streams",
    "say",
]

MAX_SHOWN = 2000
"""Characters of a text from a file that are printed; ``--json`` gives all of it."""


def open_streams() -> None:
    """Open standard streams that were closed on the null device, before a file gets their number,
    and with it what is printed.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
            missing = getattr(sys, name) is None  # as in a program with windows
        except OSError:
            missing = True
        if missing:
            # The system gives it the lowest free number, which is this one where it was closed.
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115


def claim_stdout() -> None:
    """Keep standard output for what is said here, for the rest of the process.

    What else is printed, as Blender's own messages are by its C, goes to standard error; so JSON
    stays JSON. Only for a process that does nothing but run the command.
    """
    stream = sys.stdout
    stream.flush()
    ours = os.dup(stream.fileno())
    os.dup2(sys.stderr.fileno(), stream.fileno())
    sys.stdout = open(ours, "w", encoding=stream.encoding)  # noqa: SIM115 - until the process ends


def flush_streams() -> None:
    """Write what is still held back, before the process ends; what cannot be written is dropped."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _discard(stream)


def escape_unprintable() -> None:
    """Print letters that the terminal does not have as escapes, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def say(text: str) -> None:
    """Print the result on standard output; a reader that has read enough, such as ``head``, is not
    an error. Raises InputError where it cannot be written.
    """
    try:
        if text:
            print(text)
        sys.stdout.flush()
    except OSError as error:
        _discard(sys.stdout)
        if not isinstance(error, BrokenPipeError):
            raise InputError(
                f"The result cannot be written to standard output ({error.strerror})."
            ) from error


def complain(text: str, end: str = "\n") -> None:
    """Print on standard error, if anything reads it."""
    with suppress(OSError):
        print(text, end=end, file=sys.stderr, flush=True)


_SURE = 0.03
"""The part done from which the time left is told."""


class ProgressBar:
    """Progress for people, on standard error: a bar and the time left on a terminal, ten dots
    elsewhere.

    ``stop_if_asked`` is called at every step, and raises where the command is to stop.
    """

    def __init__(self, stop_if_asked: Callable[[], None]) -> None:
        self.stop_if_asked = stop_if_asked
        self.dots = 0
        self.shown = False
        self.started = monotonic()

    def __call__(self, progress: float) -> None:
        """Show the part done, in [0, 1]."""
        self.stop_if_asked()
        part = min(max(progress, 0.0), 1.0)
        self.shown = True

        if sys.stderr.isatty():
            filled = "#" * int(30 * part)
            bar = f"[{filled:.<30}] {100 * part:3.0f} %{self._left(part)}"
            complain(f"\r{bar:<60}", end="")
        elif int(10 * part) > self.dots:
            complain("." * (int(10 * part) - self.dots), end="")
            self.dots = int(10 * part)

    def _left(self, part: float) -> str:
        """How long it will take still, where there is enough to tell by."""
        spent = monotonic() - self.started
        if part < _SURE or part == 1.0 or spent < 2.0:
            return ""
        return f", {duration(spent * (1.0 - part) / part)} left"

    def __enter__(self) -> "ProgressBar":
        return self

    def __exit__(self, *_: object) -> None:
        if self.shown:
            complain("")


def _discard(stream: TextIO) -> None:
    """Point a stream that cannot be written at the null device: what it still holds would fail
    again at exit.
    """
    with open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), stream.fileno())
