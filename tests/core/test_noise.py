"""The noise that takes are made of: what lasts, what comes and goes, and how they are drawn."""

from dataclasses import replace

import numpy as np

from dafnet_addon import Controls, Scene, generate, load_weights
from dafnet_addon.core.noise import TAPS, TakeNoise
from dafnet_addon.core.skeleton import POSE_SIZE, UPPER_THEN_LOWER, WRISTS
from dafnet_addon.core.weights import Weights


def _living(passing: float = 0.9, lasting: float = 0.4) -> TakeNoise:
    """Whose values go by with a half-life of a few frames."""
    taps = np.exp(-np.abs(np.arange(TAPS) - TAPS // 2) / 4.0)
    taps = np.tile(taps / np.linalg.norm(taps), (POSE_SIZE, 1))
    return TakeNoise(lasting * np.eye(POSE_SIZE), passing * np.eye(POSE_SIZE), taps)


def test_it_varies_as_its_matrices_and_filters_say():
    noise = _living()
    takes = np.stack([noise.draw(200, seed) for seed in range(60)])
    assert abs(takes.std() - np.hypot(0.9, 0.4)) < 0.02
    assert abs(takes.mean(axis=1).std() - np.hypot(0.4, 0.9 / np.sqrt(200 / 15))) < 0.05

    moving = takes - takes.mean(axis=1, keepdims=True)
    follows = (moving[:, 5:] * moving[:, :-5]).mean() / (moving**2).mean()
    expected = (noise.taps[0, 5:] * noise.taps[0, :-5]).sum()
    assert abs(follows - expected) < 0.05


def test_a_longer_take_begins_like_a_shorter_one():
    noise = _living()
    assert np.allclose(noise.draw(300, 7)[:100], noise.draw(100, 7), atol=1e-12)


def test_each_part_has_a_seed_and_a_temperature_of_its_own():
    noise = _living()
    both, legs = noise.draw(50, 1), noise.draw(50, 1, lower_seed=2)
    assert (
        np.allclose(both[:, :42], legs[:, :42]) and not np.isclose(both[:, 42:], legs[:, 42:]).any()
    )
    hot = noise.draw(50, 1, temperature=0.0, lower_temperature=2.0)
    assert (hot[:, :42] == 0.0).all() and np.allclose(hot[:, 42:], 2.0 * both[:, 42:])


def test_the_paper_holds_one_vector():
    drawn = TakeNoise.standard_normal().draw(20, 3)
    assert (drawn == drawn[0]).all() and 0.7 < drawn[0].std() < 1.3


def test_held_noise_is_what_lasts_and_nothing_else():
    noise = _living()
    comes_and_goes, held = noise.draw(200, 3), noise.draw(200, 3, held=True)
    assert (held == held[0]).all() and held.shape == comes_and_goes.shape
    assert np.allclose(held[0], noise.draw(1, 3, held=True)[0])
    quiet = TakeNoise(noise.lasting, 0.0 * noise.passing, noise.taps)
    assert np.allclose(held, quiet.draw(200, 3), atol=1e-12)
    legs = noise.draw(200, 3, lower_seed=4, lower_temperature=0.5, held=True)
    assert np.array_equal(legs[:, :42], held[:, :42]) and abs(legs[:, 42:].std() - 0.2) < 0.1


def test_takes_come_and_go_unless_they_are_held():
    weights = load_weights()
    living = _living()
    noise = {}
    for name, columns in UPPER_THEN_LOWER.items():
        noise |= {
            f"{name}.spread": living.lasting[columns, columns].astype(np.float32),
            f"{name}.passing": living.passing[columns, columns].astype(np.float32),
            f"{name}.taps": living.taps[columns].astype(np.float32),
        }
    lively = replace(weights, tensors={**weights.tensors, **noise})
    still = Controls(30.0, np.tile(np.eye(4), (90, 1, 1)))

    def stirs(which: Weights, **how: bool) -> float:
        take = generate(Scene(), still, which, seed=2, temperature=1.0, **how)
        return float(np.abs(np.diff(take.joints[30:, WRISTS], axis=0)).mean())

    assert stirs(lively) > 5.0 * stirs(lively, held=True)
    held = replace(weights, tensors=_without_passing(weights))
    both = (generate(Scene(), still, held, temperature=1.0, held=each) for each in (False, True))
    assert np.array_equal(*(take.joints for take in both)), "such weights hold it anyway"


def _without_passing(weights: Weights) -> dict[str, np.ndarray]:
    """The tensors of weights that were exported before takes came and went."""
    return {
        name: tensor
        for name, tensor in weights.tensors.items()
        if not name.endswith((".passing", ".taps"))
    }
