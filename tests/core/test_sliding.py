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
