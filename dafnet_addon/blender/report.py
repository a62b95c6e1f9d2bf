"""What somebody who is to help has to know, as text: versions, settings, figures and warnings."""

import platform
import re
from dataclasses import asdict

import bpy
import numpy as np

from ..core.errors import DafnetError
from ..core.manifest import content_hash, current_version
from ..core.weights import load_weights
from .character.armature import metres_per_unit
from .character.settings import settings_of
from .character.takes import draw_of, played_take, stored_take
from .preferences import weights_path

__all__ = ["report_text", "write_report"]

_TEXT = "DAFNet Report"
"""The name of the text block."""

_WORDS = ("mode", "begins", "noise")
"""Settings whose text is a word of the interface, not a name of the user's."""


def report_text(context: bpy.types.Context, armature: bpy.types.Object | None) -> str:
    """The report, of a character if there is one: names of objects are left out, only whether they
    are set is said.
    """
    lines = [
        f"DAFNet {current_version()}",
        f"Blender {bpy.app.version_string}, Python {platform.python_version()}",
        f"NumPy {np.__version__}",
        f"System: {platform.platform()}",
        f"Weights: {_weights(context)}",
    ]
    if armature is None:
        return "\n".join([*lines, "No character is selected."])

    settings = asdict(settings_of(armature, context.scene))
    said = ", ".join(
        f"{name} {'set' if isinstance(value, str) and name not in _WORDS else value}"
        for name, value in settings.items()
        if value is not None and name not in ("armature", "scene")
    )
    scene = context.scene
    unit, fps = metres_per_unit(scene), scene.render.fps / scene.render.fps_base
    lines += [
        f"Scene: {fps:g} frames a second, unit {unit:g} m",
        f"Character: mode {armature.dafnet.mode}, {said}",
    ]
    return "\n".join([*lines, *_take(armature)])


def write_report(context: bpy.types.Context, armature: bpy.types.Object | None) -> bpy.types.Text:
    """The report in a text block of the file, in place of an earlier one."""
    said = report_text(context, armature)
    text = bpy.data.texts.get(_TEXT) or bpy.data.texts.new(_TEXT)
    text.from_string(said)
    return text


def _weights(context: bpy.types.Context) -> str:
    try:
        weights = load_weights(weights_path(context))
        return f"{content_hash(weights.path)[:12]}, {weights.path.stat().st_size} bytes"
    except DafnetError as error:
        return f"cannot be read: {type(error).__name__}"


def _take(armature: bpy.types.Object) -> list[str]:
    action = played_take(armature)
    if action is None:
        return ["No take plays."]
    take, _ = stored_take(action)
    measured = sorted(item for item in take.metrics.items() if item[1] is not None)
    figures = ", ".join(f"{name} {value:.4g}" for name, value in measured)
    return [
        f"Take: {draw_of(action)}",
        f"{len(take)} frames, {figures}",
        *(_nameless(each) for each in take.warnings),
    ]


def _nameless(sentence: str) -> str:
    """A warning without the names of objects that are quoted in it."""
    return re.sub(r"'[^']*'", "'\u2026'", sentence)
