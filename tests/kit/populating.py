"""A stand-in for ``dafnet populate`` that needs no Blender: run as a script, it reads a shot's
words and writes a folder in the same way.

``seconds`` of the shot is how long that takes; the room "broken" cannot be made, "silent" ends
without a word, "large" writes 2 MB.
"""

import json
import sys
import time
from hashlib import sha256
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).absolute().parents[2]))

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.files import whole_folder
from dafnet_addon.core.manifest import MANIFEST, Manifest, content_hash, words_hash
from dafnet_addon.core.stopping import end_with_stdin
from dafnet_addon.core.tables import read_tables
from dafnet_addon.core.weights import shipped_weights
from dafnet_addon.director.shots import Shot, drawn, shot_of

__all__ = ["PROGRAM", "takes_of"]

PROGRAM = (sys.executable, str(Path(__file__).absolute()))


def takes_of(shot: Shot) -> dict[str, str]:
    """What is "made": a text for each person and take."""
    return {
        f"{person.name} {k}": f"{person.name} {person.height} {seed}"
        for person in drawn(shot)
        for k, seed in enumerate(person.take_seeds)
    }


def populate(file: Path, output: Path) -> None:
    """Write the folder of a shot, slowly."""
    words = read_tables(file, "shots")
    shot = shot_of(words, file.parent)
    with whole_folder(output, MANIFEST) as part:
        if shot.room == "broken":
            raise InputError("The room is broken; mend it.")
        if shot.room == "silent":
            sys.exit(3)
        takes = takes_of(shot)
        for name, text in takes.items():
            time.sleep((shot.seconds or 0.0) / len(takes))
            (part / f"{name}.txt").write_text(text, encoding="utf-8")
        if shot.room == "large":
            (part / "large").write_bytes(bytes(1 << 21))
        room = shot.path(shot.room)
        Manifest(
            words=words_hash(words),
            seed=shot.seed,
            takes=shot.takes,
            weights=content_hash(shipped_weights()),
            inputs={str(room): content_hash(room)} if room.is_file() else {},
            seconds={"all": shot.seconds or 0.0},
            metrics={"jerk": float(shot.seed % 7)},
            warnings=["It is dark."] if shot.room == "dark" else [],
            people=[{"name": person.name} for person in drawn(shot)],
            content={key: sha256(text.encode()).hexdigest() for key, text in takes.items()},
        ).save(part)
    print(json.dumps({"output": str(output)}))


if __name__ == "__main__":
    end_with_stdin()
    try:
        populate(Path(sys.argv[2]), Path(sys.argv[4]))
    except InputError as error:
        print(f"dafnet: {error}", file=sys.stderr)
        sys.exit(1)
