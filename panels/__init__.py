"""What the animator sees. Panels draw and change nothing."""

from .help import DAFNET_PT_help
from .main import DAFNET_PT_character, DAFNET_PT_shot
from .overlays import DAFNET_PT_overlays
from .presets import DAFNET_MT_presets, DAFNET_PT_presets
from .rig import DAFNET_PT_rig, DAFNET_UL_rig
from .setup import (
    DAFNET_MT_add,
    DAFNET_MT_walk,
    DAFNET_PT_setup,
    DAFNET_PT_softness,
    DAFNET_PT_walks,
    DAFNET_UL_walks,
    add_menu,
)
from .sitting import DAFNET_MT_sit
from .takes import DAFNET_PT_clean_up, DAFNET_PT_takes, DAFNET_UL_takes
from .tasks import DAFNET_PT_tasks, DAFNET_UL_tasks

__all__ = ["CLASSES", "add_menu"]

CLASSES = (
    DAFNET_UL_rig,
    DAFNET_PT_rig,  # above the character, while a rig is active
    DAFNET_MT_presets,
    DAFNET_PT_presets,
    DAFNET_PT_character,
    DAFNET_MT_sit,
    DAFNET_MT_walk,
    DAFNET_PT_setup,
    DAFNET_UL_walks,
    DAFNET_PT_walks,
    DAFNET_PT_softness,
    DAFNET_MT_add,
    DAFNET_UL_tasks,
    DAFNET_PT_tasks,
    DAFNET_PT_shot,
    DAFNET_UL_takes,
    DAFNET_PT_takes,
    DAFNET_PT_clean_up,
    DAFNET_PT_overlays,
    DAFNET_PT_help,
)
