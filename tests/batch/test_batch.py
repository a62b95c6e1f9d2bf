"""Lists of shots are made in processes of their own: skipped, tried again, stopped, killed; by a
stand-in of ``populate`` that needs no Blender.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import pytest

from dafnet_addon.batch import making
from dafnet_addon.batch.lists import read_list
from dafnet_addon.batch.local import local_workers
from dafnet_addon.batch.making import Outcome, Processes, make
from dafnet_addon.batch.running import MARKER, Batch, chosen, look, make_batch
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.manifest import MANIFEST
from kit.batches import HEAD, alive, contents, shot, wait_until
from kit.places import ROOT
from kit.populating import PROGRAM


def batch(tmp_path: Path, text: str, **given: Any) -> Batch:
    file = tmp_path / "jobs.toml"
    file.write_text(HEAD + text, encoding="utf-8")
    return Batch(read_list(file), tmp_path / "out", program=PROGRAM, **given)


def made(of: Batch, workers: int = 2, **given: Any) -> dict[str, Outcome]:
    return {each.name: each for each in make_batch(of, local_workers(workers), **given)}


def states(of: Batch, workers: int = 2, **given: Any) -> str:
    return " ".join(each.state for each in made(of, workers, **given).values())


@pytest.mark.slow
def test_a_list_is_made_and_made_again_only_where_it_changed(tmp_path: Path) -> None:
    room = tmp_path / "hall.blend"
    room.write_bytes(b"a hall")
    text = shot("hall", "hall.blend") + shot("other") + shot("bad", "broken")
    shares: list[float] = []
    found = made(batch(tmp_path, text), progress=shares.append)
    assert [each.state for each in found.values()] == ["made", "made", "failed"]
    assert found["bad"].sentence == "The room is broken; mend it." and shares[-1] == 1.0
    assert shares == sorted(shares)
    log = found["bad"].log
    assert log is not None and "dafnet: The room is broken" in log.read_text(encoding="utf-8")
    assert not (tmp_path / "out" / "bad").exists()
    assert states(batch(tmp_path, text)) == "unchanged unchanged failed"
    mended = text.replace("broken", "cafe")
    assert states(batch(tmp_path, mended)) == "unchanged unchanged made"
    room.write_bytes(b"a larger hall")
    assert [each.sentence for each in look(batch(tmp_path, mended))] == [
        "'hall.blend' has changed",
        "",
        "",
    ]
    assert states(batch(tmp_path, mended)) == "made unchanged unchanged"
    more = mended.replace('name = "other"\n', 'name = "other"\ntemperature = 0.5\n')
    assert states(batch(tmp_path, more)) == "unchanged made unchanged"


@pytest.mark.slow
def test_neither_order_nor_workers_change_a_result(tmp_path: Path) -> None:
    shots = [shot(f"s{k}", count=2) for k in range(3)]
    first = batch(tmp_path, "".join(shots))
    assert states(first, 1) == " ".join(["made"] * 6)
    before = contents(first.output)
    other = Batch(batch(tmp_path, "".join(reversed(shots))).shots, tmp_path / "two", None, PROGRAM)
    assert states(other, 3) == " ".join(["made"] * 6)
    assert contents(other.output) == before
    assert len({json.dumps(content) for content in before.values()}) == 6


@pytest.mark.slow
def test_several_are_made_at_once(tmp_path: Path) -> None:
    text = "".join(shot(f"s{k}", seconds=1.0) for k in range(4))
    started = time.monotonic()
    assert states(batch(tmp_path, text), 4) == "made made made made"
    assert time.monotonic() - started < 4.0


def test_shots_are_chosen_by_name_pattern_and_number(tmp_path: Path) -> None:
    shots = batch(tmp_path, shot("hall", count=3) + shot("bar")).shots

    def names(*only: str) -> list[str]:
        return [each.name for each in chosen(shots, only)]

    assert names("bar") == ["bar"] == names("4")
    assert names("4", "hall_002") == ["hall_002", "bar"]
    assert names("hall_*") == names("1:3") == ["hall_001", "hall_002", "hall_003"]
    for word in ("hal_002", "9", "5:7"):
        with pytest.raises(InputError, match="No shot of the list is called"):
            names(word)
    with pytest.raises(InputError, match="did you mean 'hall_002'"):
        names("hal_002")


def test_an_output_that_is_not_ours(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.txt").write_bytes(b"")
    with pytest.raises(InputError, match="holds something else"):
        made(batch(tmp_path, shot("a")))
    assert [each.name for each in out.iterdir()] == ["thesis.txt"]

    (out / MARKER).write_bytes(b"")
    (out / "a").mkdir()
    (out / "a" / "thesis.txt").write_bytes(b"")
    found = made(batch(tmp_path, shot("a") + shot("b")))
    assert found["a"].state == "failed" and "holds something else" in found["a"].sentence
    assert found["b"].state == "made" and (out / "a" / "thesis.txt").exists()


@pytest.mark.skipif(os.name == "nt" or not os.geteuid(), reason="for root every folder is writable")
def test_no_right_to_write(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir(mode=0o500)
    with pytest.raises(InputError, match="may not be written to"):
        made(batch(tmp_path, shot("a")))


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a place where not even root may")
def test_a_place_that_nobody_may_write_to(tmp_path: Path) -> None:
    nowhere = Batch(batch(tmp_path, shot("a")).shots, Path("/proc/dafnet/out"), program=PROGRAM)
    with pytest.raises(InputError, match="cannot be written"):
        made(nowhere)


def test_a_process_that_ends_without_a_word(tmp_path: Path) -> None:
    found = made(batch(tmp_path, shot("a", "silent")))
    assert found["a"].sentence == "Its process ended with code 3 and no reason; look into its log."
    missing = Batch(batch(tmp_path, shot("a")).shots, tmp_path / "out", program=("/no/program",))
    assert "'/no/program' cannot be used" in made(missing)["a"].sentence


@pytest.mark.slow
def test_a_full_disk(tmp_path: Path) -> None:
    """Files of over 1 MB fail, in the processes that are started here, as on a disk that is full;
    a signal would say so otherwise.
    """
    resource = pytest.importorskip("resource")
    limit = (
        "import resource, signal, sys, runpy; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20)); "
        "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY
    program = (sys.executable, "-c", limit, PROGRAM[1])
    shots = batch(tmp_path, shot("big", "large") + shot("small")).shots
    found = made(Batch(shots, tmp_path / "out", program=program))
    assert found["big"].state == "failed" and "cannot be written" in found["big"].sentence
    assert found["small"].state == "made"
    left = sorted(each.name for each in (tmp_path / "out").iterdir())
    assert left == [MARKER, "logs", "small"]
    assert states(batch(tmp_path, shot("big", "large") + shot("small"))) == "made unchanged"


_DRIVER = """
import sys
from pathlib import Path
from dafnet_addon.batch import making
from dafnet_addon.batch.lists import read_list
from dafnet_addon.batch.local import local_workers
from dafnet_addon.batch.running import Batch, make_batch
jobs, out, *program = sys.argv[1:]
batch = Batch(read_list(Path(jobs)), Path(out), program=tuple(program))
found = make_batch(batch, local_workers(2))
print(*(outcome.state for outcome in found))
"""


def driver(of: Batch) -> "subprocess.Popen[str]":
    """The batch in a process of its own, which can be killed."""
    jobs = of.output.parent / "jobs.toml"
    return subprocess.Popen(
        [sys.executable, "-c", _DRIVER, str(jobs), str(of.output), *PROGRAM],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


posix = pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks processes up in /proc")


@posix
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_what_is_stopped_goes_on_and_leaves_no_process(tmp_path: Path, number: int) -> None:
    text = shot("quick") + shot("slow", seconds=1.5, count=3)
    of = batch(tmp_path, text)
    running = driver(of)
    wait_until(lambda: (of.output / "quick").exists() and len(alive(str(tmp_path))) >= 2)
    running.send_signal(number)
    running.wait()
    wait_until(lambda: not alive(str(tmp_path)))
    assert contents(of.output).keys() == {"quick"}
    assert states(of, 4) == "unchanged made made made"
    assert sorted(each.name for each in of.output.iterdir() if each.name[0] == ".") == []


@posix
@pytest.mark.slow
def test_two_runs_share_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who finds a shot in the making leaves it alone, and waits for no longer than it takes to be
    sure.
    """
    monkeypatch.setattr(making, "_WAITS", 0.5)
    of = batch(tmp_path, shot("slow", seconds=5.0) + shot("b"))
    running = driver(of)
    wait_until(lambda: (of.output / "b").exists() and alive("slow.json"))
    found = made(of)
    assert found["slow"].state == "busy" and "Another run" in found["slow"].sentence
    assert running.communicate()[0].split() == ["made", "made"]
    assert states(of) == "unchanged unchanged"


@posix
@pytest.mark.slow
def test_a_process_that_is_killed_is_told_and_tried_again(tmp_path: Path) -> None:
    of = batch(tmp_path, shot("slow", seconds=2.0) + shot("b"))

    def kill() -> None:
        wait_until(lambda: (of.output / "b").exists() and alive("slow.json"))
        for each in alive("slow.json"):
            os.kill(each, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    found = made(of)
    killer.join()
    assert found["slow"].state == "failed" and "killed (SIGKILL)" in found["slow"].sentence
    assert states(of) == "made unchanged"


@posix
@pytest.mark.slow
def test_killed_at_random_twenty_times_all_is_made_once(tmp_path: Path) -> None:
    """Twelve shots of four files each; the run and its processes are killed wherever they are."""
    import random

    text = shot("s", seconds=0.5, count=12)
    quiet = Batch(batch(tmp_path, text).shots, tmp_path / "quiet", program=PROGRAM)
    assert {*states(quiet, 4).split()} == {"made"}
    of = batch(tmp_path, text)
    chance, kills = random.Random(1), 0
    while kills < 20:
        running = driver(of)
        time.sleep(chance.uniform(0.1, 1.2))
        if chance.random() < 0.5 and (found := alive(str(tmp_path / "out"))):
            victims: Sequence[int] = [chance.choice(found)]
        else:
            victims = [running.pid]
        for each in victims:
            try:
                os.kill(each, signal.SIGKILL)
            except ProcessLookupError:
                continue
            kills += 1
        if running.pid not in victims:
            time.sleep(chance.uniform(0.0, 0.5))
            running.kill()
        running.communicate()
    assert {*states(of, 4).split()} <= {"made", "unchanged"}
    assert contents(of.output) == contents(quiet.output)
    files = [each for each in of.output.rglob("*.txt") if each.name != MANIFEST]
    assert len(files) == 12 * 4 and not list(of.output.glob(".*"))


def test_an_order_can_be_made_alone(tmp_path: Path) -> None:
    of = batch(tmp_path, shot("a"))
    outcome = make(of.order(of.shots[0]))
    assert (outcome.state, outcome.sentence) == ("made", "") and outcome.seconds > 0.0
    assert make(of.order(of.shots[0])).state == "unchanged", "another run has made it meanwhile"
    (of.folder("a") / MANIFEST).write_text("{}", encoding="utf-8")
    ended = Processes()
    ended.end()
    assert "was stopped" in make(of.order(of.shots[0]), ended).sentence


def test_a_fault_of_ours_ends_the_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> Outcome:
        raise ZeroDivisionError

    monkeypatch.setattr("dafnet_addon.batch.local.make", fails)
    with pytest.raises(ZeroDivisionError):
        made(batch(tmp_path, shot("a") + shot("b")))


def test_inside_blender_blender_makes_the_shots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "bpy", raising=False)
    assert making.program() == (sys.executable, "-m", "dafnet_addon")
    for path, expected in (("", sys.executable), ("/opt/blender/blender", "/opt/blender/blender")):
        app = SimpleNamespace(binary_path=path)
        monkeypatch.setitem(sys.modules, "bpy", cast(ModuleType, SimpleNamespace(app=app)))
        assert making.program()[0] == expected
    assert making.program()[1:] == ("--background", "--command", "dafnet")


def test_where_files_cannot_be_locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(making, "fcntl", None)
    of = batch(tmp_path, shot("a"))
    assert make(of.order(of.shots[0])).state == "made"
