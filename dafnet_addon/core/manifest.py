"""What lies beside a shot that is done and says how it was made: ``shot.json``.

It names all that the shot depends on, by content: its words, its files, the weights and the
version. So another run can tell whether it would make the same, without opening Blender.
"""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cache
from hashlib import file_digest, sha256
from importlib import metadata
from pathlib import Path
from typing import Any

from .errors import InputError
from .files import save_text
from .text import printable, read_json

__all__ = ["MANIFEST", "Manifest", "content_hash", "current_version", "read_manifest", "words_hash"]

MANIFEST = "shot.json"
"""Its name; a folder that has it is a shot of ours."""

_LARGEST = 1 << 26  # bytes
_TEXTS = ("words", "weights", "version")


@cache
def current_version() -> str:
    """The project's version, as the extension's manifest says it; as pip knows it where that does
    not lie beside the package.
    """
    beside = Path(__file__).absolute().parents[2] / "blender_manifest.toml"
    if beside.is_file():
        return str(tomllib.loads(beside.read_text(encoding="utf-8"))["version"])
    return metadata.version("dafnet-addon")


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """How a shot was made.

    ``words``: the ``words_hash`` of what it was asked to be. ``inputs``: the ``content_hash`` of
    every file that it was made of (the room, the libraries that it links, the cast), by absolute
    path. ``weights``: that of the weights. ``seconds``: by stage. ``metrics``: by name, the mean
    over people and takes. ``people``: who did what when, in plain data. ``content``: hashes of the
    motion, which are the same wherever and whenever the shot is made again.
    """

    words: str
    seed: int
    takes: int
    weights: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    metrics: Mapping[str, float] = field(default_factory=dict)
    warnings: Sequence[str] = ()
    people: Sequence[Mapping[str, Any]] = ()
    content: Mapping[str, str] = field(default_factory=dict)
    version: str = field(default_factory=lambda: current_version())

    @property
    def all_seconds(self) -> float:
        """Of all stages; what is told as "of which …" is a part of another."""
        parts = self.seconds.items()
        return sum(spent for stage, spent in parts if not stage.startswith("of which "))

    def save(self, folder: Path) -> None:
        """Write it into the shot's folder. Raises InputError where the disk refuses."""
        save_text(folder / MANIFEST, json.dumps(asdict(self), indent=2))

    def what_changed(self, words: str, weights: str) -> str:
        """Why the shot would be another one if it were made now, as "'cafe.blend' has changed"; ""
        where it would be the same.

        ``words`` and ``weights``: the hashes of what it is to be made with.
        """
        if self.words != words:
            return "other words"
        if self.version != current_version():
            return f"made by version {printable(self.version, 40)}"
        if self.weights != weights:
            return "other weights"
        for name, known in self.inputs.items():
            try:
                same = content_hash(Path(name)) == known
            except InputError:
                return f"'{Path(name).name}' is gone"
            if not same:
                return f"'{Path(name).name}' has changed"
        return ""


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest of a shot's folder; None where there is none, or it is not one of ours."""
    file = folder / MANIFEST
    try:
        if file.stat().st_size > _LARGEST:
            return None
        said = read_json(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None

    if not isinstance(said, dict) or not all(isinstance(said.get(key), str) for key in _TEXTS):
        return None
    names = {each.name for each in fields(Manifest)}
    try:
        found = Manifest(**{key: said[key] for key in names & said.keys()})
    except TypeError:  # something is missing
        return None
    tables = (found.inputs, found.seconds, found.metrics, found.content)
    whole = isinstance(found.seed, int) and isinstance(found.takes, int)
    listed = isinstance(found.warnings, list | tuple) and isinstance(found.people, list | tuple)
    return found if whole and listed and all(isinstance(each, dict) for each in tables) else None


def words_hash(words: Mapping[str, Any]) -> str:
    """A hash of plain data, which the order of its keys does not change."""
    text = json.dumps(words, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return sha256(text.encode("ascii")).hexdigest()


def content_hash(path: Path) -> str:
    """A hash of what a file holds, or a folder with all files in it and their names; only what has
    been written to since is read again.

    Raises InputError where it cannot be read.
    """
    try:
        if path.is_dir():
            files = sorted(each for each in path.rglob("*") if each.is_file())
            inside = {each.relative_to(path).as_posix(): content_hash(each) for each in files}
            return words_hash(inside)
        state = path.stat()
        return _hash_of(str(path.absolute()), state.st_mtime_ns, state.st_size, state.st_ino)
    except OSError as error:
        raise InputError(f"'{path}' cannot be read ({error.strerror}); check its path.") from error


@cache
def _hash_of(path: str, *_state: int) -> str:
    with open(path, "rb") as file:
        return file_digest(file, "sha256").hexdigest()
