"""The report that issues ask for."""

from dataclasses import replace

import bpy
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender import report
from bl_ext.user_default.dafnet.dafnet_addon.blender.character.takes import stored_take
from bl_ext.user_default.dafnet.dafnet_addon.blender.report import report_text
from bl_ext.user_default.dafnet.panels.help import DAFNET_PT_help

from dafnet_addon.core.manifest import current_version
from kit.panels import drawn_by
from kit.stage import Stage


@pytest.fixture
def stage(blender: object) -> Stage:
    return Stage(frames=(1, 10), furnished=False)


def test_it_says_versions_settings_and_figures_and_no_names(stage: Stage) -> None:
    stage.own.root.name = "Secret project"
    stage.own.temperature = 0.75
    before = report_text(bpy.context, stage.ann)
    assert f"DAFNet {current_version()}" in before and bpy.app.version_string in before
    assert "temperature 0.75" in before and "root set" in before and "No take plays." in before
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    after = report_text(bpy.context, stage.ann)
    assert "10 frames" in after and "foot_sliding_per_frame" in after and "seed=0" in after
    assert "Secret" not in after and "Ann" not in after


def test_it_says_what_takes_begin_with_and_how_long_a_unit_counts(stage: Stage) -> None:
    units = stage.scene.unit_settings
    units.scale_length = 0.01
    said = report_text(bpy.context, stage.ann)
    assert "begins STANDING" in said and "unit 0.01 m" in said
    stage.own.begins, units.system = "AS_IT_IS", "NONE"
    said = report_text(bpy.context, stage.ann)
    assert "begins AS_IT_IS" in said and "unit 1 m" in said


def test_it_is_given_without_a_character_and_with_weights_that_are_none(stage: Stage) -> None:
    own = bpy.context.preferences.addons["bl_ext.user_default.dafnet"].preferences
    assert "No character is selected." in report_text(bpy.context, None)
    own.weights = "/nowhere/at all.safetensors"
    try:
        assert "cannot be read: WeightsError" in report_text(bpy.context, stage.ann)
    finally:
        own.weights = ""


def test_it_is_written_into_one_text(stage: Stage) -> None:
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    for _ in range(2):
        assert bpy.ops.dafnet.copy_report() == {"FINISHED"}
    (text,) = bpy.data.texts
    said = text.as_string()
    assert text.name == "DAFNet Report" and "10 frames" in said and bpy.app.version_string in said


def test_warnings_lose_the_names_in_them(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    assert bpy.ops.dafnet.generate() == {"FINISHED"}
    take, controls = stored_take(stage.ann.dafnet.takes[0].action)
    take = replace(take, warnings=("'Secret Ground' is 2 km across.",))
    monkeypatch.setattr(report, "stored_take", lambda _action: (take, controls))
    said = report_text(bpy.context, stage.ann)
    assert "is 2 km across." in said and "Secret" not in said


def test_help_is_in_the_tab_without_a_character_too(blender: object) -> None:
    assert DAFNET_PT_help.poll(bpy.context)
    assert {"wm.path_open", "dafnet.copy_report"} <= set(
        drawn_by(DAFNET_PT_help, bpy.context).words()
    )
