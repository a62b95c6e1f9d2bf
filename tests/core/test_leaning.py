"""Who sits leans as far as is asked, softly, and pelvis, feet and hands stay where they are."""

from typing import Any

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, Scene, Take, generate, load_weights
from dafnet_addon.core.errors import InputError
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.skeleton import ANKLES, FEET, HEAD, HIPS, NECK, PELVIS, WRISTS
from dafnet_addon.core.storage import packed, unpacked

CLEAN = CleanUp(feet=1.0, reach=1.0, seat=1.0)
STOOL = Box([0.0, 0.0, 0.22], [0.22, 0.22, 0.22], name="Stool")
ROOM = Scene((STOOL,))
BACK = Box([0.0, -0.25, 0.85], [0.22, 0.03, 0.45], name="Back")
SITS = Stop((0.0, 0.0), 0.0, 3.0, seated=True)


def _made(*, fps: float = 30.0, scene: Scene = ROOM, **more: Any) -> Take:
    way = route(Stop((0.0, 1.6), np.pi, 0.3), SITS, Stop((0.0, 1.6), 0.0, 0.8), fps=fps)
    controls = Controls(fps, way.path.matrices(), **more)
    return generate(scene, controls, load_weights(), clean_up=CLEAN)


@pytest.fixture(scope="module")
def plain() -> Take:
    return _made()


def _back(take: Take) -> np.ndarray:
    """Degrees that the trunk leans back, in each frame."""
    trunk = take.joints[:, NECK] - take.joints[:, PELVIS]
    across = (take.joints[:, HIPS[1]] - take.joints[:, HIPS[0]]) * (1.0, 1.0, 0.0)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    behind = -(trunk * np.cross((0.0, 0.0, 1.0), across)).sum(axis=-1)
    return np.degrees(np.arctan2(behind, trunk[:, 2]))


def _sits(take: Take) -> slice:
    """The frames in which a lean has come."""
    low = np.flatnonzero(take.joints[:, PELVIS, 2] < 0.62)
    ease = round(1.1 * take.fps)
    return slice(int(low[0]) + ease, int(low[-1]) - ease)


def _moved(take: Take, plain: Take) -> np.ndarray:
    return np.linalg.norm(take.joints - plain.joints, axis=-1)


@pytest.mark.parametrize("lean", [-20.0, 12.0, 35.0])
def test_the_trunk_leans_as_far_as_is_asked_and_the_rest_stays(plain: Take, lean: float) -> None:
    take = _made(lean=lean)
    sits = _sits(plain)
    assert sits.stop - sits.start > 40
    assert np.abs(_back(take) - _back(plain) - lean)[sits].max() < 3.0
    moved = _moved(take, plain)
    assert moved[:, [PELVIS, *ANKLES, *FEET]].max() < 1e-3
    stands = plain.joints[:, PELVIS, 2] > 0.85
    assert stands[:60].all() and stands[-20:].all() and moved[stands].max() < 1e-3
    assert take.metrics["jerk"] < 1.1 * plain.metrics["jerk"]
    assert np.abs(np.diff(_back(take) - _back(plain))).max() * 30.0 < 60.0, "degrees a second"
    assert not [each for each in take.verdict if each.word.startswith("leans")]


def test_the_face_stays_more_level_than_the_trunk(plain: Take) -> None:
    take, sits = _made(lean=30.0), _sits(plain)

    def up(made: Take) -> np.ndarray:
        crown = made.joints[sits, HEAD] - made.joints[sits, NECK]
        return np.degrees(np.arctan2(np.linalg.norm(crown[:, :2], axis=-1), crown[:, 2]))

    assert np.abs(up(take) - up(plain)).max() < 16.0


def test_at_any_rate(plain: Take) -> None:
    slow = _made(fps=24.0)
    take, sits = _made(fps=24.0, lean=15.0), _sits(slow)
    assert np.abs(_back(take) - _back(slow) - 15.0)[sits].max() < 3.0


def test_a_lean_may_change(plain: Take) -> None:
    sits = _sits(plain)
    middle = (sits.start + sits.stop) // 2
    lean = np.where(np.arange(len(plain)) < middle, 0.0, 25.0)
    leans = _back(_made(lean=lean)) - _back(plain)
    assert abs(leans[middle - 30]) < 1.0 and abs(leans[middle + 28] - 25.0) < 3.0
    assert np.abs(np.diff(leans)).max() * 30.0 < 60.0


def test_hands_and_the_head_stay_on_their_targets(plain: Take) -> None:
    places = {"hand_left": WRISTS[0], "hand_right": WRISTS[1]}
    sits, wrists = _sits(plain), {}
    for name, at in places.items():
        wrists[name] = np.full((len(plain), 3), np.nan)
        wrists[name][sits] = plain.joints[sits, at].mean(axis=0) + np.array([0.0, 0.03, 0.15])
    upright, take = (_made(mode="EE", lean=lean, **wrists) for lean in (0.0, 15.0))
    for name, at in places.items():
        assert np.linalg.norm(take.joints[:, at] - wrists[name], axis=-1)[sits].max() < 0.01
    assert np.abs(_back(take) - _back(upright) - 15.0)[sits].max() < 7.0
    assert take.metrics["jerk"] < 1.1 * upright.metrics["jerk"]

    head = plain.joints[:, HEAD].copy()
    held = _made(mode="EE", lean=25.0, head=head)
    assert np.linalg.norm(held.joints[:, HEAD] - head, axis=-1)[sits].max() < 0.01
    assert any("a target holds it" in each.text for each in held.verdict)


def test_a_chair_s_back_ends_a_lean_and_that_is_said(plain: Take) -> None:
    chair = Scene((STOOL, BACK))
    upright, take, sits = _made(scene=chair), _made(scene=chair, lean=35.0), _sits(plain)
    assert 5.0 < np.median((_back(take) - _back(upright))[sits]) < 25.0
    assert take.joints[sits, NECK, 1].min() > -0.22, "before it"
    (said,) = [each for each in take.verdict if each.word.startswith("leans")]
    assert not said.good and "instead of 35°" in said.text and "'Back' is there" in said.text
    assert take.metrics["penetration_max"] <= upright.metrics["penetration_max"] + 0.005
    ahead = _made(scene=chair, lean=-10.0)
    assert not [each for each in ahead.verdict if each.word.startswith("leans")]


def test_none_is_as_without_it_and_the_file_keeps_one(plain: Take) -> None:
    none = _made(lean=0.0)
    assert np.array_equal(none.joints, plain.joints), "to the last bit"
    lean = np.linspace(-20.0, 35.0, len(plain))
    controls = unpacked(packed(plain, Controls(30.0, plain.root, lean=lean)))[1]
    assert controls.lean is not None and np.allclose(controls.lean, lean, atol=1e-5)


@pytest.mark.parametrize(
    ("lean", "said"),
    [
        (50.0, "leaves -20 to 35 degrees"),
        ([0.0, np.nan, 0.0, 0.0], "not a number"),
        ([0.0] * 3, "has the shape"),
        ("far", "other than numbers"),
    ],
)
def test_a_lean_that_nobody_can_is_refused(lean: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Controls(30.0, np.tile(np.eye(4), (4, 1, 1)), lean=lean)
