"""``dafnet bench``: the measurements in the folder of benchmarks, each with options of its own."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from ..core.errors import InputError
from .command import Command, Progress, Result, add_weights

__all__ = ["COMMAND", "benchmark"]

_MEASURES = {
    "life": "whether people sway as they walk, sit down as slowly as asked, and move as they rest",
    "live": "step Live through five minutes of random dragging",
    "rest": "clean up bodies that hover over seats or sink into them",
    "sample": "on the held-out motion that comes with the project, beside that motion",
    "seats": "sit on ten heights from three sides",
    "sitting": "send people to every kind of seat, from two sides, and see how they sit",
    "speed": "time every system",
}
"""Measurements of weights, and what they do."""

_DATA = {
    "life": ("--motion", "FOLDER", "beside what the unseen people of these motion files do"),
    "rest": (
        "--furniture",
        "LIBRARY",
        "on these real pieces instead of seats made of boxes",
    ),
    "sitting": (
        "--furniture",
        "LIBRARY",
        "to these real pieces, alone and in rooms, instead of made ones",
    ),
}
"""What a measurement may be given besides: the option, what it takes, and its effect."""
_SHEETS = ("sitting",)
"""Measurements that draw their worst."""

_RESEARCH = {
    "ablation": "ablation",
    "baked": "baked",
    "canonical": "canonical",
    "farm": "farm",
    "life-ablation": "life_ablation",
    "rerun": "rerun",
    "scale": "scale",
    "tables": "experiments",
    "wanted": "wanted",
}
"""What docs/training.md, docs/experiments.md and docs/batch.md were made with, and the scripts that
do it.
"""

_NEEDS = {
    "ablation": ("torch",),
    "life-ablation": ("torch",),
    "baked": ("bpy",),
    "farm": ("bpy",),
    "live": ("bpy",),
    "rerun": ("torch",),
    "scale": ("bpy",),
    "speed": ("torch",),
    "tables": ("torch",),
    "wanted": ("torch",),
}


def benchmark(name: str) -> ModuleType:
    """A script in the folder of benchmarks, as a module that its processes can import as well.

    Raises InputError where that folder does not lie beside the package.
    """
    checkout = str(Path(__file__).absolute().parents[2])
    if not Path(checkout, "benchmarks").is_dir():
        raise InputError("The benchmarks are not installed; run this in a checkout of the project.")
    if checkout not in sys.path:
        sys.path.insert(0, checkout)
    return importlib.import_module(f"benchmarks.{name}")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", choices=[*_MEASURES, *_RESEARCH])
    parser.add_argument(
        "arguments",
        nargs=argparse.REMAINDER,
        help="what that one wants; '-- --help' after its name lists it",
    )


def _measured_with(name: str, arguments: Sequence[str]) -> argparse.Namespace:
    """What a measurement is asked with: ``weights``, ``json``, and ``data`` where it takes some."""
    parser = argparse.ArgumentParser(f"dafnet bench {name}", description=_MEASURES[name])
    add_weights(parser)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    if name in _DATA:
        option, metavar, effect = _DATA[name]
        parser.add_argument(option, dest="data", type=Path, metavar=metavar, help=effect)
    if name in _SHEETS:
        parser.add_argument("--sheets", type=Path, metavar="FOLDER", help="draw the worst there")
    return parser.parse_args(arguments)


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    arguments = options.arguments[options.arguments[:1] == ["--"] :]
    if options.name in _MEASURES:
        asked = _measured_with(options.name, arguments)
        options.json = options.json or asked.json
        data = [asked.data] if options.name in _DATA else []
        data += [asked.sheets] if options.name in _SHEETS else []
        found: Result = benchmark(options.name).measure(asked.weights, progress, *data)
        return found

    text: str = benchmark(_RESEARCH[options.name]).main(arguments)
    return text, text


COMMAND = Command(
    name="bench",
    summary=(
        f"measure: {'; '.join(f'{name!r}: {does}' for name, does in _MEASURES.items())}; "
        "'baked' puts takes onto a real rig; 'canonical' fits bodies to the skeleton; 'ablation', "
        "'life-ablation' and 'tables' train and compare; 'rerun' makes figures of the weights' "
        "report again, 'wanted' says what they miss of what is wanted; 'scale' makes batches and "
        "kills them, 'farm' says what many shots take"
    ),
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda options: _NEEDS.get(options.name, ()),
)
