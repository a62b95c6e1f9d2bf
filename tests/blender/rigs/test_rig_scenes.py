"""What people do in rooms as they are arranged arrives on a real character's rig: sent to a seat,
generated and baked by the panel's operators.
"""

from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.delivery.rig_trial import furnish, real_rig
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import baker, detection
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig.sizing import size_as_rig

from benchmarks.arranged import SCENES, Arranged
from kit.places import LIBRARY, SHARED
from kit.stage import Stage

pytestmark = [pytest.mark.furniture, pytest.mark.slow]

RIG = SHARED / "rigs" / "mixamo_gltf_woman.json"


def sent_and_baked(made: Arranged, number: int = 0, start: int = 0) -> tuple[Stage, Any, Any]:
    """Send a character who is as large as the rig to one of the room's seats, from one of its
    starts, and bake what she does there: the stage, the rig, and what was baked.
    """
    stage, asked = Stage(height=1.75, fps=30, furnished=False), made.asked[number]
    furnish(made.solids)
    rig = real_rig(RIG)
    rig_map = detection.detect_map(rig)
    size_as_rig(bpy.context, stage.ann, rig, rig_map)
    stage.root.location = (*made.starts[start], 0.0)
    stage.scene.cursor.location = (*(asked.near or (0.0, -99.0)), 0.0)
    stage.select(bpy.data.objects[asked.name])
    assert bpy.ops.dafnet.walk_to(goal="SEAT", seconds=1.5, pull_out="MOVED") == {"FINISHED"}
    stage.select(stage.ann)
    stage.scene.frame_end = round(stage.root.animation_data.action.frame_range[1])
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    return stage, rig, baker.bake_onto_rig(bpy.context, stage.ann, rig, rig_map)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("dining, 12 cm out", 0),
        ("office", 0),
        ("bar", 0),
        # for so tall a person pulled out twice: for knees, then for a way past the counter
        ("bar", 1),
        ("sofa corner with table", 0),
        ("room in one mesh", 0),
    ],
)
def test_people_in_rooms_arrive_on_a_real_rig(blender: ModuleType, name: str, number: int) -> None:
    """Legs, trunk, head, feet and pelvis as the character's; hands that hold on to something are
    there, for which arms of other proportions bend otherwise: what is off by more is told.
    """
    if not RIG.is_file():
        pytest.skip(f"needs the rest pose {RIG}")
    stage, rig, baked = sent_and_baked(SCENES[name](LIBRARY), number)
    assert baked.ratio == 1.0
    for part, (mean, most) in baked.errors.items():
        assert mean < (0.03 if part == "wrists" else 0.01) and most < 0.05, (part, mean, most)
    if name == "bar":
        end = stage.place(stage.scene.frame_end)
        assert np.cos(end[3] - np.pi) > 0.9, "who sits at a bar looks to it, pulled out if need be"
    for limb, (mean, _) in baked.angles.items():
        assert mean < 5.0 or "arm" in limb, (limb, mean)
    assert stage.own.takes[0].action is not None and rig.animation_data.action == baked.action
