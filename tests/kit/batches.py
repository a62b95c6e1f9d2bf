"""Lists of shots for tests of batches, and what became of them."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dafnet_addon.core.manifest import read_manifest

__all__ = ["HEAD", "alive", "contents", "shot", "wait_until"]

PEOPLE = "people = [{ count = 2, tasks = [{ wait = 1 }] }]\n"
HEAD = f"[defaults]\ntakes = 2\n{PEOPLE}"
"""How a list begins: what all shots have."""


def shot(name: str, room: str = "cafe", **words: object) -> str:
    """A shot's table in the list."""
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in words.items())
    return f'[[shots]]\nname = "{name}"\nroom = "{room}"\n{lines}'


def contents(folder: Path) -> dict[str, Any]:
    """What each shot holds that is there, by its name."""
    found = {}
    for each in sorted(folder.iterdir()):
        if each.is_dir() and each.name != "logs" and each.name[0] != ".":
            manifest = read_manifest(each)
            assert manifest is not None, f"{each} is half-written, or left over"
            found[each.name] = manifest.content
    return found


def alive(mark: str) -> list[int]:
    """Processes of ours whose command line has this word."""
    found = []
    for each in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if mark.encode() in each.read_bytes() and b"populating.py" in each.read_bytes():
                found.append(int(each.parent.name))
        except OSError:
            continue
    return found


def wait_until(true: Callable[[], object], seconds: float = 20.0) -> None:
    """Until something is true, which has to be soon."""
    until = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < until, "it did not come to pass"
        time.sleep(0.02)
