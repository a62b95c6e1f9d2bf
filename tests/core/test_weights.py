"""Weights files: the reader agrees with the safetensors library, and no header makes it do anything
but refuse.
"""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from dafnet_addon.core import weights
from dafnet_addon.core.errors import WeightsError
from dafnet_addon.core.sensor import RADIUS
from dafnet_addon.core.weights import (
    FORMAT,
    load_weights,
    quantised,
    read_safetensors,
    write_safetensors,
)

METADATA = {
    "format": FORMAT,
    "config": json.dumps({"width": 4}),
    "licence": "a licence — with a dash",
}


def some_tensors() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    tensors = {
        "byte": rng.integers(0, 256, 5).astype(np.uint8),
        "half": rng.normal(size=(3, 5)).astype(np.float16),
        "single": rng.normal(size=(2, 3, 4)).astype(np.float32),
        "double": rng.normal(size=7),
        "whole": rng.integers(-9, 9, (2, 2)),
        "short": np.array([1, -2], np.int32),
        "small": rng.integers(-127, 128, (3, 3)).astype(np.int8),
        "scalar": np.float32(1.5).reshape(()),
        "empty": np.zeros((0, 3), np.float32),
    }
    tensors["strided"] = tensors["single"].transpose(2, 0, 1)
    tensors["big_endian"] = np.arange(3, dtype=">f4")
    return tensors


def put(
    path: Path,
    header: bytes | str | dict[str, object],
    data: bytes = b"",
    length: int | None = None,
) -> Path:
    """A file with this header, true or not."""
    text = json.dumps(header) if isinstance(header, dict) else header
    raw = text.encode() if isinstance(text, str) else text
    path.write_bytes(struct.pack("<Q", len(raw) if length is None else length) + raw + data)
    return path


def entry(
    dtype: object = "F32", shape: object = (2,), offsets: object = (0, 8)
) -> dict[str, object]:
    return {"dtype": dtype, "shape": shape, "data_offsets": offsets}


def test_round_trip_is_exact_and_deterministic(tmp_path: Path) -> None:
    tensors = some_tensors()
    write_safetensors(tmp_path / "a.safetensors", tensors, METADATA)
    write_safetensors(
        tmp_path / "b.safetensors",
        dict(reversed(tensors.items())),
        dict(reversed(METADATA.items())),
    )
    assert (tmp_path / "a.safetensors").read_bytes() == (tmp_path / "b.safetensors").read_bytes()
    read, metadata = read_safetensors(tmp_path / "a.safetensors")
    assert metadata == METADATA and read.keys() == tensors.keys()
    for name, array in tensors.items():
        assert read[name].shape == array.shape and np.array_equal(read[name], array), name
        assert read[name].dtype == array.dtype.newbyteorder("="), name
    with pytest.raises(TypeError):
        write_safetensors(tmp_path / "c.safetensors", {"text": np.array(["a"])}, {})


def test_no_tensor_at_all_is_a_file_too(tmp_path: Path) -> None:
    write_safetensors(tmp_path / "none.safetensors", {}, {})
    assert read_safetensors(tmp_path / "none.safetensors") == ({}, {})
    write_safetensors(tmp_path / "empty.safetensors", {"empty": np.zeros((3, 0), np.float32)}, {})
    assert read_safetensors(tmp_path / "empty.safetensors")[0]["empty"].shape == (3, 0)


def test_library_reads_what_we_write(tmp_path: Path) -> None:
    library = pytest.importorskip("safetensors.numpy")
    write_safetensors(tmp_path / "a.safetensors", some_tensors(), METADATA)
    read = library.load_file(tmp_path / "a.safetensors")
    for name, array in some_tensors().items():
        assert np.array_equal(read[name], array), name


def test_we_read_what_the_library_writes(tmp_path: Path) -> None:
    library = pytest.importorskip("safetensors.numpy")
    tensors = {
        name: np.ascontiguousarray(array)
        for name, array in some_tensors().items()
        if name != "big_endian"
    }
    library.save_file(tensors, tmp_path / "a.safetensors", METADATA)
    read, metadata = read_safetensors(tmp_path / "a.safetensors")
    assert metadata == METADATA and read.keys() == tensors.keys()
    for name, array in tensors.items():
        assert np.array_equal(read[name], array), name


def test_brain_floats_are_widened(tmp_path: Path) -> None:
    values = np.array([1.0, -2.5, 0.15625, 1e30], np.float32)
    halves = (values.view(np.uint32) >> 16).astype("<u2")
    path = put(tmp_path / "b.safetensors", {"b": entry("BF16", [4], [0, 8])}, halves.tobytes())
    assert np.allclose(read_safetensors(path)[0]["b"], values, rtol=2**-7)
    assert np.array_equal(read_safetensors(path)[0]["b"][:3], values[:3])


def test_weights_expand_what_is_stored_small(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    big = rng.normal(size=(6, 3, 5)) * np.array([1, 10, 0.1, 0, 1, 1])[:, None, None]
    steps, scale = quantised(big)
    assert (
        steps.dtype == np.int8
        and scale.dtype == np.float32
        and np.abs(steps).max() == 127
        and scale[3] == 0
    )
    half = rng.normal(size=4).astype(np.float16)
    path = tmp_path / "w.safetensors"
    tensors = {"big": steps, "big.scale": scale, "half": half, "own.scale": np.ones(2, np.float32)}
    write_safetensors(path, tensors, METADATA)
    loaded = load_weights(path)
    assert loaded.config == {"width": 4} and loaded.metadata == METADATA and loaded.path == path
    assert set(loaded.tensors) == {"big", "half", "own.scale"}
    assert all(tensor.dtype == np.float32 for tensor in loaded.tensors.values())
    assert (np.abs(loaded.tensors["big"] - big) <= scale[:, None, None] / 2 + 1e-6).all()
    assert np.array_equal(loaded.require("half", (4,)), half.astype(np.float32))
    for name, shape in (("half", (5,)), ("absent", None)):
        with pytest.raises(WeightsError, match="another version"):
            loaded.require(name, shape)


def test_weights_say_how_large_the_spheres_are_that_they_know(tmp_path: Path) -> None:
    file = tmp_path / "w.safetensors"

    def known(config: str) -> float:
        write_safetensors(file, {}, {"format": FORMAT, "config": config})
        return load_weights(file).sphere_radius

    assert known("{}") == RADIUS / 2, "the first ones do not say it"
    assert known(f'{{"sphere_radius": {RADIUS}}}') == RADIUS
    for wrong in (0, -1, 2 * RADIUS, "true", '"wide"'):
        with pytest.raises(WeightsError, match="spheres are of a size"):
            known(f'{{"sphere_radius": {wrong}}}')


@pytest.mark.parametrize(
    ("tensors", "metadata", "said"),
    [
        ({}, {"config": "{}"}, "another version"),
        ({}, {"format": "dafnet-2", "config": "{}"}, "another version"),
        ({}, {"format": FORMAT}, "damaged"),
        ({}, {"format": FORMAT, "config": "["}, "damaged"),
        ({}, {"format": FORMAT, "config": "[]"}, "config is not an object"),
        ({}, {"format": FORMAT, "config": "[" * 20 + "{" * 40}, "config is not JSON"),
        (
            {},
            {"format": FORMAT, "config": '{"a": ' + "[" * 40 + "]" * 40 + "}"},
            "config is nested too deep",
        ),
        ({}, {"format": FORMAT, "config": '{"a": "\\ud800"}'}, "config holds half a character"),
        (
            {},
            {"format": FORMAT, "config": '{"fps": NaN}'},
            "config holds a number that is not finite",
        ),
        (
            {},
            {"format": FORMAT, "config": '{"fps": 1%s}' % ("0" * 400)},
            "config holds a number that is too large",
        ),
        ({}, {"format": "\x1b[31m" + "x" * 10**5}, r"format is '\\x1b\[31mx+…'"),
        (
            {"\x1b[2J": np.array([np.nan], np.float32)},
            METADATA,
            r"'\\x1b\[2J' holds values that are not numbers",
        ),
        ({"a": np.zeros((2, 2), np.int8)}, METADATA, "lacks its scales"),
        (
            {"a": np.zeros((2, 2), np.int8), "a.scale": np.zeros(3, np.float32)},
            METADATA,
            "lacks its scales",
        ),
        ({"a": np.array([np.nan], np.float32)}, METADATA, "not numbers"),
        ({"a": np.array([1e300])}, METADATA, "not numbers"),
    ],
)
def test_files_of_another_kind_are_refused(
    tmp_path: Path,
    tensors: dict[str, np.ndarray],
    metadata: dict[str, str],
    said: str,
) -> None:
    write_safetensors(tmp_path / "w.safetensors", tensors, metadata)
    with pytest.raises(WeightsError, match=said):
        load_weights(tmp_path / "w.safetensors")


HOSTILE: dict[str, tuple[bytes | str | dict[str, object], bytes, int | None]] = {
    "huge length": ("{}", b"", 2**63),
    "length over the file": ("{}", b"", 3),
    "zero length": ("{}", b"", 0),
    "header over a megabyte": ("{" + " " * (1 << 20) + "}", b"", None),
    "not JSON": ("{'a'", b"", None),
    "not text": (b"\xff\xfe{}", b"", None),
    "deep": ("[" * 200000, b"", None),
    "list": ("[]", b"", None),
    "number": ("17", b"", None),
    "huge number": ("9" * 100000, b"", None),
    "metadata list": ({"__metadata__": []}, b"", None),
    "metadata number": ({"__metadata__": {"a": 1}}, b"", None),
    "entry list": ({"a": []}, b"", None),
    "entry short": ({"a": {"dtype": "F32"}}, b"", None),
    "entry long": ({"a": {**entry(), "more": 1}}, bytes(8), None),
    "type unknown": ({"a": entry("F31")}, bytes(8), None),
    "type list": ({"a": entry(["F32"])}, bytes(8), None),
    "type object": ({"a": entry("O")}, bytes(8), None),
    "shape negative": ({"a": entry(shape=[-2])}, bytes(8), None),
    "shape both negative": ({"a": entry(shape=[-2, -1])}, bytes(8), None),
    "shape fraction": ({"a": entry(shape=[2.0])}, bytes(8), None),
    "shape true": ({"a": entry(shape=[True, 2])}, bytes(8), None),
    "shape text": ({"a": entry(shape="2")}, bytes(8), None),
    "shape wraps": ({"a": entry(shape=[2**32, 2**32], offsets=[0, 0])}, b"", None),
    "shape absurd": ({"a": entry(shape=[10**100])}, bytes(8), None),
    "shape empty and absurd": ({"a": entry(shape=[0, 10**30], offsets=[0, 0])}, b"", None),
    "shape empty and huge": ({"a": entry(shape=[0, 2**28, 2**28], offsets=[0, 0])}, b"", None),
    "shape empty and wide": ({"a": entry(shape=[2**20, 0, 2**20], offsets=[0, 0])}, b"", None),
    "half a character": ('{"\\ud800": ' + json.dumps(entry()) + "}", bytes(8), None),
    "half a character in the metadata": ({"__metadata__": {"licence": "\ud800"}}, b"", None),
    "deep within": ('{"a": ' + "[" * 500 + "]" * 500 + "}", b"", None),
    "endless number": ('{"a": 1e999}', b"", None),
    "shape deep": ({"a": entry(shape=[1] * 60 + [2])}, bytes(8), None),
    "size not of shape": ({"a": entry(shape=[3])}, bytes(8), None),
    "offsets negative": ({"a": entry(offsets=[-8, 0])}, bytes(8), None),
    "offsets reversed": ({"a": entry(offsets=[8, 0])}, bytes(8), None),
    "offsets three": ({"a": entry(offsets=[0, 8, 8])}, bytes(8), None),
    "offsets not a number": (
        '{"a": {"dtype": "F32", "shape": [2], "data_offsets": [0, NaN]}}',
        bytes(8),
        None,
    ),
    "beyond the file": ({"a": entry(offsets=[8, 16])}, bytes(8), None),
    "truncated": ({"a": entry()}, bytes(7), None),
    "more than it says": ({"a": entry()}, bytes(9), None),
    "overlap": ({"a": entry(), "b": entry(offsets=[4, 12])}, bytes(12), None),
    "same place": ({"a": entry(), "b": entry()}, bytes(8), None),
    "hole": ({"a": entry(), "b": entry(offsets=[12, 20])}, bytes(20), None),
    "hole at the start": ({"a": entry(offsets=[4, 12])}, bytes(12), None),
    "twice": ('{"a": %s, "a": %s}' % ((json.dumps(entry()),) * 2), bytes(8), None),
    "twice within": (
        '{"a": {"dtype": "F32", "dtype": "F32", "shape": [2], "data_offsets": [0, 8]}}',
        bytes(8),
        None,
    ),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_headers_are_refused(tmp_path: Path, case: str) -> None:
    header, data, length = HOSTILE[case]
    with pytest.raises(
        WeightsError, match=r"damaged .*; install the extension again or choose another file\.$"
    ):
        read_safetensors(put(tmp_path / "h.safetensors", header, data, length))


def test_missing_and_unreadable_files(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.safetensors", tmp_path):
        with pytest.raises(WeightsError, match="cannot be read"):
            load_weights(path)
    (tmp_path / "short.safetensors").write_bytes(b"\x02\0\0")
    with pytest.raises(WeightsError, match="damaged"):
        read_safetensors(tmp_path / "short.safetensors")


def test_files_over_the_limit_are_refused_unread(tmp_path: Path) -> None:
    path = put(tmp_path / "large.safetensors", "{}")
    with path.open("r+b") as file:
        file.truncate((1 << 29) + 1)  # a hole on disk: nothing is written
    with pytest.raises(WeightsError, match="larger than 512 MiB"):
        read_safetensors(path)


def test_flipped_bytes_never_do_anything_but_refuse_or_read(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    write_safetensors(path, some_tensors(), METADATA)
    whole, rng, refused = path.read_bytes(), np.random.default_rng(0), 0
    header = 8 + int.from_bytes(whole[:8], "little")
    for _ in range(500):
        broken = bytearray(whole[: rng.integers(len(whole))] if rng.random() < 0.2 else whole)
        for place in rng.integers(0, header, rng.integers(1, 4)):
            if place < len(broken):
                broken[place] = rng.integers(256)
        path.write_bytes(broken)
        try:
            tensors, _ = read_safetensors(path)
        except WeightsError:
            refused += 1
        else:
            assert sum(tensor.nbytes for tensor in tensors.values()) <= 2 * len(whole)
    assert refused > 250


def test_the_shipped_file_is_found_beside_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(weights, "__file__", str(tmp_path / "dafnet_addon" / "core" / "weights.py"))
    folder = tmp_path / "weights_stub"
    folder.mkdir()
    with pytest.raises(WeightsError, match="no weights file"):
        load_weights()
    write_safetensors(folder / "a.safetensors", {"x": np.ones(2, np.float32)}, METADATA)
    assert np.array_equal(load_weights().require("x", (2,)), [1, 1])
    write_safetensors(folder / "b.safetensors", {}, METADATA)
    with pytest.raises(WeightsError, match="more than one"):
        load_weights()
