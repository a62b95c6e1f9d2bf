"""Words from outside: shown so that a terminal obeys nothing in them, and read as JSON within
bounds.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon import InputError
from dafnet_addon.cli import main
from dafnet_addon.core.text import printable, read_json
from dafnet_addon.core.weights import load_weights, write_safetensors

HOSTILE = "\x1b]0;owned\x07\x1b[2J\r\nline\u2028\u202eback\x9b31m\ud800\x00"


def test_nothing_that_a_terminal_obeys_is_left() -> None:
    shown = printable(HOSTILE)
    assert shown.isprintable() and shown.startswith("\\x1b]0;owned\\x07") and "\\ud800" in shown
    shown.encode("utf-8")


def test_what_people_write_stays_as_it_is() -> None:
    for words in ("Stuhl größer", "椅子 🪑", "a\u00a0b", "C:\\tmp", ""):
        assert printable(words) == words


def test_long_texts_are_cut_and_other_things_are_named() -> None:
    assert printable("x" * 10**6, 10) == "x" * 10 + "…"
    assert (
        printable(None) == "None"
        and printable(1.5) == "1.5"
        and printable(10**5000) == "a huge number"
    )
    assert printable(np.zeros(3)) == "of the type ndarray" and printable([1]) == "of the type list"


def test_errors_are_safe_to_print_whatever_is_in_them() -> None:
    said = str(InputError(f"The object '{HOSTILE}' is odd; mend it."))
    assert said.isprintable() and said.endswith("is odd; mend it.")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "is not JSON"),
        ("", "is not JSON"),
        ("[" * 100_000, "is not JSON"),
        ("[" * 40 + "]" * 40, "nested too deep"),
        ('{"a": 1, "a": 2}', "something twice"),
        ('"\\ud800"', "half a character"),
        ('{"\\udfff": 1}', "half a character"),
        ("NaN", "not finite"),
        ("[1e999]", "not finite"),
        ("[" + "9" * 5000 + "]", "too large"),
        ("-" + "9" * 30, "too large"),
    ],
)
def test_json_is_read_within_bounds(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        read_json(text)


def test_json_in_order_is_read_as_python_reads_it() -> None:
    text = json.dumps({"a": [1, 2.5, None, True, "ä🪑"], "b": {"c": -(10**15)}})
    assert read_json(text) == json.loads(text)


def test_info_prints_metadata_safely_and_json_gives_all_of_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shipped, path = load_weights(), tmp_path / "odd.safetensors"
    hostile = HOSTILE.replace("\ud800", "")
    metadata = {
        "licence": hostile,
        "data": "x" * 100_000,
        hostile: "[" * 5000,
        "held_out": '{"a": NaN}',
        "file": "elsewhere",
    }
    write_safetensors(path, {"x": np.ones(2, np.float32)}, {**shipped.metadata, **metadata})
    assert main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert all(line.isprintable() and len(line) < 15_000 for line in out.splitlines())
    assert f"file: {path}" in out and "parameters: 2" in out
    assert main(["info", "--json", str(path)]) == 0
    described = json.loads(capsys.readouterr().out)
    assert (
        described["data"] == metadata["data"]
        and described["licence"] == hostile
        and described["file"] == str(path)
    )
