"""Measures of life, on motions whose answers are known."""

import numpy as np
import pytest

from dafnet_addon.core import liveliness
from dafnet_addon.core.skeleton import REST, joint

FPS = 30.0


def _still(frames: int) -> np.ndarray:
    return np.repeat(REST[None], frames, axis=0)


def test_a_statue_has_no_life() -> None:
    for joints in liveliness.LIVELY.values():
        assert liveliness.speed(_still(90), FPS, joints) == 0.0
        assert max(liveliness.band_speeds(_still(360), FPS, joints).values()) < 1e-9


@pytest.mark.parametrize(("hertz", "band"), [(0.5, "slow"), (2.0, "middle"), (5.0, "quick")])
def test_speeds_lie_in_the_band_of_their_frequency(hertz: float, band: str) -> None:
    joints = _still(600)
    t = np.arange(600) / FPS
    joints[:, joint("head"), 0] += 0.02 * np.sin(2 * np.pi * hertz * t)
    found = liveliness.band_speeds(joints, FPS, liveliness.LIVELY["head"])
    expected = 0.02 * 2 * np.pi * hertz / np.sqrt(2.0)
    assert abs(found[band] - expected) < 0.05 * expected
    assert sum(value for name, value in found.items() if name != band) < 0.1 * expected


def test_a_motion_that_is_too_short_for_a_band_says_nothing_of_it() -> None:
    found = liveliness.band_speeds(_still(60), FPS, liveliness.LIVELY["head"])
    assert np.isnan(found["slow"]) and found["quick"] < 1e-9


@pytest.mark.parametrize("heading", [0.0, 1.1])
def test_sway_is_what_goes_to_and_fro_across_the_way(heading: float) -> None:
    joints = _still(300)
    t = np.arange(300) / FPS
    along, across = 1.2 * t, 0.02 * np.sin(2 * np.pi * 1.0 * t)
    c, s = np.cos(heading), np.sin(heading)
    joints[..., 0] += (c * along - s * across)[:, None]
    joints[..., 1] += (s * along + c * across)[:, None]
    assert abs(liveliness.sway(joints, FPS) - 0.04) < 0.005
    assert np.isnan(liveliness.sway(_still(300), FPS)), "who stands does not sway in walking"


@pytest.mark.parametrize("seconds", [0.6, 1.3, 2.0])
def test_a_descent_takes_as_long_as_it_takes(seconds: float) -> None:
    joints = _still(200)
    start, frames = 60, round(seconds / 0.8 * FPS)
    share = np.clip((np.arange(200) - start) / frames, 0.0, 1.0)
    joints[..., 2] -= (0.4 * share)[:, None]
    assert abs(liveliness.descent(joints, FPS, start + frames) - seconds) < 0.08
    assert np.isnan(liveliness.descent(_still(200), FPS, 100))


def test_leaning_back_is_negative() -> None:
    joints = _still(3)
    trunk = joints[:, joint("neck")] - joints[:, 0]
    length = np.linalg.norm(trunk, axis=-1)
    for degrees in (-25.0, 30.0):
        angle = np.radians(degrees)
        joints[:, joint("neck")] = joints[:, 0] + length[:, None] * (
            0.0,
            np.sin(angle),
            np.cos(angle),
        )
        assert np.allclose(np.degrees(liveliness.lean(joints, np.array([[0.0, 1.0]] * 3))), degrees)
