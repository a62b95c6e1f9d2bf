"""``dafnet bench``: the measurements in the folder of benchmarks."""

import argparse
import importlib
import sys
from pathlib import Path
from types import ModuleType

from ..core.errors import InputError
from .command import Command, Progress, Result, add_weights

__all__ = ["COMMAND", "benchmark"]

_MEASURES = ("rest", "seats", "speed")
"""Measurements of weights."""

_RESEARCH = {"ablation": "ablation", "canonical": "canonical", "tables": "experiments"}
"""What docs/training.md and docs/experiments.md were made with, and the scripts that do it."""


def benchmark(name: str) -> ModuleType:
    """A script in the folder of benchmarks, as a module that its processes can import as well."""
    checkout = str(Path(__file__).absolute().parents[2])
    if checkout not in sys.path:
        sys.path.insert(0, checkout)
    return importlib.import_module(f"benchmarks.{name}")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", choices=[*_MEASURES, *_RESEARCH])
    add_weights(parser)
    parser.add_argument(
        "--furniture",
        type=Path,
        metavar="LIBRARY",
        help="with 'rest': on these real pieces instead of seats made of boxes",
    )
    parser.add_argument(
        "arguments",
        nargs=argparse.REMAINDER,
        help="for 'ablation', 'canonical' and 'tables'; '-- --help' lists them",
    )


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    module = benchmark(_RESEARCH.get(options.name, options.name))
    if options.name in _MEASURES:
        if options.furniture and options.name != "rest":
            raise InputError(
                f"'{options.name}' does not use a furniture library; leave --furniture out, or "
                "measure 'rest'."
            )
        among = {"library": options.furniture} if options.furniture else {}
        found: Result = module.measure(options.weights, progress, **among)
        return found

    arguments = options.arguments[options.arguments[:1] == ["--"] :]
    text: str = module.main(arguments)
    return text, text


COMMAND = Command(
    name="bench",
    summary=(
        "measure: 'rest' cleans up bodies that hover over seats or sink into them; 'seats' sits on "
        "ten heights from three sides; 'speed' times every system; 'canonical' fits bodies to the "
        "skeleton; 'ablation' and 'tables' train and compare"
    ),
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda options: () if options.name in ("rest", "seats", "canonical") else ("torch",),
    folder="benchmarks",
)
