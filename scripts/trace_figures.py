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
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).absolute().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks.canonical import canonical_page  # noqa: E402 - found only now
from benchmarks.sample import sample_page  # noqa: E402
from benchmarks.wanted import wanted_text  # noqa: E402
from dafnet_addon.core.weights import load_weights  # noqa: E402
from dafnet_addon.training.evaluation.real_report import real_page  # noqa: E402
from dafnet_addon.training.evaluation.report_text import report_text  # noqa: E402

CARD = ROOT / "weights_stub" / "README.md"
README = ROOT / "README.md"
REPORTS = ROOT / "docs" / "reports"
HELD_OUT, REAL = ROOT / "docs" / "evaluation.md", ROOT / "docs" / "evaluation-real.md"
WANTED, DATA = ROOT / "docs" / "wanted.md", ROOT / "docs" / "data.md"
"""Pages with whole sections that commands wrote."""

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
    def _decimals(self) -> int:
        return len(self.said.partition(".")[2])

    @property
    def expected(self) -> str:
        """The report's value with as many decimals as the page gives."""
        return "–" if self.value is None else f"{self.value:.{self._decimals}f}"

    @property
    def holds(self) -> bool:
        """Whether what is said is the value, rounded to the said decimals."""
        if self.value is None or self.said == "–":
            return self.value is None and self.said == "–"
        half = 0.5 * 10.0**-self._decimals
        return abs(float(self.said) - self.value) <= half * (1.0 + 1e-6)


def reports() -> dict[str, Any]:
    """All reports by the names of their files, and the weights' "rows"."""
    found = {
        file.stem: json.loads(file.read_text(encoding="utf-8")) for file in REPORTS.glob("*.json")
    }
    return {**found, "rows": load_weights(None).says("held_out")}


def _cells(line_start: int, line: str) -> list[tuple[int, str]]:
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
    names = [said for _, said in _cells(*lines[first])[1:]]
    for at, line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        (_, label), *cells = _cells(at, line)
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
                for run, (start, cell) in zip(_README_RUNS, _cells(at, line)[1:], strict=True):
                    yield _figure(README, start, cell, factor * of["rows"][run][key])


Value = Callable[[Reports], float]


def _at(*keys: Any, times: float = 1.0) -> Value:
    """What a report says under its ``keys``, the report's name first."""

    def value(of: Reports) -> float:
        found: Any = of
        for key in keys:
            found = found[key]
        return times * float(found)

    return value


def _ratio(first: Value, second: Value) -> Value:
    return lambda of: first(of) / second(of)


def _real(group: str, run: str, figure: str, times: float = 1.0) -> Value:
    """A figure of the bodies and makers that tell, among real furniture."""
    return _at("real-tell", group, run, figure, times=times)


def _within(group: str, run: str, *centimetres: int) -> tuple[Value, ...]:
    """Their shares of seats within so many centimetres, in per cent."""
    return tuple(_real(group, run, f"sits_within_{cm}cm", 100.0) for cm in centimetres)


def _slides(activity: str, run: str) -> Value:
    return _at("evaluation", "by_activity", activity, run, "foot_sliding_per_frame")


def _row(run: str, figure: str, times: float = 1.0) -> Value:
    return _at("rows", run, figure, times=times)


def _drifts(heat: str) -> Value:
    """How much more feet slide in the last third of a minute than in the first."""
    return _ratio(
        *(
            _at("evaluation", "drift", f"{which}_third_{heat}", "foot_sliding_per_frame")
            for which in ("last", "first")
        )
    )


def _sits(*keys: Any) -> Value:
    """A share of ``dafnet bench seats``, in per cent."""
    return _at("seats", *keys, times=100.0)


def _mean(values: Iterable[float]) -> float:
    """Of those that were measured: a take that never came down has no descent."""
    return float(np.nanmean(list(values)))


def _descent(heat: float, asked: float) -> Value:
    """Seconds that a descent takes which was asked in ``asked``: the mean."""

    def value(of: Reports) -> float:
        return _mean(
            each["took"]
            for each in of["life"]["descents"]
            if (each["temperature"], each["asked"]) == (heat, asked)
        )

    return value


def _sways(heat: float | None) -> Value:
    """Centimetres by which who walks straight on sways, captured people for None: the mean."""

    def value(of: Reports) -> float:
        walks = of["life"]["captured walks" if heat is None else "walks"]
        return _mean(each["sway"] for each in walks if heat == each.get("temperature"))

    return value


def _feet(run: str) -> Value:
    """Centimetres that feet are from where captured ones were: the mean."""
    return lambda of: _mean(each[run] for each in of["life"]["feet"])


def _lives(state: str) -> tuple[Value, ...]:
    """How much who sits or stands moves at temperature 1, over captured people, by band."""
    bands = ("slow", "middle", "quick")
    return tuple(_at("life", "life", state, "temperature 1", band) for band in bands)


CLAIMS: tuple[tuple[Path, str, tuple[Value, ...]], ...] = (
    (
        README,
        r"(\d+) % of (\d+) sit-downs in FREE end within 8 cm of .{0,60}carries one, (\d+) % within",
        (
            *_within("all seats", "free_t0", 8),
            _real("all seats", "free_t0", "seat_episodes"),
            *_within("all seats", "free_t0", 4),
        ),
    ),
    (README, r"on by default, (\d+) % within 4", _within("all seats", "free_t0_clean", 4)),
    (
        README,
        r"by \*Sit on Selected\*, (\d+) % of (\d+) do",
        (
            *_within("sent by the director", "free_t0", 8),
            _real("sent by the director", "free_t0", "clips"),
        ),
    ),
    (
        CARD,
        r"share of (\d+) seated episodes .{0,90}network gives it: \*\*(\d+) / (\d+) %\*\*",
        (
            _real("all seats", "free_t0", "seat_episodes"),
            *_within("all seats", "free_t0", 4, 8),
        ),
    ),
    (
        CARD,
        r"\*Rest on Seats\* (\d+) / (\d+) %; EE (\d+) / (\d+) %, EED (0\.\d{4})",
        (
            *_within("all seats", "free_t0_clean", 4, 8),
            *_within("all seats", "ee_t0", 4, 8),
            _real("all seats", "ee_t0", "end_effector_error"),
        ),
    ),
    (
        CARD,
        r"to (\d+) seats: (\d+) / (\d+) %\. Lying: (\d+) / (\d+) %, in EE (\d+) / (\d+)\.",
        (
            _real("sent by the director", "free_t0", "clips"),
            *_within("sent by the director", "free_t0", 4, 8),
            *_within("lying", "free_t0", 4, 8),
            *_within("lying", "ee_t0", 4, 8),
        ),
    ),
    (
        CARD,
        r"error in FULL is (0\.\d+) of .{0,90}third is (\d\.\d+) of .{0,40}and (\d\.\d+) at 1",
        (_row("full_t0", "upper_body_error"), _drifts("t0"), _drifts("t1")),
    ),
    (
        CARD,
        r"APD is (\d\.\d) times as large in FREE as in EE, (\d\.\d) times in EE as in FULL",
        (
            _at("evaluation", "diversity", "free_t1", "over_ee"),
            _at("evaluation", "diversity", "ee_t1", "over_full"),
        ),
    ),
    (
        CARD,
        r"end at pelvis heights of (0\.\d+), (0\.\d+) and (0\.\d+) m",
        tuple(
            _at("evaluation", "seats", "t0", seat, "pelvis_median")
            for seat in ("low", "medium", "high")
        ),
    ),
    (
        CARD,
        r"within 5 cm of that from (\d) of 3 sides, at temperature 1 in (\d+) of 15 trios",
        tuple(
            _at("evaluation", "seats", heat, "all_three_right", times=trios)
            for heat, trios in (("t0", 3), ("t1", 15))
        ),
    ),
    (
        CARD,
        r"of information, (\d) actions are the likeliest",
        (_at("evaluation", "actions", "likeliest_in_2_percent"),),
    ),
    (
        CARD,
        r"edges of tables are met least: (\d+) % of (\d+) within 8 cm",
        (
            _at("real-tell", "by kind", "table", "free_t0", "sits_within_8cm", times=100.0),
            _at("real-tell", "by kind", "table", "free_t0", "clips"),
        ),
    ),
    (
        CARD,
        r"probabilities: (\d\.\d+) nats .{0,140}with the activities (0\.\d+); "
        r"shuffled .{0,60}by (\d\.\d) nats, in (\d+) % of the clips",
        (
            _at("evaluation", "actions", "information_nats"),
            _at("evaluation", "actions", "normalised_mutual_information"),
            _at("evaluation", "actions", "likelihood", "all", "shuffled_adds"),
            _at(
                "evaluation", "actions", "likelihood", "all", "shuffled_worse_in_clips", times=100.0
            ),
        ),
    ),
    (
        REAL,
        r"\| refused \| (\d\.\d) % .{0,60}carries one \| (\d+\.\d) % .{0,50}mark \| (\d+\.\d) %",
        tuple(_at("sitting", "all", name) for name in ("refused", "within 4 cm", "place right")),
    ),
    (
        REAL,
        r"tenth of a second \| (\d\.\d) %, (\d\.\d) %, (\d\.\d) % .{0,50}facing \| (\d+\.\d) %",
        tuple(
            _at("sitting", "all", name)
            for name in ("shin inside", "foot inside", "trunk inside", "right")
        ),
    ),
    (REAL, r"in the take's row \| (\d\.\d) %", (_at("sitting", "all", "short and not told"),)),
    (CARD, r"\*\*(\d+) % of 360 takes sit within 8 cm\*\*", (_sits("sits"),)),
    (
        CARD,
        r"temperature 0 / 1 \| (\d+) % / (\d+) %",
        (_sits("sits_at_temperature", "0"), _sits("sits_at_temperature", "1")),
    ),
    (
        CARD,
        r"front / the side / behind \| (\d+) % / (\d+) % / (\d+) %",
        tuple(_sits("sits_by_approach", way) for way in ("front", "side", "behind")),
    ),
    (
        CARD,
        r"with / without a back \| (\d+) % / (\d+) %",
        (_sits("sits_by_back", "with"), _sits("sits_by_back", "without")),
    ),
    (
        CARD,
        r"0\.55 / 0\.65 m \| (\d+) % / (\d+) % / (\d+) % / (\d+) % \|.{0,60}no seat \| (\d+) cm",
        (
            *(_sits("sits_by_height", height) for height in ("0.350", "0.450", "0.550", "0.650")),
            _at("seats", "largest_drop_without_seat", times=100.0),
        ),
    ),
    (
        CARD,
        r"walks in FREE (\d\.\d) times real motion, all clips (\d\.\d) \(after the clean-up "
        r"(\d\.\d+)\)",
        (
            _ratio(_slides("walk", "free_t0"), _slides("walk", "ground_truth")),
            _ratio(
                _row("free_t0", "foot_sliding_per_frame"),
                _row("ground_truth", "foot_sliding_per_frame"),
            ),
            _ratio(
                _row("free_t0_clean", "foot_sliding_per_frame"),
                _row("ground_truth", "foot_sliding_per_frame"),
            ),
        ),
    ),
    (
        CARD,
        r"as well: (0\.\d+) beside (0\.\d+) at temperature 0 and (0\.\d+) of real motion",
        tuple(
            _row(run, "foot_sliding_per_frame") for run in ("free_t1", "free_t0", "ground_truth")
        ),
    ),
    (
        CARD,
        r"way down takes (\d\.\d+) s, with captured people (\d\.\d+)",
        (
            _real("all seats", "free_t0", "descent_seconds"),
            _real("all seats", "ground_truth", "descent_seconds"),
        ),
    ),
    (
        CARD,
        r"in 0\.8, 1\.3 and 2 s it comes in (\d\.\d+), (\d\.\d+) and (\d\.\d+)",
        tuple(_descent(0.0, asked) for asked in (0.8, 1.3, 2.0)),
    ),
    (
        CARD,
        r"sways by (\d\.\d) cm \((\d\.\d) at temperature 1; captured (\d\.\d)\)",
        (_sways(0.0), _sways(1.0), _sways(None)),
    ),
    (
        CARD,
        r"who sits moves (\d\.\d) / (\d\.\d) / (\d\.\d) times as much as captured people .{0,40}"
        r"who stands (\d\.\d) / (\d\.\d) / (\d\.\d) times",
        (*_lives("seated"), *_lives("standing")),
    ),
    (
        CARD,
        r"feet are (\d+\.\d) cm from where they are asked for, and (\d+\.\d) without",
        (_feet("asked"), _feet("not asked")),
    ),
    (
        CARD,
        r"it is led \(EE (\d+) %, EED (0\.\d+)\), and in FREE less often \((\d+) %\)",
        (
            _row("ee_t0_on_beds", "sits_within_6cm", 100.0),
            _row("ee_t0_on_beds", "end_effector_error"),
            _row("free_t0_on_beds", "sits_within_6cm", 100.0),
        ),
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


def written(of: Reports) -> Iterator[tuple[Path, str]]:
    """The sections that commands wrote, with their pages."""
    yield HELD_OUT, report_text(of["evaluation"]).strip()
    for role in ("choose", "tell"):
        yield REAL, real_page(of[f"real-{role}"], f"Bodies and makers that {role}").strip()
    yield WANTED, wanted_text(dict(of)).strip()
    yield DATA, sample_page(of["sample"])
    yield DATA, canonical_page(of["canonical"])


def with_section(text: str, section: str) -> str:
    """A page's text with a section in the place of the one that begins alike: up to the next
    heading of its level that it does not have itself.
    """
    lines, new = text.split("\n"), section.split("\n")
    start = lines.index(new[0])
    level = new[0].split(" ")[0] + " "
    ends = (
        k
        for k, line in enumerate(lines)
        if k > start and line.startswith(level) and line not in new
    )
    end = next(ends, len(lines))
    return "\n".join([*lines[:start], *new, "", *lines[end:]])


_NUMBER = re.compile(r"(?<![\w.,/-])(\d{1,3}(?:,\d{3})+|\d+\.\d+|\d+)(\s?%)?(?![\w,/-]|\.\d)")


def untraced(page: Path, figures: list[Figure], sections: list[str]) -> list[str]:
    """The lines of a page with figures that are neither among the traced ones nor in ``sections``
    that commands wrote: measured figures, with decimals or a percent sign, or large; not those in
    code, links and headings.
    """
    text = page.read_text(encoding="utf-8")
    for each in figures:
        text = text[: each.start] + " " * (each.stop - each.start) + text[each.stop :]
    for section in sections:
        text = text.replace(section, "")

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
    """README, card and docs."""
    return [README, CARD, *sorted((ROOT / "docs").rglob("*.md"))]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--untraced", action="store_true", help="also list what is not traced")
    parser.add_argument("--mend", action="store_true", help="write the reports' figures")
    options = parser.parse_args()

    of, faults = reports(), 0
    sections = list(written(of))
    for page, section in sections:
        text = page.read_text(encoding="utf-8")
        if section in text:
            continue
        name = section.split("\n")[0].lstrip("# ")
        print(f"{page.name}: '{name}' is not as its report has it")
        if options.mend:
            page.write_text(with_section(text, section), encoding="utf-8")
        else:
            faults += 1

    for page in pages():
        figures = traced(page, of)
        wrong = [each for each in figures if not each.holds]
        rest = untraced(page, figures, [section for where, section in sections if where == page])
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
