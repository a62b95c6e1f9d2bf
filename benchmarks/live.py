"""Is Live fast enough, and does it last: five minutes of random dragging in a café of more than
50,000 triangles, through the same code as the operator's timer.

    dafnet bench live [--weights WEIGHTS]

The root jumps about the room, onto chairs as well, hands are dragged and let go, a chair is pushed
now and then. A step is what the sensor sees, the network, and the pose; a tick is all that is done
for a frame, from reading what was dragged to posing the armature, without Blender's own redraw;
where other programs keep the cores busy, what it takes of the processor tells more.
Time runs as fast as it can be stepped. ``LIMITS`` are what is wanted.
"""

import os
import resource
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import bpy
import numpy as np

from dafnet_addon.blender.character.armature import create_character
from dafnet_addon.blender.character.properties import ensure_registered
from dafnet_addon.blender.live.listening import begin_live, end_live
from dafnet_addon.blender.live.session import LiveSession
from dafnet_addon.blender.showcase.rooms import build
from dafnet_addon.core.metrics import skate
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.weights import load_weights

__all__ = ["LIMITS", "measure"]

LIMITS = {"step, ms": 12.0, "memory grown, MB": 20.0}
"""At most: of a step in the median, and of what five minutes add to the process."""

_MINUTES = 5.0
_WARM = 60.0  # seconds after which memory is first looked at
_SIDE = 3.0  # metres from the middle of the room, within which the root is dragged
_HURRY = (0.2, 3.0)  # seconds from one place to the next, and of rest there
_ON_A_CHAIR = 0.3  # share of the places that are on a chair
_A_HAND = 0.3  # of those at which a hand is dragged as well
_PUSHED = 0.05  # of those at which a chair is pushed


def _megabytes() -> float:
    """What the process holds of memory now; where that is not told, the most that it ever held."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


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


def measure(
    weights: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    minutes: float = _MINUTES,
) -> tuple[dict[str, Any], str]:
    """The figures, and a table of them."""
    armature, chairs, triangles = _room()
    begun = perf_counter()
    session = LiveSession(bpy.context, armature, load_weights(weights))
    ready = perf_counter() - begun
    hand = _Hand(armature, chairs)
    steps, ticks, work, joints = [], [], [], []
    frames, grown = round(60.0 * minutes * MODEL_FPS), 0.0
    session.busy = np.inf
    begin_live(session)
    try:
        session.tick(bpy.context, 0.0)
        for k in range(1, frames + 1):
            now = k / MODEL_FPS + 1e-6
            hand.drag(now)
            bpy.context.view_layer.update()
            begun, worked = perf_counter(), thread_time()
            made = session.tick(bpy.context, now)
            ticks.append(perf_counter() - begun)
            work.append(thread_time() - worked)
            steps += [*session.durations][-made:]
            if len(joints) < 60 * MODEL_FPS:
                joints.append(session.body.frame.joints)
            if k == round(min(_WARM, 30.0 * minutes) * MODEL_FPS):
                grown = -_megabytes()
            progress(k / frames)
        grown += _megabytes()
    finally:
        end_live()

    figures = {
        "triangles": triangles,
        "minutes": minutes,
        "frames": frames,
        "frames lost": session.lost,
        "ready after, s": round(ready, 2),
        "step, ms": round(1e3 * float(np.median(steps)), 2),
        "step, 95th percentile, ms": round(1e3 * float(np.percentile(steps, 95)), 2),
        "tick, ms": round(1e3 * float(np.median(ticks)), 2),
        "tick, 95th percentile, ms": round(1e3 * float(np.percentile(ticks, 95)), 2),
        "of the processor, ms": round(1e3 * float(np.median(work)), 2),
        "longest tick, ms": round(1e3 * float(np.max(ticks)), 1),
        "memory grown, MB": round(grown, 1),
        "feet slide, cm a frame": round(skate(np.array(joints), MODEL_FPS), 3),
        "wanted": LIMITS,
    }
    rows = [f"{name:28}{value}" for name, value in figures.items() if name != "wanted"]
    wanted = ", ".join(f"{name} ≤ {most:g}" for name, most in LIMITS.items())
    return figures, "\n".join([*rows, f"{'wanted':28}{wanted}"])
