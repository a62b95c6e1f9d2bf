"""``dafnet batch``: many shots, each in a process of its own; run again, it goes on."""

import argparse
import importlib.util
import time
from collections.abc import Callable
from pathlib import Path

from ..batch.cluster import cluster_workers
from ..batch.lists import read_list
from ..batch.local import local_workers
from ..batch.making import Outcome
from ..batch.report import counted, report, save_report
from ..batch.running import Batch, chosen, look, make_batch
from ..core.errors import InputError
from ..core.text import duration, printable
from ..core.threads import cores
from .command import MAX_PROCESSES, Command, Progress, Result, add_weights, number
from .console import complain

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("list", type=Path, metavar="JOBS.toml", help="a list of shots")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    parser.add_argument(
        "--workers",
        type=number(int, 1, MAX_PROCESSES),
        metavar="N",
        help="how many shots at once; as many as there are cores if left out",
    )
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="make them on the workers of this Dask scheduler, such as tcp://10.0.0.1:8786",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="SHOT",
        help="these shots alone: names, patterns (hall_*), numbers (3) or ranges of them (1:100)",
    )
    parser.add_argument(
        "--report", action="store_true", help="make nothing; say what is there and what is not"
    )
    add_weights(parser)


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    if options.dask and options.workers:
        raise InputError(
            "A Dask cluster has as many workers as were started there; leave --workers out."
        )

    started = time.monotonic()
    shots = read_list(options.list)
    if options.only:
        shots = chosen(shots, options.only)
    batch = Batch(
        shots,
        options.output,
        weights=options.weights.absolute() if options.weights else None,
    )

    if options.report:
        outcomes = list(look(batch))
    else:
        if options.dask:
            workers = cluster_workers(options.dask, batch.output)
        else:
            workers = local_workers(min(options.workers or cores(), len(shots)))
        outcomes = make_batch(batch, workers, progress=progress, tell=_tell)

    told = report(batch, outcomes, time.monotonic() - started)
    lines = [f"{counted(told['counts'])}, in {duration(told['seconds'])}"]
    if not options.only:  # which other processes may be busy with, too
        lines.append(f"Report: {save_report(batch, told, _thumbnails())}")

    failed = [outcome for outcome in outcomes if outcome.state in ("failed", "busy")]
    if failed and not options.report:
        first = failed[0]
        several = len(failed) > 1
        raise InputError(
            f"{len(failed)} of {len(shots)} shots could not be made, {'first ' * several}"
            f"'{first.name}': {first.sentence} "
            f"Run again to try {'them' if several else 'it'} again."
        )
    return told, "\n".join(lines)


def _tell(outcome: Outcome) -> None:
    """Say what went wrong as soon as it does."""
    if outcome.state in ("failed", "busy"):
        log = f" ({outcome.log})" if outcome.log else ""
        complain(f"\n{outcome.name}: {printable(outcome.sentence, 1000)}{log}")


def _thumbnails() -> Callable[[Path], bytes] | None:
    """What makes a small picture of a rendered frame, where Blender is there to do it."""
    if importlib.util.find_spec("bpy") is None:
        return None

    def thumbnail(frame: Path) -> bytes:
        from ..blender.showcase.thumbnails import thumbnail

        return thumbnail(frame)

    return thumbnail


COMMAND = Command(
    name="batch",
    summary="make a list of shots, several at once, here or on a cluster; goes on where it stopped",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda options: ("distributed",) if options.dask else (),
)
