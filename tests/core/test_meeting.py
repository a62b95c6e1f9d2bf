"""A take with a middle part made anew, and one that begins with motion that is known: no pops."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from dafnet_addon import Box, Controls, InputError, Scene, Take, generate, load_weights
from dafnet_addon.core.cleanup import CleanUp
from dafnet_addon.core.kept_motion import kept_of
from dafnet_addon.core.paths import Stop, route
from dafnet_addon.core.storage import packed, unpacked

CLEAN = CleanUp(feet=1.0, reach=1.0, seat=1.0)
SEAT = Scene([Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.22, 0.22, 0.225]))])


@pytest.fixture(scope="module")
def weights():
    return load_weights()


@pytest.fixture(scope="module")
def controls() -> Controls:
    """Five metres to a seat, and down."""
    way = route(Stop((3.5, 1.2), np.pi / 2), Stop((0.0, 0.0), 0.0, seconds=2.0, seated=True))
    return Controls(fps=30, root=way.path.matrices())


@pytest.fixture(scope="module")
def take(controls, weights) -> Take:
    return generate(SEAT, controls, weights, seed=3, temperature=1.0, clean_up=CLEAN)


def _jolts(joints: np.ndarray) -> np.ndarray:
    """The greatest acceleration of a joint around each inner frame (T - 2,), m/s²."""
    return 900.0 * np.linalg.norm(np.diff(joints, 2, axis=0), axis=-1).max(axis=1)


@pytest.mark.parametrize("share", [0.3, 0.55])
def test_a_middle_part_is_made_anew_and_meets_both_ends(take, controls, weights, share) -> None:
    first = int(share * len(take))
    stop = first + 60
    anew = partial(
        generate,
        SEAT,
        controls,
        weights,
        seed=20,
        temperature=1.0,
        clean_up=CLEAN,
        resume=take,
        resume_frame=first,
        resume_until=stop,
    )
    new = anew()
    assert np.abs(new.poses[: 70 + first] - take.poses[: 70 + first]).max() < 1e-4
    assert np.abs(new.poses[70 + stop :] - take.poses[70 + stop :]).max() < 1e-4
    off = np.linalg.norm(new.joints - take.joints, axis=-1).max(axis=1)
    assert off[first:stop].max() > 0.05, "it is another one"
    own, jolts = _jolts(take.joints), _jolts(new.joints)
    seams = np.r_[jolts[first - 4 : first + 3], jolts[stop - 20 : stop + 3]]
    assert seams.max() < 1.2 * own.max(), "at the seams nothing moves more abruptly than it does"
    assert np.array_equal(anew().joints, new.joints)


@pytest.mark.parametrize(
    ("first", "stop", "words"),
    [(40, 40, "ends at frame 40, before its start"), (40, 10_000, "Frame 10000 is not inside")],
)
def test_a_middle_part_that_is_none_is_refused(take, controls, weights, first, stop, words) -> None:
    with pytest.raises(InputError, match=words):
        generate(SEAT, controls, weights, resume=take, resume_frame=first, resume_until=stop)


@pytest.mark.parametrize(("fps", "enough"), [(60, 3), (120, 7)])
def test_a_middle_part_between_two_frames_of_the_model_is_refused(weights, fps, enough) -> None:
    fast = Controls(fps=fps, root=np.tile(np.eye(4), (40, 1, 1)))
    take = generate(Scene(), fast, weights)
    with pytest.raises(InputError, match=f"between two frames of the model.*{enough} frames"):
        generate(Scene(), fast, weights, resume=take, resume_frame=10, resume_until=11)
    for frame in range(10, 14):
        middle = kept_of(take, frame, frame + enough, fast, take.path).middle
        assert middle is not None and middle[0] < middle[1]


def test_a_root_that_does_not_come_back_is_refused(take, controls, weights) -> None:
    root = controls.root.copy()
    root[60:, 0, 3] += 0.3
    with pytest.raises(InputError, match="no longer goes as in the take"):
        moved = replace(controls, root=root)
        generate(SEAT, moved, weights, resume=take, resume_frame=50, resume_until=100)


def test_a_take_begins_with_the_motion_before_it(take, controls, weights) -> None:
    at = 90
    later = replace(
        controls,
        root=controls.root[at:],
        before=take.joints[at - 70 : at + 1],
        before_root=controls.root[at - 70 : at + 1],
    )
    new = generate(SEAT, later, weights, seed=8, temperature=1.0, clean_up=CLEAN)
    assert np.linalg.norm(new.joints[0] - take.joints[at], axis=-1).max() < 0.03
    jolts = _jolts(np.concatenate([take.joints[:at], new.joints]))
    assert jolts[at - 4 : at + 3].max() < 1.3 * _jolts(take.joints).max()
    _, again = unpacked(packed(new, later))
    assert again.before.shape == (71, 22, 3) and again.before_root.shape == (71, 4, 4)


def test_a_take_begins_with_a_pose(take, controls, weights) -> None:
    """One who sits at first goes on sitting."""
    still = replace(
        controls,
        root=controls.root[-45:],
        before=take.joints[-1:],
        before_root=controls.root[-1:],
    )
    new = generate(SEAT, still, weights)
    assert np.linalg.norm(new.joints[0] - take.joints[-1], axis=-1).max() < 0.03
    assert np.abs(new.joints[:, 0, 2] - take.joints[-1, 0, 2]).max() < 0.06, "it stays down"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"before": np.zeros((1, 22, 3))}, "belong together"),
        ({"before": np.zeros((1, 5, 3)), "before_root": np.eye(4)[None]}, "'before'"),
        ({"before": np.zeros((2, 22, 3)), "before_root": np.eye(4)[None]}, "'before_root'"),
        ({"before": np.zeros((0, 22, 3)), "before_root": np.zeros((0, 4, 4))}, "has no frames"),
    ],
)
def test_what_was_before_is_checked(controls, given, words) -> None:
    with pytest.raises(InputError, match=words):
        replace(controls, **given)


def test_one_who_is_far_from_the_root_does_not_begin_there(take, controls, weights) -> None:
    far = replace(
        controls, before=take.joints[:1] + np.array([2.0, 0.0, 0.0]), before_root=controls.root[:1]
    )
    with pytest.raises(InputError, match=r"The character is 2\.0 m from its root"):
        generate(SEAT, far, weights)
