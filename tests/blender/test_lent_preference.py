"""A preference that is lent is the user's own wherever it might be saved."""

from types import ModuleType

import bpy
import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline import lent_preference
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.lent_preference import LentPreference
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.view import DrawnOnce


@pytest.fixture
def shown(blender: ModuleType, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether a window shows the preferences, as this says: the module has no windows."""
    is_shown = [False]
    monkeypatch.setattr(lent_preference, "_shown", lambda: is_shown[0])
    return is_shown


def test_a_lent_preference_comes_back_and_is_not_taken_for_changed(shown: list[bool]) -> None:
    preferences = bpy.context.preferences
    own, preferences.is_dirty = preferences.edit.use_global_undo, False
    made = LentPreference("edit", "use_global_undo", not own)
    assert preferences.edit.use_global_undo != own and not preferences.is_dirty
    made.keep()
    shown[0] = True
    made.keep()
    assert preferences.edit.use_global_undo == own, "while they are shown, and may be saved"
    shown[0] = False
    made.keep()
    assert preferences.edit.use_global_undo != own
    made.back()
    made.back()
    assert preferences.edit.use_global_undo == own and not preferences.is_dirty


def test_what_the_user_sets_meanwhile_stays(shown: list[bool]) -> None:
    system = bpy.context.preferences.system
    own, system.viewport_aa = system.viewport_aa, "16"
    try:
        view = DrawnOnce()
        assert system.viewport_aa == "FXAA"
        shown[0] = True
        view.keep()
        assert system.viewport_aa == "16"
        system.viewport_aa = "8"
        shown[0] = False
        view.keep()
        assert system.viewport_aa == "FXAA"
        view.end()
        assert system.viewport_aa == "8"

        system.viewport_aa = "OFF"
        view = DrawnOnce()
        view.keep()
        assert system.viewport_aa == "OFF", "which is drawn once already"
        view.end()
    finally:
        system.viewport_aa = own
