"""How a job in a window shares the time with what Blender draws; the window itself is driven in
tests/window/slow_redraw.py.
"""

import pytest
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.pace import Pace


class _Window:
    """A window by a clock: it takes ``redraw`` seconds to draw, everything else ``rest``, and each
    drawing is followed by ``again`` more of them by itself; while the job ``changes`` the scene
    Blender draws after every tick.
    """

    def __init__(self, redraw: float, again: int = 0, rest: float = 0.005) -> None:
        self.now = 0.0
        self.redraw, self.again, self.rest = redraw, again, rest
        self.draws, self.ticks = 0, []

    def run(self, work: float, changes: float = 0.0) -> float:
        """Seconds that so much ``work`` takes, of which the first ``changes`` set frames."""
        pace, done, left = Pace(lambda: self.now), 0.0, self.again + 1
        while done < work:
            self.now += self.rest + (self.redraw if left else 0.0)
            self.draws += left > 0
            left = max(0, left - 1)
            tick, longest = pace.resume(), pace.longest
            if done < changes:
                tick, left = max(tick, min(longest, changes - done)), 1
            tick = min(tick, work - done)
            self.ticks.append(tick)
            self.now += tick
            done += tick
            if pace.pause():
                left = self.again + 1
        return self.now


@pytest.mark.parametrize("redraw", [0.002, 0.02, 0.1, 0.5])
@pytest.mark.parametrize("work", [3.7, 40.0])
def test_drawing_takes_at_most_a_third_of_the_time(redraw: float, work: float) -> None:
    window = _Window(redraw)
    assert window.run(work) < 1.5 * work
    assert max(window.ticks) <= 0.1, "events are heard"
    assert window.draws > min(20.0, 0.2 * work / redraw), "and it is seen how far the work is"


@pytest.mark.parametrize("redraw", [0.02, 0.1, 0.5])
def test_ticks_are_longer_where_the_scene_is_changed(redraw: float) -> None:
    """As while it is read, whose frames are set for it."""
    window = _Window(redraw)
    assert window.run(6.0, changes=3.0) < 1.5 * 6.0
    assert window.ticks[-2] <= 0.1, "it hears of events sooner when that is over"


@pytest.mark.parametrize("redraw", [0.02, 0.1, 0.5])
def test_a_view_that_blender_draws_again_and_again_is_paid_for(redraw: float) -> None:
    """As where a picture is made of sixteen samples."""
    window = _Window(redraw, again=15)
    assert window.run(30.0) < 1.5 * 30.0


def test_a_view_that_is_quick_is_drawn_after_every_tick() -> None:
    window = _Window(0.005)
    window.run(4.0)
    assert window.draws > 0.8 * len(window.ticks)
