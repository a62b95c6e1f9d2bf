"""Motion files as strangers, exporters and broken downloads may leave them: real and made-up ones,
mutated.

Whatever lies in a folder, clips made of numbers come out, or one sentence for each file says why
not; within five seconds of the processor's time and 200 MB. A third of the mutations at least gets
past the parser of its file.
"""

import json
import re
import shutil
import tracemalloc
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.skeleton import JOINTS
from dafnet_addon.data.capture.mocap import Clip, read_clips
from dafnet_addon.data.capture.stated import Stated
from dafnet_addon.data.motion.canonical import calibrate, canonical
from dafnet_addon.data.motion.motion import motion_of
from kit.limits import bounded
from kit.motion_files import walk, write_amc, write_asf, write_bvh, write_compact
from kit.places import RAW

pytestmark = pytest.mark.slow

FRAMES = 12


def sentence(said: str) -> None:
    assert said.endswith(".") and "\n" not in said and said.isprintable() and len(said) < 700, said


class Folder:
    """A folder that holds one mutation at a time; how many were read, and how many came past the
    parser.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.tried, self.past = path, 0, 0

    def holding(self, files: dict[str, bytes]) -> None:
        """Put files there and read them, as ``prepare`` does, up to the canonical body."""
        shutil.rmtree(self.path, ignore_errors=True)
        self.path.mkdir()
        for name, content in ({"clips.json": b'{"*": {"licence": "CC0"}}'} | files).items():
            (self.path / name).write_bytes(content)
        self.tried += 1
        left_out: list[str] = []
        clips: list[Clip] = []
        with bounded(), np.errstate(all="ignore"):
            try:
                clips += read_clips(self.path, left_out)
            except InputError as error:
                left_out.append(str(error))
            for clip in clips:
                assert (
                    clip.joints.shape[1:] == (22, 3)
                    and len(clip.joints)
                    and np.isfinite(clip.joints).all()
                )
                try:
                    joints = canonical(clip, calibrate([clip]))
                except InputError as error:
                    left_out.append(str(error))
                else:
                    assert np.isfinite(
                        motion_of(
                            clip.name, clip.source, clip.subject, clip.category, joints
                        ).joints
                    ).all()
        assert clips or left_out
        for said in left_out:
            sentence(said)
        behind = (
            "of no known convention",
            "by name",
            "grown person",
            "never stands",
            "frame rate",
            " a second,",
        )
        self.past += bool(clips) or any(words in said for said in left_out for words in behind)

    def judge(self) -> None:
        """Enough was tried, and enough of it came past the parser."""
        print(f"{self.tried} tried, {self.past} past the parser")
        assert self.tried >= hypothesis.settings().max_examples and 3 * self.past >= self.tried


# Text.

ODD = (
    "nan",
    "inf",
    "-1e308",
    "1e-320",
    "1e9",
    "-0",
    "7",
    "99999999999999999999",
    "1_0",
    "1,5",
    "½",
    "{",
    "}",
    "End Site",
    "ROOT",
    "JOINT",
    "MOTION",
    "Frames:",
    "CHANNELS",
    "OFFSET",
    ":units",
    ":hierarchy",
    "begin",
    "end",
    "x",
    "1",
    "#",
    "\0",
    "",
    "\n",
)
"""Words that may stand where others should."""


@st.composite
def changed(draw: st.DrawFn, text: str) -> bytes:
    """A text with numbers replaced; half of them with any words replaced and pieces lost, doubled
    or made of other bytes.
    """
    words = re.split(r"(\s+)", text)
    numbers = [i for i, word in enumerate(words) if re.fullmatch(r"-?\d+\.\d+(e-?\d+)?", word)]
    for _ in range(draw(st.integers(1, 4))):
        words[draw(st.sampled_from(numbers or [0]))] = f"{draw(st.floats(-200, 200)):.4f}"
    if draw(st.booleans()):
        return "".join(words).encode()
    for _ in range(draw(st.integers(0, 2))):
        words[draw(st.integers(0, len(words) - 1))] = draw(st.sampled_from(ODD))
    data = "".join(words).encode()
    for _ in range(draw(st.integers(0, 2))):
        start, end = sorted(draw(st.tuples(st.integers(0, len(data)), st.integers(0, len(data)))))
        if draw(st.booleans()):  # most damage is small
            end = min(end, start + draw(st.integers(0, 80)))
        piece = draw(st.sampled_from((b"", 2 * data[start:end])) | st.binary(max_size=20))
        data = data[:start] + piece + data[end:]
    return data


def shortened(text: str) -> str:
    """A BVH text with its first frames alone."""
    head, _, motion = text.replace("\r\n", "\n").partition("MOTION")
    lines = motion.strip().split("\n")
    return f"{head}MOTION\nFrames: {FRAMES}\n" + "\n".join(lines[1 : 2 + FRAMES])


@pytest.fixture(scope="module")
def bvh_texts(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("bvh")
    write_bvh(folder / "a.bvh", *walk(FRAMES, "y"))
    found = [folder / "a.bvh", *sorted(RAW.glob("*.bvh"))]
    return [shortened(file.read_text(encoding="latin-1")) for file in found]


@pytest.fixture(scope="module")
def acclaim_texts(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, str]]:
    """Pairs of an .asf and the first frames of its .amc."""
    folder = tmp_path_factory.mktemp("acclaim")
    write_asf(folder / "a.asf")
    write_amc(folder / "a.amc", *walk(FRAMES, "y"))
    found = [(folder / "a.asf", folder / "a.amc")]
    if RAW.is_dir():
        found += [
            (RAW / "snu_wd2.asf", RAW / "snu_chair.amc"),
            (RAW / "hdm05_bd.asf", RAW / "hdm05_deposit_floor.amc"),
        ]
    texts = [tuple(file.read_text(encoding="latin-1") for file in pair) for pair in found]
    return [(asf, amc.partition(f"\n{FRAMES}\n")[0]) for asf, amc in texts]


def test_mutated_bvh_files_are_read_or_named(bvh_texts, tmp_path):
    folder = Folder(tmp_path / "mocap")

    @hypothesis.given(st.one_of(*map(changed, bvh_texts)))
    def attempt(data: bytes) -> None:
        folder.holding({"a.bvh": data})

    attempt()
    folder.judge()


def test_mutated_acclaim_files_are_read_or_named(acclaim_texts, tmp_path):
    folder = Folder(tmp_path / "mocap")
    pairs = [st.tuples(changed(asf), st.just(amc.encode())) for asf, amc in acclaim_texts]
    pairs += [st.tuples(st.just(asf.encode()), changed(amc)) for asf, amc in acclaim_texts]

    @hypothesis.given(st.one_of(*pairs))
    def attempt(pair: tuple[bytes, bytes]) -> None:
        folder.holding({"a.asf": pair[0], "a.amc": pair[1]})

    attempt()
    folder.judge()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "clips.csv",
            "file,licence,subject,split,fps,up\n*.bvh,CC0,anna,train,30,y\ns1/walk[1].bvh,MIT,bert,test,,\n",
        ),
        (
            "clips.json",
            json.dumps(
                {
                    "*.bvh": {"licence": "CC0", "fps": 30},
                    "walk[1].bvh": {"licence": "MIT", "split": "test"},
                }
            ),
        ),
    ],
)
def test_mutated_lists_of_clips_are_understood_or_refused(tmp_path, name, text):
    """A licence that is given comes from what the list says of this very file."""

    @hypothesis.given(changed(text.replace(",", " ,").replace(":", " :")))
    def attempt(data: bytes) -> None:
        (tmp_path / name).write_bytes(data)
        with bounded():
            try:
                stated = Stated(tmp_path)
                fields = stated.of(Path("walk[1].bvh"))
                for said in stated.unmet([Path("walk[1].bvh")]):
                    assert said.endswith(".")
            except InputError as error:
                assert str(error).endswith(".") and len(str(error)) < 2000
            else:
                assert all(isinstance(value, str) for value in fields.values())

    attempt()


# Archives.


def npy(array: np.ndarray) -> bytes:
    buffer = BytesIO()
    np.save(buffer, array, allow_pickle=True)
    return buffer.getvalue()


def archive(members: dict[str, bytes], packed: bool) -> bytes:
    buffer = BytesIO()
    with ZipFile(buffer, "w", ZIP_DEFLATED if packed else ZIP_STORED) as written:
        for name, content in members.items():
            written.writestr(f"{name}.npy", content)
    return buffer.getvalue()


@st.composite
def other_values(draw: st.DrawFn, array: np.ndarray) -> np.ndarray:
    """An array of numbers with some that are as usual, and now and then one that is not."""
    flat, real = array.copy().reshape(-1), array.dtype.kind == "f"
    for _ in range(draw(st.integers(1, 3))):
        flat[draw(st.integers(0, flat.size - 1))] = draw(
            st.floats(-3, 3) if real else st.integers(-400, 400)
        )
    if draw(st.integers(0, 3)) == 0:
        odd = (np.nan, np.inf, -1e300, 1e-9, 0.0, -1.0) if real else (0, -1, 2**15 - 1, -(2**15), 1)
        flat[draw(st.integers(0, flat.size - 1))] = draw(st.sampled_from(odd))
    return flat.reshape(array.shape)


@st.composite
def other_array(draw: st.DrawFn, array: np.ndarray) -> bytes:
    """An array with other values, of another type or shape, or with a header or bytes that are not
    its own.
    """
    kind = draw(st.sampled_from(("value", "type", "shape", "header", "bytes", "odd")))
    if kind == "value" and array.dtype.kind in "fi" and array.size:
        return npy(draw(other_values(array)))
    if kind == "type":
        type_ = draw(
            st.sampled_from(("<f2", ">f8", "<i8", "|b1", "<U5", "|S3", "<c16", "<f4", "|O"))
        )
        return npy(np.zeros(array.shape, type_) if array.dtype.kind == "U" else array.astype(type_))
    if kind == "shape":
        return npy(
            draw(
                st.sampled_from(
                    (
                        array[..., None],
                        array.reshape(-1),
                        array.reshape(-1)[:0],
                        array.reshape(-1)[:1],
                    )
                )
            )
        )
    data = npy(array)
    at = draw(st.integers(0, min(len(data), 140)))
    if kind == "header":
        sizes = f"({draw(st.integers(-5, 10**13))}, {draw(st.sampled_from((0, 3, 72, 156)))})"
        start, end = (
            data.index(b"(") if b"(" in data else 0,
            data.index(b")") + 1 if b")" in data else 0,
        )
        return data[:start] + sizes.encode() + data[end:]
    if kind == "odd":
        return draw(
            st.sampled_from(
                (b"", b"\x93NUMPY", b"\x93NUMPY\x03\0" + data[8:], data[:200], data + b"\0")
            )
        )
    return (
        data[:at] + draw(st.binary(min_size=1, max_size=8)) + data[at + draw(st.integers(0, 8)) :]
    )


@st.composite
def other_archive(draw: st.DrawFn, arrays: dict[str, np.ndarray]) -> bytes:
    """An archive with other values; half of them with arrays that are changed in other ways or
    missing, or other bytes.
    """
    members = {name: npy(array) for name, array in arrays.items()}
    bulk = [name for name, array in arrays.items() if array.size > 20]
    name = draw(st.sampled_from(bulk))
    members[name] = npy(draw(other_values(arrays[name])))
    if draw(st.booleans()):
        return archive(members, draw(st.booleans()))
    for name in draw(st.lists(st.sampled_from(sorted(arrays)), min_size=1, max_size=2)):
        members[name] = draw(other_array(arrays[name]))
    if draw(st.integers(0, 9)) == 0:
        members.pop(draw(st.sampled_from(sorted(members))))
    data = archive(members, draw(st.booleans()))
    if draw(st.integers(0, 4)) == 0:
        at = draw(st.integers(0, len(data)))
        data = data[:at] + draw(st.binary(max_size=8)) + data[at + draw(st.integers(0, 40)) :]
    return data


def test_mutated_amass_archives_are_read_or_named(tmp_path):
    rng = np.random.default_rng(0)
    poses = 0.1 * rng.standard_normal((FRAMES, 156))
    poses[:, 0] = np.pi / 2
    arrays = {
        "poses": poses,
        "trans": 0.01 * rng.standard_normal((FRAMES, 3)),
        "mocap_framerate": np.array(60.0),
    }
    folder = Folder(tmp_path / "mocap")

    @hypothesis.given(other_archive(arrays))
    def attempt(data: bytes) -> None:
        folder.holding({"a.npz": data})

    attempt()
    folder.judge()


def test_mutated_compact_archives_are_read_or_named(tmp_path):
    write_bvh(tmp_path / "a.bvh", *walk(FRAMES, "z"), up="z")
    (clip,) = read_clips(tmp_path)
    known = {
        "clip": "walk",
        "subject": "a",
        "category": "locomotion",
        "split": "train",
        "licence": "CC0",
    }
    write_compact(
        tmp_path / "a.npz", [(known, clip.joints), (known | {"clip": "again"}, clip.joints[::-1])]
    )
    with np.load(tmp_path / "a.npz") as whole:
        arrays = dict(whole)
    assert arrays["first_mm"].shape[1] == len(JOINTS)
    folder = Folder(tmp_path / "mocap")

    @hypothesis.given(other_archive(arrays))
    def attempt(data: bytes) -> None:
        folder.holding({"a.npz": data})

    attempt()
    folder.judge()


# Sizes.


def _many_joints_few_numbers() -> bytes:
    """A hundred thousand frames of one number each, of a skeleton of four thousand joints."""
    joints = "".join(f"JOINT j{i} {{ OFFSET 0 1 0 " for i in range(4000)) + "}" * 4000
    head = (
        f"HIERARCHY ROOT Hips {{ OFFSET 0 0 0 CHANNELS 1 Xposition {joints} }} MOTION Frames: "
        "100000 Frame Time: 0.03\n"
    )
    return head.encode() + b"0 " * 100_000


HEAD = b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xposition } MOTION "
HUGE: dict[str, Callable[[], dict[str, bytes]]] = {
    "frames that are not there": lambda: {"a.bvh": HEAD + b"Frames: 9999999999999 Frame Time: 1 0"},
    "joints that nothing moves": lambda: {"a.bvh": _many_joints_few_numbers()},
    "joints without end": lambda: {
        "a.bvh": b"HIERARCHY " + b"ROOT a { " * 900_000 + b"MOTION Frames: 1 Frame Time: 1 0"
    },
    "channels without end": lambda: {
        "a.bvh": HEAD.replace(b"S 1", b"S 99999999999999") + b"Frames: 1 Frame Time: 1 0"
    },
    "a word without end": lambda: {"a.bvh": HEAD + b"Frames: 1 Frame Time: 1 " + b"1" * 9_000_000},
    "spaces without end": lambda: {
        "a.bvh": b"HIERARCHY" + b" " * 9_000_000 + b"MOTION" + b" " * 9_000_000
    },
    "frames of nothing": lambda: {
        "a.asf": (
            b":units\nlength 1\n:root\norder TX\naxis XYZ\nposition 0 0 0\norientation 0 0 "
            b"0\n:bonedata\n"
        )
        + b"".join(
            b"begin\nname b%d\ndirection 1 0 0\nlength 1\naxis 0 0 0 XYZ\nend\n" % i
            for i in range(1500)
        )
        + b":hierarchy\nbegin\nroot "
        + b" ".join(b"b%d" % i for i in range(1500))
        + b"\nend\n",
        "a.amc": b"".join(b"%d\n" % i for i in range(300_000)),
    },
}


@pytest.mark.parametrize("what", HUGE)
def test_no_small_file_takes_much_memory_or_time(tmp_path, what):
    folder = Folder(tmp_path / "mocap")
    folder.holding(HUGE[what]())


def test_a_long_recording_takes_little_more_than_its_numbers(tmp_path):
    """Ten minutes at 60 frames a second: 27 MB of text, 20 MB of numbers."""
    write_bvh(tmp_path / "a.bvh", *walk(2, "y"), fps=60.0)
    head, _, motion = (tmp_path / "a.bvh").read_text(encoding="utf-8").partition("MOTION")
    line = " ".join(f"{float(x):.4f}" for x in motion.strip().split("\n")[2].split())
    times = "MOTION\nFrames: 36000\nFrame Time: 0.0166667\n"
    (tmp_path / "a.bvh").write_text(head + times + f"{line}\n" * 36_000, encoding="utf-8")
    size = (tmp_path / "a.bvh").stat().st_size
    tracemalloc.start()
    try:
        (clip,) = read_clips(tmp_path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(clip.joints) == 18_000 and peak < size + 200e6, (
        f"{peak / 1e6:.0f} MB for {size / 1e6:.0f} MB"
    )
