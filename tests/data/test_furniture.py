"""Furniture found in the motion: what the body uses, pieces that fit it, nothing that cuts it; and
contacts.
"""

import numpy as np
import pytest

from dafnet_addon.core.root import root_from_joints
from dafnet_addon.core.rotations import rotate, yaw_matrix
from dafnet_addon.core.skeleton import REST, SEAT_TO_PELVIS, joint
from dafnet_addon.data.dataset.windows import at_another_desk
from dafnet_addon.data.furnish import furniture
from dafnet_addon.data.furnish.boxes import distances
from dafnet_addon.data.furnish.fits import fit_report
from dafnet_addon.data.furnish.flesh import probes
from dafnet_addon.data.furnish.furniture import fitted, furnished
from dafnet_addon.data.furnish.real_pieces import LIES_OVER
from dafnet_addon.data.furnish.seats import seat_for
from dafnet_addon.data.furnish.shapes import PELVIS_OVER
from dafnet_addon.data.furnish.strays import scattered
from dafnet_addon.data.motion.canonical import pose_legs
from dafnet_addon.data.motion.contacts import CONTACTS, contacts
from dafnet_addon.data.motion.interactions import lying, reaching, stroking, working
from dafnet_addon.data.motion.motion import motion_of
from dafnet_addon.data.motion.rests import resting

FEET = [joint(side + part) for side in ("left_", "right_") for part in ("ankle", "foot")]
TORSO = [
    joint(name)
    for name in ("spine1", "spine2", "spine3", "neck", "head", "left_shoulder", "right_shoulder")
]


def _ease(frames: int, start: int, length: int = 30) -> np.ndarray:
    t = np.clip((np.arange(frames) - start) / length, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _standing(frames: int = 120, walk: float = 0.0) -> np.ndarray:
    """A body that stands with hanging arms, or glides forward by ``walk`` metres in all."""
    pose = REST.copy()
    for side, sign in (("left_", -1), ("right_", 1)):
        pose[joint(side + "elbow")] = pose[joint(side + "shoulder")] + (sign * 0.05, 0.0, -0.255)
        pose[joint(side + "wrist")] = pose[joint(side + "elbow")] + (0.0, 0.06, -0.243)
    joints = np.repeat(pose[None], frames, axis=0)
    joints[:, :, 1] += np.linspace(0.0, walk, frames)[:, None]
    return joints


def _seated(frames: int = 120, pelvis: float = 0.55, down: int = 20) -> np.ndarray:
    """A body that sits down from frame ``down`` on and stays; the arms go with the trunk."""
    joints = _standing(frames)
    ease = _ease(frames, down)[:, None, None]
    feet = joints[:, FEET].copy()
    joints += np.array([0.0, -0.42, pelvis - REST[0, 2]]) * ease
    joints[:, FEET] = feet
    joints[:, [joint("left_knee"), joint("right_knee")]] += np.array([0.0, 0.4, 0.2]) * ease
    return pose_legs(joints)


def _hand_to(joints: np.ndarray, side: str, wrist: np.ndarray) -> np.ndarray:
    """The motion with one wrist at ``wrist`` (T, 3), the elbow by two-bone geometry, hanging below
    the line.
    """
    out = joints.copy()
    shoulder = joints[:, joint(side + "shoulder")]
    line = wrist - shoulder
    far = np.linalg.norm(line, axis=-1, keepdims=True)
    assert (far < 0.51).all(), "the target is out of reach"
    along = (0.26**2 - 0.25**2 + far**2) / (2 * far)
    down = np.array([0.0, 0.0, -1.0]) - line * (-line[:, 2:] / far**2)
    down /= np.linalg.norm(down, axis=-1, keepdims=True)
    out[:, joint(side + "elbow")] = (
        shoulder + line / far * along + down * np.sqrt(np.maximum(0.26**2 - along**2, 0.0))
    )
    out[:, joint(side + "wrist")] = wrist
    return out


def _at_desk(seated: bool = True) -> np.ndarray:
    joints = _seated(down=-40) if seated else _standing()
    t = np.arange(len(joints)) / 30.0
    for side, sign in (("left_", -1), ("right_", 1)):
        wrist = joints[:, 0] + (sign * 0.12, 0.33, 0.24 if seated else 0.15)
        wrist[:, 0] += 0.02 * np.sin(3.0 * t)
        joints = _hand_to(joints, side, wrist)
    return joints


def _at_board() -> np.ndarray:
    """The right wrist writes on the plane y = 0.35, from 1.2 to 1.5 m high."""
    joints = _standing()
    t = np.arange(len(joints)) / 30.0
    wrist = np.stack(
        [0.15 + 0.12 * np.sin(2.0 * t), np.full(len(t), 0.35), 1.35 + 0.12 * np.sin(5.0 * t)],
        axis=-1,
    )
    return _hand_to(joints, "right_", wrist)


def _reach() -> np.ndarray:
    """The right hand leaves the hip, stops at 1.3 m for a second, and comes back."""
    joints = _standing(120)
    there = (_ease(120, 20, 20) - _ease(120, 75, 20))[:, None]
    start = joints[:, joint("right_wrist")]
    return _hand_to(joints, "right_", start * (1 - there) + np.array([0.2, 0.42, 1.30]) * there)


def _lies(height: float = 0.55, frames: int = 60) -> np.ndarray:
    """The rest pose on its back, head along +x, arms beside it, the pelvis at ``height``."""
    pose = _standing(1)[0] - REST[0]
    turned = np.stack([pose[:, 2], pose[:, 0], pose[:, 1]], axis=-1)
    return np.repeat((turned + np.array([0.3, 0.2, height]))[None], frames, axis=0)


def _furnished(seed: int, joints: np.ndarray) -> tuple[np.ndarray | None, str]:
    """The boxes of a room for a motion, or why there are none."""
    room, reason = furnished(np.random.default_rng(seed), joints, root_from_joints(joints))
    return None if room is None else room.boxes, reason


def _turned(joints: np.ndarray, yaw: float) -> np.ndarray:
    return rotate(yaw_matrix(np.array(yaw)), joints) + np.array([2.0, -1.0, 0.0])


MOTIONS = {
    "sits": _seated,
    "seat and desk": _at_desk,
    "table": lambda: _at_desk(False),
    "board": _at_board,
    "shelf": _reach,
    "bed": _lies,
    "walks": lambda: _standing(walk=4.0),
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("yaw", [0.0, 2.1])
def test_no_piece_cuts_the_swept_body(name, yaw, monkeypatch):
    """But for a table that one sits down at closely, which is looked at below."""
    monkeypatch.setattr(furniture, "_CLOSE", 0.0)
    joints, rooms = _turned(MOTIONS[name](), yaw), 0
    for seed in range(12):
        boxes, reason = _furnished(seed, joints)
        assert (boxes is None) == bool(reason)
        if boxes is None or not len(boxes):
            continue
        rooms += 1
        assert (boxes[:, 3:6] > 0).all() and (boxes[:, 2] - boxes[:, 5] > -1e-9).all(), (
            "nothing reaches under the floor"
        )
        # Beds are soft: who lies sinks in.
        assert distances(boxes, joints[:, FEET].reshape(-1, 3)).min() > (
            -0.06 if name == "bed" else -0.03
        )
        trunk = distances(boxes, joints[:, TORSO].reshape(-1, 3)).min()
        assert trunk > (-0.11 if name == "bed" else 0.03), (
            "a joint of the trunk never comes this near"
        )
        assert distances(boxes, joints[:, :1].reshape(-1, 3)).min() > 0.0
    assert rooms >= 6


@pytest.mark.parametrize("pelvis", [0.42, 0.55, 0.80])
def test_seats_are_at_the_right_height(pelvis):
    joints = _seated(pelvis=pelvis)
    path = root_from_joints(joints)
    (rest,) = resting(joints, path)
    points, gaps = probes(joints), []
    for seed in range(60):
        seat = seat_for(np.random.default_rng(seed), rest, points)
        if seat is not None:
            under = np.abs(seat[:, :2] - rest.position[:2]).max(-1) < 1.2
            gaps.append(rest.position[2] - (seat[under, 2] + seat[under, 5])[0])
    assert len(gaps) >= 50
    # How far one sinks in belongs to a kind of seat: each gap is that of one kind, within 2 cm.
    known = np.array(sorted(set(PELVIS_OVER.values())))
    assert np.abs(np.array(gaps)[:, None] - known).min(1).max() <= 0.0201
    assert len({round(g, 4) for g in gaps}) > 40, "every draw is another seat"


def test_chairs_and_desks_are_of_any_combination():
    """Hands that work at one height over every seat work at many, of which desks have."""
    heights = []
    for seed in range(60):
        joints = at_another_desk(np.random.default_rng(seed), _at_desk())
        (use,) = working(joints, root_from_joints(joints))
        heights.append(use.points[:, 2].min())
        assert heights[-1] - joints[use.start, 0, 2] > 0.09, "thighs are between"
    assert np.ptp(heights) > 0.1 and len({round(h, 3) for h in heights}) > 20
    standing = _standing()
    assert at_another_desk(np.random.default_rng(0), standing) is standing


def test_who_works_at_a_desk_has_drawn_the_chair_up_to_it():
    """The way to a seat leads through where its desk is; no motion shows the chair being moved."""
    joints = _at_desk()
    way = np.concatenate([np.linspace(1.2, 0.0, 60), np.zeros(len(joints))])
    walked = np.concatenate([_standing(60), joints])
    walked = walked + way[:, None, None] * np.array([0.0, 1.0, 0.0])
    path, worked = root_from_joints(walked), slice(70, len(walked))
    seen = {"all": slice(None), "work": worked}
    found = {}
    for name, frames in seen.items():
        rooms = [
            fitted(np.random.default_rng(s), walked, path, probes(walked), seen=frames)[0]
            for s in range(12)
        ]
        found[name] = sum(any(k == "desk" and f is not None for k, f in room) for room in rooms)
    assert found["all"] == 0 and found["work"] >= 8


def test_desk_top_lies_under_the_wrists_and_beside_the_seat():
    for seated in (True, False):
        joints = _at_desk(seated)
        path = root_from_joints(joints)
        (use,) = working(joints, path)
        lowest = joints[:, [joint("left_wrist"), joint("right_wrist")], 2].min()
        assert use.end - use.start > 60 and abs(use.points[:, 2].min() - lowest) < 0.01
        found = 0
        for seed in range(12):
            boxes, _ = _furnished(seed, joints)
            if boxes is None:
                continue
            tops = boxes[:, 2] + boxes[:, 5]
            wrists = np.median(joints[:, [joint("left_wrist"), joint("right_wrist")]], axis=0)
            below = [
                i
                for i, row in enumerate(boxes)
                if 0.015 <= lowest - tops[i] <= 0.055
                and (distances(row[None], wrists * (1, 1, 0) + (0, 0, tops[i] - 0.01)) < 0).all()
            ]
            found += bool(below)
        assert found >= 7


def test_hands_that_swing_hang_or_walk_have_no_desk():
    for joints in (_standing(), _standing(walk=4.0), _seated()):
        assert not working(joints, root_from_joints(joints))


def test_board_stands_beyond_the_hand_that_strokes_it():
    joints = _turned(_at_board(), 0.8)
    path = root_from_joints(joints)
    (use,) = stroking(joints, path)
    assert abs(use.yaw - 0.8) < 0.1
    wrists, found = joints[:, joint("right_wrist")], 0
    for seed in range(12):
        boxes, _ = _furnished(seed, joints)
        gaps = distances(boxes, wrists) if boxes is not None and len(boxes) else np.ones((1, 1))
        found += bool(((gaps.min(1) > 0.045) & (gaps.max(1) < 0.1)).any())
    assert found >= 7
    assert not stroking(_standing(), root_from_joints(_standing()))


def test_a_shelf_lies_under_the_hand_that_reached():
    joints = _reach()
    path = root_from_joints(joints)
    (use,) = reaching(joints, path)
    assert 35 < use.start < use.end < 90
    hand, found = use.points.mean(0), 0
    for seed in range(20):
        boxes, _ = _furnished(seed, joints)
        if boxes is not None and len(boxes):
            under = np.abs(boxes[:, 2] + boxes[:, 5] - (hand[2] - 0.055)) < 0.03
            found += bool((under & (distances(boxes, hand[None])[:, 0] < 0.09)).any())
    assert 5 <= found < 20, "most reaches find a shelf, some stay in the air"


def test_a_lying_body_gets_a_bed_and_a_body_on_the_floor_none():
    joints = _lies()
    (use,) = lying(joints)
    assert abs(use.yaw + np.pi / 2) < 0.1, "the head lies along +x"
    for seed in range(8):
        boxes, reason = _furnished(seed, joints)
        assert boxes is not None, reason
        line = joints[0, [joint("pelvis"), joint("spine3")]].mean(0)
        depth = line[2] - (boxes[:, 2] + boxes[:, 5])
        under = distances(boxes, (line - (0, 0, 0.15))[None])[:, 0] < 0.02
        assert (under & (depth >= LIES_OVER - 1e-4) & (depth <= LIES_OVER + 0.0201)).any()
    on_floor = _lies(0.12)
    assert not lying(on_floor)
    boxes, _ = _furnished(0, on_floor)
    assert boxes is not None and (distances(boxes, on_floor[0]).min() > 0.0 if len(boxes) else True)


def test_bending_down_is_no_lying():
    joints = _standing()
    trunk = [j for j in range(22) if j not in (0, 1, 2, 4, 5, 7, 8, 10, 11)]
    offset = joints[:, trunk] - joints[:, :1]
    joints[:, trunk] = joints[:, :1] + np.stack(
        [offset[..., 0], offset[..., 2], 0.1 * offset[..., 2]], axis=-1
    )
    assert not lying(joints)


def test_bowing_on_a_seat_is_no_lying():
    joints = _seated(down=-40)
    upper = [
        joint(name)
        for name in (
            "spine1",
            "spine2",
            "spine3",
            "neck",
            "head",
            "left_shoulder",
            "right_shoulder",
        )
    ]
    offset = joints[:, upper] - joints[:, :1]
    joints[:, upper] = joints[:, :1] + np.stack(
        [offset[..., 0], offset[..., 2], 0.2 * offset[..., 2]], axis=-1
    )
    assert not lying(joints)


def test_who_sits_on_the_edge_and_lies_down_has_one_bed():
    sits = _seated(60, 0.57, down=-40)
    place = sits[-1, 0]
    lies = _turned(_lies(0.55, 60), 0.0)
    lies += place - lies[0, 0] + np.array([0.0, -0.2, -0.02])
    legs = [
        joint(side + part) for side in ("left_", "right_") for part in ("knee", "ankle", "foot")
    ]
    share = _ease(20, 0, 20)[:, None, None]
    over = sits[-1] * (1 - share) + lies[0] * share
    over[:, legs, 2] += 0.15 * np.sin(np.pi * share[..., 0])  # the feet clear the edge
    joints = np.concatenate([sits, over, lies])
    path, found = root_from_joints(joints), 0
    for seed in range(10):
        pieces, missing = fitted(np.random.default_rng(seed), joints, path, probes(joints))
        if not missing:
            found += 1
            (bed,) = [rows for kind, rows in pieces if kind == "bed"]
            assert all(kind != "seat" for kind, _ in pieces)
            assert distances(bed.boxes, (place - (0, 0, SEAT_TO_PELVIS))[None]).min() < 0.1
    assert found >= 4


def test_a_table_stands_close_to_some_who_sit_and_no_root_goes_through_it():
    """Who came along the lane between table and chair has no room to stand, but his root has."""
    joints = _seated(frames=150, down=60)
    aside = np.maximum(1.0 - np.arange(150) / 40.0, 0.0)  # a metre, from the right
    joints[..., 0] += aside[:, None]
    path, near = root_from_joints(joints), []
    (rest,) = resting(joints, path)
    for seed in range(60):
        pieces, _ = fitted(np.random.default_rng(seed), joints, path, probes(joints))
        for kind, desk in pieces:
            if kind == "spare desk" and desk is not None:
                top = desk.boxes[:1]
                at = np.c_[path.position[:, :2], np.full(len(path), top[0, 2])]
                assert distances(top, at).min() > -0.13
                near.append(distances(top, np.array([[*rest.position[:2], top[0, 2]]])).min())
    assert 3 <= sum(gap < 0.4 for gap in near) < len(near)


def test_motion_cut_off_half_way_down_is_not_used():
    joints = _seated(frames=120, down=40)[:58]
    boxes, reason = _furnished(0, joints)
    assert boxes is None and reason == "cut"
    backward = joints[::-1]
    assert _furnished(0, backward)[1] == "cut"


def test_a_seat_that_cannot_be_had_says_so():
    # The body sits down where its own legs had walked through whatever seat there may be.
    joints = _seated(frames=90, down=5)
    through = _standing(frames=60)
    through[:, :, 1] += np.linspace(-1.5, 0.0, 60)[:, None]
    joints = np.concatenate([through, joints])
    boxes, reason = _furnished(0, joints)
    assert boxes is None and reason == "seat"


def test_some_random_pieces_stand_in_the_way():
    joints = _standing(walk=4.0)
    path, points = root_from_joints(joints), probes(joints)
    gaps = []
    for seed in range(40):
        pieces = scattered(np.random.default_rng(seed), points, path, 1)
        if len(pieces):
            gaps.append(distances(pieces, points.reshape(-1, 3)).min())
    close = (np.array(gaps) < 0.33).mean()
    assert len(gaps) > 30 and min(gaps) > 0.06 and 0.3 < close < 0.95


def test_contacts_of_known_motion():
    joints = _seated(frames=150, down=40)
    joints = _hand_to(
        joints,
        "left_",
        np.median(joints[100:, joint("left_wrist")], axis=0)
        + np.where(
            np.arange(150)[:, None] < 100,
            joints[:, joint("left_wrist")] - joints[-1, joint("left_wrist")],
            (0.0, 0.2, 0.15),
        ),
    )
    touch = contacts(joints)
    assert touch.shape == (150, len(CONTACTS)) and touch.dtype == bool
    assert touch[:, :2].all(), "the feet never leave the floor"
    pelvis = touch[:, CONTACTS.index("pelvis")]
    assert not pelvis[:60].any() and pelvis[80:].all()
    left, right = touch[:, CONTACTS.index("left_hand")], touch[:, CONTACTS.index("right_hand")]
    assert not left[:90].any() and left[110:].all() and not right.any(), (
        "the hanging hand touches nothing"
    )


def test_contacts_of_a_step_and_of_noise():
    joints = _standing(frames=60)
    lifted = np.sin(np.pi * np.clip((np.arange(60) - 20) / 20, 0, 1))
    joints[:, [joint("right_ankle"), joint("right_foot")], 2] += 0.15 * lifted[:, None]
    joints[50, joint("left_foot"), 2] += 0.3
    touch = contacts(joints)
    assert touch[:, 0].all(), "one bad frame breaks no contact"
    assert touch[:18, 1].all() and not touch[24:36, 1].any() and touch[43:, 1].all()
    assert not touch[:, 2:].any()


def test_report_counts_what_fits_and_why_not():
    sits = motion_of("sits", "made", "0", "sit-stand", _seated(150, down=60))
    moments = {
        "rest": (np.array([[0, 165]]), np.ones(1)),
        "on the way": (np.array([[0, 60]]), np.ones(1)),
    }
    head, rest, on_the_way = fit_report(
        [sits], moments, np.random.default_rng(0), count=10
    ).splitlines()
    columns = head.split()
    assert columns[:6] == ["moments", "of", "used", "no", "seat", "no"] and rest.split()[:2] == [
        "rest",
        "10",
    ]
    assert "10/10" in rest, "a seat for every one of the ten"
    assert on_the_way.split()[3:7] == ["0", "0", "0", "10"], "all are cut off half-way down"
