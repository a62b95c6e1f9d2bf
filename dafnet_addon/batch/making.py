"""One shot, made by ``dafnet populate`` in a process of its own.

The process writes its folder whole or not at all, and ends when the one that started it is gone.
While it works it holds its log locked, so that no other run makes the same shot at the same time.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO

from ..core.errors import DafnetError, InputError
from ..core.files import save_text
from ..core.manifest import content_hash, read_manifest, words_hash
from ..core.stopping import ENDS_WITH_STDIN
from ..core.text import printable
from ..core.weights import shipped_weights

try:
    import fcntl
except ImportError:  # on Windows: two runs at once may make a shot twice, and both whole
    fcntl = None  # type: ignore[assignment]

__all__ = ["SAYS", "Order", "Outcome", "Processes", "make", "program"]

SAYS = "dafnet: "
"""How the command begins the sentence of an error."""

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""A process a core; and so results do not depend on how many cores there are."""
_WAITS = 10.0
"""Seconds for the lock of a process that is just ending, and for processes that are told to end."""


@dataclass(frozen=True)
class Order:
    """A shot to be made: its ``words``, the ``folder`` that it becomes, where its ``log`` is
    written, and other ``weights`` than those that ship. ``program``: whose ``populate`` makes it;
    empty for this one, wherever it is made.
    """

    name: str
    words: Mapping[str, Any]
    folder: Path
    log: Path
    weights: Path | None = None
    program: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What became of a shot: ``state`` is "made", "unchanged", "failed" or "busy", for which
    ``sentence`` gives the reason. ``seconds``: of the process.
    """

    name: str
    state: str
    sentence: str = ""
    seconds: float = 0.0
    log: Path | None = None


def program() -> tuple[str, ...]:
    """The command ``dafnet``, as this process runs it: Python, or a real Blender."""
    blender = getattr(getattr(sys.modules.get("bpy"), "app", None), "binary_path", "")
    if blender:
        return (blender, "--background", "--command", "dafnet")
    return (sys.executable, "-m", "dafnet_addon")


@dataclass
class Processes:
    """Those that are at work, so that all can be ended at once."""

    _at_work: "set[subprocess.Popen[bytes]]" = field(default_factory=set)
    _lock: Lock = field(default_factory=Lock)
    _ended: bool = False

    @contextmanager
    def start(self, command: list[str], **options: Any) -> "Iterator[subprocess.Popen[bytes]]":
        """A process in a group of its own, which is ended with the block at the latest."""
        windows = os.name == "nt"
        group: dict[str, Any] = {"start_new_session": True}
        if windows:
            group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}  # type: ignore[attr-defined,unused-ignore]
        with self._lock:
            if self._ended:
                raise InputError("The batch was stopped; run it again to go on.")
            process = subprocess.Popen(command, **group, **options)
            self._at_work.add(process)
        try:
            yield process
        finally:
            if process.poll() is None:
                _end([process])
            with self._lock:
                self._at_work.discard(process)

    def end(self) -> None:
        """End all, and start no other."""
        with self._lock:
            self._ended = True
            at_work = list(self._at_work)
        _end(at_work)


def _end(processes: "list[subprocess.Popen[bytes]]") -> None:
    """Tell them to end, and make them where they do not."""
    for process in processes:
        _signal(process, getattr(signal, "CTRL_BREAK_EVENT", signal.SIGTERM))
    until = time.monotonic() + _WAITS
    for process in processes:
        try:
            process.wait(max(0.0, until - time.monotonic()))
        except subprocess.TimeoutExpired:
            _signal(process, getattr(signal, "SIGKILL", signal.SIGTERM))
            process.wait()


def _signal(process: "subprocess.Popen[bytes]", number: int) -> None:
    """To a process and, where there are such, all that it has started."""
    with suppress(OSError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)


def make(order: Order, processes: Processes | None = None) -> Outcome:
    """Make a shot; what became of it is an ``Outcome``, whatever it is."""
    started = time.monotonic()
    try:
        state, sentence = _made(order, processes or Processes())
    except BlockingIOError:
        state, sentence = "busy", "Another run makes it just now; run again when that has ended."
    except DafnetError as error:
        state, sentence = "failed", str(error)
    except OSError as error:
        what = printable(error.filename or "A file", 200)
        state, sentence = "failed", f"'{what}' cannot be used ({error.strerror}); check its path."
    return Outcome(order.name, state, sentence, time.monotonic() - started, order.log)


def _made(order: Order, processes: Processes) -> tuple[str, str]:
    """Make a shot, unless another run has made it since it was asked for; its state, and why it was
    not made.
    """
    order.log.parent.mkdir(parents=True, exist_ok=True)
    with order.log.open("ab") as log:
        _lock(log)
        manifest = read_manifest(order.folder)
        weights = content_hash(order.weights or shipped_weights())
        if manifest and not manifest.what_changed(words_hash(order.words), weights):
            return "unchanged", ""

        log.truncate(0)
        words = order.log.with_suffix(".json")
        save_text(words, json.dumps(order.words, indent=2))

        command = [*(order.program or program()), "populate", str(words), "-o", str(order.folder)]
        command += ["--weights", str(order.weights)] if order.weights else []
        inherited = {"pass_fds": (log.fileno(),)} if fcntl else {}
        with processes.start(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=_environment(),
            **inherited,
        ) as process:
            said = _listen(process, log)
            code = process.wait()
    return ("made", "") if code == 0 else ("failed", _why(code, said))


def _lock(log: BinaryIO) -> None:
    """Lock a log for as long as it is open here or in a process that inherits it.

    Raises BlockingIOError where another run has it.
    """
    if fcntl is None:
        return
    until = time.monotonic() + _WAITS
    while True:
        try:
            fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)
        except OSError:  # a disk that knows no locks
            return
        else:
            return


def _environment() -> dict[str, str]:
    package = str(Path(__file__).absolute().parents[2])
    before = os.environ.get("PYTHONPATH")
    return {
        **os.environ,
        **dict.fromkeys(_ONE_THREAD, "1"),
        ENDS_WITH_STDIN: "1",
        "PYTHONPATH": os.pathsep.join([package, before] if before else [package]),
        "PYTHONIOENCODING": "utf-8",
    }


def _listen(process: "subprocess.Popen[bytes]", log: BinaryIO) -> str:
    """Write down what a process says until it ends; the last sentence of ours in it."""
    said = ""
    assert process.stdout is not None
    for line in process.stdout:
        with suppress(OSError):  # a full disk is the process's to tell
            log.write(line)
            log.flush()
        text = line.decode("utf-8", errors="replace").strip()
        if text.startswith(SAYS):
            said = text.removeprefix(SAYS)
    return printable(said, 1000)


def _why(code: int, said: str) -> str:
    if code < 0:
        with suppress(ValueError):
            return (
                f"Its process was killed ({signal.Signals(-code).name}), as happens where memory "
                "runs out; run again, if need be with fewer workers."
            )
    return said or f"Its process ended with code {code} and no reason; look into its log."
