"""``dafnet train``: weights from a training set."""

import argparse
from dataclasses import replace
from pathlib import Path

from ..core.files import require_writable
from .command import Command, Progress, Result, number

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "config", type=Path, metavar="CONFIG.toml", help="sizes and budgets; see configs/"
    )
    parser.add_argument("dataset", type=Path, metavar="DATASET", help="made by 'prepare'")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="RUN", help="folder of the run"
    )
    parser.add_argument(
        "--minutes",
        type=number(float, 0.0),
        help="how long to train the flow, instead of what the configuration says",
    )
    parser.add_argument(
        "--from",
        dest="begin_with",
        type=Path,
        metavar="WEIGHTS",
        help="weights that a new run starts from",
    )
    parser.add_argument(
        "--device", default="cpu", help="'cpu', or 'cuda'; several GPUs through torchrun"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="overrides a setting of the configuration, such as batch=256 or width=384",
    )


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..core.weights import load_weights
    from ..training import precision, ranks
    from ..training.candidates import write_weights
    from ..training.config import read_config
    from ..training.train import train

    model, config = read_config(options.config, options.set)
    if options.minutes is not None:
        config = replace(config, minutes_flow=options.minutes)

    device = ranks.device_of(options.device)
    begin_with = load_weights(options.begin_with) if options.begin_with else None
    file = options.output / f"{model.system}.safetensors"
    require_writable(file)
    if ranks.rank() == 0:
        precision.warn_if_missing(config.mixed, device)

    train(
        options.dataset,
        options.output,
        model,
        config,
        progress=progress,
        device=device,
        begin_with=begin_with,
    )
    if ranks.rank():
        return None

    write_weights(options.output, options.dataset, file, device)
    return {"weights": str(file)}, f"Written to {file}"


COMMAND = Command(
    name="train",
    summary="train a model, or resume a run, and write its weights",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("torch",),
)
