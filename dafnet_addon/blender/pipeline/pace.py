"""How a job that runs in a window shares the time with Blender, which draws between its ticks."""

from collections.abc import Callable
from time import perf_counter

__all__ = ["Pace"]

_TICK = 0.05
"""Seconds of work before the user's events are looked at again."""
_LONGEST_TICK = 5.0
"""Seconds of it where Blender draws after each tick by itself, and is slow at it."""
_FOR_DRAWING = 0.4
"""Seconds that Blender may draw for each second of work: less than a third of the time."""
_FIRST_DRAW = 0.1
"""Seconds that the window is taken to need before it was ever drawn."""
_OVERDRAWN = 3.0
"""Draws for which the work has not paid, after which ticks are longer until it has."""


class Pace:
    """Says how long to work, and when to have the window drawn, by how long that took before.

    The work pays for what Blender draws; the window's turn comes when enough is saved for it: all
    of it, since in some a label takes as long as the view. ``clock``: seconds.
    """

    def __init__(self, clock: Callable[[], float] = perf_counter) -> None:
        self._clock = clock
        self._since = clock()
        self._saved = 0.0
        self._drawing = _FIRST_DRAW
        self._asked = True  # since the window shows that the job has begun

    @property
    def longest(self) -> float:
        """For how many seconds to work where that changes the scene, which Blender then draws."""
        return min(max(_TICK, self._drawing / _FOR_DRAWING), _LONGEST_TICK)

    def resume(self) -> float:
        """Blender has looked at events and drawn; for how many seconds to work now."""
        now = self._clock()
        busy, self._since = now - self._since, now
        self._saved = min(self._saved, self._drawing) - busy
        if self._asked:
            self._drawing = busy
        overdrawn = not self._asked and self._saved < -_OVERDRAWN * self._drawing
        return min(max(_TICK, busy / _FOR_DRAWING), _LONGEST_TICK) if overdrawn else _TICK

    def pause(self) -> bool:
        """A tick is done; whether to have the window drawn."""
        now = self._clock()
        self._saved += _FOR_DRAWING * (now - self._since)
        self._since = now
        self._asked = self._saved >= self._drawing
        return self._asked
