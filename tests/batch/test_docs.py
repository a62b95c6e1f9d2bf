"""What docs/batch.md and examples/shots.toml say is true."""

import argparse
import re
import tomllib
from pathlib import Path

from dafnet_addon.batch.lists import read_list
from dafnet_addon.commands import batch
from dafnet_addon.director.shots import shot_of
from kit.places import ROOT

PAGE = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")


def test_the_example_is_twenty_shots_of_three_takes() -> None:
    shots = read_list(ROOT / "examples" / "shots.toml")
    assert [shot.refusal for shot in shots] == [""] * len(shots)
    cafe = [shot_of(shot.words) for shot in shots if shot.name.startswith("cafe_")]
    assert len(cafe) == 20 == len({shot.seed for shot in cafe})
    for shot in cafe:
        assert (shot.room, shot.takes, shot.wishes.truth) == ("cafe", 3, True)
        assert shot.wishes.export == ("fbx",)


def test_the_list_on_the_page_is_one(tmp_path: Path) -> None:
    text = PAGE.split("```toml\n")[1].split("```")[0]
    assert tomllib.loads(text)
    (tmp_path / "cafe.toml").write_bytes((ROOT / "examples" / "cafe.toml").read_bytes())
    (tmp_path / "jobs.toml").write_text(text, encoding="utf-8")
    shots = read_list(tmp_path / "jobs.toml")
    assert [shot.refusal for shot in shots] == [""] * 24
    names = [shot.name for shot in shots]
    assert names[0] == "cafe_001" and names[19] == "cafe_020"
    assert names[20:] == ["hall_1_0.5", "hall_1_1.0", "hall_2_0.5", "hall_2_1.0"]
    assert shots[-1].words["room"] == str(tmp_path / "rooms" / "hall.blend")


def test_the_page_names_every_option() -> None:
    parser = argparse.ArgumentParser()
    batch.COMMAND.add_arguments(parser)
    options = {each for action in parser._actions for each in action.option_strings}
    long = {each for each in options if each.startswith("--")} - {"--help", "--output"}
    assert long and not [each for each in long if not re.search(rf"`{each}\b", PAGE)]
