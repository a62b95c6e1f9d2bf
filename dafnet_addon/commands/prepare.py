"""``dafnet prepare``: a training set from motion files."""

import argparse
import json
from pathlib import Path

from ..core.checks import MAX_SEED
from ..core.files import require_writable
from ..core.threads import cores
from .command import MAX_PROCESSES, Command, Progress, Result, number

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of motion files")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DATASET")
    parser.add_argument(
        "--furniture",
        type=Path,
        metavar="LIBRARY",
        help="folder of real furniture to use besides boxes",
    )
    parser.add_argument(
        "--windows", type=number(int, 1), default=12000, help="how many training windows"
    )
    parser.add_argument("--processes", type=number(int, 1, MAX_PROCESSES), default=cores())
    parser.add_argument("--seed", type=number(int, 0, MAX_SEED), default=0)


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..data.dataset.prepare import prepare

    require_writable(options.output / "dataset.json")
    prepare(
        options.folder,
        options.output,
        windows=options.windows,
        processes=options.processes,
        seed=options.seed,
        progress=progress,
        furniture=options.furniture,
    )
    description, summary, fits = (
        (options.output / name).read_text(encoding="utf-8")
        for name in ("dataset.json", "summary.txt", "fits.txt")
    )
    written = f"Written to {options.output}; look at its preview.png"
    return json.loads(description), summary + fits + written


COMMAND = Command(
    name="prepare",
    summary="make a training set from motion files, or resume making one",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("matplotlib",),
)
