"""What scripts/window.sh plays: what may come between while a take is made, then a first shot with
the mouse.

In this order, since Blender 4.3 crashes by itself when it opens a new file after another scene was
made with Rigify on.
"""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from first_shot import first_shot
from interruptions import interruptions

from kit import humanoids
from kit.window import Waits, play

PICTURES = Path(sys.argv[sys.argv.index("--") + 1])


def everything() -> Waits:
    yield from interruptions(PICTURES)
    bpy.ops.wm.read_homefile(app_template="")
    yield 0.5
    yield from first_shot(PICTURES, humanoids)


play(everything)
