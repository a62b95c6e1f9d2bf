"""Names and turns of phrase that are not to come back; the vocabulary is in CONTRIBUTING.md."""

import ast
import re
from pathlib import Path

import pytest

from kit.places import ROOT

SOURCES = sorted(
    file
    for folder in ("dafnet_addon", "operators", "panels", "benchmarks", "tests")
    for file in (ROOT / folder).rglob("*.py")
    if file != Path(__file__).absolute()
)
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])

NAMES = {
    "drained": "run_to_end",
    "Landed": "RetargetedMotion",
    "Told": "Request",
    "own_told": "own_request",
    "MOST_FRAMES": "MAX_FRAMES",
    "MOST_SEED": "MAX_SEED",
    "absorb": "encode",
    "Made": "Samples",
    "_Wish": "_BakeOptions",
    "laid_over": "has_bone_overrides",
    "settled": "evaluated_now",
    "show_growing": "show_live_pose",
    "_COMES_OVER": "_BLEND_SECONDS",
    "_stored": "stored_take",
    "_elsewhere": "_hint_at_other_scenes",
    "handed": "lead_hand",
    "lent": "lend_upper_body",
    "swayed": "lean_and_turn",
    "on_the_body": "fit_to_bones",
    "pool_of": "index_walks",
    "ways_of": "find_walks",
    "matches_of": "find_matches",
    "told_of": "passage_warnings",
    "keyed_along": "key_route",
    "extended_to": "extend_range",
    "as_moved": "along_object",
    "doubted": "unit_doubt",
    "in_names_of": "with_bone_names_of",
    "in_order": "frames_to_play",
    "test_motions": "held_out_motions",
    "may_direct": "can_direct",
    "clean_again_of": "clean_up_again",
    "_adopted": "_adopt",
    "_unbake": "_remove_bake",
    "_worked": "_advance",
    "spread_out": "map_in_processes",
    "in_processes": "map_clips",
    "of_training": "training_tensors",
    "rows_of": "rows_by_run",
    "before_it_cooled": "uncooled_run",
    "held_loss": "held_out_loss",
    "_lived": "_scheduled",
    "measured_samp": "measure_samp",
}
"""Names that said nothing alone, or two things, and what stands in their place."""

PHRASES = (
    r"(?<!there )(?<!there\n)\b(?:is|are) no "
    r"(?!longer|more|lower|better|nearer|reason|match|place|way|room|such)\w+",
    r"as one sees them who",
    r"\bleaves who\b",
    r"\bcame of a\b",
    r"\bgoes? again\b",
    r"the first was so before",
    r"\bany more;",
    r"\belse than its\b",
    r"\bnot there for the character\b",
    r"\boverrules the character's own\b",
    r"\bfigures? of lines\b",
    r"\bset the range's start to its\b",
)
"""What is not English, or not clear: "is no armature" is "is not an armature"."""


@pytest.mark.parametrize("file", SOURCES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_names_that_say_nothing_stay_away(file: Path) -> None:
    used = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            used.add(node.name)
        elif isinstance(node, ast.Name):
            used.add(node.id)
        elif isinstance(node, ast.Attribute):
            used.add(node.attr)
        elif isinstance(node, ast.arg):
            used.add(node.arg)
        elif isinstance(node, ast.alias):
            used.add(node.name)
    assert not {name: NAMES[name] for name in used & NAMES.keys()}


@pytest.mark.parametrize(
    "file", [*SOURCES, *PAGES], ids=lambda file: file.relative_to(ROOT).as_posix()
)
def test_sentences_are_english(file: Path) -> None:
    text = re.sub(r"\s+#?\s*", " ", file.read_text(encoding="utf-8"))
    found = [match.group() for each in PHRASES for match in re.finditer(each, text, re.I)]
    assert not found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_files_that_pages_name_are_there(page: Path) -> None:
    named = re.findall(
        r"`([\w./-]+/[\w-]+\.(?:py|toml|json|md|sh))`", page.read_text(encoding="utf-8")
    )
    bases = (ROOT, ROOT / "dafnet_addon", page.parent)
    assert not [path for path in named if not any((base / path).exists() for base in bases)]
