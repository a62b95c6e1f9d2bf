"""What scripts/window.sh plays: a first shot with the mouse, then what may come between."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import rig_builders
from driver import Waits, play
from first_shot import first_shot
from interruptions import interruptions

PICTURES = Path(sys.argv[sys.argv.index("--") + 1])


def everything() -> Waits:
    yield from first_shot(PICTURES, rig_builders)
    yield from interruptions(PICTURES)


play(everything)
