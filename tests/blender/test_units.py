"""Scenes, heights and rigs of another unit are noticed before anything runs, with the likely
unit.
"""

from types import ModuleType

import bpy
import pytest
from bl_ext.user_default.dafnet.panels.main import DAFNET_PT_character

from kit import humanoids
from kit.panels import drawn_by
from kit.stage import Stage


def noted() -> str:
    return " ".join(drawn_by(DAFNET_PT_character, bpy.context).words())


@pytest.mark.parametrize(
    ("scale", "said"),
    [(1.0, None), (100.0, "centimetres"), (1000.0, "millimetres"), (0.01, "100 times too small")],
)
def test_the_panel_says_so_and_generate_as_well(
    blender: ModuleType, capfd: pytest.CaptureFixture[str], scale: float, said: str | None
) -> None:
    stage = Stage(fps=30, frames=(1, 4))
    stage.seat("Chair", location=(0.5, 1.0, 0.0), scale=(scale, scale, scale))
    stage.box("Table", (0.0, 2.0, 0.0), (1.0, 2.6, 0.72), scale=(scale, scale, scale))
    stage.select(stage.ann)
    bpy.context.view_layer.update()
    if said is None:
        assert "unit" not in noted()
    else:
        assert "is its unit right?" in noted() and said in noted()
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    out = capfd.readouterr().out
    assert ("is its unit right?" in out) == (said is not None)


def test_the_panel_is_quiet_where_nothing_stands(blender: ModuleType) -> None:
    Stage(furnished=False)
    assert "unit" not in noted()


@pytest.mark.parametrize(
    ("height", "unit"), [(175.0, "centimetres"), (69.0, "inches"), (5.9, "feet")]
)
def test_a_height_of_another_unit_is_named(blender: ModuleType, height: float, unit: str) -> None:
    with pytest.raises(RuntimeError, match=f"looks like {unit}; give 1\\.[78]"):
        bpy.ops.dafnet.add_character(height=height)
    assert not bpy.data.objects
    assert bpy.ops.dafnet.add_character(height=2.4) == {"FINISHED"}


def test_a_rig_of_180_units_is_named_before_it_is_baked_or_measured(blender: ModuleType) -> None:
    stage = Stage(fps=30, frames=(1, 4), furnished=False)
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    rig = humanoids.mixamo(bpy)
    rig.scale = [100.0 * each for each in rig.scale]
    bpy.context.view_layer.update()
    stage.select(rig)
    assert bpy.ops.dafnet.detect_rig() == {"FINISHED"}
    for operator in (bpy.ops.dafnet.bake_to_rig, bpy.ops.dafnet.size_as_rig):
        with pytest.raises(RuntimeError, match="looks like centimetres; scale the armature"):
            operator()
    assert rig.animation_data is None or rig.animation_data.action is None
    assert stage.ann.scale.x == 1.0
    rig.scale = [0.01 * each for each in rig.scale]
    bpy.context.view_layer.update()
    assert bpy.ops.dafnet.bake_to_rig() == {"FINISHED"}
