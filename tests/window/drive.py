"""What scripts/window.sh plays: what may come between while a take is made, then a first shot with
the mouse.

In this order, since Blender 4.3 crashes by itself when it opens a new file after another scene was
made with Rigify on.
"""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import rig_builders
from driver import Waits, play
from first_shot import first_shot
from interruptions import interruptions

PICTURES = Path(sys.argv[sys.argv.index("--") + 1])


def everything() -> Waits:
    yield from interruptions(PICTURES)
    bpy.ops.wm.read_homefile(app_template="")
    yield 0.5
    yield from first_shot(PICTURES, rig_builders)


play(everything)
