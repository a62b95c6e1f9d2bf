"""One door for research: the scripts behind ``dafnet bench`` are asked as every other command."""

from pathlib import Path

import pytest

from dafnet_addon.cli import main

pytestmark = pytest.mark.torch


@pytest.mark.parametrize(
    "name",
    [
        "ablation",
        "canonical",
        "life-ablation",
        "tables",
        "wanted",
        "life",
        "rest",
        "seats",
        "speed",
    ],
)
def test_each_says_what_it_wants(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", name, "--", "--help"]) == 0
    assert f"dafnet bench {name}" in "".join(capsys.readouterr())
    assert main(["bench", name, "--unknown"]) == 2
    assert "usage" in capsys.readouterr().err


def test_what_cannot_be_done_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", "tables", "table2", str(tmp_path / "none"), "-o", str(tmp_path)]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and said[0].startswith("dafnet: ") and "none" in said[0]
