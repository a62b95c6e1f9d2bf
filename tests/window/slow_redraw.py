"""A window whose 3D view takes half a second to draw: a take costs little more than as one call,
and Esc is heard at once.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter, sleep, thread_time
from typing import Any

import bpy
from first_shot import progress

from kit.window import Driver, Waits

__all__ = ["slow_redraw"]

_REDRAW = 0.5
"""Seconds that the 3D view takes to draw."""
_DEARER = 1.5
"""What a take may cost in the window, over the same call."""
_HEARD = 0.1
"""Seconds of work within which Esc is heard."""


class _Work:
    """What the operator works, tick by tick: when it began and ended, and its seconds of this
    thread alone, which other programs don't lengthen.
    """

    def __init__(self) -> None:
        self.ticks: list[tuple[float, float, float]] = []
        module: Any = next(m for name, m in sys.modules.items() if name.endswith("operators.long"))
        self._operator = module.LongOperator
        self._advance = self._operator._advance

    def __enter__(self) -> "_Work":
        advance, ticks = self._advance, self.ticks

        def noted(operator: Any, seconds: float, longest: float) -> Any:
            began, started = perf_counter(), thread_time()
            try:
                return advance(operator, seconds, longest)
            finally:
                ticks.append((began, perf_counter(), thread_time() - started))

        self._operator._advance = noted
        return self

    def __exit__(self, *_: object) -> None:
        self._operator._advance = self._advance

    def after(self, moment: float) -> float:
        """Seconds that were worked since then."""
        return sum(worked for began, _, worked in self.ticks if began >= moment)


@contextmanager
def _slow() -> Iterator[list[float]]:
    """A block in which the 3D view is slow; the moments at which it was drawn."""
    drawn: list[float] = []

    def draw() -> None:
        drawn.append(perf_counter())
        sleep(_REDRAW)

    handle = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")
    try:
        yield drawn
    finally:
        bpy.types.SpaceView3D.draw_handler_remove(handle, "WINDOW")


def _quiet(user: Driver, drawn: list[float]) -> Waits:
    """Wait until Blender has drawn what was asked for, which it does several times over."""
    yield 1.0
    yield from user.until(
        lambda: not drawn or perf_counter() - drawn[-1] > 4.0, "the end of drawing"
    )


def slow_redraw(pictures: Path) -> Waits:
    """Make the same take by a call and by the button, and cancel another one."""
    user = Driver(pictures)
    yield from user.press("ESC")  # the splash screen
    with user.override():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
        bpy.ops.dafnet.add_example(kind="DESK")
    own = bpy.context.object.dafnet
    own.take_count = 2
    yield from user.sidebar("DAFNet")
    x, y = yield from user.find("dafnet.generate(task='NEW')")

    with user.override():
        bpy.ops.dafnet.generate()  # measures the furniture, which is kept
        started = perf_counter()
        bpy.ops.dafnet.generate()
    call = perf_counter() - started

    with _slow() as drawn, _Work() as work:
        user.move(x, y)
        yield from _quiet(user, drawn)
        drawn.clear()
        yield from user.press("LEFTMOUSE")
        yield from user.until(lambda: len(own.takes) == 6, "the takes in a slow window")
        started = work.ticks[0][0]  # to the last one's end, as the call, which is drawn afterwards
        spent = work.ticks[-1][1] - started
        longest = max(worked for _, _, worked in work.ticks)
        worked = sum(end - began for began, end, _ in work.ticks)
        print(
            f"slow redraw: {call:.2f} s as one call, {spent:.2f} s in the window, "
            f"{worked:.2f} of them at work, {len(drawn)} redraws, {len(work.ticks)} "
            f"ticks, the longest of {longest:.3f} s; drawn after "
            f"{[round(each - started, 1) for each in drawn]} s, ticks until "
            f"{[round(end - started, 1) for _, end, _ in work.ticks[:4]]} s",
            flush=True,
        )

    yield 1.0
    x, y = yield from user.find("dafnet.generate(task='NEW')")
    with _slow() as drawn, _Work() as work:
        user.move(x, y)
        yield from _quiet(user, drawn)
        yield from user.press("LEFTMOUSE")
        yield from user.until(lambda: (progress() or 0.0) > 0.4, "the middle of the job")
        pressed = perf_counter()
        yield from user.press("ESC")
        yield from user.until(lambda: progress() is None, "the end after Esc", 30.0)
        heard = work.after(pressed)
        print(f"Esc is heard after {heard:.3f} s of work", flush=True)

    assert len(own.takes) == 6
    assert heard < _HEARD
    # Of the work itself, since on a busy machine a call takes longer from one minute to the next.
    assert spent < _DEARER * max(call, worked)
