"""The command's words, exit codes and errors."""

import json
import sys
from pathlib import Path

import pytest

from dafnet_addon.cli import main
from dafnet_addon.commands import COMMANDS
from dafnet_addon.commands.console import open_streams
from dafnet_addon.core.weights import load_weights
from kit.places import ROOT


def test_wrong_command_lines_return_2_and_help_returns_0(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([]) == 2
    assert main(["bake", "a.blend"]) == 2
    assert main(["bake", "a.blend", "-o", "b.blend", "--frames", "7"]) == 2
    assert "FIRST:LAST" in capsys.readouterr().err
    assert main(["--help"]) == 0
    assert "bake" in capsys.readouterr().out


def test_errors_are_one_sentence_on_standard_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(tmp_path / "none.safetensors")]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("dafnet: ") and said.err.count("\n") == 1


def test_info_says_what_a_file_is(capsys: pytest.CaptureFixture[str]) -> None:
    weights = load_weights()
    assert main(["info", "--json"]) == 0
    described = json.loads(capsys.readouterr().out)
    assert described["format"] == "dafnet-1"
    assert described["config"] == weights.config
    assert described["parameters"] == sum(tensor.size for tensor in weights.tensors.values())
    assert main(["info", str(weights.path)]) == 0
    assert f"parameters: {described['parameters']}" in capsys.readouterr().out


def test_every_command_is_a_file_of_its_name() -> None:
    names = {command.name for command in COMMANDS}
    files = {file.stem for file in (ROOT / "dafnet_addon" / "commands").glob("*.py")}
    assert files - {"__init__", "command", "console"} == names


def test_standard_streams_that_are_missing_are_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a program with windows, whose streams are None."""
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    open_streams()
    with sys.stdout, sys.stderr:
        print("heard by nobody")
        print("nor this", file=sys.stderr)
