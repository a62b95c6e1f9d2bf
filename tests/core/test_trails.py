"""Lines that are walked along, and what moved as a root: at the speed, the turns and the rests of
people.
"""

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.paths import Stop
from dafnet_addon.core.trails import followed, trail


def test_a_straight_line_is_walked_in_the_time_that_people_take() -> None:
    made = trail(
        np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 4.0]]), speed=1.2, fps=30.0, seconds=1.0, floor=0.5
    )
    assert abs(len(made.path) / 30 - (4.0 / 1.2 + 0.6 * (1 / 1.4 + 1 / 1.2) + 1.0)) < 0.1
    speed = np.linalg.norm(np.diff(made.path.position, axis=0), axis=1) * 30
    assert (
        speed.max() < 1.21
        and speed[0] < 0.2
        and abs(speed[60] - 1.2) < 0.02
        and (speed[-29:] == 0).all()
    )
    assert np.abs(made.path.yaw).max() < 1e-6 and np.abs(made.path.position[:, 0]).max() < 1e-6
    assert (made.path.position[:, 2] == 0.5).all() and np.allclose(
        made.path.position[-1], (0, 4, 0.5), atol=1e-3
    )


def test_corners_are_rounded_and_taken_slowly() -> None:
    corner = trail(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]]), speed=1.4, fps=60.0)
    rate = np.abs(np.diff(corner.path.yaw)) * 60
    speed = np.linalg.norm(np.diff(corner.path.position, axis=0), axis=1) * 60
    assert np.degrees(rate.max()) < 125 and speed[np.argmax(rate)] < 0.9
    assert abs(corner.path.yaw[0] + np.pi / 2) < 0.01 and abs(corner.path.yaw[-1]) < 0.01
    off = np.abs(corner.path.position[:, :2] - (3.0, 0.0)).min(1)
    assert off.max() < 0.12, "it keeps to the line"


def test_one_may_start_elsewhere_or_keep_looking_where_one_looks() -> None:
    line = np.array([[0.0, 1.0], [0.0, 4.0]])
    turned = trail(line, Stop((0.0, 0.0), np.pi, 0.2), fps=30.0)
    assert abs(turned.path.yaw[0] - np.pi) < 1e-9 and abs(np.cos(turned.path.yaw[-1]) - 1.0) < 1e-6
    assert (
        np.allclose(turned.path.position[0, :2], 0.0)
        and np.degrees(np.abs(np.diff(turned.path.yaw)).max() * 30) < 185
    )
    kept = trail(line, yaw=1.0)
    assert np.allclose(kept.path.yaw, 1.0)


@pytest.mark.parametrize(
    "points, speed, words",
    [
        ([[0.0, 0.0], [0.3, 0.0]], 1.0, "only 0.30 m long"),
        ([[0.0, 0.0]], 1.0, "only 0.00 m"),
        ([[0.0, 0.0], [np.nan, 0.0]], 1.0, "not a number"),
        ([[0.0, 0.0], [2.0, 0.0]], 5.0, "People walk at 0.4 to 3.0"),
    ],
)
def test_lines_that_cannot_be_walked_are_refused(
    points: list[list[float]], speed: float, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        trail(np.array(points), speed=speed)


def test_what_moved_becomes_a_root_that_looks_where_it_goes() -> None:
    rng = np.random.default_rng(0)
    there, back = (
        np.linspace(0.0, 3.0, 91)[:, None] * (1.0, 0.0),
        np.linspace(3.0, 0.0, 91)[:, None] * (1.0, 0.0),
    )
    way = np.concatenate([np.zeros((60, 2)), there, np.tile([3.0, 0.0], (75, 1)), back])
    made = followed(way + rng.normal(scale=0.003, size=way.shape), 30.0, yaw=0.5)
    assert len(made.path) == len(way) and np.abs(made.path.position[:, :2] - way).max() < 0.09
    assert [
        (abs(rest.start - a) < 12, abs(rest.stop - 1 - b) < 12)
        for rest, a, b in zip(made.rests, (0, 150), (60, 225), strict=True)
    ] == [(True, True)] * 2
    yaw = made.path.yaw
    assert abs(yaw[5] - 0.5) < 0.05 and abs(yaw[100] + np.pi / 2) < 0.05, "held, then turned"
    assert (
        abs(np.cos(yaw[-20] - np.pi / 2) - 1.0) < 0.01
        and np.degrees(np.abs(np.diff(yaw)).max() * 30) < 161
    )
    rest = made.rests[1]
    assert np.abs(np.diff(made.path.position[rest.start : rest.stop], axis=0)).max() < 5e-3
    with pytest.raises(InputError, match="hardly moves"):
        followed(np.zeros((50, 2)), 30.0)
