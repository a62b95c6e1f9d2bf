"""Sentences in the sidebar, broken into lines that fit."""

from textwrap import wrap

import bpy

__all__ = ["draw_sentence"]

_LETTER = 6.5
"""Pixels of a letter, more or less."""
_SHORTEST = 20
"""Letters of the shortest line."""


def draw_sentence(
    layout: bpy.types.UILayout,
    context: bpy.types.Context,
    sentence: str,
    icon: str,
    alert: bool = False,
) -> None:
    """Draw a sentence over as many lines as it needs, the icon before the first."""
    width = context.region.width if context.region else 0
    letter = _LETTER * (context.preferences.system.ui_scale or 1.0)
    for k, line in enumerate(wrap(sentence, max(_SHORTEST, round(width / letter)))):
        row = layout.row()
        row.alert = alert
        row.label(text=line, icon="BLANK1" if k and icon != "NONE" else icon, translate=False)
