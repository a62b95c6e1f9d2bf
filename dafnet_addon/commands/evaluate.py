"""``dafnet evaluate``: weights measured on held-out motion, in one of three tests."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.errors import InputError
from ..core.files import require_writable, save_text
from .command import Command, Progress, Result, add_weights

if TYPE_CHECKING:
    from ..data.held_out.captured import HeldClip

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of motion files")
    add_weights(parser)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FOLDER",
        help="write evaluation.json, .md and .png there",
    )
    parser.add_argument(
        "--save", action="store_true", help="write the figures into the weights' metadata"
    )
    parser.add_argument(
        "--sheets",
        type=Path,
        metavar="FOLDER",
        help="also draw twenty clips, real motion above generated motion",
    )
    parser.add_argument(
        "--furniture",
        type=Path,
        metavar="LIBRARY",
        help="measure among this real furniture instead",
    )
    parser.add_argument(
        "--role",
        choices=["choose", "tell"],
        default="choose",
        help=(
            "with --furniture: the bodies and makers kept for choosing a model, or those kept for "
            "reporting on it"
        ),
    )


def _needs(options: argparse.Namespace) -> Sequence[str]:
    plots = ("matplotlib",) if options.output or options.sheets else ()
    sheets = ("PIL",) if options.sheets else ()
    return "torch", *plots, *sheets


def _run(options: argparse.Namespace, progress: Progress) -> Result:
    from ..data.held_out.captured import held_out

    for folder in filter(None, (options.output, options.sheets)):
        require_writable(folder / "evaluation.json")

    if options.furniture:
        return _among_real_furniture(options, progress)

    clips = held_out(options.folder)
    if options.weights is not None and options.weights.suffix in (".checkpoint", ".pt"):
        return _samp(options, clips, progress)
    return _on_held_out_clips(options, clips, progress)


def _on_held_out_clips(
    options: argparse.Namespace, clips: "list[HeldClip]", progress: Progress
) -> Result:
    """The main test: clips of bodies that training has not seen."""
    from ..core.weights import load_weights
    from ..training.evaluation.contact_sheets import contact_sheets
    from ..training.evaluation.plots import draw_bars
    from ..training.evaluation.report import report
    from ..training.evaluation.report_text import report_text
    from ..training.export import annotate

    weights = load_weights(options.weights)
    found = report(weights, clips, progress)
    if options.save:
        rows = found["rows"]
        annotate(
            weights.path,
            {"ground_truth": json.dumps(rows["ground_truth"]), "held_out": json.dumps(rows)},
        )

    if options.output:
        save_text(options.output / "evaluation.json", json.dumps(found, indent=2))
        save_text(options.output / "evaluation.md", report_text(found))
        draw_bars(found, options.output / "evaluation.png")
    if options.sheets:
        contact_sheets(weights, clips, options.sheets)

    return found, report_text(found)


def _among_real_furniture(options: argparse.Namespace, progress: Progress) -> Result:
    """The test among real furniture: seats by kind, maker and body."""
    from ..core.weights import load_weights
    from ..data.held_out.real import real_test
    from ..data.held_out.walks import real_walks
    from ..training.evaluation.real_report import real_page, real_report, real_text

    if options.save or options.sheets:
        raise InputError(
            "The test among real furniture makes tables only; leave out --save and --sheets."
        )

    weights = load_weights(options.weights)
    found = real_report(
        weights,
        real_test(options.folder, options.furniture, options.role),
        progress,
        walks=real_walks(options.furniture, options.role),
    )
    if options.output:
        save_text(options.output / f"real-{options.role}.json", json.dumps(found, indent=2))
        title = f"Bodies and makers that {options.role}"
        save_text(options.output / f"real-{options.role}.md", real_page(found, title))

    return found, real_text(found)


def _samp(options: argparse.Namespace, clips: "list[HeldClip]", progress: Progress) -> Result:
    """A checkpoint of SAMP: only the rows, for each way to run its network."""
    from ..baselines.samp_evaluate import measure_samp
    from ..baselines.train import load_samp
    from ..training.evaluation.clips import rows_by_group, table

    if options.save or options.sheets or options.output:
        raise InputError(
            "A checkpoint of SAMP gives a table only; leave out --save, --sheets and --output."
        )

    kind, _ = load_samp(options.weights)
    found = {}
    for each in ("samp", "samp-a") if kind == "samp" else (kind,):
        found[each] = rows_by_group(measure_samp(options.weights, each, clips, progress))

    return found, "\n\n".join(f"## {name}\n\n{table(r)}" for name, r in found.items())


COMMAND = Command(
    name="evaluate",
    summary="measure weights on held-out clips, and the clips themselves for comparison",
    add_arguments=_add_arguments,
    run=_run,
    needs=_needs,
)
