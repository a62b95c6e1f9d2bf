"""Sentences in the sidebar, broken into lines that fit."""

from textwrap import wrap

import bpy

__all__ = ["draw_sentence"]

_LETTER = 6.3
"""Pixels of a letter, more or less."""
_BESIDE, _ICON = 14, 24
"""Pixels of the sidebar beside it, and of its icon."""
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
    scale = context.preferences.system.ui_scale or 1.0
    beside = scale * (_BESIDE + (_ICON if icon != "NONE" else 0))
    width = context.region.width - beside if context.region else 0
    letter = _LETTER * scale
    for k, line in enumerate(wrap(sentence, max(_SHORTEST, round(width / letter)))):
        row = layout.row()
        row.alert = alert
        row.label(text=line, icon="BLANK1" if k and icon != "NONE" else icon, translate=False)
