"""The job that runs in a window, one at a time: panels show it, and other operators wait for it.

It belongs to the session and to no file: undoing, or opening another file, leaves it alone.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["RunningJob", "begin_job", "end_job", "note_change", "running_job", "stop_job"]


@dataclass
class RunningJob:
    """How far a job is.

    ``progress``: the share done, in [0, 1]. ``seconds_left``: an estimate. ``joints`` (22, 3): of
    the frame generated last, world, metres; None before the first one. ``cancel_requested``: the
    job is to end at its next step. ``changed``: its last step has changed the scene, which Blender
    will draw. ``stop``: ends it at once, as Esc does; None before it listens to events.
    """

    progress: float = 0.0
    seconds_left: float = 0.0
    joints: np.ndarray | None = None
    cancel_requested: bool = False
    changed: bool = False
    stop: Callable[[], None] | None = None


_running: list[RunningJob] = []  # at most one


def running_job() -> RunningJob | None:
    """The job that is running; None where none is."""
    return _running[0] if _running else None


def begin_job() -> RunningJob:
    """A new job that is running from now on."""
    _running[:] = [RunningJob()]
    return _running[0]


def end_job() -> None:
    """From now on no job is running."""
    _running.clear()


def stop_job() -> None:
    """End the job that is running, if one is, from outside: the scene is as it was."""
    job = running_job()
    if job is not None and job.stop is not None:
        job.stop()


def note_change() -> None:
    """The job that is running, if one is, has changed the scene: a frame of it, or an action."""
    for job in _running:
        job.changed = True
