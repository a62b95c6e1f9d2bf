"""Which joints of a motion file are which: by names, and by where they lie."""

from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.skeleton import JOINTS, PARENTS, REST, joint
from dafnet_addon.data.capture.mocap import read_clips
from dafnet_addon.data.capture.recording import Recording
from dafnet_addon.data.capture.rigs import mapped, rigs
from kit.messages import one_sentence
from kit.motion_files import (
    MIXAMO,
    walk,
    write_bvh,
)


def test_an_unknown_skeleton_names_what_it_lacks(tmp_path):
    names = MIXAMO | {"left_foot": "Zehe", "right_wrist": "Pfote"}
    angles, way = walk(3, "y")
    write_bvh(tmp_path / "a.bvh", angles, way, names=names)
    with pytest.raises(
        InputError, match=r"'mixamo' it lacks lefttoebase, righthand \(for left_foot, right_wrist\)"
    ) as error:
        list(read_clips(tmp_path))
    one_sentence(error)


def test_a_prefix_and_case_do_not_hide_a_skeleton(tmp_path):
    angles, way = walk(3, "y")
    write_bvh(
        tmp_path / "a.bvh",
        angles,
        way,
        names={ours: f"mixamorig:{name.upper()}" for ours, name in MIXAMO.items()},
    )
    assert len(list(read_clips(tmp_path))) == 1


def test_names_alone_do_not_make_a_skeleton(tmp_path):
    angles, way = walk(3, "y")
    swapped = MIXAMO | {"left_knee": "LeftFoot", "left_ankle": "LeftLeg"}
    write_bvh(tmp_path / "a.bvh", angles, way, names=swapped)
    with pytest.raises(InputError, match="does not hang from"):
        list(read_clips(tmp_path))
    recording = Recording(
        tuple(MIXAMO.values()), PARENTS, np.repeat(REST[None], 2, axis=0), REST, 30.0
    )
    recording.positions[:, joint("left_knee")] += (0, 0, 0.3)
    with pytest.raises(InputError, match="thigh"):
        mapped(recording, Path("a.bvh"))


def test_every_map_has_all_joints_with_weights_that_sum_to_one():
    assert {rig.name for rig in rigs()} >= {"cmu", "hdm05", "accad", "mixamo", "smpl", "snu"}
    for rig in rigs():
        assert set(rig.joints) == set(JOINTS) and rig.about
        assert all(
            sum(weights.values()) == pytest.approx(1.0) for weights in rig.joints.values()
        ), rig.name
