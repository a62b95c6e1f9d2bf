"""What is known of a clip, its licence above all, is stated beside it and reaches it."""

import json
import os

import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.data.capture.mocap import UNSTATED, read_clips
from kit.messages import one_sentence
from kit.motion_files import (
    walk,
    write_bvh,
)


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
        one_sentence(error)
    for wrong in ("[1]", "{", '{"a.bvh": 3}'):
        (tmp_path / "clips.json").write_text(wrong, encoding="utf-8")
        with pytest.raises(InputError, match="does not list clips") as error:
            list(read_clips(tmp_path))
        one_sentence(error)


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
    one_sentence(error)
