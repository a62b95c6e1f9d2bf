"""What scripts/window.sh plays: what may come between while a take is made, a slow view, what is
done with takes, Live, seats and rigs, how many clicks a first shot takes, and one with the mouse;
or only the parts that are named.

In this order, since Blender 4.3 crashes by itself when it opens a new file after another scene was
made with Rigify on.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from clicks import clicks
from films import films
from first_shot import first_shot
from interruptions import interruptions
from live import live
from seats import seats
from slow_redraw import slow_redraw
from stranger import stranger
from uses_of_takes import uses_of_takes

from kit import humanoids
from kit.window import Waits, play

PICTURES, *NAMED = sys.argv[sys.argv.index("--") + 1 :]
PARTS: dict[str, Callable[[Path], Waits]] = {
    "interruptions": interruptions,
    "live": live,
    "slow_redraw": slow_redraw,
    "uses_of_takes": uses_of_takes,
    "seats": lambda pictures: seats(pictures, Path(__file__).parent / "rigs"),
    "clicks": clicks,
    "first_shot": lambda pictures: first_shot(pictures, humanoids),
}
ONLY_NAMED: dict[str, Callable[[Path], Waits]] = {
    "films": films,
    "stranger": lambda pictures: stranger(
        pictures, humanoids, (pictures.parent / "repository" / "index.json").as_uri()
    ),
}
"""Parts that are played where they are named, alone."""


def everything() -> Waits:
    for number, name in enumerate(NAMED or PARTS):
        if number:
            bpy.ops.wm.read_homefile(app_template="")
            yield 0.5
        yield from (PARTS | ONLY_NAMED)[name](Path(PICTURES))
        print(f"{name}: done", flush=True)


play(everything)
