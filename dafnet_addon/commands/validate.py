"""``dafnet validate``: how good a run has become, while it trains."""

import argparse
from pathlib import Path

from ..core.files import require_writable
from .command import MAX_PROCESSES, Command, Progress, Result, number
from .console import complain

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("training", type=Path, metavar="RUN", help="folder of the run")
    parser.add_argument("dataset", type=Path, metavar="DATASET", help="what it trains on")
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of motion files")
    parser.add_argument(
        "--furniture", type=Path, required=True, metavar="LIBRARY", help="folder of real pieces"
    )
    parser.add_argument(
        "--every",
        type=number(float, 0.0),
        metavar="MINUTES",
        help="measure again and again until the run's budget is spent",
    )
    parser.add_argument("--processes", type=number(int, 1, MAX_PROCESSES), default=1)


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    import torch

    from ..data.held_out.real import real_test
    from ..training.validation import BEST, describe, read_record, validate_steps

    torch.set_num_threads(options.processes)
    require_writable(options.training / BEST)
    for found in validate_steps(
        options.training,
        options.dataset,
        real_test(options.folder, options.furniture, "choose"),
        every=options.every,
        processes=options.processes,
        progress=progress,
    ):
        if options.every is not None:
            complain(describe(found))

    rows = read_record(options.training)
    return rows, "\n".join(describe(each) for each in rows)


COMMAND = Command(
    name="validate",
    summary="measure a run among real furniture while it trains, and keep its best weights",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("torch", "matplotlib"),
)
