"""What the animator can do. Operators translate between Blender and the add-on and compute nothing themselves."""

from .add_character import DAFNET_OT_add_character
from .generate import DAFNET_OT_cancel, DAFNET_OT_generate
from .mark_frames import DAFNET_OT_mark_frames
from .presets import DAFNET_OT_add_preset
from .takes import DAFNET_OT_clean_again, DAFNET_OT_keep_accepted, DAFNET_OT_play_take, DAFNET_OT_reject_take
from .walk_to import DAFNET_OT_walk_to

__all__ = ["CLASSES"]

CLASSES = (
    DAFNET_OT_add_character, DAFNET_OT_generate, DAFNET_OT_cancel, DAFNET_OT_walk_to,
    DAFNET_OT_play_take, DAFNET_OT_reject_take, DAFNET_OT_keep_accepted, DAFNET_OT_clean_again,
    DAFNET_OT_mark_frames, DAFNET_OT_add_preset,
)
