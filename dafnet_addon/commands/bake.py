"""``dafnet bake``: motion for the character of a .blend file, without a window."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import InputError
from ..core.take import MODES
from ..core.text import printable
from ..core.wishes import Wishes
from ..director.task_lists import read_task_file
from ..director.tasks import said
from .command import (
    Command,
    Progress,
    Result,
    add_noise,
    add_weights,
    add_wishes,
    frame_range,
    number,
    wished,
)
from .console import MAX_SHOWN

if TYPE_CHECKING:
    from ..blender.pipeline.batch import Written

__all__ = ["COMMAND"]

_OBJECTS = {
    "root": "root",
    "furniture": "furniture",
    "head": "head",
    "hand-left": "hand_left",
    "hand-right": "hand_right",
    "foot-left": "foot_left",
    "foot-right": "foot_right",
    "look-at": "look_at",
    "upper-body": "upper_body_source",
    "lower-body": "lower_body_source",
}
"""Options that name an object or a collection, and the character's settings that they override."""

_SHARES = {
    "plant-feet": "0 leaves the feet as generated, 1 holds standing feet in place",
    "rest-on-seats": (
        "0 leaves the body as generated, 1 brings it to where the seat it rests on carries it"
    ),
    "reach-targets": "0 leaves head, hands and feet as generated, 1 puts them onto targets",
    "clear-furniture": "0 leaves hands and feet as generated, 1 moves them out of furniture",
    "smooth": "0 leaves the motion as generated, 1 smooths out abrupt changes",
}
"""Options of the clean-up, each from 0 to 1, and what they do."""

_BEGINS = {"standing": "STANDING", "as-it-is": "AS_IT_IS"}
"""The words of the option ``--begins``, and the setting's values."""

_NOISES = {"comes-and-goes": "COMES_AND_GOES", "held": "HELD"}
"""The words of the option ``--noise``, and the setting's values."""

_SETTINGS = (
    *_OBJECTS.values(),
    "mode",
    "temperature",
    "seed",
    "noise",
    *(name.replace("-", "_") for name in _SHARES),
)
"""The character's settings that the command may override, each by the option of its name."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    # Inside Blender the file that is open is the scene, if no other is named.
    nargs = "?" if parser.get_default("in_blender") else None
    parser.add_argument("file", type=Path, nargs=nargs, metavar="FILE.blend")

    written = parser.add_mutually_exclusive_group(required=True)
    written.add_argument("-o", "--output", type=Path, metavar="OUT.blend")
    written.add_argument("--in-place", action="store_true", help="overwrite FILE.blend itself")

    parser.add_argument(
        "--scene",
        metavar="NAME",
        help="the scene to use instead of the one that is active in the file",
    )

    parser.add_argument(
        "--character", metavar="ARMATURE", help="needed where the scene has several characters"
    )

    for name, setting in _OBJECTS.items():
        parser.add_argument(
            f"--{name}", dest=setting, metavar="NAME", help="overrides the character's own setting"
        )

    parser.add_argument(
        "--begins",
        choices=sorted(_BEGINS),
        help="whether it stands at first, or begins with the pose and motion that it has there",
    )
    parser.add_argument("--mode", choices=MODES, help="one mode for all frames")
    parser.add_argument(
        "--frames",
        type=frame_range,
        metavar="A:B",
        help="first and last frame; write --frames=A:B if A is negative",
    )

    for name, effect in _SHARES.items():
        parser.add_argument(f"--{name}", type=number(float, 0.0, 1.0), metavar="SHARE", help=effect)

    parser.add_argument(
        "--takes",
        type=number(int, 1),
        default=1,
        metavar="N",
        help="how many takes; the first one plays",
    )

    add_noise(parser, temperature=None)
    parser.add_argument(
        "--noise",
        choices=sorted(_NOISES),
        help="whether what makes takes differ varies during a take, as in real motion, or is held",
    )
    add_weights(parser)
    parser.add_argument(
        "--device",
        metavar="NAME",
        help="run the network on PyTorch, where that is installed: 'cpu', 'cuda' or 'mps'",
    )

    parser.add_argument(
        "--tasks",
        type=Path,
        metavar="FILE",
        help="a TOML or JSON file of tasks, planned in the scene and keyed before",
    )
    parser.add_argument(
        "--already-there",
        action="store_true",
        help="with --tasks: at first the character is where its first task is done",
    )
    parser.add_argument(
        "--find",
        action="store_true",
        help="find the furniture along the root's path, as Find Furniture does",
    )
    add_wishes(parser)
    parser.add_argument(
        "--rig",
        metavar="ARMATURE",
        help="put the takes onto this armature as well, and deliver it instead of the character",
    )


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """What the options set on the character, by the setting's name."""
    changes = {setting: getattr(options, setting) for setting in _SETTINGS}
    changes["noise"] = _NOISES.get(options.noise)
    changes["begins"] = _BEGINS.get(options.begins)
    if options.frames:
        changes["frame_start"], changes["frame_end"] = options.frames
    return {setting: value for setting, value in changes.items() if value is not None}


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..blender.pipeline.batch import bake_takes
    from ..core.weights import load_weights

    if options.already_there and options.tasks is None:
        raise InputError("--already-there is about tasks; give --tasks as well.")

    written = bake_takes(
        options.file,
        options.output,
        scene=options.scene,
        character=options.character,
        takes=options.takes,
        weights=load_weights(options.weights) if options.weights else None,
        device=options.device,
        progress=progress,
        changes=_changes(options),
        tasks=read_task_file(options.tasks) if options.tasks else (),
        already_there=options.already_there,
        find=options.find,
        wishes=Wishes(rig=options.rig, **wished(options)),
    )
    result = written.result

    report: dict[str, Any] = {
        "output": str(written.file),
        "delivered": None if written.folder is None else str(written.folder),
        "tasks": _tasks(written),
        "takes": [
            {
                "action": action.name,
                "seed": take.draw.seed,
                "temperature": take.draw.temperature,
                "frames": len(take),
                "log_likelihood": round(take.log_likelihood, 3),
                "metrics": take.metrics,
                "raw_metrics": take.raw_metrics,
                "verdict": [asdict(finding) for finding in take.verdict],
            }
            for action, take in zip(result.actions, result.takes, strict=True)
        ],
        "warnings": list(result.warnings),
        "seconds": {stage: round(spent, 4) for stage, spent in result.seconds.items()},
    }

    return report, _as_text(report)


def _tasks(written: "Written") -> list[dict[str, Any]]:
    """What was planned, in the scene's frames."""
    if written.directed is None:
        return []
    first = written.directed.first
    return [
        {
            "task": said(entry.task),
            "start": first + entry.start,
            "there": first + entry.there,
            "stop": first + entry.stop,
            "furniture": entry.furniture,
            "seat": entry.seat,
        }
        for entry in written.directed.plan.timeline
    ]


def _as_text(report: dict[str, Any]) -> str:
    lines = [f"Warning: {printable(warning, MAX_SHOWN)}" for warning in report["warnings"]]
    for task in report["tasks"]:
        seat = f" ({printable(task['seat'])})" if task["seat"] else ""
        lines.append(
            f"Frames {task['start']} to {task['stop'] - 1}: {printable(task['task'])}{seat}"
        )
    for take in report["takes"]:
        slides = f"{take['metrics']['foot_sliding_per_frame']:.2f} sliding feet per frame"
        lines.append(
            f"{printable(take['action'])}: {take['frames']} frames, seed {take['seed']}, {slides}"
        )

    spent = (f"{stage} {seconds:.2f} s" for stage, seconds in report["seconds"].items())
    lines += [", ".join(spent), f"Written to {report['output']}"]
    if report["delivered"]:
        lines.append(f"Delivered in {report['delivered']}")
    return "\n".join(lines)


COMMAND = Command(
    name="bake",
    summary="generate the motion of a scene's character and save the scene with its keys",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda options: ("bpy", "torch") if options.device else ("bpy",),
)
