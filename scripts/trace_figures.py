#!/usr/bin/env python3
"""Holds the figures of README, card and docs to the reports that commands made.

    scripts/trace_figures.py              each figure that is traced, and what of each page is not
    scripts/trace_figures.py --untraced   also the lines whose figures are not

Reports are the rows that ``dafnet evaluate --save`` wrote into the weights that ship, and
docs/evaluation-real.md, which ``dafnet evaluate --furniture`` writes. Traced are the tables that
stand for the weights, cell by cell, and the sentences of ``CLAIMS``. Exits with 1 where a figure is
another than its report's.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[1]
sys.path.insert(0, str(ROOT))

from dafnet_addon.core.weights import load_weights  # noqa: E402 - found only now

CARD = ROOT / "weights_stub" / "README.md"
README = ROOT / "README.md"
REAL = ROOT / "docs" / "evaluation-real.md"
WRITTEN = (ROOT / "docs" / "evaluation.md", REAL)
"""Pages that commands write."""

CLAIMS = (
    (README, r"(\d+) % of (\d+) sit-downs in FREE end within 8 cm", ("raw 8", "clips")),
    (README, r"carries one, (\d+) % within 4, as", ("raw 4",)),
    (README, r"on by default, (\d+) % within 4", ("clean 4",)),
    (CARD, r"share of (\d+) seated episodes whose", ("clips",)),
    (CARD, r"network gives it: \*\*(\d+) / (\d+) %\*\*", ("raw 4", "raw 8")),
    (
        CARD,
        r"\*Rest on Seats\* (\d+) / (\d+) %; EE (\d+) / (\d+) %",
        ("clean 4", "clean 8", "ee 4", "ee 8"),
    ),
    (CARD, r"EED (0\.\d{4})\. Sent by", ("eed",)),
)
"""Sentences on real furniture, and what of REAL's first row "all seats" their figures are."""

_README_ROWS = {
    "sits with the pelvis": ("sits_within_6cm", 100.0),
    "stands when": ("stands_when_it_should", 100.0),
    "sliding feet": ("foot_sliding_per_frame", 1.0),
    "joints that collide": ("bad_collisions_per_frame", 1.0),
    "distance of head": ("end_effector_error", 1.0),
}
_README_RUNS = ("ground_truth", "free_t0", "free_t0_clean", "ee_t0", "ee_t0_clean")
"""README's table: its rows by how they begin, and its columns."""

_NUMBER = re.compile(r"(?<![\w.,/-])(\d{1,3}(?:,\d{3})+|\d+\.\d+|\d+)(\s?%)?(?![\w,/-]|\.\d)")
_RUNS = {"**ground truth**": "ground_truth"}
_PARTS = {
    "at desks and shelves": "_at_desks_and_shelves",
    "composed": "_composed",
    "on beds": "_on_beds",
    "bodies also in training": "_bodies_in_training",
}
"""How the card names the runs of the weights' rows, and kinds of clips."""

_COLUMNS = {
    "clips": ("clips", 1.0),
    "seats": ("seat_episodes", 1.0),
    "sits within 6 cm": ("sits_within_6cm", 100.0),
    "stands when it should": ("stands_when_it_should", 100.0),
    "EED": ("end_effector_error", 1.0),
    "FS, feet a frame": ("foot_sliding_per_frame", 1.0),
    "skate, cm a frame": ("skate_cm", 1.0),
    "BCC a frame": ("bad_collisions_per_frame", 1.0),
    "jerk, m/s³": ("jerk", 1.0),
}
"""The card's columns: a figure of the rows, and what it is multiplied by."""


def held_out_rows() -> dict[str, dict[str, Any]]:
    """The rows that ``dafnet evaluate --save`` wrote into the weights that ship."""
    rows: dict[str, dict[str, Any]] = load_weights(None).says("held_out")
    return rows


def wrong_cells(page: str, rows: dict[str, dict[str, Any]]) -> tuple[int, list[str]]:
    """How many cells of the card's table were looked at, and those that are not what the weights'
    rows say at as many digits.
    """
    looked_at, wrong = 0, []
    lines = page.splitlines()
    start = next(i for i, line in enumerate(lines) if "| sits within 6 cm |" in line)
    names = [name.strip() for name in lines[start].split("|")[2:-1]]
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        label, *cells = (cell.strip() for cell in line.split("|")[1:-1])
        row = rows[_run(label)]
        for name, cell in zip(names, cells, strict=True):
            key, factor = _COLUMNS[name]
            value, figure = row.get(key), cell.rstrip("%")
            looked_at += 1
            if figure != "–" if value is None else not _is_rounded(value * factor, figure):
                wrong.append(f"{label}, {name}: the page says {cell}, the weights {value}")
    return looked_at, wrong


def _run(label: str) -> str:
    """The weights' row of a label of the card, as "FREE, 0, cleaned up"."""
    parts = [part.strip() for part in label.split(",")]
    kind = next((_PARTS[part] for part in parts if part in _PARTS), "")
    if parts[0] in _RUNS:
        return _RUNS[parts[0]] + kind
    run = f"{parts[0].lower()}_t{parts[1].removeprefix('temperature ')}"
    return f"{run}{'_clean' if 'cleaned up' in parts else ''}{kind}"


def _is_rounded(value: float, figure: str) -> bool:
    """Whether a figure is a value, rounded to the figure's decimals."""
    half = 0.5 * 10.0 ** -len(figure.partition(".")[2])
    return abs(float(figure) - value) <= half * (1.0 + 1e-6)


def wrong_readme_cells(page: str, rows: dict[str, dict[str, Any]]) -> tuple[int, list[str]]:
    """As ``wrong_cells``, for README's table."""
    looked_at, wrong = 0, []
    for begins, (key, factor) in _README_ROWS.items():
        line = next(line for line in page.splitlines() if line.startswith(f"| {begins}"))
        for run, cell in zip(_README_RUNS, line.split("|")[2:-1], strict=True):
            looked_at += 1
            figure = cell.strip().removesuffix("%").strip()
            value = rows[run][key] * factor
            if not _is_rounded(value, figure):
                wrong.append(f"{begins}, {run}: the page says {figure}, the weights {value:g}")
    return looked_at, wrong


def real_figures(page: str) -> dict[str, str]:
    """The figures of the telling test's row "all seats" in docs/evaluation-real.md."""
    telling = page[page.index("## Bodies and makers that tell") :]
    line = next(line for line in telling.splitlines() if line.startswith("| **all seats** |"))
    clips, raw, clean, led, eed = (cell.strip() for cell in line.split("|")[2:7])
    found = {"clips": clips, "eed": eed}
    for name, cell in (("raw", raw), ("clean", clean), ("ee", led)):
        shares = cell.split(" (")[0].split(" / ")
        found |= {f"{name} {within}": share for within, share in zip("248", shares, strict=True)}
    return found


def wrong_claims() -> tuple[int, list[str]]:
    """As ``wrong_cells``, for the sentences of ``CLAIMS``."""
    looked_at, wrong, real = 0, [], real_figures(REAL.read_text(encoding="utf-8"))
    for page, pattern, names in CLAIMS:
        text = re.sub(r"\s+", " ", page.read_text(encoding="utf-8"))
        found = re.search(pattern, text)
        if found is None:
            wrong.append(f"{page.name} no longer says what matches '{pattern}'")
            continue
        for said, name in zip(found.groups(), names, strict=True):
            looked_at += 1
            if said != real[name]:
                wrong.append(f"{page.name}: {said} for {name}, the report {real[name]}")
    return looked_at, wrong


def figures(text: str) -> Iterator[tuple[str, str]]:
    """The figures of a page with their lines: measured ones, with decimals or a percent sign, or
    large; not those in code, links and headings.
    """
    text = re.sub(r"(?s)```.*?```", "", text)
    for line in text.splitlines():
        plain = re.sub(r"`[^`]*`|\]\([^)]*\)|https?://\S+", "", line)
        if line.startswith("#"):
            continue
        for number, percent in _NUMBER.findall(plain):
            if "." in number or percent or "," in number or int(number) >= 100:
                yield number.replace(",", ""), line.strip()


def checks() -> Iterator[tuple[str, int, list[str]]]:
    """All that is traced: what it is, how many figures it has, and those that are wrong."""
    rows = held_out_rows()
    yield "the card's table", *wrong_cells(CARD.read_text(encoding="utf-8"), rows)
    yield "README's table", *wrong_readme_cells(README.read_text(encoding="utf-8"), rows)
    yield "sentences on real furniture", *wrong_claims()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--untraced", action="store_true", help="also list what is not traced")
    options = parser.parse_args()

    faults = 0
    for name, looked_at, wrong in checks():
        print(f"{name}: {looked_at - len(wrong)} of {looked_at} figures are their report's")
        faults += len(wrong)
        for each in wrong:
            print(f"  {each}")

    print("\nNot traced (figures with decimals or a percent sign, or of 100 and more):")
    for page in (README, CARD, *sorted((ROOT / "docs").rglob("*.md"))):
        if page in WRITTEN:
            continue
        lines = [line for _, line in untraced(page)]
        print(f"  {page.relative_to(ROOT).as_posix()}: {len(lines)}")
        if options.untraced:
            for line in dict.fromkeys(lines):
                print(f"    {line[:150]}")
    sys.exit(bool(faults))


def untraced(page: Path) -> Iterator[tuple[str, str]]:
    """The figures of a page, but for those of the tables and sentences that are traced."""
    text = page.read_text(encoding="utf-8")
    if page == README:
        rows = tuple(f"| {begins}" for begins in _README_ROWS)
        text = "\n".join(line for line in text.splitlines() if not line.startswith(rows))
    if page == CARD:
        text = re.sub(r"(?ms)^\| \| clips \| seats \|.*?\n\n", "\n", text)
    for of, pattern, _ in CLAIMS:
        if page == of:
            text = re.sub(pattern.replace(" ", r"\s+"), "", text)
    yield from figures(text)


if __name__ == "__main__":
    main()
