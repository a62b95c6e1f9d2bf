"""Several people through the network side by side: each as he would be alone."""

from dataclasses import replace

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, Scene, load_weights
from dafnet_addon.core import generate
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.generate import crowd_steps, takes_steps
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.take import Asked

CLEAN = CleanUp(feet=1.0, reach=1.0, seat=1.0)
ROUNDED = 1e-4
"""Metres, or probability of an action, by which single precision may tell somebody in a crowd from
somebody alone.
"""
SEAT = Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.22, 0.22, 0.225]))


def walker(frames: int, fps: float = 30.0, **more: object) -> Controls:
    path = route(Stop((2.0, 0.0), 0.0, 0.2), Stop((2.0, 3.0), 0.0, 1.0), fps=fps).path
    return Controls(fps=fps, root=path.matrices()[:frames], **more)


def sitter(frames: int, **more: object) -> Controls:
    return Controls(fps=30.0, root=np.tile(np.eye(4), (frames, 1, 1)), **more)


def people() -> list[Asked]:
    """Other lengths, sizes, rates, numbers of takes, modes that change, targets that count in
    part.
    """
    head = np.tile([0.0, 0.15, 1.25], (50, 1))
    share = np.linspace(0.0, 1.0, 50)
    led = sitter(50, head=head, mode=("FREE",) * 20 + ("EE",) * 30, head_influence=share)
    return [
        Asked(walker(30), (Draw(1, temperature=1.0),)),
        Asked(led, (Draw(2), Draw(3, temperature=0.5))),
        Asked(walker(40, fps=24.0, scale=0.9), (Draw(4, lower_seed=9, temperature=1.0),)),
        Asked(sitter(20, scale=1.1), (Draw(5, temperature=1.0),)),
    ]


def test_each_is_as_alone_but_for_rounding() -> None:
    scene, weights = Scene([SEAT]), load_weights()
    together = run_to_end(crowd_steps(scene, people(), weights, clean_up=CLEAN))
    assert [len(takes) for takes in together] == [1, 2, 1, 1]
    for asked, takes in zip(people(), together, strict=True):
        job = takes_steps(scene, asked.controls, weights, asked.draws, clean_up=CLEAN)
        for alone, made in zip(run_to_end(job), takes, strict=True):
            assert len(made) == len(asked.controls)
            for name in ("poses", "unchanged", "joints", "action"):
                one, other = getattr(alone, name), getattr(made, name)
                assert one.shape == other.shape
                assert np.abs(one - other).max(initial=0.0) < ROUNDED, name
            assert abs(alone.log_likelihood - made.log_likelihood) < 1e-3
            assert alone.warnings == made.warnings


def test_a_crowd_that_memory_does_not_hold_is_made_in_groups(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene, weights = Scene([SEAT]), load_weights()
    asked = [Asked(walker(10 + k), (Draw(k),)) for k in range(5)]
    whole = run_to_end(crowd_steps(scene, asked, weights))
    monkeypatch.setattr(generate, "_FRAMES_AT_ONCE", 170)  # two of 80 and a few
    parts = run_to_end(crowd_steps(scene, asked, weights))
    for (one,), (other,) in zip(whole, parts, strict=True):
        assert np.abs(one.joints - other.joints).max() < ROUNDED
    assert run_to_end(crowd_steps(scene, [], weights)) == []


def test_who_begins_with_motion_that_is_known_does_so_in_a_crowd() -> None:
    scene, weights = Scene(), load_weights()
    (first,) = run_to_end(takes_steps(scene, walker(60), weights, [Draw(1)]))
    walks = walker(60)
    goes_on = replace(
        walks, root=walks.root[40:], before=first.joints[:41], before_root=walks.root[:41]
    )
    asked = [
        Asked(each, (Draw(k, temperature=1.0), Draw(9)))
        for k, each in enumerate([walker(30), goes_on, walker(25), walker(20)])
    ]
    found = run_to_end(crowd_steps(scene, asked, weights))
    for one, made in zip(asked, found, strict=True):
        alone = run_to_end(takes_steps(scene, one.controls, weights, one.draws))
        for each, other in zip(alone, made, strict=True):
            assert np.abs(each.joints - other.joints).max() < ROUNDED
    assert np.abs(found[1][0].joints[0] - first.joints[40]).max() < 0.03, "in mid-stride"


def test_progress_grows_to_its_end() -> None:
    asked = [Asked(walker(10), (Draw(k),)) for k in range(3)]
    shares = list(crowd_steps(Scene(), asked, load_weights()))
    assert shares == sorted(shares) and shares[0] >= 0.0 and shares[-1] <= 1.0
