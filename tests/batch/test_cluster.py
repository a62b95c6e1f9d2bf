"""Lists of shots are made on a Dask cluster: here of processes on this machine."""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if importlib.util.find_spec("distributed") is None:
    pytest.skip("needs Dask (pip install distributed)", allow_module_level=True)

from dafnet_addon.batch import cluster
from dafnet_addon.batch.cluster import cluster_workers
from dafnet_addon.batch.lists import read_list
from dafnet_addon.batch.making import Outcome
from dafnet_addon.batch.running import Batch, make_batch
from dafnet_addon.core.errors import InputError
from kit.batches import HEAD, alive, contents, shot, wait_until
from kit.places import ROOT
from kit.populating import PROGRAM

if TYPE_CHECKING:
    from distributed import Future

pytestmark = pytest.mark.slow

_DASK = (sys.executable, "-m", "distributed.cli.dask_scheduler")
_WORKER = (sys.executable, "-m", "distributed.cli.dask_worker")


@contextmanager
def started(*command: str, path: Path = ROOT) -> Iterator["subprocess.Popen[bytes]"]:
    """A process to which ``path`` is where packages are."""
    process = subprocess.Popen(
        command,
        cwd=path,
        env={**os.environ, "PYTHONPATH": str(path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(3.0)
        except subprocess.TimeoutExpired:  # a worker looks for its scheduler for half a minute
            process.kill()
            process.wait()


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler without workers."""
    file = tmp_path / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    with started(*_DASK, *options, "--scheduler-file", str(file)):
        yield address_in(file)


def address_in(file: Path) -> str:
    """The address in a scheduler's file, once all of that is written."""
    wait_until(lambda: file.exists() and file.read_text(encoding="utf-8").endswith("}"), 60.0)
    return str(json.loads(file.read_text(encoding="utf-8"))["address"])


@contextmanager
def worker(address: str, *options: str, path: Path = ROOT) -> Iterator["subprocess.Popen[bytes]"]:
    """A worker of one thread."""
    given = ["--nthreads", "1", "--no-dashboard", *(options or ["--no-nanny"])]
    with started(*_WORKER, address, *given, path=path) as process:
        yield process


def batch(tmp_path: Path, text: str) -> Batch:
    file = tmp_path / "jobs.toml"
    file.write_text(HEAD + text, encoding="utf-8")
    return Batch(read_list(file), tmp_path / "out", program=PROGRAM)


def made(of: Batch, address: str) -> str:
    outcomes = make_batch(of, cluster_workers(address, of.output))
    return " ".join(each.state for each in outcomes)


def test_a_cluster_makes_the_same(tmp_path: Path, scheduler: str) -> None:
    of = batch(tmp_path, shot("a", count=4) + shot("bad", "broken"))
    with worker(scheduler), worker(scheduler):
        assert made(of, scheduler) == "made made made made failed"
        assert made(of, scheduler) == "unchanged unchanged unchanged unchanged failed"
    from dafnet_addon.batch.local import local_workers

    here = Batch(of.shots, tmp_path / "here", program=PROGRAM)
    make_batch(here, local_workers(2))
    assert contents(here.output) == contents(of.output)


def test_what_a_killed_worker_made_is_made_elsewhere(tmp_path: Path, scheduler: str) -> None:
    of = batch(tmp_path, shot("a", seconds=3.0, count=2))
    with worker(scheduler) as first, worker(scheduler):
        killed = []

        def kill() -> None:
            wait_until(lambda: len(alive(str(tmp_path / "out"))) == 2, 60.0)
            first.send_signal(signal.SIGKILL)
            killed.append(first.wait())

        killer = threading.Thread(target=kill)
        killer.start()
        assert made(of, scheduler) == "made made"
        killer.join()
    assert killed == [-signal.SIGKILL]
    quiet = Batch(of.shots, tmp_path / "quiet", program=PROGRAM)
    from dafnet_addon.batch.local import local_workers

    make_batch(quiet, local_workers(2))
    assert contents(of.output) == contents(quiet.output)


def test_a_cluster_that_does_not_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_ANSWERS", 1.0)
    of = batch(tmp_path, shot("a"))
    for address in ("tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1:no"):
        with pytest.raises(InputError, match="No Dask scheduler answers at"):
            made(of, address)


def test_a_cluster_without_workers(
    tmp_path: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "_ANSWERS", 1.0)
    with pytest.raises(InputError, match="has no workers; start some"):
        made(batch(tmp_path, shot("a")), scheduler)


def test_a_scheduler_that_is_gone(tmp_path: Path) -> None:
    file = tmp_path / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    of = batch(tmp_path, shot("quick") + shot("slow", seconds=60.0))
    with started(*_DASK, *options, "--scheduler-file", str(file)) as process:
        address = address_in(file)
        with worker(address):

            def kill() -> None:
                wait_until(lambda: alive("slow.json"), 60.0)
                process.kill()

            killer = threading.Thread(target=kill)
            killer.start()
            with pytest.raises(InputError, match="The Dask scheduler is gone"):
                made(of, address)
            killer.join()
    wait_until(lambda: not alive(str(tmp_path / "out")))
    assert contents(of.output).keys() == {"quick"}


def test_a_scheduler_that_goes_while_an_outcome_is_fetched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "scheduler.json"
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    of = batch(tmp_path, shot("quick"))
    with started(*_DASK, *options, "--scheduler-file", str(file)) as process:
        address = address_in(file)
        fetched = cluster._outcome

        def killing(name: str, future: "Future") -> Outcome:
            process.kill()
            return fetched(name, future)

        monkeypatch.setattr(cluster, "_outcome", killing)
        with worker(address), pytest.raises(InputError, match="The Dask scheduler is gone"):
            made(of, address)
    assert contents(of.output).keys() == {"quick"}


_OTHER = """
from dafnet_addon.core import manifest
manifest.current_version = lambda: "9.9.9"
from dafnet_addon.batch import cluster
cluster.current_version = manifest.current_version
"""


@pytest.mark.parametrize(
    ("startup", "words"),
    [
        (_OTHER, "has version 9.9.9 of DAFNet, this is"),
        (
            "from dafnet_addon.batch import cluster; cluster.content_hash = lambda path: 'other'",
            "has other weights",
        ),
    ],
)
def test_workers_that_would_make_something_else(
    tmp_path: Path, scheduler: str, startup: str, words: str
) -> None:
    of = batch(tmp_path, shot("a"))
    preload = tmp_path / "preload.py"
    preload.write_text(startup, encoding="utf-8")
    with (
        worker(scheduler, "--no-nanny", "--preload", str(preload)),
        pytest.raises(InputError, match=words),
    ):
        made(of, scheduler)
    assert not contents(of.output)


def test_a_worker_without_the_project(tmp_path: Path, scheduler: str) -> None:
    of = batch(tmp_path, shot("a"))
    with (
        worker(scheduler, path=tmp_path),
        pytest.raises(InputError, match="lacks this version of DAFNet"),
    ):
        made(of, scheduler)


def test_an_output_that_workers_do_not_see(
    tmp_path: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = batch(tmp_path, shot("a"))
    monkeypatch.setattr(cluster, "save_text", lambda file, text: file.parent.mkdir(parents=True))
    with worker(scheduler), pytest.raises(InputError, match="does not see"):
        made(of, scheduler)


def test_a_worker_that_fails_is_told(tmp_path: Path, scheduler: str) -> None:
    """By Dask, which gives a shot up after some workers have died of it."""
    of = batch(tmp_path, shot("a", seconds=60.0) + shot("b"))
    stop = threading.Event()

    def kill() -> None:
        # What waits for a worker counts as lost with it.
        wait_until(lambda: stop.is_set() or (of.output / "b").exists(), 60.0)
        while not stop.is_set():
            for each in alive("a.json"):
                parent = int(Path(f"/proc/{each}/stat").read_text(encoding="ascii").split()[3])
                os.kill(parent, signal.SIGKILL)
            time.sleep(0.05)

    with worker(scheduler, "--nworkers", "2"):
        killer = threading.Thread(target=kill)
        killer.start()
        found = {each.name: each for each in make_batch(of, cluster_workers(scheduler, of.output))}
        stop.set()
        killer.join()
    # Asked for anew where the worker that made it was killed before it had told.
    assert found["b"].state in {"made", "unchanged"} and contents(of.output).keys() == {"b"}
    assert found["a"].state == "failed" and "was killed" in found["a"].sentence
