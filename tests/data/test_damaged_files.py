"""What cannot be read is refused in one sentence, before it takes memory, and keeps no other file
from being read.
"""

import tracemalloc
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZipFile

import numpy as np
import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.skeleton import REST
from dafnet_addon.data.capture.mocap import UNSTATED, read_clips
from kit.messages import one_sentence
from kit.motion_files import (
    walk,
    write_amc,
    write_asf,
    write_bvh,
    write_compact,
)


@pytest.mark.parametrize("rate", [np.nan, np.inf, 1e-9, -30.0, 0.5, 1e9])
def test_a_rate_that_no_motion_has_is_refused_before_any_memory_is_taken(tmp_path, rate):
    np.savez(
        tmp_path / "a.npz", poses=np.zeros((41, 156)), trans=np.zeros((41, 3)), mocap_framerate=rate
    )
    with pytest.raises(InputError, match=r"41 frames at .* a second, .*'fps'") as error:
        list(read_clips(tmp_path))
    one_sentence(error)
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
    one_sentence(error)


def test_archives_of_another_kind_are_refused_inone_sentence(tmp_path):
    np.savez(
        tmp_path / "a.npz", poses=np.zeros((4, 156)), trans=np.zeros((4, 3)), mocap_framerate=60.0
    )
    assert len(list(read_clips(tmp_path))) == 1
    whole = (tmp_path / "a.npz").read_bytes()
    at = whole.index(b"poses.npy") + 400
    broken = whole[:at] + b"\x07" + whole[at + 1 :]
    np.save(tmp_path / "b.npy", np.zeros((4, 156)))
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_BZIP2) as archive:
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
        one_sentence(error)


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
def test_a_damaged_compact_archive_is_refused_inone_sentence(tmp_path, damage):
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
    one_sentence(error)


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
def test_a_damaged_bvh_is_refused_inone_sentence(tmp_path, damage):
    angles, way = walk(12, "y")
    write_bvh(tmp_path / "a.bvh", angles, way)
    (tmp_path / "a.bvh").write_text(
        damage((tmp_path / "a.bvh").read_text(encoding="utf-8")), encoding="utf-8"
    )
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    one_sentence(error)


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
def test_damaged_acclaim_files_are_refused_inone_sentence(tmp_path, file, damage):
    write_asf(tmp_path / "s.asf")
    angles, way = walk(5, "y")
    write_amc(tmp_path / "s_a.amc", angles, way)
    (tmp_path / file).write_text(
        damage((tmp_path / file).read_text(encoding="utf-8")), encoding="utf-8"
    )
    with pytest.raises(InputError) as error:
        list(read_clips(tmp_path))
    one_sentence(error)


def test_damaged_archives_are_refused_inone_sentence(tmp_path):
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
        one_sentence(error)
    for content in (b"", b"PK\x03\x04 broken", b"nothing"):
        (tmp_path / "a.npz").write_bytes(content)
        with pytest.raises(InputError) as error:
            list(read_clips(tmp_path))
        one_sentence(error)
