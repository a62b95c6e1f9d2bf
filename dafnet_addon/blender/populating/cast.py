"""Who plays: the project's mannequin for everybody, at his height and build."""

import bpy
import numpy as np

from ...director.shots import Somebody
from ..character.armature import create_character

__all__ = ["hire"]

_BUILDS = (0.9, 1.12)
"""How thick trunks and limbs are over the usual, between which a build is drawn."""


def hire(context: bpy.types.Context, who: Somebody) -> bpy.types.Object:
    """The armature that plays somebody, made at the world's origin."""
    build = float(np.random.default_rng(who.seed).uniform(*_BUILDS))
    return create_character(context, who.name, who.height, build)
