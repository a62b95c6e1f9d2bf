"""``dafnet carry``: a dataset or a run packed for another machine, and unpacked there."""

import argparse
from pathlib import Path

from ..core.errors import InputError
from ..core.files import require_writable
from .command import Command, Progress, Result, number

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="a dataset, or a run's folder")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    parser.add_argument(
        "--mebibytes",
        type=number(float, 1.0),
        default=60.0,
        help="pack as many windows of a dataset as fit into this size",
    )


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..data.dataset.packed import is_packed, pack, unpack

    source, output = options.folder, options.output
    if source.resolve() == output.resolve():
        raise InputError("The folder cannot be packed into itself; name another one after -o.")

    require_writable(output / "dataset.json")
    if any(source.glob("*.checkpoint")):
        from ..training.checkpoints import slim_run

        files = [str(file) for file in slim_run(source, output)]
        return {"files": files}, "\n".join(files)

    if is_packed(source):
        windows = unpack(source, output, progress)
    else:
        windows = pack(source, output, options.mebibytes, progress)

    return {"windows": windows}, f"{windows} windows written to {output}"


COMMAND = Command(
    name="carry",
    summary="pack a dataset or a run for another machine, or unpack a packed dataset",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda options: ("torch",) if any(options.folder.glob("*.checkpoint")) else (),
)
