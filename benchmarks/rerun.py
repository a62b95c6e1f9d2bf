"""Figures of the report on the weights that ship, drawn at random and made again.

    dafnet bench rerun FOLDER --seed 7

``FOLDER`` holds the motion files (docs/data.md). The report's rows are those that ``dafnet evaluate
FOLDER --save`` wrote into the weights file, from which the card's and README's tables come
(``scripts/trace_figures.py``). Each figure that is drawn is measured anew on the clips that it is
of. On another processor sums round otherwise, and a take at temperature 1 may go another way.
"""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dafnet_addon.core.errors import DafnetError
from dafnet_addon.core.weights import load_weights
from dafnet_addon.data.held_out.captured import held_out
from dafnet_addon.training.evaluation.clips import (
    COLUMNS,
    SEEDS,
    group_of,
    measure_clips,
    rows_by_group,
)
from dafnet_addon.training.evaluation.markdown import markdown_table

__all__ = ["drawn", "main", "made_again"]

_SAME = 0.01
"""Share by which a figure may differ where sums round otherwise."""


def drawn(rows: dict[str, dict[str, Any]], count: int, seed: int) -> list[tuple[str, str]]:
    """So many figures of the ``rows`` that pages show: the row's name and the figure's."""
    figures = [
        (row, name)
        for row, values in rows.items()
        for name, value in values.items()
        if name in COLUMNS and isinstance(value, float)
    ]
    chosen = np.random.default_rng(seed).choice(len(figures), count, replace=False)
    return [figures[k] for k in sorted(chosen)]


def made_again(folder: Path, row: str, weights: Path | None = None) -> dict[str, Any]:
    """One row of the report, measured anew on its clips alone."""
    clips = held_out(folder)
    group = max((group_of(clip) for clip in clips if row.endswith(group_of(clip))), key=len)
    of = [clip for clip in clips if group_of(clip) == group]
    run = row.removesuffix(group)
    found = measure_clips(
        load_weights(weights),
        of,
        seeds=SEEDS if run.endswith("t1") else 1,
        modes=() if run == "ground_truth" else (run.split("_")[0].upper(),),
        clean=run.endswith("_clean"),
    )
    return rows_by_group(found)[row]


def _compared(
    folder: Path, rows: dict[str, dict[str, Any]], chosen: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, str, float, float]]:
    again: dict[str, dict[str, Any]] = {}
    for row, name in chosen:
        if row not in again:
            again[row] = made_again(folder, row)
        yield row, name, rows[row][name], again[row][name]


def main(arguments: Sequence[str]) -> str:
    """Run what the arguments ask for; the table as text. Raises DafnetError where a figure is not
    what the report says.
    """
    parser = argparse.ArgumentParser(
        "dafnet bench rerun",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=5)
    parser.add_argument("--seed", type=int, required=True)
    options = parser.parse_args(arguments)

    rows = load_weights(None).says("held_out")
    chosen = drawn(rows, options.count, options.seed)
    compared = list(_compared(options.folder, rows, chosen))
    table = markdown_table(
        ("row", "figure", "report", "again"),
        [(row, name, f"{report:.4g}", f"{again:.4g}") for row, name, report, again in compared],
    )
    other = [
        f"{row}, {name}"
        for row, name, report, again in compared
        if abs(again - report) > _SAME * abs(report)
    ]
    if other:
        raise DafnetError(f"{table}\n\nNot what the report says: {'; '.join(other)}.")
    return table
