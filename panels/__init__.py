"""What the animator sees. Panels draw and change nothing."""

from .main import DAFNET_PT_character
from .overlays import DAFNET_PT_overlays
from .presets import DAFNET_MT_presets, DAFNET_PT_presets
from .takes import DAFNET_PT_clean_up, DAFNET_PT_takes, DAFNET_UL_takes

__all__ = ["CLASSES"]

CLASSES = (
    DAFNET_MT_presets, DAFNET_PT_presets, DAFNET_PT_character,
    DAFNET_UL_takes, DAFNET_PT_takes, DAFNET_PT_clean_up,
    DAFNET_PT_overlays,
)
