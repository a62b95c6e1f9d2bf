"""Operators that work between the user's events: however a job ends, Blender is free again."""

from collections.abc import Generator, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import bpy
import pytest
from bl_ext.user_default import dafnet
from bl_ext.user_default.dafnet.dafnet_addon.blender.overlay import display
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.running import end_job, running_job
from bl_ext.user_default.dafnet.dafnet_addon.blender.pipeline.view import DrawnOnce
from bl_ext.user_default.dafnet.operators.generate import DAFNET_OT_generate
from bl_ext.user_default.dafnet.operators.long import LongOperator

from kit.stage import Stage

ESC = SimpleNamespace(type="ESC")


def _listen(operator: Any, context: bpy.types.Context) -> None:
    """``LongOperator._listen`` but for the handler, which only a window has."""
    operator._timer = context.window_manager.event_timer_add(0.01, window=context.window)
    operator._view = DrawnOnce()


class Job(LongOperator):
    """A job without an end, which may fail to be closed."""

    _listen = _listen

    def __init__(self, fails: bool = False) -> None:
        self.closed = False
        self._fails = fails

    def steps(self, _context: bpy.types.Context) -> Generator[float, None, Any]:
        try:
            while True:
                yield 0.5
        finally:
            self.closed = True
            if self._fails:
                raise OSError("close")

    def report(self, _kind: set[str], words: str) -> None:
        pass


@pytest.fixture
def smooth(blender: ModuleType) -> Iterator[None]:
    """The view is drawn sixteen times over, which a job does not let it; no job outlives a
    test.
    """
    system = bpy.context.preferences.system
    own, system.viewport_aa = system.viewport_aa, "16"
    yield
    end_job()
    display.hide_live_pose()
    system.viewport_aa = own


def _free() -> bool:
    """Whether nothing of a job is left."""
    return running_job() is None and bpy.context.preferences.system.viewport_aa == "16"


@pytest.mark.parametrize("fails", [False, True])
def test_a_job_that_cannot_be_closed_is_at_an_end_too(smooth: None, fails: bool) -> None:
    Stage(furnished=False)
    job = Job(fails)
    assert job.invoke(bpy.context, None) == {"RUNNING_MODAL"} and not _free()
    assert not bpy.ops.dafnet.generate.poll()
    if fails:
        with pytest.raises(OSError, match="close"):
            job.modal(bpy.context, ESC)
    else:
        assert job.modal(bpy.context, ESC) == {"CANCELLED"}
    assert job.closed and _free() and bpy.ops.dafnet.generate.poll()
    assert job.modal(bpy.context, SimpleNamespace(type="G")) == {"CANCELLED"}, "no key is swallowed"


@pytest.mark.parametrize("fails", [False, True])
def test_disabling_the_add_on_ends_the_job(smooth: None, fails: bool) -> None:
    job = Job(fails)
    job.invoke(bpy.context, None)
    try:
        if fails:
            with pytest.raises(OSError, match="close"):
                dafnet.unregister()
        else:
            dafnet.unregister()
        assert job.closed and _free()
        assert not hasattr(bpy.types, "DAFNET_PT_setup"), "it is taken away all the same"
    finally:
        dafnet.register()


def test_the_pose_that_is_shown_goes_with_a_job_that_cannot_be_closed(
    smooth: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    Stage(frames=(1, 10), furnished=False)

    def run(operator: Any, context: bpy.types.Context) -> None:
        assert operator.invoke(context, None) == {"RUNNING_MODAL"} and display._live_pose
        operator.modal(context, ESC)

    monkeypatch.setattr(DAFNET_OT_generate, "steps", lambda _, context: Job(True).steps(context))
    monkeypatch.setattr(DAFNET_OT_generate, "_listen", _listen)
    monkeypatch.setattr(DAFNET_OT_generate, "run", run)
    with pytest.raises(RuntimeError, match="OSError: close"):
        bpy.ops.dafnet.generate()
    assert not display._live_pose and _free()
