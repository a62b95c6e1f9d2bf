"""``dafnet populate``: a room filled with people who do things, from a file."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..core.checks import MAX_SEED
from ..core.text import printable
from .command import Command, Progress, Result, add_weights, add_wishes, number, wished
from .console import MAX_SHOWN

__all__ = ["COMMAND"]

_OVERRIDES = ("seed", "takes")
"""Options that stand for words of the file."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="SHOT.toml")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FOLDER")
    parser.add_argument(
        "--seed", type=number(int, 0, MAX_SEED), help="of all that is drawn, instead of the file's"
    )
    parser.add_argument(
        "--takes", type=number(int, 1), metavar="N", help="of everybody, instead of the file's"
    )
    add_wishes(parser)
    add_weights(parser)


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """What the options say in place of the file, by its words."""
    given = {word: getattr(options, word) for word in _OVERRIDES}
    return wished(options) | {word: value for word, value in given.items() if value is not None}


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..blender.populating.populate import populate
    from ..core.weights import load_weights

    made = populate(
        options.file,
        options.output,
        changes=_changes(options),
        weights=load_weights(options.weights) if options.weights else None,
        progress=progress,
    )
    report = {"output": str(options.output), **asdict(made)}
    return report, _as_text(report)


def _as_text(report: dict[str, Any]) -> str:
    lines = [f"Warning: {printable(warning, MAX_SHOWN)}" for warning in report["warnings"]]
    for person in report["people"]:
        did = ", ".join(
            f"{task['task']}{' (' + task['seat'] + ')' if task['seat'] else ''} "
            f"from {task['there']:.1f} s"
            for task in person["tasks"]
        )
        lines.append(
            f"{printable(person['name'])}, {person['height']:.2f} m: {printable(did, 300)}"
        )
    spent = (f"{stage} {seconds:.1f} s" for stage, seconds in report["seconds"].items())
    return "\n".join((*lines, ", ".join(spent), f"Written to {report['output']}"))


COMMAND = Command(
    name="populate",
    summary="fill a room with people who do what a file says, and save it with their keys",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("bpy",),
)
