"""An animator's first shot, with the mouse: see scripts/window.sh."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from driver import Driver, Waits, play

PICTURES = Path(sys.argv[sys.argv.index("--") + 1])


def shot() -> Waits:
    user = Driver(PICTURES)
    yield from user.press("ESC")  # the splash screen
    yield from user.sidebar("DAFNet")
    yield from user.picture("01_empty")
    yield from user.click("dafnet.add_character")
    yield 0.5
    yield from user.picture("02_character")
    assert bpy.context.scene.objects.get("Character"), "Add Character"
    yield from user.click("dafnet.generate")
    yield 0.3
    yield from user.picture("03_generating")


play(shot)
