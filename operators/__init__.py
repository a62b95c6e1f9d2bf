"""What the animator can do. Operators translate between Blender and the add-on and compute nothing
themselves.
"""

from .add_character import DAFNET_OT_add_character
from .add_example import DAFNET_OT_add_example
from .add_root import DAFNET_OT_add_root
from .add_targets import DAFNET_OT_add_foot_targets, DAFNET_OT_add_targets
from .bake_to_rig import DAFNET_OT_bake_to_rig
from .copy_report import DAFNET_OT_copy_report
from .find_furniture import DAFNET_OT_find_furniture
from .follow_path import (
    DAFNET_OT_root_from_object,
    DAFNET_OT_walk_along_curve,
    DAFNET_OT_walk_through_points,
)
from .generate import DAFNET_OT_cancel, DAFNET_OT_generate
from .lie_on import DAFNET_OT_lie_on
from .live import DAFNET_OT_live, DAFNET_OT_live_draw, DAFNET_OT_live_record
from .map_rig import DAFNET_OT_detect_rig, DAFNET_OT_load_rig_map, DAFNET_OT_save_rig_map
from .mark_frames import DAFNET_OT_mark_frames
from .presets import DAFNET_OT_add_preset
from .redo_walk import DAFNET_OT_redo_walk
from .size_as_rig import DAFNET_OT_size_as_rig
from .takes import (
    DAFNET_OT_clean_again,
    DAFNET_OT_export_take,
    DAFNET_OT_keep_accepted,
    DAFNET_OT_mark_take,
    DAFNET_OT_play_take,
    DAFNET_OT_reject_take,
    DAFNET_OT_take_to_nla,
)
from .tasks import (
    DAFNET_OT_add_task,
    DAFNET_OT_move_task,
    DAFNET_OT_plan_tasks,
    DAFNET_OT_remove_task,
)
from .walk_to import DAFNET_OT_walk_to

__all__ = ["CLASSES"]

CLASSES = (
    DAFNET_OT_add_character,
    DAFNET_OT_generate,
    DAFNET_OT_cancel,
    DAFNET_OT_live,
    DAFNET_OT_live_record,
    DAFNET_OT_live_draw,
    DAFNET_OT_walk_to,
    DAFNET_OT_redo_walk,
    DAFNET_OT_lie_on,
    DAFNET_OT_add_task,
    DAFNET_OT_remove_task,
    DAFNET_OT_move_task,
    DAFNET_OT_plan_tasks,
    DAFNET_OT_play_take,
    DAFNET_OT_reject_take,
    DAFNET_OT_keep_accepted,
    DAFNET_OT_clean_again,
    DAFNET_OT_take_to_nla,
    DAFNET_OT_mark_take,
    DAFNET_OT_export_take,
    DAFNET_OT_mark_frames,
    DAFNET_OT_add_preset,
    DAFNET_OT_copy_report,
    DAFNET_OT_walk_along_curve,
    DAFNET_OT_walk_through_points,
    DAFNET_OT_root_from_object,
    DAFNET_OT_find_furniture,
    DAFNET_OT_add_root,
    DAFNET_OT_add_foot_targets,
    DAFNET_OT_add_targets,
    DAFNET_OT_add_example,
    DAFNET_OT_detect_rig,
    DAFNET_OT_load_rig_map,
    DAFNET_OT_save_rig_map,
    DAFNET_OT_size_as_rig,
    DAFNET_OT_bake_to_rig,
)
