"""What many shots take on a farm: machines, hours, memory and disk, simulated from measured costs.

    dafnet bench farm JOBS.toml [--only SHOT …] [--shots 10000] [--machines 1 4 16 64]

Some shots of the list are made here, one after the other, and their processor time, memory and
disk are measured. Then a farm of so many machines takes one shot after the other, on each core one,
each as long as one of those, drawn at random; some are killed on the way and made again. What
machines lose by sharing disk and memory among their cores is not in it.
"""

import argparse
import heapq
import random
import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dafnet_addon.batch.lists import read_list
from dafnet_addon.batch.making import make
from dafnet_addon.batch.running import Batch, chosen
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.text import duration

__all__ = ["Costs", "main", "measured", "simulated"]

_MEASURED = ("1:5",)
"""Which shots of a list are measured, where nothing else is said."""


@dataclass(frozen=True)
class Costs:
    """Of shots: processor ``seconds`` of each, ``disk`` of each in megabytes, and the ``memory``
    that a process took at most, in megabytes.
    """

    seconds: tuple[float, ...]
    disk: tuple[float, ...]
    memory: float


def measured(batch: Batch) -> Costs:
    """Make the shots, one after the other. Raises InputError where one cannot be made."""
    import resource

    seconds, disk = [], []
    for shot in batch.shots:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        outcome = make(batch.order(shot))
        if outcome.state != "made":
            raise InputError(f"'{shot.name}' could not be made: {outcome.sentence}")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        files = [each for each in batch.folder(shot.name).rglob("*") if each.is_file()]
        disk.append(sum(each.stat().st_size for each in files) / 1e6)
    return Costs(tuple(seconds), tuple(disk), after.ru_maxrss / 1e3)


def simulated(
    seconds: Sequence[float], shots: int, slots: int, killed: float, seed: int = 0
) -> tuple[float, float]:
    """Seconds until all ``shots`` are made in as many ``slots`` at once, and processor seconds
    spent.

    ``seconds``: what one may take; ``killed``: the share of attempts that end somewhere on the way,
    after which the shot is queued again.

    >>> simulated([10.0], shots=6, slots=3, killed=0.0)
    (20.0, 60.0)
    """
    chance = random.Random(seed)
    free = [0.0] * slots  # when each slot is free; a heap
    waiting, spent = shots, 0.0
    again: list[float] = []  # when shots that were killed are queued again
    while waiting or again:
        now = heapq.heappop(free)
        if not waiting:
            now = max(now, heapq.heappop(again))
        else:
            waiting -= 1
        takes = chance.choice(seconds)
        if chance.random() < killed:
            takes *= chance.random()
            heapq.heappush(again, now + takes)
        spent += takes
        heapq.heappush(free, now + takes)
    return max(free), spent


def main(arguments: Sequence[str]) -> str:
    """Measure some shots of a list and give the sheet as text."""
    parser = argparse.ArgumentParser("dafnet bench farm", description=__doc__)
    parser.add_argument("list", type=Path, metavar="JOBS.toml")
    parser.add_argument("--only", nargs="+", default=_MEASURED, help="the shots to be measured")
    parser.add_argument("--shots", type=int, default=10_000, help="how many are to be made")
    parser.add_argument("--machines", type=int, nargs="+", default=[1, 4, 16, 64])
    parser.add_argument("--cores", type=int, default=16, help="of a machine")
    parser.add_argument("--memory", type=float, default=64.0, help="of a machine, in GB")
    parser.add_argument("--killed", type=float, default=0.01, help="share of attempts")
    given = parser.parse_args(arguments)

    shots = chosen(read_list(given.list), given.only)
    with tempfile.TemporaryDirectory(prefix="dafnet_farm_") as folder:
        costs = measured(Batch(shots, Path(folder)))
    return sheet(costs, given)


def sheet(costs: Costs, given: argparse.Namespace) -> str:
    """The sheet of figures, as Markdown. Raises InputError where a machine is too small."""
    slots = min(given.cores, int(1e3 * given.memory / costs.memory))
    if slots < 1:
        raise InputError(
            f"A shot takes {costs.memory / 1e3:.1f} GB; give the machines more --memory."
        )
    mean = statistics.mean(costs.seconds)
    disk = statistics.mean(costs.disk)
    lines = [
        f"Measured on {len(costs.seconds)} shots: {mean:.1f} s of a core each "
        f"({min(costs.seconds):.1f} to {max(costs.seconds):.1f}), {costs.memory / 1e3:.2f} GB at "
        f"most, {disk:.1f} MB of disk.",
        "",
        f"{given.shots:,} shots, {slots} at once on a machine of {given.cores} cores and "
        f"{given.memory:g} GB, {100 * given.killed:g} % of attempts killed:",
        "",
        "| machines | time | machine hours | memory a machine, GB | disk, GB |",
        "|---|---|---|---|---|",
    ]
    for machines in given.machines:
        seconds, _ = simulated(costs.seconds, given.shots, machines * slots, given.killed)
        lines.append(
            f"| {machines} | {duration(seconds)} | {machines * seconds / 3600:.1f} | "
            f"{slots * costs.memory / 1e3:.1f} | {given.shots * disk / 1e3:.0f} |"
        )
    return "\n".join(lines)
