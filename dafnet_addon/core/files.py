"""Files and folders of the user's, written whole or not at all.

What is written goes to a name of its own beside the file, which it takes the place of in one step.
So two runs that write to one file leave the one or the other, and what a killed run leaves is never
taken for its output; the next run that writes to that folder removes it.
"""

import errno
import os
import platform
import re
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError

__all__ = [
    "is_device",
    "portable_name",
    "remove_abandoned",
    "require_replaceable",
    "require_writable",
    "save_text",
    "whole_file",
    "whole_folder",
]

_HOST = re.sub(r"[^0-9A-Za-z]", "", platform.node())[:32]
_PART = re.compile(r"\.dafnet-(?P<host>\w*)-(?P<process>\d+)-(?P<name>[0-9a-f]{16})\.part")
"""How the name of an unfinished file begins; Blender puts an @ behind it while it writes."""
_IN_THE_WAY = (errno.ENOTEMPTY, errno.EEXIST, errno.EACCES, errno.ENOTDIR)
"""What a system says where a folder is renamed to a name that is taken; Windows the third."""
_DEVICES = {"con", "prn", "aux", "nul"} | {f"{x}{k}" for x in ("com", "lpt") for k in "123456789"}
"""Names that are something else than files on Windows, with any ending."""
_ours: set[str] = set()
"""Names of what this process is writing."""


def is_device(name: str) -> bool:
    """Whether Windows takes the name of a file or folder, with whatever ending, for a device's."""
    return name.lower().split(".")[0] in _DEVICES


def portable_name(name: str) -> str:
    """A name that is a file's on every system, where ``name`` is one on most."""
    return f"{name}_" if is_device(name) else name


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

    _require_place(path)


def require_replaceable(folder: Path, marker: str) -> None:
    """Raise InputError where ``whole_folder`` could not write, before anything is computed for it;
    makes nothing.
    """
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder; give the output another name.")
    if not _may_go(folder, marker):
        raise InputError(
            f"The folder '{folder}' holds something else than an earlier run's output; give the "
            "output another name."
        )
    _require_place(Path(os.path.realpath(folder)))


def _may_go(folder: Path, marker: str) -> bool:
    """Whether a folder is missing, empty, or the output of an earlier run."""
    try:
        names = os.listdir(folder)
    except FileNotFoundError:
        return True
    return not names or marker in names


def _require_place(path: Path) -> None:
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
    with _beside(Path(os.path.realpath(path))) as (part, path):
        yield part
        _replace(part, path)


@contextmanager
def whole_folder(path: Path, marker: str) -> Iterator[Path]:
    """A new, empty folder beside ``path`` to write into, which becomes ``path`` when the block ends
    well.

    As ``whole_file`` for a folder with all that is in it. ``marker``: the name of a file that every
    such output has; what is there without it, and is not empty, is not ours and is never replaced.
    An earlier output is: it is there until the new one is whole; a run killed just then leaves
    neither. Raises InputError as well where what is there is not ours.
    """
    require_replaceable(path, marker)
    with _beside(Path(os.path.realpath(path))) as (part, path):
        part.mkdir()
        yield part
        for folder, _, names in os.walk(part, topdown=False):
            for name in names:
                _sync(Path(folder, name))
            _sync(Path(folder))
        _replace_folder(part, path, marker)


@contextmanager
def _beside(path: Path) -> Iterator[tuple[Path, Path]]:
    """A new name beside ``path``, and ``path`` again; nothing of that name is left. An OSError
    becomes an InputError.
    """
    name = secrets.token_hex(8)
    part = path.with_name(f".dafnet-{_HOST}-{os.getpid()}-{name}.part")
    made: list[Path] = []
    _ours.add(name)
    try:
        made = _make(path.parent)
        remove_abandoned(path.parent)
        yield part, path
    except OSError as error:
        raise InputError(
            f"'{path}' cannot be written ({error.strerror or error}); give the output another "
            "place."
        ) from error
    finally:
        for left in (part, part.with_name(part.name + "@")):
            _remove(left)
        _ours.discard(name)
        for folder in reversed(made):
            with suppress(OSError):  # it is not empty
                folder.rmdir()


def _remove(path: Path) -> None:
    """Remove a file, or a folder with all that is in it; what cannot be removed stays."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Have a file's or a folder's content on the disk."""
    posix = os.name == "posix"  # elsewhere a folder cannot be opened, nor a file be only read
    if path.is_dir() and not posix:
        return

    opened = os.open(path, os.O_RDONLY if posix else os.O_RDWR)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def _replace_folder(part: Path, path: Path, marker: str) -> None:
    """Put a folder in the place of an earlier output, whoever else does the same just now."""
    while True:
        try:
            os.rename(part, path)
        except OSError as error:
            if error.errno not in _IN_THE_WAY or not path.exists():
                raise
        else:
            break

        require_replaceable(path, marker)
        with _beside(path) as (old, _), suppress(FileNotFoundError):
            os.rename(path, old)

    _sync(path.parent)


def _replace(part: Path, path: Path) -> None:
    """Put a file in another's place, once it is on the disk."""
    _sync(part)

    try:
        os.replace(part, path)
    except PermissionError as error:  # on Windows, where an open file is not replaced
        raise InputError(
            f"'{path}' cannot be replaced; close it in other programs, or give the output another "
            "name."
        ) from error

    _sync(path.parent)


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


def remove_abandoned(folder: Path) -> None:
    """Remove what killed runs of this machine left in a folder."""
    for each in os.scandir(folder):
        found = _PART.match(each.name)
        if found is None or found["host"] != _HOST or found["name"] in _ours:
            continue
        process = int(found["process"])
        if process == os.getpid() or not _runs(process):
            _remove(Path(each.path))


def _runs(process: int) -> bool:
    """Whether a process of this number runs."""
    if sys.platform == "win32":  # where os.kill would end it
        import _winapi

        try:
            handle = _winapi.OpenProcess(0x1000, False, process)  # to ask, not to touch
        except OSError as error:
            return error.winerror == 5  # it is there, but not ours
        try:
            return _winapi.GetExitCodeProcess(handle) == _winapi.STILL_ACTIVE
        finally:
            _winapi.CloseHandle(handle)

    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True

    try:  # Linux: one that has ended is there until its parent has heard of it
        stat = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return True
    return stat.rpartition(")")[2].split()[0] not in {"Z", "X"}
