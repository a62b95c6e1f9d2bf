"""``dafnet cool``: candidate weights from a run that keeps training."""

import argparse
from pathlib import Path

from ..core.files import require_writable
from .command import Command, Progress, Result, number

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("training", type=Path, metavar="RUN", help="folder of the run, only read")
    parser.add_argument("dataset", type=Path, metavar="DATASET", help="what it trains on")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="CANDIDATE", help="folder of the copy"
    )
    parser.add_argument(
        "--minutes", type=number(float, 0.0), default=5.0, help="how long to train each part"
    )
    parser.add_argument("--device", default="cpu", help="'cpu' or 'cuda'")


def _run(options: argparse.Namespace, _progress: Progress) -> Result:
    from ..training import ranks
    from ..training.candidates import cool

    device = ranks.device_of(options.device)
    require_writable(options.output / "weights")
    file = cool(options.training, options.dataset, options.output, options.minutes, device)
    return {"weights": str(file)}, f"Written to {file}"


COMMAND = Command(
    name="cool",
    summary="train a copy of a run for some minutes at a falling rate, and write its weights",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("torch",),
)
