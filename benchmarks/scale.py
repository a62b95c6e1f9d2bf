"""Do batches and populations hold what they promise: how long crowds take, what a second worker
gives, what is left of a batch whose processes are killed at random, and who sits where.

    dafnet bench scale [--only people density populations workers kills dask] [-o FOLDER]

``kills`` and ``dask`` find processes in /proc, which Linux has. ``LIMITS`` are what is wanted.
"""

import argparse
import importlib.util
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dafnet_addon.core.files import save_text
from dafnet_addon.core.manifest import read_manifest
from dafnet_addon.core.text import duration
from dafnet_addon.core.threads import cores

__all__ = ["ROWS", "Options", "Row", "dafnet", "main", "prepared"]

ROOT = Path(__file__).absolute().parents[1]

_FASTER = 1.7
"""Times that two workers are to be faster than one."""
_EARLY = 0.7
"""Of the time that a quiet run takes: until then all kills are done."""
_TICK = 0.02  # seconds
_TAKE = ": "
"""Between a scene's name and its take's."""


@dataclass(frozen=True)
class Options:
    """``folder``: where shots are made. ``scenes`` of ``takes`` of ``frames`` each are killed
    ``kills`` times in ``rounds`` batches, at random by ``seed``.
    """

    folder: Path
    scenes: int = 100
    takes: int = 10
    frames: int = 60
    kills: int = 20
    rounds: int = 2
    workers: int = 2
    seed: int = 1


@dataclass(frozen=True)
class Row:
    """What was measured, in words, and whether it holds."""

    what: str
    hold: str
    measured: str
    holds: bool


def dafnet(*arguments: object) -> "subprocess.Popen[str]":
    """The command in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "dafnet_addon", *map(str, arguments)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def prepared(options: Options, name: str, count: int) -> Path:
    """A list of shots of somebody on a chair, in a room of its own."""
    from dafnet_addon.blender.showcase.small_room import save_small_room

    room = options.folder / "small.blend"
    if not room.exists():
        save_small_room(room)
    file = options.folder / f"{name}.toml"
    save_text(
        file,
        f"""
[[shots]]
name = "scene"
room = "small.blend"
takes = {options.takes}
seconds = {options.frames / 30}
people = [{{ tasks = [{{ sit_on = "Chair", seconds = 1 }}] }}]
count = {count}
""",
    )
    return file


def _made(shots: Path, output: Path, *more: object) -> float:
    """Run a batch to its end; the seconds that it took. Raises RuntimeError where it fails."""
    started = time.monotonic()
    process = dafnet("batch", shots, "-o", output, *more)
    _, said = process.communicate()
    if process.returncode:
        raise RuntimeError(said)
    return time.monotonic() - started


def _contents(output: Path) -> dict[str, str]:
    """A hash of the keys of each action and of each take, by scene and name.

    Raises RuntimeError for a scene that is half-written, and for what is left over beside them.
    """
    from dafnet_addon.blender.pipeline.contents import key_hashes

    found = {}
    for each in sorted(output.iterdir()):
        if not each.is_dir() or each.name == "logs":
            continue
        manifest = read_manifest(each)
        if each.name.startswith(".") or manifest is None:
            raise RuntimeError(f"'{each}' is half-written or left over")
        for action, digest in key_hashes(each / "scene.blend").items():
            found[f"{each.name}/{action}"] = digest
        found |= {f"{each.name}{_TAKE}{take}": digest for take, digest in manifest.content.items()}
    return found


def _takes(contents: dict[str, str]) -> int:
    """How many takes are among contents."""
    return sum(_TAKE in name for name in contents)


def _children(process: int) -> list[int]:
    """Processes that a process has started and that run."""
    found = []
    for each in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = each.read_text(encoding="utf-8").rsplit(")", 1)[1].split()[:2]
        except (OSError, IndexError):
            continue
        if int(parent) == process and state != "Z":
            found.append(int(each.parent.name))
    return found


def kills(options: Options) -> Iterator[Row]:
    """Batches whose driver and processes are killed with SIGKILL, beside one that is not."""
    shots = prepared(options, "kills", options.scenes)
    quiet = options.folder / "quiet"
    seconds = _made(shots, quiet, "--workers", options.workers)
    expected = _contents(quiet)
    chance = random.Random(options.seed)

    told, holds = [], _takes(expected) == options.scenes * options.takes
    for turn in range(1, options.rounds + 1):
        output = options.folder / f"killed_{turn}"
        drivers, tasks = _killed(shots, output, options, seconds, chance)
        runs = 0
        while runs < 3:
            runs += 1
            process = dafnet("batch", shots, "-o", output, "--workers", options.workers)
            process.communicate()
            if process.returncode == 0:
                break
        found = _contents(output)
        same = found == expected
        holds = holds and same and process.returncode == 0
        told.append(
            f"{drivers} drivers and {tasks} processes killed, then {runs} run to the end: "
            f"{_takes(found)} takes, {'the same' if same else 'NOT the same'}"
        )

    yield Row(
        f"{options.scenes} scenes of {options.takes} takes of {options.frames} frames, killed "
        f"{options.kills} times, {options.rounds} times over",
        "all takes, none twice, none half-written, as in one quiet run",
        f"quiet: {_takes(expected)} takes in {duration(seconds)}; " + "; ".join(told),
        holds,
    )


def _killed(
    shots: Path, output: Path, options: Options, seconds: float, chance: random.Random
) -> tuple[int, int]:
    """Kill a batch, or one of its processes, as often as asked; how many of either. It ends before
    the batch does: there is always work to be killed at.
    """
    drivers = tasks = 0
    between = _EARLY * seconds / options.kills
    while drivers + tasks < options.kills:
        process = dafnet("batch", shots, "-o", output, "--workers", options.workers)
        while process.poll() is None and drivers + tasks < options.kills:
            time.sleep(chance.uniform(0.2, 1.8) * between)
            running = _children(process.pid)
            if running and chance.random() < 0.5:
                with suppress(ProcessLookupError):
                    os.kill(chance.choice(running), signal.SIGKILL)
                    tasks += 1
            elif process.poll() is None:
                process.kill()
                process.wait()
                drivers += 1
        process.kill()
        process.communicate()
        if process.returncode == 0:
            raise RuntimeError(f"all was made after {drivers + tasks} kills; make more scenes")
    return drivers, tasks


def workers(options: Options) -> Iterator[Row]:
    """Eight shots by one worker and by two."""
    shots = prepared(options, "workers", 8)
    one, two = (
        _made(shots, options.folder / f"by_{count}", "--workers", count) for count in (1, 2)
    )
    yield Row(
        f"8 shots on two workers against one ({cores()} cores)",
        f"≥ {_FASTER} times",
        f"{one / two:.2f} times: {one:.1f} s and {two:.1f} s",
        one / two >= _FASTER,
    )


def dask(options: Options) -> Iterator[Row]:
    """A cluster of two workers, one of which is killed while it makes a shot."""
    what = "a Dask worker killed in the middle"
    hold = "its shot is made elsewhere, and is the same"
    if importlib.util.find_spec("distributed") is None:
        yield Row(what, hold, "not measured: needs distributed", False)
        return

    shots = prepared(options, "dask", 6)
    _made(shots, options.folder / "dask_quiet", "--workers", 1)
    expected = _contents(options.folder / "dask_quiet")
    output = options.folder / "dask"
    with _cluster(options.folder) as (address, servants):
        batch = dafnet("batch", shots, "-o", output, "--dask", address)
        victim = servants[0]
        while not (making := _children(victim.pid)):
            if batch.poll() is not None:
                raise RuntimeError(batch.communicate()[1])
            time.sleep(_TICK)
        victim.kill()
        victim.wait()
        _, said = batch.communicate()
    gone = [each for each in making if not Path(f"/proc/{each}").exists()]
    same = batch.returncode == 0 and _contents(output) == expected
    yield Row(
        what,
        hold,
        f"6 shots, {'the same' if same else f'NOT the same {said}'}; the killed worker's process "
        f"{'ended with it' if gone == making else 'went ON'}",
        same and gone == making,
    )


@contextmanager
def _cluster(folder: Path) -> Iterator[tuple[str, "list[subprocess.Popen[bytes]]"]]:
    """A scheduler and two workers, as processes of this machine."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)

    def started(*command: str) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [sys.executable, "-m", *command, "--no-dashboard"],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    processes = [
        started(
            *("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"),
            *("--scheduler-file", str(file)),
        )
    ]
    try:
        while not file.exists():
            time.sleep(_TICK)
        address = json.loads(file.read_text(encoding="utf-8"))["address"]
        worker = ("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny")
        processes += [started(*worker) for _ in range(2)]
        yield address, processes[1:]
    finally:
        for each in reversed(processes):
            each.terminate()
            each.wait()


def people(options: Options) -> Iterator[Row]:
    """60 people in one room."""
    found = _alone("sixty_people(folder)", options.folder)
    stages = found["stages"]
    generating, network = stages["generating"], stages["of which network"]
    yield Row(
        f"{found['people']} people, {found['frames']} frames, one room, from spec to saved .blend",
        "under 60 s, under 3 GB; the network's share under 20 s",
        f"{found['seconds']:.0f} s ({found['processor_seconds']:.0f} s of a core), "
        f"{found['megabytes'] / 1e3:.2f} GB; generating {generating:.1f} s, of which the network "
        f"{network:.1f} s",
        found["seconds"] < 60.0 and found["megabytes"] < 3e3 and network < 20.0,
    )


def density(options: Options) -> Iterator[Row]:
    """100 people of one hall against 10."""
    few, many = _alone("by_number(folder)", options.folder).values()
    times = many["processor_seconds_each"] / few["processor_seconds_each"]
    yield Row(
        f"seconds a person at {many['people']} people, against {few['people']}",
        "≤ 1.2 times",
        f"{times:.2f} times: {many['processor_seconds_each']:.2f} s of a core each, and "
        f"{few['processor_seconds_each']:.2f} s",
        times <= 1.2,
    )


def populations(options: Options) -> Iterator[Row]:
    """A café by one seed after another."""
    found = _alone("many_populations()", options.folder)
    wrong = [*found["seats_taken_twice"], *found["overlaps"]]
    refused = sorted({*found["refused"].values()})
    yield Row(
        f"{found['made'] + len(found['refused'])} populations of a room by seed",
        "nobody on a seat that is taken; nobody over 2 cm in anybody; every refusal a sentence",
        f"{found['made']} made, {len(found['seats_taken_twice'])} seats taken twice, "
        f"{len(found['overlaps'])} overlaps, the nearest {100 * found['deepest']:+.1f} cm in; "
        f"refused: {'; '.join(refused) or 'none'}{'; wrong: ' * bool(wrong)}{'; '.join(wrong[:5])}",
        not wrong,
    )


_CODE = """
import json, os, sys
from pathlib import Path
from dafnet_addon.blender.populating.measuring import *
folder = Path(sys.argv[1])
print(json.dumps({call}), flush=True)
os._exit(0)
"""


def _alone(call: str, folder: Path) -> dict[str, Any]:
    """What is measured beside what populates, in a process of its own, whose memory counts. Raises
    RuntimeError where it fails.
    """
    done = subprocess.run(
        [sys.executable, "-c", _CODE.format(call=call), str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


ROWS: dict[str, Callable[[Options], Iterator[Row]]] = {
    "people": people,
    "density": density,
    "populations": populations,
    "workers": workers,
    "kills": kills,
    "dask": dask,
}
"""What can be measured, by name."""


def main(arguments: Sequence[str]) -> str:
    """Measure what is named, everything if nothing is, and give the table as text."""
    parser = argparse.ArgumentParser("dafnet bench scale", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=sorted(ROWS), default=list(ROWS))
    parser.add_argument("-o", "--output", type=Path, help="keeps what was made, and scale.json")
    for name in ("scenes", "takes", "frames", "kills", "rounds", "workers", "seed"):
        parser.add_argument(f"--{name}", type=int, default=getattr(Options, name))
    given = parser.parse_args(arguments)

    with tempfile.TemporaryDirectory(prefix="dafnet_scale_") as temporary:
        folder = (given.output or Path(temporary)).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        options = Options(
            folder=folder,
            scenes=given.scenes,
            takes=given.takes,
            frames=given.frames,
            kills=given.kills,
            rounds=given.rounds,
            workers=given.workers,
            seed=given.seed,
        )
        rows = [row for name in given.only for row in ROWS[name](options)]
        if given.output:
            save_text(folder / "scale.json", json.dumps([asdict(row) for row in rows], indent=2))
    lines = ["| what | hold | measured | holds |", "|---|---|---|---|"]
    lines += [
        f"| {row.what} | {row.hold} | {row.measured} | {'yes' if row.holds else 'NO'} |"
        for row in rows
    ]
    return "\n".join(lines)
