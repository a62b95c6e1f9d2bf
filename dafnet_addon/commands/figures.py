"""``dafnet figures``: the paper's figures, drawn with any weights."""

import argparse
from pathlib import Path

from ..core.errors import InputError
from ..core.files import require_writable
from .bench import benchmark
from .command import Command, Progress, Result, add_weights

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", type=Path, default=Path("out/figures"), metavar="FOLDER")
    add_weights(parser)
    parser.add_argument(
        "--other",
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="weights of another system",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="NUMBER",
        help="figure numbers as in the paper; all if left out",
    )


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    others = {}
    for each in options.other:
        name, _, file = each.partition("=")
        if not file:
            raise InputError(f"'{each}' does not name a weights file; write it as NAME=FILE.")
        others[name] = Path(file)

    require_writable(options.output / "figure.png")
    files = [
        str(file)
        for file in benchmark("figures").draw(
            options.output, options.weights, others, options.only, progress
        )
    ]
    return files, "\n".join(files)


COMMAND = Command(
    name="figures",
    summary="draw the paper's figures with these weights",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("bpy", "PIL"),
)
