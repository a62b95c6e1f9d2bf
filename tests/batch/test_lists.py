"""What a list of shots stands for, and what is said where it cannot be used."""

from pathlib import Path

import pytest

from dafnet_addon.batch.lists import ListedShot, read_list
from dafnet_addon.core.errors import InputError
from dafnet_addon.director.shots import shot_of

PEOPLE = "people = [{ tasks = [{ wait = 1 }] }]\n"


def listed(tmp_path: Path, text: str) -> tuple[ListedShot, ...]:
    file = tmp_path / "jobs.toml"
    file.write_text(text, encoding="utf-8")
    return read_list(file)


def test_defaults_a_file_and_own_words(tmp_path: Path) -> None:
    (tmp_path / "shots").mkdir()
    (tmp_path / "shots" / "bar.toml").write_text(
        f'room = "bar.blend"\ntakes = 2\n{PEOPLE}cast = {{ files = ["hero.blend"] }}\n',
        encoding="utf-8",
    )
    bar, hall = listed(
        tmp_path,
        f"""
        [defaults]
        takes = 3
        truth = true
        {PEOPLE}
        [[shots]]
        shot = "shots/bar.toml"
        temperature = 0.5
        [[shots]]
        name = "hall"
        room = "cafe"
        takes = 4
        """,
    )
    assert (bar.name, hall.name, bar.refusal, hall.refusal) == ("bar", "hall", "", "")
    first, second = shot_of(bar.words), shot_of(hall.words)
    assert (first.takes, first.temperature, first.wishes.truth) == (2, 0.5, True)
    assert first.room == str(tmp_path / "shots" / "bar.blend")
    assert first.cast == (str(tmp_path / "shots" / "hero.blend"),)
    assert (second.takes, second.room) == (4, "cafe"), "a name of ours stays one"


def test_what_each_word_is_and_how_often(tmp_path: Path) -> None:
    (tmp_path / "pieces").mkdir()
    shots = listed(
        tmp_path,
        f"""
        [defaults]
        {PEOPLE}
        [[shots]]
        name = "a"
        each = {{ room = ["rooms/old hall.blend", "pieces"], temperature = [0.5, 1] }}
        [[shots]]
        name = "b"
        room = "cafe"
        count = 2
        """,
    )
    names = [shot.name for shot in shots]
    assert names[:4] == ["a_old-hall_0.5", "a_old-hall_1", "a_pieces_0.5", "a_pieces_1"]
    assert names[4:] == ["b_001", "b_002"]
    assert shots[2].words["room"] == str(tmp_path / "pieces")
    assert len({shot.words["seed"] for shot in shots}) == 6


def test_a_seed_follows_from_name_and_list_alone(tmp_path: Path) -> None:
    def seeds(text: str, count: int = 3) -> dict[str, int]:
        other = '[[shots]]\nname = "other"\nroom = "cafe"\n'
        hall = f'[[shots]]\nname = "hall"\nroom = "cafe"\ncount = {count}\n'
        fixed = '[[shots]]\nname = "fixed"\nroom = "cafe"\nseed = 5\n'
        whole = text.replace("OTHER", other).replace("HALL", hall).replace("FIXED", fixed)
        return {
            shot.name: shot.words["seed"]
            for shot in listed(tmp_path, whole.replace("PEOPLE", f"[defaults]\n{PEOPLE}"))
        }

    first = seeds("PEOPLE HALL OTHER FIXED")
    assert len({*first.values()}) == 5 and first["fixed"] == 5
    assert seeds("PEOPLE FIXED OTHER HALL") == first, "the order does not matter"
    assert seeds("PEOPLE HALL", count=9).items() >= {
        (name, seed) for name, seed in first.items() if name.startswith("hall")
    }
    assert seeds("seed = 1\nPEOPLE HALL")["hall_001"] != first["hall_001"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "lists no shots"),
        ("shots = 3", "lists no shots"),
        ("[[shot]]\nroom = 'cafe'", "did you mean 'shots'?"),
        ("[defaults]\ntaks = 2\n[[shots]]\nroom = 'cafe'", "did you mean 'takes'?"),
        ("seed = -1\n[[shots]]\nroom = 'cafe'", "The list's seed is -1"),
        ("[[shots]\n", "is not TOML"),
        ("[[shots]]\nname = 'a'\nroom = 'x'\n[[shots]]\nname = 'A'\nroom = 'y'", "2 shots are"),
        ("[[shots]]\nroom = 'cafe'\ncount = 100000\n[[shots]]\nroom = 'cafe'", "several lists"),
    ],
)
def test_a_list_that_cannot_be_used(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        listed(tmp_path, text)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("taks = 2", "Shot 2 of the list does not know 'taks'; did you mean 'takes'?"),
        ("name = '../up'", "cannot be a folder's name"),
        ("name = 'logs'", "cannot be a folder's name"),
        ("name = 'CON.1'", "cannot be a folder's name"),
        ("name = 'report.json'", "cannot be a folder's name"),
        ("shot = 'jobs.toml'\nname = 'itself'", "The shot does not know 'defaults'"),
        ("name = 7", "cannot be a folder's name"),
        ("shot = 'none.toml'", "cannot be read"),
        ("shot = ''", "is not a path"),
        ("count = 0", "The count of shot 2 of the list is 0"),
        ("each = { seed = 3 }", "write the values"),
        ("each = { sed = [3] }", "did you mean 'seed'?"),
        ("takes = 0", "The number of takes is 0"),
        ("room = 3", "The shot has no room"),
        ("export = ['fxb']", "did you mean 'fbx'?"),
        ("seed = 1.5\ncount = 2", "The seed is 1.5"),
    ],
)
def test_a_shot_that_cannot_be_used_stops_no_other(tmp_path: Path, text: str, words: str) -> None:
    lines = "" if "room" in text or "shot =" in text else "room = 'cafe'\n"
    found = listed(
        tmp_path,
        f"[defaults]\n{PEOPLE}[[shots]]\nname = 'good'\nroom = 'cafe'\n[[shots]]\n{lines}{text}",
    )
    assert found[0].refusal == "" and len({shot.name for shot in found}) == len(found) >= 2
    for bad in found[1:]:
        assert words in bad.refusal and bad.refusal.count(". ") == 0


def test_a_list_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        read_list(tmp_path / "none.toml")
    assert "cannot be read" in str(error.value)
