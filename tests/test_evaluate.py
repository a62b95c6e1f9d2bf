"""The frozen test: which clips it holds, that no body of it is trained on, that its furniture still fits."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.skeleton import SEAT_TO_PELVIS
from dafnet_addon.data import held_out as h
from dafnet_addon.data.mocap import read_clips

MOCAP = Path(__file__).resolve().parents[2] / "shared" / "data" / "mocap"
needs_mocap = pytest.mark.skipif(not any(MOCAP.glob("*.npz")), reason="the motion files are not here")


@cache
def _clips() -> list[h.HeldClip]:
    return h.held_out(MOCAP)


def test_fingerprint_tells_motions_apart():
    joints = np.random.default_rng(0).normal(size=(30, 22, 3)).cumsum(0) * 0.01
    own = np.array(h.fingerprint(joints))
    assert np.abs(own - h.fingerprint(joints + 1e-5)).max() < 2e-4
    for other in (joints + np.array([0.02, 0, 0]), joints[5:], joints * (-1, 1, 1), joints * 1.05):
        assert np.abs(own - h.fingerprint(other)).max() > 1e-3


def test_a_test_clip_that_is_not_the_frozen_one_is_refused():
    joints = np.random.default_rng(0).normal(size=(40, 22, 3))
    motion = h.Motion("a", "b", "c", "walk", joints, np.ones(40, bool), ())
    frozen = {"name": "b/a", "unseen": True, "start": 5, "frames": 30, "rests": [[0, 10]], "boxes": [[0, 0, 1, 1, 1, 1, 0.5]],
              "fingerprint": h.fingerprint(joints[5:35])}
    clip = h._clip(frozen, motion)
    assert clip.activity == "walk" and clip.body == "b/c" and np.array_equal(clip.joints, joints[5:35])
    assert len(clip.scene.solids) == 1 and (clip.rests[0].start, clip.rests[0].end) == (0, 10)
    with pytest.raises(InputError, match="b/a"):
        h._clip(frozen, replace(motion, joints=joints * 1.1))
    with pytest.raises(InputError, match="b/a"):
        h._clip({**frozen, "frames": 50}, motion)


@needs_mocap
def test_no_body_of_the_unseen_test_clips_is_in_training():
    trained = {f"{clip.source}/{clip.subject}" for clip in read_clips(MOCAP) if clip.split == "train"}
    assert trained.isdisjoint(clip.body for clip in _clips() if clip.unseen)
    assert {clip.body for clip in _clips() if not clip.unseen} <= trained


@needs_mocap
def test_the_frozen_furniture_is_under_those_who_sit():
    clips = _clips()
    assert len(clips) == len(json.loads(h.FROZEN.read_text())["clips"])
    assert sum(len(clip.rests) for clip in clips if clip.unseen) >= 40
    for clip in clips:
        for rest in clip.rests:
            tops = [box.center[2] + box.half_size[2] for box in clip.scene.solids]
            gaps = np.abs(rest.position[2] - SEAT_TO_PELVIS - np.array(tops))
            assert gaps.min() < 0.041, clip.name
