"""``dafnet demo``: the example room, from nothing to a film."""

import argparse
from pathlib import Path

from .command import Command, Progress, Result, add_noise, add_weights

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", type=Path, default=Path("out/demo"), metavar="FOLDER")
    parser.add_argument(
        "--no-preview", action="store_true", help="make no film and no contact sheet"
    )
    add_noise(parser, temperature=0.0)
    add_weights(parser)


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..blender.showcase.demo_room import run_demo

    report = run_demo(
        options.output,
        seed=options.seed,
        temperature=options.temperature,
        weights=options.weights,
        preview=not options.no_preview,
        progress=progress,
    )
    seats = (
        f"{seat['name']}: seat {seat['seat_height']:.2f} m, pelvis {seat['pelvis_height']:.3f} m, "
        f"{100 * seat['error']:+.1f} cm from where it should be"
        for seat in report["seats"]
    )
    return report, "\n".join((*seats, f"Written to {options.output}"))


COMMAND = Command(
    name="demo",
    summary="build the example room, generate, bake, render a preview and report",
    add_arguments=_add_arguments,
    run=_run,
    needs=lambda _: ("bpy",),
)
