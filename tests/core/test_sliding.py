"""Sliding as an eye sees it, beside the paper's count."""

import numpy as np
import pytest

from dafnet_addon import CleanUp, Controls, Scene, generate, load_weights
from dafnet_addon.core.metrics import foot_sliding
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.skeleton import REST
from dafnet_addon.core.sliding import SEEN, slides
from kit.places import ROOT


def standing(frames: int) -> np.ndarray:
    joints = np.tile(REST, (frames, 1, 1))
    joints[..., 2] -= REST[[10, 11], 2].min() - 0.02
    return joints


def test_a_body_that_stands_does_not_slide_and_one_that_glides_does() -> None:
    still = standing(60)
    assert slides(still, 30.0).max() == 0.0
    for speed in (0.2, 0.5, 1.1):
        glides = still.copy()
        glides[:, :, 1] += speed / 30.0 * np.arange(60)[:, None]
        assert slides(glides, 30.0).max() == pytest.approx(speed * 59 / 30.0, rel=0.3)
        assert (slides(glides, 30.0)[10:50] > SEEN).all()
        assert slides(glides, 30.0, floor=-0.5).max() == 0.0, "over the floor"


def test_one_frame_and_none_that_moves_are_nothing() -> None:
    assert slides(standing(1), 30.0).shape == (1, 2)


def test_a_foot_that_goes_where_it_was_asked_to_does_not_slide() -> None:
    """A foot that is drawn over the floor to its target, all along or for a while."""
    glides = standing(90)
    glides[30:50, [7, 10], 1] += np.linspace(0.0, 0.3, 20)[:, None]
    glides[50:, [7, 10], 1] += 0.3
    assert slides(glides, 30.0)[:, 0].max() > 0.2
    target = glides[:, 7].copy()
    assert slides(glides, 30.0, targets={"foot_left": target}).max() == 0.0
    target[:40] = np.nan
    assert slides(glides, 30.0, targets={"foot_left": target}).max() == 0.0, "on the way there"
    target[:70] = np.nan
    assert slides(glides, 30.0, targets={"foot_left": target})[:, 0].max() > 0.2, "before that"
    assert slides(glides, 30.0, targets={"foot_right": glides[:, 8]})[:, 0].max() > 0.2


@pytest.mark.slow
def test_a_take_with_targets_of_feet_does_not_slide_for_them() -> None:
    walked = route(Stop((0.0, 0.0), 0.0, 1.0), Stop((0.0, 2.0), 0.0, 1.5), fps=30.0)
    root = walked.path.matrices()
    place = np.tile([-0.25, 2.1, 0.08], (len(root), 1))
    weights = load_weights(ROOT / "weights_stub" / "dafnet.safetensors")
    plain, asked = (
        generate(
            Scene([]),
            Controls(fps=30.0, root=root, mode="EE", foot_left=target),
            weights,
            clean_up=CleanUp(feet=1.0, reach=1.0),
        )
        for target in (None, place)
    )
    assert asked.metrics["slide_max"] <= plain.raw_metrics["slide_max"]
    assert asked.metrics["slide_max"] < 2.0 * SEEN, "the other foot, at the start"
    assert not [each for each in asked.verdict if "left foot slides" in each.text]


@pytest.mark.slow
def test_a_good_walk_does_not_slide_though_the_paper_counts_its_roll_off() -> None:
    walked = route(Stop((0.0, 0.0), 0.0, 1.0), Stop((0.0, 4.0), 0.0, 1.0), fps=30.0)
    weights = load_weights(ROOT / "weights_stub" / "dafnet.safetensors")
    controls = Controls(fps=30.0, root=walked.path.matrices())
    clean, raw = (
        generate(Scene([]), controls, weights, clean_up=CleanUp(feet=feet)) for feet in (1.0, 0.0)
    )
    assert foot_sliding(clean.joints, 30.0).mean() > 0.2
    assert slides(clean.joints / clean.scale, 30.0).max() < SEEN
    assert slides(raw.joints / raw.scale, 30.0).max() > SEEN
