"""A list of shots, as TOML or JSON: what is made of it, one by one.

    seed = 1                             # of the list

    [defaults]                           # what each shot says, unless its own words say otherwise
    takes = 3
    truth = true

    [[shots]]
    shot = "cafe.toml"                   # a shot's file, whose words these change
    count = 20                           # cafe_001 … cafe_020, with a seed each

    [[shots]]                            # or a shot of its own
    name = "hall"
    room = "hall.blend"
    people = [{ count = 4, tasks = [{ sit_on = "Bench.*", seconds = 5 }] }]
    each = { seed = [1, 2], temperature = [0.5, 1.0] }     # hall_1_0.5, hall_1_1.0, hall_2_0.5 …

Relative paths are relative to the file that says them.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

from ..core.checks import MAX_SEED, whole
from ..core.errors import InputError
from ..core.files import is_device
from ..core.manifest import words_hash
from ..core.tables import read_tables, require_known
from ..core.text import printable
from ..core.wishes import Wishes
from ..director.shots import Shot, shot_of

__all__ = ["MAX_SHOTS", "ListedShot", "read_list"]

MAX_SHOTS = 100_000

_LONGEST = 100  # characters of a name
_OURS = {"logs", "batch.json", "report.html", "report.json"}
"""Names that are something else beside a shot's folder."""

_WORDS = tuple(
    each.name
    for kind in (Shot, Wishes)
    for each in fields(kind)
    if each.name not in ("folder", "wishes")
)
"""Of a shot."""

_OWN = ("name", "shot", "count", "each")
"""Of the list, in the table of a shot."""


@dataclass(frozen=True)
class ListedShot:
    """One shot of a list, named as its folder will be.

    ``words``: what a shot's file holds, all paths absolute. ``refusal``: why it cannot be made, in
    a sentence; "" where it can.
    """

    name: str
    words: Mapping[str, Any] = field(default_factory=dict)
    refusal: str = ""

    @property
    def words_hash(self) -> str:
        """That of its words, which its manifest has."""
        return words_hash(self.words)


def read_list(file: Path) -> tuple[ListedShot, ...]:
    """The shots of a list, in its order; one that cannot be used says why, and stops no other.

    A shot without a seed has one that follows from the list's seed and its name, so that no other
    shot changes it. Raises InputError where the list itself cannot be used.
    """
    folder = file.absolute().parent
    said = require_known(
        read_tables(file, "shots"), ("seed", "defaults", "shots"), "The list of shots"
    )
    seed = whole(said.get("seed", 0), "The list's seed", 0, MAX_SEED)
    defaults = _absolute(require_known(said.get("defaults", {}), _WORDS, "'defaults'"), folder)

    entries = said.get("shots")
    if not isinstance(entries, list) or not entries:
        raise InputError(
            f"'{file}' lists no shots; write [[shots]] and under it a room and people, or "
            'shot = "cafe.toml".'
        )

    found: list[ListedShot] = []
    for k, entry in enumerate(entries, 1):
        found += _expanded(entry, f"shot_{k:03d}", f"Shot {k} of the list", folder, defaults, seed)
        if len(found) > MAX_SHOTS:
            raise InputError(f"'{file}' lists over {MAX_SHOTS:,} shots; make several lists of it.")

    (name, times), *_ = Counter(each.name.lower() for each in found).most_common(1)
    if times > 1:
        raise InputError(f"{times} shots are called '{name}'; give each a 'name' of its own.")
    return tuple(found)


def _expanded(
    entry: object, fallback: str, which: str, folder: Path, defaults: Mapping[str, Any], seed: int
) -> Iterator[ListedShot]:
    """The shots that one table of the list stands for; what cannot be used is one that says so."""
    name = fallback
    try:
        said: dict[str, Any] = entry if isinstance(entry, dict) else {}
        file = _file(said.get("shot"), which, folder)
        name = _name(said.get("name", file.stem if file else fallback), which)
        require_known(entry, (*_OWN, *_WORDS), which)
        written = _absolute(read_tables(file, "shots"), file.parent) if file else {}
        own = _absolute({key: said[key] for key in said if key not in _OWN}, folder)
        words = {**defaults, **written, **own}
        variants = list(_variants(said, name, which, folder))
    except InputError as error:
        yield ListedShot(name, refusal=str(error))
        return

    for full_name, changes in variants:
        changed = {**words, **changes}
        refusal = _refusal(changed)
        if not refusal and ("count" in said or "seed" not in changed):
            changed["seed"] = _seed(changed.get("seed", seed), full_name)
        yield ListedShot(full_name, changed, refusal)


def _refusal(words: Mapping[str, Any]) -> str:
    try:
        shot_of(words)
    except InputError as error:
        return str(error)
    return ""


def _file(shot: object, which: str, folder: Path) -> Path | None:
    if shot is None:
        return None
    if not isinstance(shot, str) or not shot.strip():
        raise InputError(f'{which} has a "shot" that is not a path; write shot = "cafe.toml".')
    return folder / Path(shot).expanduser()


def _name(value: object, which: str) -> str:
    good = isinstance(value, str) and re.fullmatch(r"\w[\w. -]*(?<![. ])", value)
    name = str(value).lower()
    taken = name in _OURS or is_device(name)
    if not good or taken or len(name) > _LONGEST:
        raise InputError(
            f"{which} is called '{printable(value, 40)}', which cannot be a folder's name; use "
            "letters, digits, - and _."
        )
    return str(value)


def _variants(
    said: Mapping[str, Any], name: str, which: str, folder: Path
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Name and changes of each shot that a table stands for: one with each combination of the
    values in ``each``, ``count`` times.
    """
    count = whole(said.get("count", 1), f"The count of {_lowered(which)}", 1, MAX_SHOTS)
    each = require_known(said.get("each", {}), _WORDS, f"'each' of {_lowered(which)}")
    for word, values in each.items():
        if not isinstance(values, list) or not values:
            raise InputError(
                f"'{word}' in 'each' of {_lowered(which)} is not a list; write the values to be "
                "used one after the other."
            )

    for values in product(*each.values()):
        labels = [_label(value, each[word]) for word, value in zip(each, values, strict=True)]
        label = _name("_".join([name, *labels]), which)
        changes = _absolute(dict(zip(each, values, strict=True)), folder)
        for k in range(1, count + 1):
            yield f"{label}_{k:03d}" if "count" in said else label, changes


def _lowered(text: str) -> str:
    return text[:1].lower() + text[1:]


def _label(value: object, among: list[Any]) -> str:
    """A value as a part of a name."""
    if isinstance(value, str):
        return re.sub(r"[^\w-]+", "-", Path(value).stem).strip("-") or "x"
    if isinstance(value, int | float):
        return str(value).lower()
    return str(among.index(value) + 1)


def _seed(seed: int, name: str) -> int:
    digest = sha256(f"{seed}/{name}".encode()).digest()
    return int.from_bytes(digest[:8], "big") % (MAX_SEED + 1)


def _absolute(words: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The same words with absolute paths."""
    found = dict(words)
    if isinstance(room := found.get("room"), str):
        found["room"] = _path(room, folder)
    cast = found.get("cast")
    if isinstance(cast, dict) and isinstance(files := cast.get("files"), list | str):
        files = [files] if isinstance(files, str) else files
        found["cast"] = {
            **cast,
            "files": [_path(each, folder) if isinstance(each, str) else each for each in files],
        }
    return found


def _path(name: str, folder: Path) -> str:
    """A path, absolute; a name of one of our rooms stays one."""
    path = folder / Path(name).expanduser()
    return (
        str(path.resolve())
        if Path(name).suffix or Path(name).name != name or path.exists()
        else name
    )
