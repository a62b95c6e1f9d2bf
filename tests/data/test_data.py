"""Composing training data: boxes, fitted furniture, retargeted heights, windows; and the real
motion files where they are.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.occupancy import occupancy as sensor_occupancy
from dafnet_addon.core.root import AHEAD, RootPath, ahead, root_from_joints, velocities
from dafnet_addon.core.rotations import yaw_matrix
from dafnet_addon.core.skeleton import FEET, HIPS, NECK, OFFSETS, PARENTS, REST, TOE_HEIGHT, joint
from dafnet_addon.core.solids import Box, Scene
from dafnet_addon.data.capture.mocap import Clip, read_clips
from dafnet_addon.data.dataset.motions import read_motions, write_motions
from dafnet_addon.data.dataset.windows import draw_window
from dafnet_addon.data.furnish import boxes as b
from dafnet_addon.data.motion.canonical import LEG, calibrate, canonical, pose_legs
from dafnet_addon.data.motion.motion import mirrored, motion_of
from dafnet_addon.data.motion.rests import resting
from kit.motion_files import write_compact
from kit.places import MOCAP

BONES = np.linalg.norm(OFFSETS[1:], axis=1)


def _lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, 1:] - joints[:, list(PARENTS[1:])], axis=-1)


def _sit_down(seated: float = 0.55, frames: int = 150) -> np.ndarray:
    """A made-up sit-down on the canonical body: the pelvis goes back and down, legs by two-bone IK,
    then rests.
    """
    t = np.clip((np.arange(frames) - 40) / 40, 0, 1)
    ease = (t * t * (3 - 2 * t))[:, None]
    arms_down = REST.copy()
    for side, sign in (("left_", -1), ("right_", 1)):
        hanging = np.array([sign * 0.05, 0.0, -np.sqrt(0.26**2 - 0.05**2)])
        arms_down[joint(side + "elbow")] = REST[joint(side + "shoulder")] + hanging
        arms_down[joint(side + "wrist")] = arms_down[joint(side + "elbow")] + np.array(
            [0.0, 0.15, -0.2]
        )
    joints = np.repeat(arms_down[None], frames, axis=0)
    legs = [joint(s + n) for s in ("left_", "right_") for n in ("ankle", "foot")]
    feet = joints[:, legs].copy()
    joints += np.array([0.0, -0.42, seated - REST[0, 2]]) * ease[..., None]
    joints[:, legs] = feet
    knees = [joint("left_knee"), joint("right_knee")]
    joints[:, knees] += np.array([0.0, 0.4, 0.2]) * ease[..., None]
    return pose_legs(joints)


def test_occupancy_of_upright_boxes_is_the_sensors():
    rng = np.random.default_rng(0)
    rows = rng.uniform((-1, -1, 0.1, 0.05, 0.05, 0.05, -3), (1, 1, 1.2, 0.6, 0.6, 0.6, 3), (6, 7))
    path = RootPath(np.c_[rng.uniform(-0.5, 0.5, (20, 2)), np.zeros(20)], rng.uniform(-3, 3, 20))
    scene = Scene(tuple(Box(r[:3], r[3:6], yaw_matrix(np.array(r[6]))) for r in rows))
    assert np.abs(b.occupancy(rows, path) - sensor_occupancy(scene, path)).max() < 1e-5


def test_box_distances_are_exact():
    row = b.placed(b.box((0, 0, 0.5), (0.4, 0.2, 1.0))[None], np.array([1.0, 2.0]), np.pi / 2)
    points = np.array([[1.0, 2.0, 0.5], [1.0, 2.5, 0.5], [1.4, 2.0, 0.5], [1.0, 2.0, 2.0]])
    assert np.allclose(b.distances(row, points)[0], [-0.1, 0.3, 0.3, 1.0])


def test_a_mirror_swaps_sides_and_is_its_own_inverse():
    joints = _sit_down()
    joints[:, joint("left_wrist"), 2] += 0.3
    other = mirrored(joints)
    assert np.allclose(mirrored(other), joints)
    assert np.allclose(other[:, joint("right_wrist"), 2], joints[:, joint("left_wrist"), 2])
    assert (root_from_joints(other).yaw + root_from_joints(joints).yaw).max() < 1e-9


def test_windows_hold_the_motion_they_were_drawn_from():
    motion = motion_of("made up", "test", "nobody", "sit_down", _sit_down())
    rng, drawn = np.random.default_rng(1), 0
    for _ in range(30):
        window = draw_window(rng, motion, focus=100)
        if window is None:
            continue
        drawn += 1
        joints = window.poses.reshape(80, 22, 3)
        assert np.abs(_lengths(joints) - BONES).max() < 0.03, (
            "turning and mirroring keep lengths; re-timing nearly"
        )
        assert joints[..., 2].min() > TOE_HEIGHT - 0.03 and window.boxes.shape == (b.MOST, 7)
        path = RootPath(np.c_[window.root[:, :2], np.zeros(70)], window.root[:, 2])
        assert b.occupancy(window.boxes, path).max() > 0.8, "a seat is seen"
        assert np.abs(velocities(path)[1:] - window.velocity[11:]).max() < 1e-9, (
            "the root moves as it is said to"
        )
        whole = len(path) - max(AHEAD)  # frames, all of whose way ahead is in the window
        assert np.abs(ahead(path)[:whole] - window.ahead[:whole]).max() < 1e-9, (
            "and goes where it is said to"
        )
    assert drawn > 15


def test_motions_come_back_from_their_file(tmp_path):
    motion = motion_of("made up", "test", "nobody", "sit_down", _sit_down())
    draws = {"sit": (np.array([[0, 90], [0, 100]]), np.array([0.25, 0.75]))}
    write_motions(tmp_path / "m.npz", [motion], draws)
    (again,), moments = read_motions(tmp_path / "m.npz")
    assert (
        np.abs(again.joints - motion.joints).max() <= 0.00051
        and (again.valid == motion.valid).all()
    )
    assert [(r.start, r.end, r.yaw) for r in again.rests] == [
        (r.start, r.end, r.yaw) for r in motion.rests
    ]
    assert (moments["sit"][0] == draws["sit"][0]).all() and (
        moments["sit"][1] == draws["sit"][1]
    ).all()


def test_a_canonical_body_keeps_planted_toes():
    joints = _sit_down()
    clip = Clip("made up", "test", "nobody", "", "sit_down", "train", "none", joints * 1.1)
    body = calibrate([clip])
    out = canonical(clip, body)
    assert abs(body.scale - LEG / (LEG * 1.1)) < 1e-3
    assert np.abs(_lengths(out) - BONES).max() < 1e-6
    toe = joint("left_foot")
    assert (
        np.abs(np.diff(out[:, toe, :2], axis=0)).max() < 2e-3
        and abs(np.median(out[:, toe, 2]) - TOE_HEIGHT) < 0.01
    )


def test_a_folder_without_motion_is_refused(tmp_path):
    with pytest.raises(InputError, match="no motion files"):
        list(read_clips(tmp_path))


@pytest.fixture(scope="module")
def real_clips():
    return [c for c in read_clips(MOCAP) if c.source in ("rocketbox", "ui_prmd")]


@pytest.mark.mocap
def test_real_sit_downs_become_canonical(real_clips):
    clips = [c for c in real_clips if c.source == "rocketbox" and c.subject == "male"]
    body = calibrate(clips)
    for clip in (c for c in clips if c.category == "sit_down"):
        joints = canonical(clip, body)
        assert np.abs(_lengths(joints) - BONES).max() < 1e-6
        assert 0.88 < joints[0, 0, 2] < 1.0 and joints[-1, 0, 2] < 0.7
        (rest, *_) = resting(joints, root_from_joints(joints))
        assert rest.end - rest.start >= 8


@pytest.mark.mocap
def test_real_windows_are_in_the_roots_frame(real_clips):
    clips = [c for c in real_clips if c.source == "rocketbox" and c.subject == "male"]
    body = calibrate(clips)
    clip = next(c for c in clips if c.category == "sit_down")
    motion = motion_of(clip.name, clip.source, clip.subject, clip.category, canonical(clip, body))
    rng = np.random.default_rng(0)
    windows = [
        w
        for w in (draw_window(rng, motion, motion.rests[0].start) for _ in range(20))
        if w is not None
    ]
    assert len(windows) > 8
    pelvis = np.stack([w.poses.reshape(80, 22, 3)[:, 0] for w in windows])
    assert np.abs(pelvis[..., :2]).max() < 0.35 and np.abs(np.median(pelvis[..., :2])) < 0.05


def _covers(boxes: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Whether upright boxes (M, 7) lie over or under a place (2,), seen from above."""
    x, y = (place - boxes[:, :2]).T
    turn = boxes[:, 6]
    right, forward = np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x
    return (np.abs(right) < boxes[:, 3]) & (np.abs(forward) < boxes[:, 4])


def test_a_seat_that_is_used_later_is_there_before():
    down = _sit_down()
    joints = np.concatenate([np.repeat(down[:1], 60, axis=0), down])
    motion = motion_of("a", "b", "c", "sit-stand", joints)
    rng, seen, standing = np.random.default_rng(0), 0, 0
    for _ in range(40):
        window = draw_window(rng, motion, 40)
        if window is None:
            continue
        pelvis = window.poses.reshape(80, 22, 3)[:, 0, 2]
        if pelvis.min() < 0.9:
            continue  # sits in it, or was turned round in time
        standing += 1
        x, y, yaw = window.root[0]
        place = np.array([x + 0.42 * np.sin(yaw), y - 0.42 * np.cos(yaw)])  # where it will sit
        seen += _covers(window.boxes, place).any()
    assert standing > 20 and seen > 0.8 * standing


@pytest.fixture(scope="module")
def real_motions():
    """All motions that are used, by split."""
    from dafnet_addon.data.dataset.usable import load_motions

    return {"train": load_motions(MOCAP, "train"), "test": load_motions(MOCAP, "choose", "tell")}


@pytest.mark.mocap
def test_the_split_is_by_body(real_motions):
    from dafnet_addon.data.dataset.splits import TRAINED_ON_PARTLY

    train, test = (
        {f"{m.source}/{m.subject}" for m in real_motions[split]} for split in ("train", "test")
    )
    both = {
        body
        for body in train & test
        if body not in TRAINED_ON_PARTLY and body.split("/")[0] not in TRAINED_ON_PARTLY
    }
    assert not both and not any(body.startswith("hdm05") for body in train)


@pytest.mark.mocap
def test_a_dataset_is_made_and_gone_on_with(tmp_path):
    pytest.importorskip("matplotlib", reason="previews are drawn with it")
    from dafnet_addon.data.dataset.prepare import load_pool, prepare

    folder, out = tmp_path / "mocap", tmp_path / "dataset"
    folder.mkdir()
    (folder / "rocketbox.npz").symlink_to(MOCAP / "rocketbox.npz")
    prepare(folder, out, windows=24)
    pool = load_pool([out / "pool-0000.npz"])
    assert pool["poses"].shape == (24, 80, 66) and pool["poses"].dtype == np.int16
    assert {"walk", "stand"} & set(pool["kinds"]) and {"approach", "descend", "sit"} & set(
        pool["kinds"]
    )
    described = json.loads((out / "dataset.json").read_text(encoding="utf-8"))
    assert described["train"] == ["rocketbox/male"] and described["held_out"] == [
        "rocketbox/female"
    ]
    summary = (out / "summary.txt").read_text(encoding="utf-8")
    assert "sit_down" in summary and "MIT" in summary and "minutes" in summary
    assert (
        "no seat" in (out / "fits.txt").read_text(encoding="utf-8")
        and (out / "preview.png").stat().st_size > 10_000
    )
    stamp = (out / "pool-0000.npz").stat().st_mtime_ns
    prepare(folder, out, windows=24)
    assert (out / "pool-0000.npz").stat().st_mtime_ns == stamp, "finished shards are kept"


@pytest.mark.mocap
def test_a_dataset_of_raw_files_needs_a_licence_and_a_held_out_body(tmp_path):
    raw = MOCAP / "raw_samples"
    pytest.importorskip("matplotlib", reason="previews are drawn with it")
    from dafnet_addon.data.dataset.prepare import prepare

    folder, out = tmp_path / "mocap", tmp_path / "dataset"
    folder.mkdir()
    with pytest.raises(InputError, match="no motion files"):
        prepare(folder, out, windows=4)
    for name in ("cmu69_69_02_1.bvh", "accad_male1_B3_walk.bvh"):
        (folder / name).symlink_to(raw / name)
    free = {"licence": "CC0", "category": "locomotion"}
    for stated, lacking in (
        ({}, "test"),
        ({"*": free}, "test"),
        ({"*": {**free, "split": "test"}}, "train"),
    ):
        (folder / "clips.json").write_text(json.dumps(stated), encoding="utf-8")
        with pytest.raises(InputError, match=f"split '{lacking}'.*clips.json"):
            prepare(folder, out, windows=4)
    (out / "test.npz").unlink()
    (folder / "clips.json").write_text(
        json.dumps({"*": free, "accad*": {"subject": "a", "split": "test"}}), encoding="utf-8"
    )
    prepare(folder, out, windows=4)
    assert (out / "pool-0000.npz").exists()
    assert json.loads((out / "dataset.json").read_text(encoding="utf-8"))["held_out"] == ["mocap/a"]


def _over_the_hips(motion) -> np.ndarray:
    """Metres (N,) by which the pelvis is over the hips' middle where a body stands upright."""
    trunk = motion.joints[:, NECK] - motion.joints[:, 0]
    upright = (motion.joints[:, 0, 2] > 0.88) & (
        trunk[:, 2] > 0.97 * np.linalg.norm(trunk, axis=-1)
    )
    return motion.joints[upright, 0, 2] - motion.joints[upright][:, HIPS, 2].mean(1)


@pytest.mark.mocap
@pytest.mark.parametrize("each", ["source", "body"])
def test_the_pelvis_is_over_the_hips_alike_in_all(real_motions, each):
    """Sources put it from 3 cm under to 10 cm over the hips' middle; a seat's height is read off
    it.
    """
    over: dict[str, list[np.ndarray]] = {}
    for motion in [*real_motions["train"], *real_motions["test"]]:
        whose = motion.source if each == "source" else f"{motion.source}/{motion.subject}"
        over.setdefault(whose, []).append(_over_the_hips(motion))
    assert {"mhad", "cmu_fbx", "cmu_daz", "rocketbox", "snu_tiling", "snu_ys2010", "cmu69"} <= {
        whose.split("/")[0] for whose in over
    }
    # CMU's bodies are on one skeleton, and calibrated as one: of an expectant mother 6 mm remain.
    middle, ends = (0.002, 0.01) if each == "source" else (0.007, 0.015)
    measured = 0
    for whose, heights in over.items():
        of_all = np.concatenate(heights)
        if each == "body" and len(of_all) < 30:
            continue  # of one who hardly stands
        measured += 1
        assert abs(np.median(of_all) + OFFSETS[HIPS[0]][2]) < middle, whose
        assert np.abs(np.percentile(of_all, (2, 98)) + OFFSETS[HIPS[0]][2]).max() < ends, whose
    assert measured > (10 if each == "source" else 40)


@pytest.mark.mocap
def test_new_people_sit_as_high_as_their_own_hips_were_captured(real_motions):
    """By body, to 3 cm: what is scaled is the body, and its ankles are brought to one height."""
    clips = [clip for clip in read_clips(MOCAP) if clip.source in ("mhad", "cmu_fbx")]
    bodies: dict[str, list[Clip]] = {}
    for clip in clips:
        bodies.setdefault(clip.subject if clip.source == "mhad" else "CMU", []).append(clip)
    scale = {body: calibrate(own).scale for body, own in bodies.items()}
    captured = {(clip.source, clip.name): clip.joints for clip in clips}
    off: dict[str, list[float]] = {}
    for motion in [*real_motions["train"], *real_motions["test"]]:
        raw = captured.get((motion.source, motion.name))
        if raw is None or not motion.rests:
            continue
        raw = raw * scale[motion.subject if motion.source == "mhad" else "CMU"]
        hips = np.percentile(raw[:, HIPS, 2].mean(1), 20) - np.percentile(raw[:, FEET, 2], 8)
        ours = np.percentile(motion.joints[:, HIPS, 2].mean(1), 20) - TOE_HEIGHT
        off.setdefault(motion.subject, []).append(float(ours - hips))
    assert len(off) > 25
    for body, gaps in off.items():
        assert abs(np.median(gaps)) < 0.03, (body, np.median(gaps))


def _made_up_folder(folder: Path, **more: list[tuple[dict[str, str], np.ndarray]]) -> Path:
    """A folder with a body to train on and one held out, each of whom sits down twice; and ``more``
    archives.
    """
    folder.mkdir()
    for source, split in (("here", "train"), ("there", "test")):
        info = {
            "licence": f"CC0 from {source}",
            "split": split,
            "subject": source,
            "category": "sit_down",
        }
        clips = [
            (info | {"clip": f"{source} {seated}"}, _sit_down(seated)) for seated in (0.5, 0.6)
        ]
        write_compact(folder / f"{source}.npz", clips)
    for source, clips in more.items():
        write_compact(folder / f"{source}.npz", clips)
    return folder


def _count(out: Path) -> list[int]:
    files = sorted(out.glob("pool-*.npz"))
    assert files == sorted(out.glob("pool-????.npz")), "nothing is mistaken for a shard"
    with_kinds = [np.load(file) for file in files]
    return [len(archive["kinds"]) for archive in with_kinds]


@pytest.mark.slow
def test_a_dataset_has_as_many_windows_as_were_asked_for(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib", reason="previews are drawn with it")
    from dafnet_addon.data.dataset import prepare as p

    monkeypatch.setattr(p, "_SHARD", 10)
    folder, out = _made_up_folder(tmp_path / "mocap"), tmp_path / "dataset"
    for wrong in {"windows": 0}, {"windows": 10**9}, {"seed": -1}:
        with pytest.raises(InputError):
            p.prepare(folder, out, **({"windows": 15} | wrong))
        assert not out.exists()
    p.prepare(folder, out, windows=15)
    assert _count(out) == [10, 5]
    described = json.loads((out / "dataset.json").read_text(encoding="utf-8"))
    assert described["windows"] == 15 and described["licences"] == {"CC0 from here": ["here"]}
    kept = {
        name: (out / name).stat().st_mtime_ns
        for name in ("pool-0000.npz", "train.npz", "summary.txt")
    }
    first = np.load(out / "pool-0001.npz")["poses"]
    (out / "pool-0000.part.npz").write_bytes(b"of a run that was killed")
    p.prepare(folder, out, windows=32)
    assert _count(out) == [10, 10, 10, 2] and not list(out.glob("*.part.*"))
    assert kept == {name: (out / name).stat().st_mtime_ns for name in kept}
    assert (np.load(out / "pool-0001.npz")["poses"][:5] == first).all(), (
        "a shard that was too short begins as it did"
    )
    assert json.loads((out / "dataset.json").read_text(encoding="utf-8"))["windows"] == 32
    for asked, said in (
        ({"windows": 15}, "begun with 32 windows"),
        ({"windows": 40, "seed": 1}, "begun with the seed 0"),
    ):
        with pytest.raises(InputError, match=said):
            p.prepare(folder, out, **asked)
    assert _count(out) == [10, 10, 10, 2]


@pytest.mark.slow
def test_what_a_dataset_leaves_out_is_said_and_does_not_stop_it(tmp_path):
    pytest.importorskip("matplotlib", reason="previews are drawn with it")
    from dafnet_addon.data.dataset.prepare import prepare

    known = {"licence": "CC0", "split": "train"}
    lying = _sit_down()[..., [0, 2, 1]] * (1, -1, 1)
    folder, out = tmp_path / "mocap", tmp_path / "dataset"
    _made_up_folder(
        folder,
        lies=[(known | {"clip": "sleep", "subject": "tired", "category": "lying"}, lying)],
        dances=[(known | {"clip": "waltz", "category": "dance"}, _sit_down())],
        cooks=[
            (known | {"clip": "chopOnions", "category": "kitchen_mime"}, _sit_down()),
            (known | {"clip": "hopOverOnions", "category": "kitchen_mime"}, _sit_down()),
        ],
        hops=[(known | {"clip": "hop on", "category": "locomotion"}, _sit_down())],
        unstated=[({"clip": "walk"}, _sit_down())],
        ui_prmd=[
            (
                known | {"clip": "squat down", "category": "sit-stand", "description": ""},
                _sit_down(),
            ),
            (known | {"clip": "sit", "category": "sit-stand"}, _sit_down()),
        ],
    )
    (folder / "torn.npz").write_bytes((folder / "here.npz").read_bytes()[:-700])
    (folder / "torn.bvh").write_text("HIERARCHY", encoding="utf-8")
    prepare(folder, out, windows=4)
    assert _count(out) == [4]
    summary = (out / "summary.txt").read_text(encoding="utf-8")
    assert "kitchen_mime" in summary and "activity 'kitchen_mime'" not in summary
    for said in (
        "torn.npz' cannot be read",
        "torn.bvh' is damaged",
        "'lies/tired' never stands upright",
        "The clip 'sit' of 'ui_prmd' has arms that are not real, and none to borrow",
        "of the activity 'dance', of which no windows are drawn (1 of the clips of dances).",
        "whose name or description says 'hop' (2 of the clips of cooks, hops).",
        "in which no hand keeps a level (it is composed with) (cooks/chopOnions).",
        "or of no stated licence (1 of the clips of unstated).",
    ):
        assert said in summary, said
    described = json.loads((out / "dataset.json").read_text(encoding="utf-8"))
    assert described["licences"] == {"CC0": ["cooks"], "CC0 from here": ["here"]}


def test_motion_that_is_too_short_for_a_window_is_no_endless_search(tmp_path):
    from dafnet_addon.data.dataset.prepare import prepare

    known = {"licence": "CC0", "subject": "a", "category": "standing"}
    standing = np.repeat(_sit_down()[:1], 20, axis=0) + np.linspace(0, 0.8, 20)[:, None, None] * (
        1,
        0,
        0,
    )
    (tmp_path / "mocap").mkdir()
    for split in ("train", "test"):
        write_compact(
            tmp_path / "mocap" / f"{split}.npz", [(known | {"clip": "a", "split": split}, standing)]
        )
    with pytest.raises(InputError, match="no window could be drawn"):
        prepare(tmp_path / "mocap", tmp_path / "dataset", windows=4)
