"""The figures of README and card are those of the reports that commands made."""

import json
import runpy

from kit.places import ROOT

TRACE = runpy.run_path(str(ROOT / "scripts" / "trace_figures.py"))


def test_every_traced_figure_is_its_reports() -> None:
    looked_at = {}
    for name, count, wrong in TRACE["checks"]():
        assert not wrong, name
        looked_at[name] = count
    assert len(looked_at) == 3 and looked_at["the card's table"] > 200
    assert looked_at["README's table"] == 25 and looked_at["sentences on real furniture"] > 10


def test_a_wrong_figure_is_found() -> None:
    rows, card = TRACE["held_out_rows"](), TRACE["CARD"].read_text(encoding="utf-8")
    changed = json.loads(json.dumps(rows))
    changed["free_t0"]["sits_within_6cm"] -= 0.01
    _, wrong = TRACE["wrong_cells"](card, changed)
    assert len(wrong) == 1 and wrong[0].startswith("FREE, temperature 0, sits within 6 cm")
    _, wrong = TRACE["wrong_readme_cells"](TRACE["README"].read_text(encoding="utf-8"), changed)
    assert len(wrong) == 1 and wrong[0].startswith("sits with the pelvis, free_t0:")
