"""The figures of README, card and docs are those of the reports that commands made."""

import copy
import runpy

import pytest

from kit.places import ROOT

TRACE = runpy.run_path(str(ROOT / "scripts" / "trace_figures.py"))
REPORTS = TRACE["reports"]()


@pytest.mark.parametrize("page", TRACE["pages"](), ids=lambda page: page.name)
def test_every_traced_figure_is_its_reports(page) -> None:
    wrong = [each for each in TRACE["traced"](page, REPORTS) if not each.holds]
    assert not [(each.said, each.expected) for each in wrong]


def test_pages_hold_what_commands_wrote() -> None:
    for page, section in TRACE["written"](REPORTS):
        text = page.read_text(encoding="utf-8")
        assert section in text, f"{page.name}: scripts/trace_figures.py --mend"
        assert TRACE["with_section"](text, section).strip() == text.strip()
        changed = TRACE["with_section"](text, section.replace("0", "7"))
        assert section not in changed and TRACE["with_section"](changed, section) == text


def test_the_tables_and_what_else_speaks_for_the_weights_are_traced() -> None:
    assert len(TRACE["traced"](TRACE["CARD"], REPORTS)) > 290
    assert len(TRACE["traced"](TRACE["README"], REPORTS)) > 28


def test_a_wrong_figure_is_found_and_mended() -> None:
    changed = copy.deepcopy(REPORTS)
    changed["rows"]["free_t0"]["sits_within_6cm"] -= 0.1
    for page in (TRACE["CARD"], TRACE["README"]):
        figures = TRACE["traced"](page, changed)
        (wrong,) = (each for each in figures if not each.holds)
        text = page.read_text(encoding="utf-8")
        assert TRACE["mended"](page, figures) == (
            text[: wrong.start] + wrong.expected + text[wrong.stop :]
        )
