"""The frozen test like the paper's: whose motion it is, and that its ground truth walks, sits,
works and stays clear.
"""

import json
from collections import defaultdict
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.metrics import body_points
from dafnet_addon.core.occupancy import distance
from dafnet_addon.core.root import RootPath
from dafnet_addon.core.skeleton import REST, SEAT_TO_PELVIS, joint
from dafnet_addon.data.capture.mocap import read_clips
from dafnet_addon.data.furnish.boxes import box, distances
from dafnet_addon.data.held_out import paper as p
from dafnet_addon.data.held_out.captured import HeldClip, frozen_text
from dafnet_addon.data.motion.contacts import contacts
from dafnet_addon.data.motion.motion import Motion
from kit.places import MOCAP

pytestmark = pytest.mark.mocap
TOES = [joint("left_foot"), joint("right_foot")]
FEET = [*TOES, joint("left_ankle"), joint("right_ankle")]
WRISTS = [joint("left_wrist"), joint("right_wrist")]
SEATS = {  # the heights of seats and desks, metres
    "low chair": (0.38, 0.42),
    "high wide chair": (0.50, 0.55),
    "low chair and desk": (0.38, 0.42),
    "high chair and desk": (0.50, 0.55),
}
DESKS = {"low chair and desk": (0.65, 0.70), "high chair and desk": (0.75, 0.80)}
# metres by which a desk is higher or lower than it should be: it is fitted under the hands
OFF = 0.015


@cache
def _motions() -> dict[str, Motion]:
    return p._unseen(MOCAP)


def _frozen() -> list[dict[str, Any]]:
    clips: list[dict[str, Any]] = json.loads(p.FROZEN.read_text(encoding="utf-8"))["clips"]
    return clips


@cache
def _clips() -> list[HeldClip]:
    motions = _motions()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(p, "_unseen", lambda folder: motions)
        return p.paper_test(MOCAP)


def _over_seat(clip: HeldClip) -> np.ndarray:
    """The pelvis' height in each frame of the rest (N,), metres over the highest box under it."""
    (rest,) = clip.rests
    pelvis = clip.joints[rest.start : rest.end, 0]
    under = [
        row[2] + row[5]
        for row in clip.boxes
        if distances(row[None], rest.position * (1, 1, 0) + (0, 0, row[2])) < 0
    ]
    return pelvis[:, 2] - max(under)


def _desk(clip: HeldClip) -> np.ndarray:
    """The desk's top, the largest box over the seat that lies flat."""
    (rest,) = clip.rests
    flat = clip.boxes[
        (clip.boxes[:, 2] > rest.position[2])
        & (clip.boxes[:, 5] < 0.05)
        & (clip.boxes[:, 3:5].min(1) > 0.08)
    ]
    return flat[np.argmax(flat[:, 3] * flat[:, 4])]


def _hand_gaps(clip: HeldClip, works: int) -> np.ndarray:
    """Distances (2, N) of the wrists to the desk's top, or to the board, from frame ``works``
    on.
    """
    surface = clip.boxes[:1] if clip.room == "whiteboard" else _desk(clip)[None]
    hands = clip.joints[works:, WRISTS]
    return distances(surface, hands.reshape(-1, 3))[0].reshape(-1, 2).T


def _cut(clip: HeldClip) -> float:
    """How deep any bone is in the furniture, metres."""
    return float(-distance(clip.scene, body_points(clip.joints), floor=0.0).min())


def test_all_clips_load_and_say_what_they_are():
    clips = _clips()
    assert len(clips) == len(_frozen()) and len({clip.name for clip in clips}) == len(clips) >= 25
    assert 4000 <= sum(len(clip.joints) for clip in clips) <= 6500
    assert all(clip.composed and clip.unseen for clip in clips)
    assert {clip.room for clip in clips} == {*SEATS, "whiteboard"}
    assert all(
        (clip.activity == "reach") == (clip.room == "whiteboard") == (not clip.rests)
        for clip in clips
    )


def test_no_body_of_training_is_in_it():
    clips = {f"{clip.source}/{clip.name}": clip for clip in read_clips(MOCAP)}
    trained = {f"{clip.source}/{clip.subject}" for clip in clips.values() if clip.split == "train"}
    parts = {
        part: {r[part]["clip"] for r in _frozen() if part in r}
        for part in ("walk", "sit", "upper", "stand")
    }
    assert all(len(names) > 2 for names in parts.values())
    for name in set().union(*parts.values()):
        assert (
            clips[name].split == "test"
            and f"{clips[name].source}/{clips[name].subject}" not in trained
        ), name
        assert clips[name].source not in ("cmu69", "snu_ys2010", "hdm05_cuts"), name
    # UI-PRMD's bodies have arms lent by these.
    lenders = [
        c
        for c in clips.values()
        if c.split == "test" and c.category in ("standing_idle", "seated_chair")
    ]
    assert lenders and trained.isdisjoint(f"{clip.source}/{clip.subject}" for clip in lenders)
    bodies = {clip.body for clip in _clips()}
    assert len(bodies) >= 4 and trained.isdisjoint(bodies)


def test_every_kind_is_approached_from_three_sides():
    sides = defaultdict(set)
    for clip in _clips():
        sides[clip.room].add(p.side_of(clip))
        assert np.linalg.norm(clip.joints[0, 0, :2] - clip.joints[-1, 0, :2]) > 0.9, clip.name
    assert sides["whiteboard"] == {"front", "left", "right"}
    assert all(len(found) >= 3 for found in sides.values()), sides
    assert all({"front", "behind"} < sides[kind] for kind in ("low chair", "high wide chair"))


def test_sides_are_the_furnitures():
    clip = _clips()[0]
    for yaw in (0.0, 2.0):
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        for start, chair, board in (
            ((0.2, 2.0), "front", "behind"),
            ((-0.2, -2.0), "behind", "front"),
            ((2.0, 1.0), "right", "right"),
            ((-2.0, -1.0), "left", "left"),
        ):
            places = np.zeros((60, 3))
            places[0, :2] = turn @ start
            path = RootPath(places + np.array([3.0, 1.0, 0.0]), np.full(60, yaw))
            assert p.side_of(replace(clip, path=path, room="low chair")) == chair
            assert p.side_of(replace(clip, path=path, room="whiteboard")) == board


def test_it_walks_and_stands_on_the_floor():
    for clip in _clips():
        toes = clip.joints[:, TOES]
        assert toes[..., 2].min() > -0.02, clip.name
        over = (clip.joints[:, FEET, 2] - REST[FEET, 2]).min(1)
        assert np.median(over) < 0.02 and np.quantile(over, 0.95) < 0.04, clip.name
        stands = contacts(clip.joints)[:, :2]
        steps = np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1)[stands[1:] & stands[:-1]]
        assert steps.max() < 0.021 and steps.mean() < 0.004, clip.name
        assert np.linalg.norm(np.diff(clip.joints, axis=0), axis=-1).max() * 30 < 5.0, clip.name


def test_it_sits_on_seats_of_the_right_height():
    for clip in _clips():
        if clip.rests:
            over, (low, high) = _over_seat(clip), SEATS[clip.room]
            assert np.abs(over - SEAT_TO_PELVIS).max() < 0.05, clip.name
            top = clip.rests[0].position[2] - np.median(over)
            assert low - 0.01 < top < high + 0.01, clip.name
            assert (
                clip.rests[0].end == len(clip.joints)
                and clip.rests[0].end - clip.rests[0].start >= 45
            )
        if clip.room == "high wide chair":
            assert clip.boxes[0, 3] >= 0.3, clip.name
    with pytest.raises(AssertionError):
        clip = next(clip for clip in _clips() if clip.rests)
        assert (
            np.abs(
                _over_seat(replace(clip, joints=clip.joints + np.array([0, 0, 0.08])))
                - SEAT_TO_PELVIS
            ).max()
            < 0.05
        )


def test_hands_work_on_the_desk_and_at_the_board():
    frozen = {recipe["name"]: recipe for recipe in _frozen()}
    for clip in _clips():
        if clip.room in DESKS:
            desk, (low, high) = _desk(clip), DESKS[clip.room]
            assert low - OFF < desk[2] + desk[5] < high + OFF, clip.name
        if clip.room in DESKS or clip.room == "whiteboard":
            gaps = _hand_gaps(clip, frozen[clip.name]["works"])
            assert gaps.min() > 0.0, clip.name
            assert (gaps.min(0) < 0.15).mean() > 0.9 and np.median(gaps.min(0)) < 0.10, clip.name


def test_the_body_cuts_no_furniture():
    for clip in _clips():
        assert _cut(clip) < 0.011, clip.name
    clip = _clips()[0]
    wall = box((*clip.joints[30, 0, :2], 1.0), (0.1, 0.1, 2.0))
    assert _cut(replace(clip, boxes=np.concatenate([clip.boxes, wall[None]]))) > 0.03


def test_motion_that_is_missing_or_not_the_same_is_refused(monkeypatch, tmp_path):
    recipe = next(recipe for recipe in _frozen() if recipe["kind"] == "low chair and desk")
    walk, sit = recipe["walk"]["clip"], recipe["sit"]["clip"]
    captured = _motions()
    stretched = replace(captured[walk], joints=captured[walk].joints * 1.1)
    shorter = replace(captured[walk], joints=captured[walk].joints[: recipe["walk"]["at"]])
    never = replace(captured[sit], rests=())
    monkeypatch.setattr(p, "FROZEN", tmp_path / "paper_test.json")
    p.FROZEN.write_text(json.dumps({"clips": [recipe]}), encoding="utf-8")
    for changed, told in (
        ({walk: stretched}, "is not the motion"),
        ({walk: shorter}, "is not the motion"),
        ({sit: never}, "is not the motion"),
        ({walk: None}, f"needs '{walk}', which is not in"),
    ):
        motions = {
            name: motion for name, motion in {**captured, **changed}.items() if motion is not None
        }
        monkeypatch.setattr(p, "_unseen", lambda folder, motions=motions: motions)
        with pytest.raises(InputError, match=told):
            p.paper_test(MOCAP)


def test_freezing_is_the_same_again(monkeypatch):
    motions = _motions()
    monkeypatch.setattr(p, "_unseen", lambda folder: motions)
    monkeypatch.setattr(p, "_KINDS", {"whiteboard": replace(p._KINDS["whiteboard"], clips=1)})
    first = p.freeze_paper_test(MOCAP, 5)
    assert first == p.freeze_paper_test(MOCAP, 5) and len(first["clips"]) == 1
    assert first["clips"] != p.freeze_paper_test(MOCAP, 6)["clips"]
    assert json.loads(frozen_text(first)) == first
