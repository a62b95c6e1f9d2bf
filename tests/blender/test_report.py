"""The report that issues ask for."""

import bpy
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.report import report_text

from dafnet_addon.core.manifest import current_version
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


def test_it_is_given_without_a_character_and_with_weights_that_are_none(stage: Stage) -> None:
    own = bpy.context.preferences.addons["bl_ext.user_default.dafnet"].preferences
    assert "No character is selected." in report_text(bpy.context, None)
    own.weights = "/nowhere/at all.safetensors"
    try:
        assert "cannot be read: WeightsError" in report_text(bpy.context, stage.ann)
    finally:
        own.weights = ""


def test_it_is_copied(stage: Stage) -> None:
    assert bpy.ops.dafnet.copy_report() == {"FINISHED"}
