"""What is told of a batch, on a page that needs nothing besides itself."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from dafnet_addon.batch.lists import read_list
from dafnet_addon.batch.making import Outcome
from dafnet_addon.batch.report import counted, report, save_report
from dafnet_addon.batch.running import Batch
from dafnet_addon.cli import main
from dafnet_addon.core.manifest import Manifest
from kit.batches import HEAD, shot
from kit.populating import PROGRAM


class Page(HTMLParser):
    """The cells of a page's table, row by row, and all addresses that it names."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.addresses: list[str] = []
        self._inside = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.addresses += [value or "" for key, value in attrs if key in ("src", "href")]
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self._inside = True

    def handle_endtag(self, tag: str) -> None:
        self._inside = self._inside and tag not in ("td", "th")

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.rows[-1][-1] += data


def made(output: Path, name: str, **said: object) -> Outcome:
    """A finished shot that says this of itself."""
    (output / name).mkdir(parents=True)
    given: dict = {"words": "w", "weights": "v", "seed": 1, "takes": 2, **said}
    Manifest(**given).save(output / name)
    return Outcome(name, "made", seconds=2.0)


def test_the_worst_come_first_and_nothing_is_loaded(tmp_path: Path) -> None:
    out = tmp_path / "out"
    outcomes = [
        made(out, "good", metrics={"bad_collisions_per_frame": 0.1, "jerk": None}),
        made(
            out, "dark", metrics={"bad_collisions_per_frame": 0.1}, warnings=["It is <b>dark</b>."]
        ),
        made(out, "through", metrics={"bad_collisions_per_frame": 3.0}, people=[{"name": "Ann"}]),
        Outcome("bad", "failed", "The room is broken; mend it.", log=out / "logs" / "bad.log"),
    ]
    batch = Batch((), out)
    told = report(batch, outcomes, 100.0)
    assert [row["name"] for row in told["shots"]] == ["bad", "dark", "through", "good"]
    frames = out / "good" / "frames" / "Camera"
    frames.mkdir(parents=True)
    for k in range(3):
        (frames / f"{k:04d}.png").write_bytes(b"frame %d" % k)
        (frames / f"{k:04d}_mask.png").write_bytes(b"mask")
    page = save_report(batch, told, thumbnail=lambda frame: b"small " + frame.read_bytes())
    text = page.read_text(encoding="utf-8")
    found = Page(text)
    assert [row[1] for row in found.rows[1:]] == ["bad", "dark", "through", "good"]
    assert len({len(row) for row in found.rows}) == 1
    assert "4 shots: 3 made, 1 failed, in 2 min" in text
    assert "The room is broken; mend it." in found.rows[1][-1]
    assert found.rows[2][-1] == "It is <b>dark</b>."
    assert "jerk" not in found.rows[0], "which was not measured of any"
    pictures = [each for each in found.addresses if each.startswith("data:")]
    assert [base64.b64decode(each.split(",")[1]) for each in pictures] == [b"small frame 1"]
    others = {each for each in found.addresses if not each.startswith("data:")}
    assert others == {"logs/bad.log", "dark/", "good/", "through/"}
    assert not re.search(r"https?:|@import|url\(", text)
    assert json.loads((out / "report.json").read_text(encoding="utf-8")) == told


def test_what_an_eye_would_find_wrong_stands_first(tmp_path: Path) -> None:
    sits = {"word": "sits", "text": "Sits on 'Chair'", "good": True}
    hovers = {"word": "hovers 9 cm", "text": "Hovers 9 cm over 'Sofa'", "good": False}
    people = [{"name": "Ann", "verdict": [[sits], [hovers, sits]]}]
    outcomes = [
        made(tmp_path, "warned", warnings=["The root jumps."] * 3),
        made(tmp_path, "hovers", people=people),
        made(tmp_path, "odd", people=[{"name": 3, "verdict": "none"}]),
    ]
    told = report(Batch((), tmp_path), outcomes, 1.0)
    assert [row["name"] for row in told["shots"]] == ["hovers", "warned", "odd"]
    assert told["shots"][0]["faults"] == ["Ann, take 2: Hovers 9 cm over 'Sofa'"]
    page = save_report(Batch((), tmp_path), told).read_text(encoding="utf-8")
    assert Page(page).rows[1][-1] == "Ann, take 2: Hovers 9 cm over 'Sofa'"


def test_shots_are_counted() -> None:
    assert counted({"made": 1}) == "1 shot: 1 made"
    assert counted({"made": 2, "failed": 1}) == "3 shots: 2 made, 1 failed"


@pytest.fixture
def jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A list whose shots are made by the stand-in, one of which cannot be."""
    monkeypatch.setattr("dafnet_addon.batch.making.program", lambda: PROGRAM)
    file = tmp_path / "jobs.toml"
    file.write_text(HEAD + shot("a", count=2) + shot("bad", "broken"), encoding="utf-8")
    return file


def test_the_command_says_what_became_of_all(
    jobs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["batch", str(jobs), "-o", str(out), "--workers", "2"]
    assert main([*command, "--only", "a_*"]) == 0
    assert "2 shots: 2 made" in capsys.readouterr().out and not (out / "report.html").exists()

    assert main([*command, "--report"]) == 0
    assert "3 shots: 2 unchanged, 1 missing" in capsys.readouterr().out

    assert main(command) == 1
    said = capsys.readouterr()
    assert said.out == "" and "bad: The room is broken; mend it. (" in said.err
    assert said.err.splitlines()[-1] == (
        "dafnet: 1 of 3 shots could not be made, 'bad': The room is broken; mend it. Run "
        "again to try it again."
    )
    (worst, *_) = json.loads((out / "report.json").read_text(encoding="utf-8"))["shots"]
    assert (worst["name"], worst["state"]) == ("bad", "failed")

    assert main([*command, "--report", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["counts"] == {"unchanged": 2, "failed": 1}

    assert main([*command, "--only", "none"]) == 1
    assert "No shot of the list is called 'none'" in capsys.readouterr().err
    assert main(["batch", str(tmp_path / "none.toml"), "-o", str(out)]) == 1
    assert main(["batch", str(jobs), "-o", str(out), "--workers", "0"]) == 2
    assert main([*command, "--weights", str(tmp_path / "none.safetensors")]) == 1
    assert "none.safetensors' cannot be read" in capsys.readouterr().err.splitlines()[-1]


def test_a_shots_refusal_is_a_failure(
    jobs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jobs.write_text(HEAD + shot("a") + shot("b", taks=3), encoding="utf-8")
    assert main(["batch", str(jobs), "-o", str(tmp_path / "out")]) == 1
    assert "b: Shot 2 of the list does not know 'taks'; did you mean" in capsys.readouterr().err
    batch = Batch(read_list(jobs), tmp_path / "out")
    assert batch.folder("a").exists() and not batch.log("b").exists()
