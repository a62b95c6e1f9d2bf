"""Files of the user's, written whole or not at all.

What is written goes to a name of its own beside the file, which it takes the place of in one step.
So two runs that write to one file leave the one or the other, and what a killed run leaves is never
taken for its output; the next run that writes to that folder removes it.
"""

import os
import re
import secrets
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError

__all__ = ["require_writable", "save_text", "whole_file"]

_HOST = re.sub(r"[^0-9A-Za-z]", "", socket.gethostname())[:32]
_PART = re.compile(r"\.dafnet-(?P<host>\w*)-(?P<process>\d+)-(?P<name>[0-9a-f]{16})\.part")
"""How the name of an unfinished file begins; Blender puts an @ behind it while it writes."""
_ours: set[str] = set()
"""Names of what this process is writing."""


def save_text(path: Path, text: str) -> None:
    """Write a text, in UTF-8 with a line end behind it. ``InputError`` as for ``whole_file``."""
    with whole_file(path) as part:
        part.write_text(text.rstrip("\n") + "\n", encoding="utf-8")


def require_writable(path: Path) -> None:
    """Raise InputError where ``path`` cannot be written, before anything is computed for it; makes
    nothing.
    """
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; give the output another name.")

    folder = _existing(path.absolute().parent)
    if not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder; give the output another place.")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(
            f"The folder '{folder}' may not be written to; give the output another place."
        )


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A new name beside ``path`` to write to; what lies there when the block ends well becomes
    ``path`` in one step.

    Until then ``path`` is what it was, whatever fails and whenever the process is killed. Links are
    followed, folders that are missing are made. Where the block fails, neither the new name nor a
    new folder is left. Raises InputError where the disk refuses.
    """
    path = Path(os.path.realpath(path))
    name = secrets.token_hex(8)
    part = path.with_name(f".dafnet-{_HOST}-{os.getpid()}-{name}.part")
    made: list[Path] = []
    _ours.add(name)
    try:
        made = _make(path.parent)
        _remove_abandoned(path.parent)
        yield part
        _replace(part, path)
    except OSError as error:
        raise InputError(
            f"'{path}' cannot be written ({error.strerror or error}); give the output another "
            "place."
        ) from error
    finally:
        for left in (part, part.with_name(part.name + "@")):
            with suppress(OSError):
                left.unlink(missing_ok=True)
        _ours.discard(name)
        for folder in reversed(made):
            with suppress(OSError):  # it is not empty
                folder.rmdir()


def _replace(part: Path, path: Path) -> None:
    """Put a file in another's place, once it is on the disk."""
    with part.open("rb+") as written:
        os.fsync(written.fileno())

    try:
        os.replace(part, path)
    except PermissionError as error:  # on Windows, where an open file is not replaced
        raise InputError(
            f"'{path}' cannot be replaced; close it in other programs, or give the output another "
            "name."
        ) from error

    if os.name == "posix":  # elsewhere a folder cannot be opened
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _existing(folder: Path) -> Path:
    """The folder, or the one above that is there."""
    while not os.path.lexists(folder):
        folder = folder.parent
    return folder


def _make(folder: Path) -> list[Path]:
    """Make a folder and those above it; those that were made, the uppermost first."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing[::-1]


def _remove_abandoned(folder: Path) -> None:
    """Remove what killed runs of this machine left in a folder."""
    for each in os.scandir(folder):
        found = _PART.match(each.name)
        if found is None or found["host"] != _HOST or found["name"] in _ours:
            continue
        process = int(found["process"])
        if process == os.getpid() or not _runs(process):
            with suppress(OSError):
                os.unlink(each.path)


def _runs(process: int) -> bool:
    """Whether there is a process of this number."""
    if sys.platform == "win32":
        import ctypes

        handle = ctypes.windll.kernel32.OpenProcess(0x1000, False, process)  # to ask, not to touch
        if handle:
            ctypes.windll.kernel32.CloseHandle(handle)

        # it is there, but not ours
        return bool(handle) or ctypes.windll.kernel32.GetLastError() == 5

    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True

    return True
