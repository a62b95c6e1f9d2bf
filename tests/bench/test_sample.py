"""Figures that the pages give are those that the shipped weights have: done again on the held-out
motion that comes with the project.
"""

import re

import pytest

from benchmarks.sample import COLUMNS, FILE, RUNS, measure, sample
from kit.places import ROOT

HOW_NEAR = {
    "seat_episodes": 0,
    "sits_within_6cm": 0,
    "stands_when_it_should": 0.002,
    "end_effector_error": 0.0005,
    "foot_sliding_per_frame": 0.01,
    "bad_collisions_per_frame": 0.03,
}
"""What another NumPy and processor may change, by column."""


def page_rows() -> dict[str, dict[str, float]]:
    """The table of docs/data.md, by run and column."""
    page = (ROOT / "docs" / "data.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    head = next(line for line in lines if "sits within 6cm" in line)
    start = lines.index(head)
    names = [name.strip().replace(" ", "_") for name in head.split("|")[2:-1]]
    rows = {}
    for line in lines[start + 1 : start + 1 + len(RUNS)]:
        label, *cells = (cell.strip() for cell in line.split("|")[1:-1])
        numbers = [float(re.split(r" \(", cell)[0]) for cell in cells]
        rows[label.replace(" ", "_")] = dict(zip(names, numbers, strict=True))
    return rows


def test_the_motion_is_small_and_has_its_licence_beside_it() -> None:
    assert FILE.stat().st_size < 300_000
    licence = (FILE.parent / "LICENSE").read_text(encoding="utf-8")
    assert "MIT License" in licence and "Microsoft" in licence
    clips = sample()
    assert len(clips) == 16 and all(clip.unseen and clip.body == clips[0].body for clip in clips)


@pytest.mark.slow
def test_the_page_says_what_the_shipped_weights_do() -> None:
    said = page_rows()
    rows, _ = measure(None, lambda share: None)
    assert tuple(said) == RUNS and HOW_NEAR.keys() == set(COLUMNS)
    for run, row in rows.items():
        for name, near in HOW_NEAR.items():
            assert row[name] == pytest.approx(said[run][name], abs=near + 1e-9), (run, name)
