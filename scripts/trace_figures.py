#!/usr/bin/env python3
"""Holds the figures of README, card and docs to the reports that commands made.

    scripts/trace_figures.py              how many figures of each page are their report's
    scripts/trace_figures.py --untraced   also the lines whose figures are not traced
    scripts/trace_figures.py --mend       write the reports' figures into the pages

Reports lie in docs/reports, as commands wrote them (docs/figures-from.md says which), and the rows
of ``dafnet evaluate --save`` in the weights that ship. Traced are tables, cell by cell, and the
sentences of ``CLAIMS``. Exits with 1 where a figure is another than its report's.
"""

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[1]
sys.path.insert(0, str(ROOT))

from dafnet_addon.core.weights import load_weights  # noqa: E402 - found only now

CARD = ROOT / "weights_stub" / "README.md"
README = ROOT / "README.md"
REPORTS = ROOT / "docs" / "reports"
WRITTEN = (ROOT / "docs" / "evaluation.md", ROOT / "docs" / "evaluation-real.md")
"""Pages that commands write."""

Reports = Mapping[str, Any]


@dataclass(frozen=True)
class Figure:
    """A figure of a page, from ``start`` to ``stop`` of its text, and the ``value`` that its report
    has for it: None where it has none, and the page a dash.
    """

    page: Path
    start: int
    stop: int
    said: str
    value: float | None

    @property
    def expected(self) -> str:
        """The report's value with as many decimals as the page gives."""
        if self.value is None:
            return "–"
        decimals = len(self.said.partition(".")[2])
        return f"{self.value:.{decimals}f}"

    @property
    def holds(self) -> bool:
        """Whether what is said is the value, rounded to the said decimals."""
        if self.value is None or self.said == "–":
            return self.value is None and self.said == "–"
        half = 0.5 * 10.0 ** -len(self.said.partition(".")[2])
        return abs(float(self.said) - self.value) <= half * (1.0 + 1e-6)


def reports() -> dict[str, Any]:
    """All reports by the names of their files, and the weights' "rows"."""
    found = {
        file.stem: json.loads(file.read_text(encoding="utf-8")) for file in REPORTS.glob("*.json")
    }
    return {**found, "rows": load_weights(None).says("held_out")}


def _cells(text: str, line_start: int, line: str) -> list[tuple[int, str]]:
    """The cells of a table's line: where each begins in the text, and what it says."""
    found, at = [], line_start + line.index("|") + 1
    for cell in line.split("|")[1:-1]:
        said = cell.strip()
        found.append((at + cell.index(said) if said else at, said))
        at += len(cell) + 1
    return found


def _lines(text: str) -> Iterator[tuple[int, str]]:
    at = 0
    for line in text.splitlines(keepends=True):
        yield at, line.rstrip("\n")
        at += len(line)


def _figure(page: Path, at: int, cell: str, value: float | None) -> Figure:
    said = cell.removesuffix("%").strip()
    return Figure(page, at, at + len(said), said, value)


_CARD_RUNS = {"**ground truth**": "ground_truth"}
_CARD_PARTS = {
    "at desks and shelves": "_at_desks_and_shelves",
    "composed": "_composed",
    "on beds": "_on_beds",
    "bodies also in training": "_bodies_in_training",
}
"""How the card names the runs of the weights' rows, and kinds of clips."""

_CARD_COLUMNS = {
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


def _run(label: str) -> str:
    """The weights' row of a label of the card, as "FREE, 0, cleaned up"."""
    parts = [part.strip() for part in label.split(",")]
    kind = next((_CARD_PARTS[part] for part in parts if part in _CARD_PARTS), "")
    if parts[0] in _CARD_RUNS:
        return _CARD_RUNS[parts[0]] + kind
    run = f"{parts[0].lower()}_t{parts[1].removeprefix('temperature ')}"
    return f"{run}{'_clean' if 'cleaned up' in parts else ''}{kind}"


def card_table(text: str, of: Reports) -> Iterator[Figure]:
    """The card's table of held-out clips."""
    lines = list(_lines(text))
    first = next(i for i, (_, line) in enumerate(lines) if "| sits within 6 cm |" in line)
    names = [said for _, said in _cells(text, *lines[first])[1:]]
    for at, line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        (_, label), *cells = _cells(text, at, line)
        row = of["rows"][_run(label)]
        for name, (start, cell) in zip(names, cells, strict=True):
            key, factor = _CARD_COLUMNS[name]
            value = row.get(key)
            yield _figure(CARD, start, cell, None if value is None else factor * value)


_README_ROWS = {
    "sits with the pelvis": ("sits_within_6cm", 100.0),
    "stands when": ("stands_when_it_should", 100.0),
    "sliding feet": ("foot_sliding_per_frame", 1.0),
    "joints that collide": ("bad_collisions_per_frame", 1.0),
    "distance of head": ("end_effector_error", 1.0),
}
_README_RUNS = ("ground_truth", "free_t0", "free_t0_clean", "ee_t0", "ee_t0_clean")
"""README's table: its rows by how they begin, and its columns."""


def readme_table(text: str, of: Reports) -> Iterator[Figure]:
    """README's table of held-out clips."""
    for at, line in _lines(text):
        for begins, (key, factor) in _README_ROWS.items():
            if line.startswith(f"| {begins}"):
                for run, (start, cell) in zip(
                    _README_RUNS, _cells(text, at, line)[1:], strict=True
                ):
                    yield _figure(README, start, cell, factor * of["rows"][run][key])


def _share(report: str, group: str, run: str, within: int) -> Callable[[Reports], float]:
    """A share, in per cent, of a report on real furniture."""
    return lambda of: 100.0 * float(of[report][group][run][f"sits_within_{within}cm"])


CLAIMS: tuple[tuple[Path, str, tuple[Callable[[Reports], float], ...]], ...] = (
    (
        README,
        r"(\d+) % of (\d+) sit-downs in FREE end within 8 cm of .{0,60}carries one, (\d+) % within",
        (
            _share("real-tell", "all seats", "free_t0", 8),
            lambda of: of["real-tell"]["all seats"]["free_t0"]["seat_episodes"],
            _share("real-tell", "all seats", "free_t0", 4),
        ),
    ),
    (
        README,
        r"on by default, (\d+) % within 4",
        (_share("real-tell", "all seats", "free_t0_clean", 4),),
    ),
)
"""Sentences: a page, a pattern (any white space for a space) whose groups are figures, and what of
the reports each of them is.
"""


def claims(page: Path, text: str, of: Reports) -> Iterator[Figure]:
    """The figures of the page's sentences. Raises ValueError where one is no longer there."""
    for where, pattern, values in CLAIMS:
        if where != page:
            continue
        found = re.search(pattern.replace(" ", r"\s+"), text, re.DOTALL)
        if found is None:
            raise ValueError(f"{page.name} no longer says what matches '{pattern}'")
        for group, value in enumerate(values, start=1):
            yield Figure(page, found.start(group), found.end(group), found[group], value(of))


def traced(page: Path, of: Reports) -> list[Figure]:
    """All figures of a page that are traced."""
    text = page.read_text(encoding="utf-8")
    tables = {CARD: card_table, README: readme_table}
    found = list(tables[page](text, of)) if page in tables else []
    return [*found, *claims(page, text, of)]


_NUMBER = re.compile(r"(?<![\w.,/-])(\d{1,3}(?:,\d{3})+|\d+\.\d+|\d+)(\s?%)?(?![\w,/-]|\.\d)")


def untraced(page: Path, figures: list[Figure]) -> list[str]:
    """The lines of a page with figures that are not among the traced ones: measured figures, with
    decimals or a percent sign, or large; not those in code, links and headings.
    """
    text = page.read_text(encoding="utf-8")
    for each in figures:
        text = text[: each.start] + " " * (each.stop - each.start) + text[each.stop :]

    found = []
    for line in re.sub(r"(?s)```.*?```", "", text).splitlines():
        plain = re.sub(r"`[^`]*`|\]\([^)]*\)|https?://\S+", "", line)
        if line.startswith("#"):
            continue
        for number, percent in _NUMBER.findall(plain):
            if "." in number or percent or "," in number or int(number) >= 100:
                found.append(line.strip())
    return found


def mended(page: Path, figures: list[Figure]) -> str:
    """The page's text with the reports' figures."""
    text = page.read_text(encoding="utf-8")
    for each in sorted(figures, key=lambda figure: -figure.start):
        if not each.holds:
            text = text[: each.start] + each.expected + text[each.stop :]
    return text


def pages() -> list[Path]:
    """README, card and docs, but for what commands write."""
    docs = sorted((ROOT / "docs").rglob("*.md"))
    return [README, CARD, *(page for page in docs if page not in WRITTEN)]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--untraced", action="store_true", help="also list what is not traced")
    parser.add_argument("--mend", action="store_true", help="write the reports' figures")
    options = parser.parse_args()

    of, faults = reports(), 0
    for page in pages():
        figures = traced(page, of)
        wrong = [each for each in figures if not each.holds]
        rest = untraced(page, figures)
        name = page.relative_to(ROOT).as_posix()
        print(f"{name}: {len(figures) - len(wrong)} of {len(figures)} hold; {len(rest)} untraced")
        for each in wrong:
            print(f"    {each.said} should be {each.expected}")
        for line in dict.fromkeys(rest) if options.untraced else ():
            print(f"    untraced: {line[:150]}")
        if options.mend and wrong:
            page.write_text(mended(page, figures), encoding="utf-8")
        elif wrong:
            faults += len(wrong)

    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
