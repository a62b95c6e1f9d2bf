"""Long jobs as generators, and the one BLAS thread that their small steps run on."""

from collections.abc import Generator

import numpy as np
import pytest

from dafnet_addon.core.progress import drained, within
from dafnet_addon.core.threads import _openblas, one_thread


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
    assert drained(_job([]), seen.append) == "result" and seen == [0.0, 0.5, 1.0]


def test_a_part_of_a_job_keeps_to_its_share_and_hands_on_its_result():
    def whole() -> Generator[float, None, str]:
        return (yield from within(_job([]), 0.2, 0.4))

    seen: list[float] = []
    assert drained(whole(), seen.append) == "result" and np.allclose(seen, [0.2, 0.3, 0.4])


def test_closing_a_job_closes_its_part():
    closed: list[bool] = []
    part = within(_job(closed), 0.0, 1.0)
    next(part)
    part.close()
    assert closed == [True]


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
