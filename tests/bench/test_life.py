"""What ``dafnet bench life`` calls sway and descent is what an eye would."""

import numpy as np

from benchmarks import life
from dafnet_addon.core.series import MODEL_FPS
from dafnet_addon.core.skeleton import FEET, JOINTS, PELVIS


def _walker(aside: float) -> np.ndarray:
    """Joints (T, 22, 3) of one who walks along +y, a step each half a second, and leans so many
    metres to the left while his left foot stands.
    """
    seconds = np.arange(round(6 * MODEL_FPS)) / MODEL_FPS
    joints = np.zeros((len(seconds), len(JOINTS), 3))
    joints[..., 1] = seconds[:, None]
    left = np.sin(2 * np.pi * seconds)
    joints[:, PELVIS, 0] = -aside * left
    for foot, stands in zip(FEET, (left, -left), strict=True):
        joints[:, foot, 1] = np.cumsum(np.where(stands > 0, 0.0, 2.0)) / MODEL_FPS
    return joints


def test_sway_is_told_from_its_opposite() -> None:
    assert life.led_by(_walker(0.02)) > 0.8
    assert life.led_by(_walker(-0.02)) < -0.8


def test_walks_and_descents_are_measured_without_motion_files() -> None:
    report, said = life.measure(None, lambda share: None, noise=[(0.0, 0)])
    assert {each["asked"] for each in report["descents"]} == set(life.ASKED)
    assert all(0.1 < each["took"] < 4.0 for each in report["descents"])
    assert all(0.0 < each["sway"] < 20.0 for each in report["walks"])
    assert "life" not in report and "descents asked at 0.8 s" in said
