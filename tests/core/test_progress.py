"""Long jobs as generators, and the one BLAS thread that their small steps run on."""

import ctypes
import inspect
import os
import pickle
from collections.abc import Callable, Generator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dafnet_addon import Take, generate
from dafnet_addon.core import threads
from dafnet_addon.core.progress import run_to_end, stepwise, within
from dafnet_addon.core.threads import _openblas, cores, one_thread


def _job(closed: list[bool]) -> Generator[float, None, str]:
    try:
        yield 0.0
        yield 0.5
        yield 1.0
    finally:
        closed.append(True)
    return "result"


def test_a_drained_job_gives_its_result_and_tells_its_progress():
    seen: list[float] = []
    assert run_to_end(_job([]), seen.append) == "result" and seen == [0.0, 0.5, 1.0]


def test_a_part_of_a_job_keeps_to_its_share_and_hands_on_its_result():
    def whole() -> Generator[float, None, str]:
        return (yield from within(_job([]), 0.2, 0.4))

    seen: list[float] = []
    assert run_to_end(whole(), seen.append) == "result" and np.allclose(seen, [0.2, 0.3, 0.4])


def test_closing_a_job_closes_its_part():
    closed: list[bool] = []
    part = within(_job(closed), 0.0, 1.0)
    next(part)
    part.close()
    assert closed == [True]


@stepwise
def doubled(number: float, times: int = 1) -> Generator[float, None, float]:
    """The number, doubled some times."""
    for time in range(times):
        yield time / times
        number *= 2
    return number


def test_a_stepwise_job_runs_to_its_end_or_step_by_step():
    seen: list[float] = []
    assert doubled(3.0, times=2) == 12.0 and doubled(3.0) == 6.0
    assert run_to_end(doubled.steps(3.0, times=2), seen.append) == 12.0 and seen == [0.0, 0.5]


def test_a_stepwise_job_is_told_of_as_the_function_that_it_is():
    for function, result in ((doubled, float), (generate, Take)):
        assert inspect.isfunction(function) and pickle.loads(pickle.dumps(function)) is function
        assert inspect.signature(function).return_annotation is result
        assert inspect.signature(function.steps).return_annotation == Generator[float, None, result]
    assert inspect.getdoc(doubled) == "The number, doubled some times."
    assert list(inspect.signature(generate).parameters)[:3] == ["scene", "controls", "weights"]


def test_one_thread_gives_back_what_it_took():
    found = _openblas()
    if found is None:
        pytest.skip("this NumPy runs on no OpenBLAS that can be reached")
    get, put = found
    before = get()
    put(2)
    try:
        with pytest.raises(ValueError), one_thread():
            assert get() == 1
            raise ValueError
        assert get() == 2
    finally:
        put(before)


def _no_library(name: str) -> Any:
    raise OSError(f"{name}: cannot open shared object file")


@pytest.mark.parametrize(
    "library", [_no_library, lambda name: SimpleNamespace()], ids=["none", "another"]
)
def test_without_openblas_nothing_is_changed(
    monkeypatch: pytest.MonkeyPatch, library: Callable[[str], Any]
) -> None:
    monkeypatch.setattr(ctypes, "CDLL", library)
    monkeypatch.setattr(threads, "_openblas", _openblas.__wrapped__)
    assert threads._openblas() is None
    with one_thread():
        assert (np.eye(3) @ np.ones(3) == 1.0).all()


@pytest.mark.parametrize(
    ("bound", "quota", "expected"),
    [
        (1, None, 1),
        (64, None, 64),
        (64, "max 100000", 64),
        (64, "200000 100000", 2),
        (2, "6400000 100000", 2),
        (64, "50000 100000", 1),
        (64, "nonsense", 64),
        (None, None, 128),
        (None, "200000 100000", 2),
    ],
)
def test_cores_are_those_that_the_process_may_use(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    bound: int | None,
    quota: str | None,
    expected: int,
) -> None:
    """Of a machine of 128; ``bound`` None: on a system that binds no process to cores."""
    monkeypatch.setattr(os, "cpu_count", lambda: 128)
    monkeypatch.setattr(threads, "_QUOTA", tmp_path / "cpu.max")
    if quota is not None:
        (tmp_path / "cpu.max").write_text(quota + "\n", encoding="utf-8")
    if bound is None:
        monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    else:
        monkeypatch.setattr(
            os, "sched_getaffinity", lambda process: set(range(bound)), raising=False
        )
    assert cores() == expected
