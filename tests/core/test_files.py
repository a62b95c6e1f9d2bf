"""Files of the user's are written whole or not at all, by however many at once."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from dafnet_addon.core import files
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.files import (
    is_device,
    portable_name,
    remove_abandoned,
    require_replaceable,
    require_writable,
    save_text,
    whole_file,
    whole_folder,
)
from dafnet_addon.core.stopping import Stop
from kit.places import ROOT


def names(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def test_a_file_is_replaced_in_one_step(tmp_path: Path) -> None:
    file = tmp_path / "out.txt"
    file.write_bytes(b"old")
    with whole_file(file) as part:
        part.write_bytes(b"new")
        assert part.parent == tmp_path and part.name.startswith(".") and part.suffix != ".txt"
        assert file.read_bytes() == b"old"
    assert file.read_bytes() == b"new" and names(tmp_path) == ["out.txt"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt, InputError])
def test_what_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, failure: type[BaseException]
) -> None:
    file = tmp_path / "out.txt"
    file.write_bytes(b"old")
    with pytest.raises(failure), whole_file(file) as part:
        part.write_bytes(b"half")
        part.with_name(part.name + "@").write_bytes(b"as Blender leaves it")
        raise failure("it")
    assert file.read_bytes() == b"old" and names(tmp_path) == ["out.txt"]


def test_folders_are_made_for_what_is_written_and_go_where_nothing_was(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), whole_file(tmp_path / "a" / "b" / "out.txt"):
        raise RuntimeError
    assert names(tmp_path) == []
    save_text(tmp_path / "a" / "b" / "out.txt", "Ö")
    assert (tmp_path / "a" / "b" / "out.txt").read_bytes() == "Ö\n".encode()


def test_two_at_once_leave_one_or_the_other(tmp_path: Path) -> None:
    file = tmp_path / "out.txt"
    with whole_file(file) as first:
        first.write_bytes(b"first")
        with whole_file(file) as second:
            second.write_bytes(b"second")
        assert file.read_bytes() == b"second" and first != second
    assert file.read_bytes() == b"first" and names(tmp_path) == ["out.txt"]


def test_links_are_followed_and_permissions_are_the_users(tmp_path: Path) -> None:
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    try:
        link.symlink_to(target)
    except OSError:
        pytest.skip("no links on this system")
    before = os.umask(0o027)
    try:
        save_text(link, "new")
    finally:
        os.umask(before)
    assert link.is_symlink() and target.read_bytes() == b"new\n"
    assert os.name == "nt" or target.stat().st_mode & 0o777 == 0o640


def _left_by(process: int, host: str | None = None) -> str:
    host = files._HOST if host is None else host
    return f".dafnet-{host}-{process}-0123456789abcdef.part"


def test_what_killed_runs_left_is_removed_and_no_more(tmp_path: Path) -> None:
    """Killed while it writes: what it leaves does not count as output, and the next run removes
    it. What others write stays.
    """
    code = (
        "import os, signal, sys; from pathlib import Path; from dafnet_addon.core.files import "
        "whole_file\n"
        "with whole_file(Path(sys.argv[1])) as part:\n"
        "    part.write_bytes(b'half'); part.with_name(part.name + '@').write_bytes(b'half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL if hasattr(signal, 'SIGKILL') else "
        "signal.SIGTERM)\n"
    )
    file = tmp_path / "out.blend"
    killed = subprocess.run([sys.executable, "-c", code, str(file)], cwd=ROOT)
    assert killed.returncode != 0 and len(names(tmp_path)) == 2 and not file.exists()
    assert not [each for each in tmp_path.iterdir() if each.suffix == ".blend"]

    running = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    stay = [
        _left_by(running.pid),
        _left_by(running.pid, "elsewhere"),
        _left_by(1 << 22, "elsewhere"),
        ".dafnet-mine.part",
    ]
    for name in stay:
        (tmp_path / name).write_bytes(b"")
    (tmp_path / _left_by(os.getpid())).write_bytes(b"of a process that had this one's number")
    try:
        save_text(file, "whole")
    finally:
        running.communicate(b"\n")
    assert names(tmp_path) == sorted([*stay, "out.blend"])


def test_a_disk_that_refuses_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "out.txt"

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def open_elsewhere(*_: object) -> None:
        raise PermissionError(
            13, "The process cannot access the file because it is being used by another process"
        )

    for refusal, words in ((full, "No space left"), (open_elsewhere, "close it in other programs")):
        monkeypatch.setattr(os, "replace", refusal)
        with pytest.raises(InputError, match=words), whole_file(file) as part:
            part.write_bytes(b"new")
        assert names(tmp_path) == []


def test_outputs_are_looked_at_before_anything_is_computed(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    require_writable(tmp_path / "new" / "folder" / "out.txt")
    with pytest.raises(InputError, match="is a folder"):
        require_writable(tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        require_writable(tmp_path / "file" / "out.txt")
    if os.name != "nt" and os.geteuid():
        tmp_path.chmod(0o500)
        with pytest.raises(InputError, match="may not be written to"):
            require_writable(tmp_path / "out.txt")
    assert names(tmp_path) == ["file"]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_for_the_next_step(number: int) -> None:
    before = signal.getsignal(number)
    steps = 0
    with pytest.raises(KeyboardInterrupt) as stopped, Stop() as stop:
        stop.now()
        signal.raise_signal(number)
        steps += 1
        stop.now()
    assert (steps, stopped.value.args) == (1, (number,)) and signal.getsignal(number) == before


def test_a_second_ctrl_c_does_not_wait() -> None:
    with pytest.raises(KeyboardInterrupt), Stop():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        pytest.fail("it waited")


def test_signals_that_are_ignored_stay_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Stop() as stop:
            signal.raise_signal(signal.SIGINT)
            stop.now()
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks processes up in /proc")
def test_what_a_killed_process_left_goes_before_its_parent_has_heard_of_it(tmp_path: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", "pass"])
    stat = Path(f"/proc/{ended.pid}/stat")
    while stat.read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z":
        time.sleep(0.01)
    left = tmp_path / f".dafnet-{files._HOST}-{ended.pid}-0123456789abcdef.part"
    left.touch()
    remove_abandoned(tmp_path)
    assert not left.exists()
    ended.wait()


def test_the_hosts_name_is_part_of_what_is_left() -> None:
    assert all(each.isalnum() for each in files._HOST) and (files._HOST or not socket.gethostname())


def _folder(tmp_path: Path, content: str) -> Path:
    """An output whose marker says ``content``."""
    folder = tmp_path / "shot"
    with whole_folder(folder, "mark") as part:
        (part / "deeper").mkdir()
        (part / "deeper" / "a.txt").write_text(content, encoding="utf-8")
        (part / "mark").write_text(content, encoding="utf-8")
    return folder


def test_a_folder_is_replaced_as_a_whole(tmp_path: Path) -> None:
    folder = _folder(tmp_path, "old")
    (folder / "left over").write_bytes(b"")
    with whole_folder(folder, "mark") as part:
        assert part.parent == tmp_path and names(part) == [] and (folder / "mark").exists()
        (part / "mark").write_bytes(b"new")
    assert names(folder) == ["mark"] and names(tmp_path) == ["shot"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt, OSError])
def test_a_folder_that_fails_leaves_the_old_one(
    tmp_path: Path, failure: type[BaseException]
) -> None:
    folder = _folder(tmp_path, "old")
    expected = InputError if failure is OSError else failure
    with pytest.raises(expected), whole_folder(folder, "mark") as part:
        (part / "half").write_bytes(b"half")
        raise failure(28, "No space left on device")
    assert (folder / "mark").read_text(encoding="utf-8") == "old" and names(tmp_path) == ["shot"]
    with pytest.raises(expected), whole_folder(tmp_path / "a" / "b", "mark"):
        raise failure(28, "No space left on device")
    assert names(tmp_path) == ["shot"]


def test_a_folder_of_somebody_elses_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "shot").mkdir()
    _folder(tmp_path, "in an empty one")
    other, file = tmp_path / "other", tmp_path / "file"
    other.mkdir()
    (other / "thesis.txt").write_bytes(b"")
    file.write_bytes(b"")
    for taken, words in ((other, "holds something else"), (file, "is not a folder")):
        with pytest.raises(InputError, match=words):
            require_replaceable(taken, "mark")
        with pytest.raises(InputError, match=words), whole_folder(taken, "mark"):
            pytest.fail("it began")
    # It came while the output was being made.
    with (
        pytest.raises(InputError, match="holds something else"),
        whole_folder(tmp_path / "late", "mark"),
    ):
        (tmp_path / "late").mkdir()
        (tmp_path / "late" / "thesis.txt").write_bytes(b"")
    assert names(tmp_path) == ["file", "late", "other", "shot"]
    assert names(other) == ["thesis.txt"] == names(tmp_path / "late")


def test_two_folders_at_once_leave_one_or_the_other(tmp_path: Path) -> None:
    with whole_folder(tmp_path / "shot", "mark") as first:
        (first / "mark").write_bytes(b"first")
        _folder(tmp_path, "second")
    assert names(tmp_path / "shot") == ["mark"] and names(tmp_path) == ["shot"]


def test_folders_that_killed_runs_left_are_removed(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys; from pathlib import Path; from dafnet_addon.core.files import "
        "whole_folder\n"
        "with whole_folder(Path(sys.argv[1]), 'mark') as part:\n"
        "    (part / 'half').mkdir(); os.kill(os.getpid(), signal.SIGTERM)\n"
    )
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path / "shot")], cwd=ROOT)
    assert killed.returncode != 0 and len(names(tmp_path)) == 1
    _folder(tmp_path, "whole")
    assert names(tmp_path) == ["shot"]


@pytest.mark.parametrize("name", ["con", "Aux.png", "COM1", "lpt9.tar.gz", "NUL"])
def test_what_windows_takes_for_a_device_becomes_a_file(name: str) -> None:
    assert is_device(name) and not is_device(portable_name(name.split(".")[0]))


def test_other_names_stay() -> None:
    for name in ("Ann", "console", "com", "com10", "花子"):
        assert portable_name(name) == name


def test_on_windows_a_process_is_asked_for_without_touching_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a stand-in for the system's calls: this runs on no Windows."""
    running, closed = {7: 259, 8: 0}, []

    def opened(_access: int, _inherit: bool, process: int) -> int:
        if process not in running:
            error = OSError("no such process, or not ours")
            error.winerror = 5 if process == 9 else 87  # type: ignore[attr-defined]
            raise error
        return process

    calls = SimpleNamespace(
        OpenProcess=opened,
        GetExitCodeProcess=running.__getitem__,
        CloseHandle=closed.append,
        STILL_ACTIVE=259,
    )
    monkeypatch.setitem(sys.modules, "_winapi", calls)
    monkeypatch.setattr(files.sys, "platform", "win32")
    assert [files._runs(process) for process in (7, 8, 9, 10)] == [True, False, True, False]
    assert closed == [7, 8]
