"""Tooltips: one line each, and whole in every language."""

from collections.abc import Iterator
from typing import Any

import bpy
import pytest
from bl_ext.user_default.dafnet import operators
from bl_ext.user_default.dafnet.dafnet_addon.blender import (
    german_tooltips,
    preferences,
    translations,
)
from bl_ext.user_default.dafnet.dafnet_addon.blender.character import properties
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay import display
from bl_ext.user_default.dafnet.dafnet_addon.blender.rig import properties as rig_properties

OF_BLENDER = {each.identifier for each in bpy.types.Operator.bl_rna.properties} - {"name"}
"""Properties that all operators have."""
OF_NAMES = {
    "Name of the preset, used to make the path name",
    *(
        base.bl_rna.properties["name"].description
        for base in (bpy.types.Operator, bpy.types.PropertyGroup)
    ),
}
"""What Blender says of a name, and translates itself."""
GROUPS = (*properties._GROUPS, rig_properties.RigRow, rig_properties.RigSettings)
SENTENCES = {"furniture at the 3D cursor and a character, ready to generate"}
"""Ends of tooltips that are composed."""


def of_properties(owner: Any) -> Iterator[str]:
    """The tooltips of what an owner has that is shown."""
    for each in owner.properties:
        if each.identifier in {*OF_BLENDER, "rna_type"} or each.is_hidden:
            continue
        yield each.description
        if each.type == "ENUM":
            yield from (item.description for item in each.enum_items)


def tooltips() -> set[str]:
    """What the add-on says where the mouse rests."""
    said = set()
    for cls in operators.CLASSES:
        rna = getattr(bpy.ops.dafnet, cls.bl_idname.partition(".")[2]).get_rna_type()
        said |= {rna.description, *of_properties(rna)}
    for group in (*GROUPS, display.Overlays, preferences.Preferences):
        said |= {*of_properties(group.bl_rna)}
    return said - {"", *OF_NAMES}


def test_every_tooltip_is_one_line(blender: object) -> None:
    assert len(tooltips()) > 150
    assert not [each for each in tooltips() if "\n" in each or "  " in each]


def test_every_tooltip_is_german_and_no_german_one_is_left_over(blender: object) -> None:
    asked = tooltips()
    assert asked - german_tooltips.TOOLTIPS.keys() == set()
    assert german_tooltips.TOOLTIPS.keys() - asked - SENTENCES == set()


@pytest.mark.parametrize("language", ["de_DE"])
def test_blender_says_them_in_its_language(blender: object, language: str) -> None:
    if language not in bpy.app.translations.locales:
        pytest.skip("this Blender has no other languages")
    view = bpy.context.preferences.view
    before = view.language, view.use_translate_tooltips
    view.language, view.use_translate_tooltips = language, True
    try:
        for sentence, said in german_tooltips.TOOLTIPS.items():
            assert translations.translated_tip(sentence) == said
    finally:
        view.language, view.use_translate_tooltips = before
