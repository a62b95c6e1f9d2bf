"""Bad frames are cut for their reasons; what is read is counted, and drawn on a sheet."""

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.skeleton import REST, joint
from dafnet_addon.data.capture.cuts import bad_frames, cuts
from dafnet_addon.data.capture.mocap import Clip, read_clips
from dafnet_addon.data.capture.summary import summary
from dafnet_addon.data.dataset.sheet import sheet
from dafnet_addon.data.furnish.boxes import box
from dafnet_addon.data.furnish.flesh import Furnishing
from dafnet_addon.data.motion.canonical import calibrate
from kit.messages import one_sentence
from kit.motion_files import (
    walk,
    write_bvh,
)


def _standing(frames: int) -> np.ndarray:
    """A body with hanging arms that sways a little."""
    joints = np.repeat(REST[None], frames, axis=0)
    for side, x in (("left_", -1), ("right_", 1)):
        shoulder = REST[joint(side + "shoulder")]
        joints[:, joint(side + "elbow")] = shoulder + np.array([0.03 * x, 0, -0.26])
        joints[:, joint(side + "wrist")] = shoulder + np.array([0.05 * x, 0.03, -0.50])
    return joints + 0.01 * np.sin(np.arange(frames) / 9)[:, None, None]


def test_good_frames_are_not_cut():
    assert cuts(_standing(120)) == [] and cuts(_standing(1)) == []


def test_bad_frames_are_cut_for_their_reasons():
    joints = _standing(200)
    joints[:30] = REST + 0.001 * np.sin(np.arange(30) / 9)[:, None, None]
    joints[60:66, joint("left_wrist")] = joints[60, joint("left_wrist")] + (0, 0.3, 0)
    joints[100:, :, :2] *= -1
    joints[150:] += (0.8, 0, 0)
    bad = bad_frames(joints)
    assert bad["T-pose"][:30].all() and not bad["T-pose"][31:].any()
    assert (
        bad["dropout"][60:66].all()
        and not bad["dropout"][70:].any()
        and not bad["dropout"][:55].any()
    )
    assert list(np.flatnonzero(bad["flip"])) == [99, 100]
    assert {149, 150} <= set(np.flatnonzero(bad["speed"]))
    found = cuts(joints)
    assert [c.start for c in found] == sorted(c.start for c in found) and {
        c.reason for c in found
    } == set(bad)


def test_the_summary_counts_minutes_clips_and_cuts(tmp_path):
    angles, way = walk(90, "y")
    write_bvh(tmp_path / "walk_1.bvh", angles, way)
    write_bvh(tmp_path / "walk_2.bvh", angles, way)
    text = summary(read_clips(tmp_path))
    assert (
        "2 clips" in text
        and "locomotion" in text
        and "0.1" in text
        and "2 clips are not trained on" in text
    )
    assert "T-pose" in text, "the rest skeleton is a T-pose, swung a little"


def test_legs_are_measured_standing():
    """Legs from markers measure shorter when bent; a body scaled by that would hover over the floor
    when it stands.
    """
    joints = np.concatenate([_standing(60), _standing(200)])
    hips = [
        j
        for j in range(22)
        if j not in {joint(s + n) for s in ("left_", "right_") for n in ("ankle", "foot")}
    ]
    joints[60:, hips] -= (0.0, 0.0, 0.3)  # lower, with shins as much shorter
    clip = Clip("a", "markers", "s1", "", "sit-stand", "train", "CC0", joints)
    assert calibrate([clip]).scale == pytest.approx(1.0, abs=1e-3)
    lying = Clip(
        "b", "markers", "s1", "", "lying", "train", "CC0", joints[..., [0, 2, 1]] * (1, -1, 1)
    )
    with pytest.raises(InputError, match="'markers/s1' never stands") as error:
        calibrate([lying])
    one_sentence(error)


def test_a_sheet_is_drawn_for_any_length(tmp_path):
    image = pytest.importorskip("matplotlib.image")
    seat = box((0.0, 0.3, 0.4), (0.5, 0.5, 0.05))[None]
    touching = np.ones((30, 5), dtype=bool)
    plain, full = tmp_path / "plain.png", tmp_path / "full.png"
    sheet(plain, [("a pose", REST[None], None), ("a motion", _standing(30), None)], columns=3)
    rows = [("a pose", REST[None], None), ("a motion", _standing(30), Furnishing(seat))]
    sheet(full, rows, columns=3, contacts=[None, touching])
    without, drawn = (image.imread(file)[..., :3] for file in (plain, full))
    assert (np.abs(drawn - without).max(-1) > 0.1).mean() > 0.01, "furniture is drawn too"
    green = [(each[..., 1] - each[..., ::2].max(-1) > 0.2).sum() for each in (without, drawn)]
    assert green[1] > green[0], "contacts are drawn too"
