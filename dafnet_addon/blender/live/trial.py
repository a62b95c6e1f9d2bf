"""A trial of Live without a window: a character in the café, and a hand that drags its root and
targets about at random.
"""

import bpy
import numpy as np

from ...core.weights import Weights
from ..character.armature import create_character
from ..character.properties import ensure_registered
from ..showcase.rooms import build
from .listening import begin_live, end_live
from .session import LiveSession

__all__ = ["Trial"]

_SIDE = 3.0
"""Metres from the middle of the room, within which the root is dragged."""
_HURRY = (0.2, 3.0)
"""Seconds from one place to the next, and of rest there."""
_ON_A_CHAIR = 0.3
"""Share of the places that are on a chair."""
_A_HAND = 0.3
"""Share of those at which a hand is dragged as well."""
_PUSHED = 0.05
"""Share of those at which a chair is pushed."""


class Trial:
    """A ``session`` in the café, in a new file; ``triangles``: of the furniture."""

    def __init__(self, weights: Weights | None = None) -> None:
        armature, chairs, self.triangles = _room()
        self.session = LiveSession(bpy.context, armature, weights)
        self.session.busy = np.inf
        self._hand = _Hand(armature, chairs)

    def begin(self) -> None:
        """Begin at 0 seconds."""
        begin_live(self.session)
        self.session.tick(bpy.context, 0.0)

    def drag(self, now: float) -> None:
        """Move what is dragged to where it is at ``now``, seconds; Blender evaluates the scene."""
        self._hand.drag(now)
        bpy.context.view_layer.update()

    def tick(self, now: float) -> int:
        """Make the frames that are due; how many it made."""
        return self.session.tick(bpy.context, now)

    def end(self) -> None:
        """Put everything back."""
        end_live()


def _room() -> tuple[bpy.types.Object, list[bpy.types.Object], int]:
    """A character in the café, the chairs there, and how many triangles all of it has."""
    ensure_registered()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    build(scene, "cafe")
    furniture = list(bpy.data.collections["Furniture"].objects)
    triangles = 0
    for each in furniture:
        each.data.calc_loop_triangles()
        triangles += len(each.data.loop_triangles)

    armature = create_character(bpy.context, "Ann")
    armature.dafnet.furniture = bpy.data.collections["Furniture"]
    return armature, [each for each in furniture if "hair" in each.name], triangles


class _Hand:
    """Drags about at random, as a user in a hurry does."""

    def __init__(self, armature: bpy.types.Object, chairs: list[bpy.types.Object]) -> None:
        self.own = armature.dafnet
        self.chairs = chairs
        self._random = np.random.default_rng(0)
        self._from = self._to = np.zeros(2)
        self._begins, self._there, self._next = 0.0, 0.1, 0.2

    def drag(self, now: float) -> None:
        """Move what is dragged to where it is at ``now``, seconds."""
        rng = self._random
        if now >= self._next:
            self._from, self._begins = self._to, now
            chair = self.chairs[rng.integers(len(self.chairs))]
            on_it = rng.random() < _ON_A_CHAIR
            self._to = np.array(chair.location)[:2] if on_it else rng.uniform(-_SIDE, _SIDE, 2)
            self._there = now + rng.uniform(*_HURRY)
            self._next = self._there + rng.uniform(*_HURRY)
            self.own.root.rotation_euler.z += rng.normal(0.0, 1.0)
            if rng.random() < _A_HAND:
                place = np.array(self.own.root.location) + rng.uniform(
                    (-0.5, -0.5, 0.6), (0.5, 0.5, 1.7)
                )
                self.own.hand_right.location = place
            if rng.random() < _PUSHED:
                chair.location.x += rng.normal(0.0, 0.1)
        share = min(1.0, (now - self._begins) / (self._there - self._begins))
        self.own.root.location[:2] = (1.0 - share) * self._from + share * self._to
