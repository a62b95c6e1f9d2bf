"""Readers of motion capture: what is written with a known answer is read back; what is damaged is
refused in one sentence.
"""

import json
import os
import tracemalloc
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZIP_LZMA, ZipFile

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.rotations import rotate
from dafnet_addon.core.skeleton import JOINTS, PARENTS, REST, TOE_HEIGHT, joint
from dafnet_addon.data.acclaim import read_amc, read_asf
from dafnet_addon.data.amass import read_amass
from dafnet_addon.data.boxes import box
from dafnet_addon.data.bvh import read_bvh
from dafnet_addon.data.canonical import calibrate
from dafnet_addon.data.cuts import bad_frames, cuts
from dafnet_addon.data.flesh import Furnishing
from dafnet_addon.data.mocap import UNSTATED, Clip, read_clips
from dafnet_addon.data.recording import Recording, posed, rotation_about
from dafnet_addon.data.rigs import mapped, rigs
from dafnet_addon.data.sheet import sheet
from dafnet_addon.data.summary import summary
from dafnet_addon.data.world import at_model_rate, floor_height, unit_of
from kit.motion_files import (
    MIXAMO,
    VICON,
    Y_UP,
    walk,
    write_amc,
    write_asf,
    write_bvh,
    write_compact,
)
from kit.places import MOCAP, RAW


def test_an_axis_turns_as_it_should():
    quarter = np.radians(90)
    for axis, start, end in (
        ("x", [0, 1, 0], [0, 0, 1]),
        ("y", [0, 0, 1], [1, 0, 0]),
        ("z", [1, 0, 0], [0, 1, 0]),
    ):
        assert np.allclose(
            rotate(rotation_about(axis, np.array(quarter)), np.array(start, float)), end
        )


@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YZX"])
def test_bvh_positions_are_those_of_its_angles(tmp_path, order):
    angles, way = walk(12, "y")
    angles *= 8
    truth = write_bvh(tmp_path / "a.bvh", angles, way, order, unit=0.0254)
    recording = read_bvh(tmp_path / "a.bvh")
    assert recording.rate == 30.0 and recording.names.count("LeftHand end") == 1
    joints, rest = mapped(recording, tmp_path / "a.bvh")
    assert np.abs(joints * 0.0254 - truth).max() < 1e-6
    assert (
        np.abs((rest[12] - rest[0]) * 0.0254 - (REST[12] - REST[0])[Y_UP[0]] * Y_UP[1]).max() < 1e-6
    )


@pytest.mark.parametrize(
    ("up", "unit", "fps"), [("y", 0.01, 120), ("z", 1.0, 30), ("y", 0.0254, 24), ("z", 0.001, 60)]
)
def test_units_way_up_and_rate_are_found(tmp_path, up, unit, fps):
    frames = 2 * fps + 1
    angles, way = walk(frames, up)
    truth = write_bvh(tmp_path / "walk.bvh", angles, way, fps=fps, unit=unit, up=up)
    (clip,) = read_clips(tmp_path)
    truth = truth if up == "z" else truth[..., [0, 2, 1]] * (1, -1, 1)
    assert len(clip.joints) == 61
    read = clip.joints[::30] - clip.joints[0, 0]
    assert np.abs(read - (truth[::fps] - truth[0, 0])).max() < 1e-5, (
        "whole seconds are whole frames in both"
    )


def test_a_lying_body_shares_the_way_up_of_the_others_in_its_folder(tmp_path):
    angles, way = walk(60, "y")
    write_bvh(tmp_path / "walk.bvh", angles, way)
    lying = angles * 0
    lying[:, 0, 0] = 90.0  # on its face: the head lies along +z
    lying_truth = write_bvh(tmp_path / "lie.bvh", lying, way * (0, 0, 0) + (0, 0.1, 0))
    assert lying_truth[0, 15, 2] - lying_truth[0, 0, 2] > 0.5
    clips = {c.name: c for c in read_clips(tmp_path)}
    assert clips["lie"].category == "lying" and np.ptp(clips["lie"].joints[0, :, 2]) < 0.4
    assert clips["lie"].joints[..., 2].min() > -0.01
    assert clips["walk"].joints[0, 15, 2] > 1.4


def test_the_floor_is_under_planted_toes():
    joints = np.repeat(REST[None], 60, axis=0) + np.array([0.3, 0.2, 1.7])
    swing = np.sin(np.linspace(0, 3, 30)) * 0.2
    joints[30:, joint("left_foot"), 2] += swing
    joints[30:, joint("left_foot"), 1] += np.linspace(0, 0.8, 30)
    assert abs(floor_height(joints) - 1.7) < 1e-6
    assert floor_height(joints - (0, 0, 1.7 + TOE_HEIGHT)) == pytest.approx(-TOE_HEIGHT)


def test_a_body_of_no_unit_is_refused():
    with pytest.raises(InputError, match="scale the file to metres"):
        unit_of(REST[None] * 7.0 / 0.82, None, Path("giant.bvh"))
    assert unit_of(REST[None] * 100, None, Path("a.bvh")) == 0.01
    assert unit_of(REST[None] / 0.0254, 0.0254, Path("a.amc")) == 0.0254
    assert unit_of(REST[None], 0.0254, Path("a.amc")) == 1.0, (
        "what a file says of its units gives way to the body"
    )


def test_resampling_keeps_time():
    ramp = np.linspace(0, 1, 121)[:, None, None] * np.ones((1, 22, 3))
    out = at_model_rate(ramp, 120.0)
    assert len(out) == 31 and np.allclose(out[:, 0, 0], np.linspace(0, 1, 31))
    assert len(at_model_rate(ramp, 24.0)) == 151


def test_asf_and_amc_give_the_joints_of_their_angles(tmp_path):
    rest = write_asf(tmp_path / "s.asf")
    angles, way = walk(9, "y")
    way = way / (0.0254 / 0.45)
    write_amc(tmp_path / "s_walk.amc", angles, way)

    # Acclaim: a bone turns by C M C⁻¹, each of C and M about x, then y, then z, all about fixed
    # axes.
    def turn(degrees: np.ndarray) -> np.ndarray:
        x, y, z = (
            rotation_about(a, np.array(np.radians(d))) for a, d in zip("xyz", degrees, strict=True)
        )
        return z @ y @ x

    axis = turn(np.array([20, -30, 40]))
    local = np.stack(
        [
            np.stack([turn(a[0]), *(axis @ turn(a[j]) @ axis.T for j in range(1, 22))])
            for a in angles
        ]
    )
    offsets = np.repeat((rest - rest[list(PARENTS)])[None], 9, axis=0)
    offsets[:, 0] = way
    truth = posed(PARENTS, offsets, local)
    recording = read_amc(tmp_path / "s_walk.amc", read_asf(tmp_path / "s.asf"))
    assert recording.rate is None and recording.unit == pytest.approx(0.0254 / 0.45)
    for j, name in enumerate(JOINTS):
        read = recording.positions[:, recording.names.index(VICON.get(name, "root"))]
        assert np.abs(read - truth[:, j]).max() < 1e-6, name
    (clip,) = read_clips(tmp_path)
    assert len(clip.joints) == 3, "an .amc that does not say is taken as 120 frames a second"
    leg = np.linalg.norm(
        clip.joints[:, joint("left_knee")] - clip.joints[:, joint("left_hip")], axis=-1
    )
    assert np.allclose(leg, 0.41)


def test_an_amc_goes_with_the_asf_it_is_named_after(tmp_path):
    write_asf(tmp_path / "s.asf")
    write_asf(tmp_path / "s2.asf")
    angles, way = walk(9, "y")
    write_amc(tmp_path / "s2_walk.amc", angles, way)
    assert len(list(read_clips(tmp_path))) == 1
    (tmp_path / "s2_walk.amc").rename(tmp_path / "other.amc")
    with pytest.raises(InputError, match=r"2 \.asf files"):
        list(read_clips(tmp_path))


@pytest.mark.parametrize(
    ("size", "rate_name"),
    [(156, "mocap_framerate"), (165, "mocap_frame_rate"), (72, "mocap_framerate")],
)
def test_amass_archives_are_posed_on_our_rest_skeleton(tmp_path, size, rate_name):
    poses = np.zeros((41, size))
    # AMASS: z up; the body looks along its own +z and stands along +y, so that a quarter turn about
    # x sets it up.
    poses[:, 0] = np.pi / 2
    poses[:, 3 * joint("left_elbow") + 1] = -np.pi / 2  # the forearm forward
    way = np.stack([np.zeros(41), np.linspace(0, -2, 41), np.full(41, 5.0)], -1)
    np.savez(
        tmp_path / "01_01_poses.npz",
        poses=poses,
        trans=way,
        **{rate_name: 120.0},
        betas=np.zeros(16),
        gender="male",
    )
    recording = read_amass(tmp_path / "01_01_poses.npz")
    assert recording.names == JOINTS and recording.rate == 120.0
    (clip,) = read_clips(tmp_path)
    body = clip.joints[0] - clip.joints[0, 0]
    assert len(clip.joints) == 11 and np.allclose(clip.joints[-1, 0, 1] - clip.joints[0, 0, 1], -2)
    assert clip.joints[0, 0, 2] == pytest.approx(REST[0, 2]), "the floor is found"
    # It looks along −y, so its left is at +x and its forearm points along −y.
    assert body[joint("left_shoulder"), 0] > 0.1
    assert np.allclose(
        body[joint("left_wrist")] - body[joint("left_elbow")], (0, -0.25, 0), atol=1e-9
    )


def test_archives_that_are_no_motion_are_passed_over(tmp_path):
    np.savez(tmp_path / "shape.npz", betas=np.zeros(16))
    np.savez(tmp_path / "pool-000.npz", poses=np.zeros((3, 80, 66)), velocity=np.zeros(3))
    with pytest.raises(InputError, match="no motion files"):
        list(read_clips(tmp_path))


def test_what_is_known_of_a_clip_is_stated_beside_it(tmp_path):
    (tmp_path / "s1").mkdir()
    angles, way = walk(12, "y")
    write_bvh(tmp_path / "s1" / "WalkUp_01.bvh", angles, way)
    write_bvh(tmp_path / "sit_on_chair.bvh", angles, way)
    clips = {c.name: c for c in read_clips(tmp_path)}
    assert clips["s1/WalkUp_01"].subject == "s1" and clips["s1/WalkUp_01"].category == "locomotion"
    assert (
        clips["sit_on_chair"].category == "sit-stand"
        and clips["sit_on_chair"].source == tmp_path.name
    )
    assert all(c.licence == UNSTATED and c.split == "" for c in clips.values()), (
        "no licence, no training"
    )

    (tmp_path / "clips.json").write_text(
        json.dumps(
            {
                "*": {"licence": "CC0", "subject": "me"},
                "s1/*": {"split": "test", "category": "work"},
            }
        ),
        encoding="utf-8",
    )
    clips = {c.name: c for c in read_clips(tmp_path)}
    assert [clips["s1/WalkUp_01"].split, clips["sit_on_chair"].split] == ["test", "train"]
    assert clips["s1/WalkUp_01"].category == "work" and {c.subject for c in clips.values()} == {
        "me"
    }
    (tmp_path / "clips.json").rename(tmp_path / "other.json")
    (tmp_path / "clips.csv").write_text("file,licence,fps,up\n*,CC BY,60,\n", encoding="utf-8")
    assert {c.licence for c in read_clips(tmp_path)} == {"CC BY"} and {
        len(c.joints) for c in read_clips(tmp_path)
    } == {6}
    for wrong in (
        "file,split\n*,all\n",
        "file,fps\n*,fast\n",
        "file,up\n*,x\n",
        "file,colour\n*,red\n",
        "file,up\n*,z,more\n",
    ):
        (tmp_path / "clips.csv").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match="states for '\\*' what cannot be used") as error:
            list(read_clips(tmp_path))
        _one_sentence(error)
    for wrong in ("[1]", "{", '{"a.bvh": 3}'):
        (tmp_path / "clips.json").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match="does not list clips") as error:
            list(read_clips(tmp_path))
        _one_sentence(error)


def _one_sentence(error: pytest.ExceptionInfo[InputError]) -> None:
    text = str(error.value)
    assert text.endswith(".") and "\n" not in text and ";" in text and len(text) < 500, text


LIBERTIES = {
    "a byte order mark": lambda text: "\ufeff" + text,
    "UTF-16": lambda text: text,
    "Windows' line ends": lambda text: text.replace("\n", "\r\n"),
    "an old Mac's line ends": lambda text: text.replace("\n", "\r"),
    "tabs": lambda text: text.replace(" ", "\t"),
    "blank lines": lambda text: text.replace("\n", "\n\n  \n"),
    "decimal commas": lambda text: text.replace(".", ","),
    "trailing spaces": lambda text: text.replace("\n", "  \n"),
}
"""What a text file may look like without meaning anything else."""

BVH_LIBERTIES = LIBERTIES | {
    "one frame more than announced": lambda text: text.replace("Frames: 12", "Frames: 11"),
    "one frame less than announced": lambda text: text.replace("Frames: 12", "Frames: 13"),
    "no space after the colons": lambda text: text.replace("Frames: ", "Frames:").replace(
        "Time: ", "Time:"
    ),
    "a space before the colons": lambda text: text.replace("Frames:", "Frames :").replace(
        "Time:", "Time :"
    ),
    "capitals": lambda text: text.upper(),
    "small letters": lambda text: text.lower(),
    "end sites with names": lambda text: text.replace("End Site", "End Site LeftTip"),
    "end sites in one word": lambda text: text.replace("End Site", "EndSite"),
    "end sites without a word": lambda text: text.replace("End Site", "End"),
    "end sites without offset": lambda text: text.replace("OFFSET 0 1 0", ""),
    "end sites that say they are still": lambda text: text.replace(
        "OFFSET 0 1 0", "OFFSET 0 1 0 CHANNELS 0"
    ),
    "braces on their names' line": lambda text: text.replace("\n{", "{").replace("Hips", "Hips "),
    "commas between numbers": lambda text: (
        text[: text.index("MOTION")]
        + text[text.index("MOTION") :]
        .replace(" ", ", ")
        .replace("Frames:,", "Frames:")
        .replace("Frame,", "Frame")
        .replace("Time:,", "Time:")
    ),
    "frames over several lines": lambda text: (
        text[: text.index("Time")] + text[text.index("Time") :].replace(" ", "\n")
    ),
    "a prefix with a colon": lambda text: _renamed(text, "mixamorig:"),
    "a prefix with an underscore": lambda text: _renamed(text, "mixamorig1_"),
    "a prefix of its own": lambda text: _renamed(text, "Hero 2 "),
}


def _renamed(text: str, prefix: str) -> str:
    for name in sorted(MIXAMO.values(), key=len, reverse=True):
        text = text.replace(f" {name}\n", f" {prefix}{name}\n")
    return text


@pytest.mark.parametrize("liberty", BVH_LIBERTIES)
def test_a_bvh_is_read_whatever_its_exporter_made_of_it(tmp_path, liberty):
    angles, way = walk(12, "y")
    truth = write_bvh(tmp_path / "a.bvh", angles, way)
    text = (tmp_path / "a.bvh").read_text(encoding="utf-8")
    changed = BVH_LIBERTIES[liberty](text)
    assert changed != text or liberty == "UTF-16"
    (tmp_path / "a.bvh").write_bytes(changed.encode("utf-16" if liberty == "UTF-16" else "utf-8"))
    recording = read_bvh(tmp_path / "a.bvh")
    joints, _ = mapped(recording, tmp_path / "a.bvh")
    assert recording.rate == 30.0 and np.abs(joints * 0.01 - truth).max() < 1e-6
    assert len(list(read_clips(tmp_path))) == 1


@pytest.mark.parametrize("liberty", [*LIBERTIES, "small letters", "capitals"])
def test_acclaim_files_are_read_whatever_was_made_of_them(tmp_path, liberty):
    write_asf(tmp_path / "s.asf")
    angles, way = walk(9, "y")
    write_amc(tmp_path / "s_a.amc", angles, way)
    (before,) = read_clips(tmp_path)
    changes = LIBERTIES | {"small letters": str.lower, "capitals": str.upper}
    for name in ("s.asf", "s_a.amc"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        changed = changes[liberty](text)
        (tmp_path / name).write_bytes(changed.encode("utf-16" if liberty == "UTF-16" else "utf-8"))
        (after,) = read_clips(tmp_path)
        assert np.abs(before.joints - after.joints).max() < 1e-9, name


@pytest.mark.parametrize("rate", [np.nan, np.inf, 1e-9, -30.0, 0.5, 1e9])
def test_a_rate_that_no_motion_has_is_refused_before_any_memory_is_taken(tmp_path, rate):
    np.savez(
        tmp_path / "a.npz", poses=np.zeros((41, 156)), trans=np.zeros((41, 3)), mocap_framerate=rate
    )
    with pytest.raises(InputError, match=r"41 frames at .* a second, .*'fps'") as error:
        list(read_clips(tmp_path))
    _one_sentence(error)
    (tmp_path / "clips.json").write_text('{"*": {"fps": 60}}', encoding="utf-8")
    assert [len(clip.joints) for clip in read_clips(tmp_path)] == [21], "what is stated counts"


def _archive(file: Path, name: str, header: str, content: bytes = b"") -> None:
    """An AMASS archive in which one array has another header."""
    arrays = {
        "poses": np.zeros((4, 156)),
        "trans": np.zeros((4, 3)),
        "mocap_framerate": np.array(60.0),
    }
    with ZipFile(file, "w", ZIP_DEFLATED) as archive:
        for each, array in arrays.items():
            if each == name:
                padded = header.encode() + b" " * (118 - len(header)) + b"\n"
                written = (
                    b"\x93NUMPY\x01\x00" + len(padded).to_bytes(2, "little") + padded + content
                )
            else:
                buffer = BytesIO()
                np.save(buffer, array)
                written = buffer.getvalue()
            archive.writestr(f"{each}.npy", written)


@pytest.mark.parametrize(
    ("header", "content"),
    [
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (20000000000, 156), }", b""),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 156), }", b"\0" * 800),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (-4, -156), }", b"\0" * 4992),
        ("{'descr': '<U0', 'fortran_order': False, 'shape': (10000000000, 156), }", b""),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (4, 156), }", b"\0" * 4992),
        ("{'descr': '<f8', 'fortran_order': False, 'shape': (4", b""),
        ("{'descr': '<f4', 'fortran_order': False, 'shape': (300000, 156), }", b"\0" * 187_200_000),
    ],
)
def test_nothing_is_unpacked_that_an_archive_cannot_hold(tmp_path, header, content):
    _archive(tmp_path / "a.npz", "poses", header, content)
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as error:
            list(read_clips(tmp_path))
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    _one_sentence(error)


def test_archives_of_another_kind_are_refused_in_one_sentence(tmp_path):
    np.savez(
        tmp_path / "a.npz", poses=np.zeros((4, 156)), trans=np.zeros((4, 3)), mocap_framerate=60.0
    )
    assert len(list(read_clips(tmp_path))) == 1
    whole = (tmp_path / "a.npz").read_bytes()
    at = whole.index(b"poses.npy") + 400
    broken = whole[:at] + b"\x07" + whole[at + 1 :]
    np.save(tmp_path / "b.npy", np.zeros((4, 156)))
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_LZMA) as archive:
        archive.writestr("poses.npy", whole)
        archive.writestr("trans.npy", whole)
    for content, said in (
        (broken, "CRC"),
        ((tmp_path / "b.npy").read_bytes(), "zip"),
        (packed.getvalue(), "packed"),
    ):
        (tmp_path / "a.npz").write_bytes(content)
        with pytest.raises(InputError, match=said) as error:
            list(read_clips(tmp_path))
        _one_sentence(error)


@pytest.mark.parametrize(
    "damage",
    [
        lambda arrays: arrays | {"frames": arrays["frames"] + 1},
        lambda arrays: arrays | {"frames": -arrays["frames"]},
        lambda arrays: arrays | {"first_mm": arrays["first_mm"][:0]},
        lambda arrays: arrays | {"first_mm": arrays["first_mm"] * 9},
        lambda arrays: arrays | {"delta_mm": arrays["delta_mm"][..., :2]},
        lambda arrays: {"delta_mm": arrays["delta_mm"]},
        lambda arrays: arrays | {"delta_mm": arrays["delta_mm"] * 0.5},
        lambda arrays: arrays | {"clips": "{"},
        lambda arrays: arrays | {"clips": "[1]"},
        lambda arrays: arrays | {"clips": "[" * 9999},
    ],
)
def test_a_damaged_compact_archive_is_refused_in_one_sentence(tmp_path, damage):
    standing = np.repeat(REST[None], 10, axis=0)
    infos = {"clip": "walk", "licence": "CC0", "split": "train"}, {"clip": "stand"}
    write_compact(tmp_path / "a.npz", [(info, standing) for info in infos])
    with np.load(tmp_path / "a.npz") as archive:
        arrays = dict(archive)
    clips = list(read_clips(tmp_path))
    assert [(c.name, c.category, c.licence, c.split) for c in clips] == [
        ("walk", "locomotion", "CC0", "train"),
        ("stand", "standing", UNSTATED, ""),
    ]
    assert np.abs(clips[0].joints - REST).max() < 0.001
    np.savez(tmp_path / "a.npz", **damage(arrays))
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


def test_what_cannot_be_used_is_named_and_the_rest_is_read(tmp_path):
    angles, way = walk(12, "y")
    write_bvh(tmp_path / "good.bvh", angles, way)
    text = (tmp_path / "good.bvh").read_text(encoding="utf-8")
    bad = {
        "cut.bvh": text[:-200].encode(),
        "empty.bvh": b"",
        "gone.npz": b"PK",
        "alone.amc": b"1\nroot 0 0 0 0 0 0\n",
        "other.bvh": text.replace("Hips", "Becken").encode(),
    }
    for name, content in bad.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "link.bvh").symlink_to(tmp_path / "nowhere.bvh")
    (tmp_path / "folder.bvh").mkdir()
    np.savez(tmp_path / "half.npz", poses=np.zeros((4, 156)))
    write_compact(tmp_path / "tall.npz", [({"clip": "giant"}, REST[None] * 9)])
    write_compact(
        tmp_path / "fine.npz", [({"clip": "a"}, REST[None]), ({"clip": "dwarf"}, REST[None] * 0.2)]
    )
    (tmp_path / "__MACOSX").mkdir()
    for hidden in ("__MACOSX/._good.bvh", "._good.bvh", ".DS_Store.npz", "._s.asf"):
        (tmp_path / hidden).write_bytes(b"\0\5\x16\7")

    left_out: list[str] = []
    assert sorted(clip.name for clip in read_clips(tmp_path, left_out)) == ["a", "good"]
    wanted = (*bad, "link.bvh", "half.npz", "giant", "dwarf")
    named = {name: [said for said in left_out if f"{name}'" in said] for name in wanted}
    assert all(len(said) == 1 for said in named.values()) and len(left_out) == len(named), left_out
    assert all(said.endswith(".") and "\n" not in said for said in left_out)
    for name in ("good.bvh", "fine.npz"):
        (tmp_path / name).unlink()
    with pytest.raises(
        InputError, match=r"None of the motion files .* can be used; of the first: .*'"
    ):
        list(read_clips(tmp_path, []))


def test_a_broken_skeleton_does_not_keep_others_from_theirs(tmp_path):
    write_asf(tmp_path / "s.asf")
    angles, way = walk(5, "y")
    write_amc(tmp_path / "s_a.amc", angles, way)
    (tmp_path / "broken.asf").write_text(":units\n length 0\n", encoding="utf-8")
    assert len(list(read_clips(tmp_path))) == 1
    (tmp_path / "s.asf").unlink()
    with pytest.raises(InputError, match=r"broken\.asf"):
        list(read_clips(tmp_path))


def test_a_bone_of_acclaim_that_is_missing_in_a_frame_is_seen(tmp_path):
    """As many lines as there should be, but not where: the motion would be out of step."""
    write_asf(tmp_path / "s.asf")
    angles, way = walk(5, "y")
    write_amc(tmp_path / "s_a.amc", angles, way)
    lines = (tmp_path / "s_a.amc").read_text(encoding="utf-8").splitlines()
    first, second, *_ = (i for i, line in enumerate(lines) if line.startswith("ltibia"))
    lines.insert(first, lines.pop(second))
    (tmp_path / "s_a.amc").write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError, match="does not give the bone 'ltibia' 3 numbers in each"):
        list(read_clips(tmp_path))


def test_a_bvh_of_two_skeletons_is_refused(tmp_path):
    angles, way = walk(3, "y")
    write_bvh(tmp_path / "a.bvh", angles, way)
    text = (tmp_path / "a.bvh").read_text(encoding="utf-8")
    (tmp_path / "a.bvh").write_text(
        text.replace("MOTION", "ROOT Prop\n{\nOFFSET 0 0 0\n}\nMOTION"), encoding="utf-8"
    )
    with pytest.raises(InputError, match="several skeletons"):
        list(read_clips(tmp_path))


@pytest.mark.parametrize(
    ("name", "table"),
    [
        ("clips.csv", "\ufefffile,licence,subject\nwalk[1].bvh,CC0,anna\n"),
        ("clips.csv", "\ufefffile;licence;subject\r\nwalk[1].bvh;CC0;anna\r\n;;\r\n"),
        ("clips.csv", "File, Licence , subject\nwalk[1].bvh , CC0,anna\n"),
        ("clips.csv", "file\tlicence\tsubject\nwalk?1?.*\tCC0\tanna\n"),
        ("clips.json", '\ufeff{"walk[1].bvh": {"licence": "CC0", "subject": "anna"}}'),
    ],
)
def test_a_licence_reaches_its_clip_however_it_is_written(tmp_path, name, table):
    """Byte order marks and semicolons as Excel writes them; names as browsers number downloads."""
    angles, way = walk(3, "y")
    write_bvh(tmp_path / "walk[1].bvh", angles, way)
    write_bvh(tmp_path / "walk1.bvh", angles, way)
    (tmp_path / name).write_text(table, encoding="utf-8", newline="")
    left_out: list[str] = []
    licences = {clip.name: (clip.licence, clip.split) for clip in read_clips(tmp_path, left_out)}
    assert licences == {"walk[1]": ("CC0", "train"), "walk1": (UNSTATED, "")} and not left_out


def test_a_folders_name_and_accents_do_not_lose_a_licence(tmp_path):
    angles, way = walk(3, "y")
    # decomposed, as a Mac names files
    for folder, name in ("take [2]", "geh.bvh"), ("s1", "Ru\u0308cken.bvh"):
        (tmp_path / folder).mkdir()
        write_bvh(tmp_path / folder / os.fsdecode(name.encode()), angles, way)
    stated = {
        "take [2]/*": {"licence": "CC0"},
        "s1\\R\u00fccken.bvh": {"licence": "MIT"},
        "s3/*": {"licence": "CC BY"},
    }
    (tmp_path / "clips.json").write_text(json.dumps(stated), encoding="utf-8")
    left_out: list[str] = []
    assert [clip.licence for clip in read_clips(tmp_path, left_out)] == ["MIT", "CC0"]
    assert len(left_out) == 1 and "states 's3/*', which no motion file is called" in left_out[0]


@pytest.mark.parametrize(
    "content",
    [
        b"file,licence\n\xe9.bvh,CC0\n",
        b"licence\nCC0\n",
        b"file,licence\n,CC0\n",
        b"a\0b",
        b"\xff\xfe",
        b"file\n" + b"a" * 200_000,
    ],
)
def test_a_table_that_cannot_be_understood_is_refused(tmp_path, content):
    angles, way = walk(3, "y")
    write_bvh(tmp_path / "a.bvh", angles, way)
    (tmp_path / "clips.csv").write_bytes(content)
    with pytest.raises(InputError, match="does not list clips by file name") as error:
        list(read_clips(tmp_path, []))
    _one_sentence(error)


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[: len(text) // 3],
        lambda text: text[:-200],
        lambda text: text.replace("HIERARCHY", "HI", 1),
        lambda text: text.replace("Xrotation", "Wrotation", 1),
        lambda text: text.replace("Frames: 12", "Frames: 0"),
        lambda text: text.replace("Frame Time: 0.0333333", "Frame Time: nought"),
        lambda text: text + " nan",
        lambda text: "",
        lambda text: text.replace("}", "", 1),
        lambda text: text.replace("OFFSET", "OFFSETS", 1),
    ],
)
def test_a_damaged_bvh_is_refused_in_one_sentence(tmp_path, damage):
    angles, way = walk(12, "y")
    write_bvh(tmp_path / "a.bvh", angles, way)
    (tmp_path / "a.bvh").write_text(
        damage((tmp_path / "a.bvh").read_text(encoding="utf-8")), encoding="utf-8"
    )
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


@pytest.mark.parametrize(
    ("file", "damage"),
    [
        ("s.asf", lambda text: text[: len(text) // 2]),
        ("s.asf", lambda text: text.replace(":units", ":unit")),
        ("s.asf", lambda text: text.replace("name ltibia", "name elsewhere")),
        ("s.asf", lambda text: text.replace("dof rx", "dof qx", 1)),
        ("s_a.amc", lambda text: text[:-60]),
        ("s_a.amc", lambda text: text.replace("ltibia", "tail")),
        ("s_a.amc", lambda text: ":DEGREES\n"),
        ("s_a.amc", lambda text: text.replace("root", "root x", 1)),
    ],
)
def test_damaged_acclaim_files_are_refused_in_one_sentence(tmp_path, file, damage):
    write_asf(tmp_path / "s.asf")
    angles, way = walk(5, "y")
    write_amc(tmp_path / "s_a.amc", angles, way)
    (tmp_path / file).write_text(
        damage((tmp_path / file).read_text(encoding="utf-8")), encoding="utf-8"
    )
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


def test_damaged_archives_are_refused_in_one_sentence(tmp_path):
    good = {"poses": np.zeros((4, 156)), "trans": np.zeros((4, 3)), "mocap_framerate": 60.0}
    for wrong in (
        {"poses": np.zeros((4, 99))},
        {"trans": np.zeros((3, 3))},
        {"poses": np.full((4, 156), np.nan)},
        {"mocap_framerate": 0.0},
        {"poses": np.zeros((0, 156)), "trans": np.zeros((0, 3))},
        {"poses": np.array([{}], dtype=object)},
    ):
        np.savez(tmp_path / "a.npz", **(good | wrong))
        with pytest.raises(InputError) as error:
            list(read_clips(tmp_path))
        _one_sentence(error)
    for content in (b"", b"PK\x03\x04 broken", b"nothing"):
        (tmp_path / "a.npz").write_bytes(content)
        with pytest.raises(InputError) as error:
            list(read_clips(tmp_path))
        _one_sentence(error)


def test_an_unknown_skeleton_names_what_it_lacks(tmp_path):
    names = MIXAMO | {"left_foot": "Zehe", "right_wrist": "Pfote"}
    angles, way = walk(3, "y")
    write_bvh(tmp_path / "a.bvh", angles, way, names=names)
    with pytest.raises(
        InputError, match=r"'mixamo' it lacks lefttoebase, righthand \(for left_foot, right_wrist\)"
    ) as error:
        list(read_clips(tmp_path))
    _one_sentence(error)


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
    _one_sentence(error)


def test_a_sheet_is_drawn_for_any_length(tmp_path):
    pytest.importorskip("matplotlib")
    seat = box((0.0, 0.3, 0.4), (0.5, 0.5, 0.05))[None]
    touching = np.ones((30, 5), dtype=bool)
    plain, full = tmp_path / "plain.png", tmp_path / "full.png"
    sheet(plain, [("a pose", REST[None], None), ("a motion", _standing(30), None)], columns=3)
    rows = [("a pose", REST[None], None), ("a motion", _standing(30), Furnishing(seat))]
    sheet(full, rows, columns=3, contacts=[None, touching])
    assert 5_000 < plain.stat().st_size < full.stat().st_size, (
        "furniture and contacts are drawn too"
    )


@pytest.fixture(scope="module")
def pairs():
    """Clips that are there in their first form and in the compact one: (read, compact) joints."""
    if not RAW.is_dir():
        pytest.skip(f"needs the motion capture at {MOCAP}")
    raw = {c.name: c.joints for c in read_clips(RAW)}
    wanted = {
        "accad_male1_A9_lie_down": ("accad_male1", "Male1_A9_LieDown"),
        "accad_male1_B3_walk": ("accad_male1", "Male1_B3_Walk"),
        "cmu69_69_02_1": ("cmu69", "69_02_1"),
        "snu_chair": ("snu_tiling", "1/chair"),
        "cmu_daz_14_12_wash_windows": ("cmu_daz", "14/14_12"),
        "cmu_daz_14_30_sit_stepstool": ("cmu_daz", "14/14_30"),
        "snu_ys2010_walk_turn_180": ("snu_ys2010", "Walking/rawmotion/woddy2_walk_turn_180"),
        "hdm05_deposit_floor": ("hdm05_cuts", "train/1/HDM_bd_depositFloorR_001_120"),
    }
    compact = {(c.source, c.name): c.joints for c in read_clips(MOCAP)}
    return {name: (raw[name], compact[key]) for name, key in wanted.items()}


def test_real_files_are_read_as_their_compact_form_has_them(pairs):
    for name, (read, compact) in pairs.items():
        # The compact form left out frames at the start, or took its frames half-way between these.
        def apart(
            shift: float, read: np.ndarray = read, compact: np.ndarray = compact
        ) -> np.ndarray:
            times = np.arange(len(compact)) + shift
            both = (times >= 0) & (times <= len(read) - 1)
            low = np.minimum(times[both].astype(int), len(read) - 2)
            share = (times[both] - low)[:, None, None]
            difference = read[low] * (1 - share) + read[low + 1] * share - compact[both]
            return np.linalg.norm(difference - difference[:, 0].mean(0), axis=-1)

        best = min(
            (apart(shift) for shift in np.arange(-0.5, 2.01, 0.05)), key=lambda d: float(d.mean())
        )
        # ours lie at the hand's bone
        wrists = [joint("left_wrist"), joint("right_wrist")] if name.startswith("hdm05") else []
        joints = [j for j in range(22) if j not in wrists]
        assert np.median(best[:, joints]) < 0.002 and np.percentile(best[:, joints], 99) < 0.012, (
            name
        )


def test_real_files_stand_on_the_floor(pairs):
    for name, (read, _) in pairs.items():
        toes = read[:, [joint("left_foot"), joint("right_foot")], 2].min(1)
        assert read[..., 2].min() > -0.05, name
        if "lie_down" not in name:
            assert (
                abs(np.percentile(toes, 10) - TOE_HEIGHT) < 0.01 and 1.2 < read[0, 15, 2] < 1.8
            ), name
