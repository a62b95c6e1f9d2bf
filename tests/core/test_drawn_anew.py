"""Who stays standing before his seat, by the noise that he is drawn with, is drawn anew."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import Box, Controls, Scene, Take, load_weights
from dafnet_addon.core import drawing
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.generate import crowd_steps, takes_steps
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.take import Asked, warnings_of
from dafnet_addon.core.verdict import STANDS

HOT = 4.0
"""A temperature at which some stay standing, whatever the weights."""
SEAT = Box(np.array([0.0, 0.0, 0.225]), np.array([0.22, 0.22, 0.225]), name="Seat")
WALK = route(Stop((-1.0, 2.5), np.pi, 0.4), Stop((0.0, 0.0), 0.0, 2.0, seated=True)).path
SENT = Controls(fps=30, root=WALK.matrices())
DRAWS = tuple(Draw(seed, temperature=HOT) for seed in range(8))


@pytest.fixture(scope="module")
def weights():
    return load_weights()


def _takes(weights, draws: tuple[Draw, ...] = DRAWS) -> list[Take]:
    return run_to_end(takes_steps(Scene((SEAT,)), SENT, weights, draws))


def _stands(take: Take) -> bool:
    return any(each.word == STANDS for each in take.verdict)


def _other_seed(take: Take) -> int | None:
    found = [re.search(r"drawn with (\d+)", each) for each in take.warnings]
    return next((int(each.group(1)) for each in found if each), None)


@pytest.fixture(scope="module")
def once(weights):
    """The takes as they are drawn first."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "_AGAIN", 0)
        return _takes(weights)


@pytest.fixture(scope="module")
def made(weights):
    return _takes(weights)


def test_who_stood_sits_and_is_told_of_it(once, made):
    stood = [_stands(take) for take in once]
    assert any(stood)
    assert sum(map(_stands, made)) < sum(stood)
    for draw, before, take, was_standing in zip(DRAWS, once, made, stood, strict=True):
        assert before.draw == draw and take.draw.seed == (_other_seed(take) or draw.seed)
        if not was_standing:
            assert np.array_equal(take.joints, before.joints) and _other_seed(take) is None
        elif not _stands(take):
            assert _other_seed(take) is not None


def test_the_seed_that_is_named_gives_that_take(weights, made):
    take = next(take for take in made if _other_seed(take) is not None)
    assert take.draw == Draw(_other_seed(take), temperature=HOT)
    (again,) = _takes(weights, (take.draw,))
    assert np.allclose(again.joints, take.joints, atol=1e-4)


def test_in_a_crowd_as_alone(weights, made):
    people = [Asked(SENT, DRAWS[:4]), Asked(SENT, DRAWS[4:])]
    found = run_to_end(crowd_steps(Scene((SEAT,)), people, weights))
    for take, alone in zip([*found[0], *found[1]], made, strict=True):
        assert np.allclose(take.joints, alone.joints, atol=1e-3)
        assert _other_seed(take) == _other_seed(alone)


def test_what_takes_have_to_say_is_said_once(made):
    first, second = (replace(made[0], warnings=said) for said in (("A", "B", "A"), ("B", "C")))
    assert warnings_of([first, second]) == {"A": [0], "B": [0, 1], "C": [1]}


def test_without_noise_nothing_is_drawn_anew(weights, monkeypatch):
    called: list[str] = []

    def counted(name: str) -> None:
        as_it_is = getattr(drawing, name)

        def noted(*given, **more):
            called.append(name)
            return as_it_is(*given, **more)

        monkeypatch.setattr(drawing, name, noted)

    counted("_drawn")
    counted("wanted_steps")
    monkeypatch.setattr(drawing, "_stands", lambda take: True)
    for temperature, times in ((0.0, 1), (1.0, 1 + drawing._AGAIN)):
        called.clear()
        _takes(weights, (Draw(temperature=temperature),))
        assert called.count("_drawn") == times
        assert called.count("wanted_steps") == 1, "what is known of the scene stays"


def test_progress_never_goes_back(weights):
    job, last = takes_steps(Scene((SEAT,)), SENT, weights, DRAWS), 0.0
    for share in job:
        assert last - 1e-9 <= share <= 1.0 + 1e-9
        last = share
    assert last == pytest.approx(1.0)
