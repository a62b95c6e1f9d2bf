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

import numpy as np

from dafnet_addon.core.metrics import skate
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.weights import load_weights

__all__ = ["LIMITS", "measure"]

LIMITS = {"step, ms": 12.0, "memory grown, MB": 20.0}
"""At most: of a step in the median, and of what five minutes add to the process."""

_MINUTES = 5.0
_WARM = 60.0  # seconds after which memory is first looked at


def _megabytes() -> float:
    """What the process holds of memory now; where that is not told, the most that it ever held."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def measure(
    weights: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    minutes: float = _MINUTES,
) -> tuple[dict[str, Any], str]:
    """The figures, and a table of them."""
    from dafnet_addon.blender.live.trial import Trial

    begun = perf_counter()
    trial = Trial(load_weights(weights))
    session, ready = trial.session, perf_counter() - begun
    steps: list[float] = []
    ticks: list[float] = []
    work: list[float] = []
    joints: list[np.ndarray] = []
    frames, grown = round(60.0 * minutes * MODEL_FPS), 0.0
    trial.begin()
    try:
        for k in range(1, frames + 1):
            now = k / MODEL_FPS + 1e-6
            trial.drag(now)
            begun, worked = perf_counter(), thread_time()
            made = trial.tick(now)
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
        trial.end()

    figures = {
        "triangles": trial.triangles,
        "minutes": minutes,
        "frames": frames,
        "frames lost": session.lost,
        "ready after, s": round(ready, 2),
        "step, ms": round(1e3 * float(np.median(steps)), 2),
        "step, 95th percentile, ms": round(1e3 * float(np.percentile(steps, 95)), 2),
        "tick, ms": round(1e3 * float(np.median(ticks)), 2),
        "tick, 95th percentile, ms": round(1e3 * float(np.percentile(ticks, 95)), 2),
        "of the processor, ms": round(1e3 * float(np.median(work)), 2),
        "of the processor, 95th percentile, ms": round(1e3 * float(np.percentile(work, 95)), 2),
        "longest tick, ms": round(1e3 * float(np.max(ticks)), 1),
        "memory grown, MB": round(grown, 1),
        "feet slide, cm a frame": round(skate(np.array(joints), MODEL_FPS), 3),
        "wanted": LIMITS,
    }
    rows = [f"{name:40}{value}" for name, value in figures.items() if name != "wanted"]
    wanted = ", ".join(f"{name} ≤ {most:g}" for name, most in LIMITS.items())
    return figures, "\n".join([*rows, f"{'wanted':40}{wanted}"])
