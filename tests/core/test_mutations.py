"""What strangers' files and careless callers may hand in: weights, stored takes, controls, boxes
and meshes, mutated.

Whatever comes in, motion made of numbers comes out, or one sentence that names the field; within
five seconds of the processor's time and 200 MB. A third of the mutations at least gets past the
parser, so that the checks behind it are tested too. 100 of each are tried; 1,000 with
``--hypothesis-profile=full``.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest

from dafnet_addon import (
    Box,
    CleanUp,
    Controls,
    DafnetError,
    Mesh,
    Scene,
    Take,
    generate,
    load_weights,
)
from dafnet_addon.core import distance, storage
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.generate import clean_again_steps, takes_steps
from dafnet_addon.core.progress import run_to_end
from dafnet_addon.core.sampler import Sampler
from dafnet_addon.core.skeleton import END_EFFECTORS, OFFSETS, UPPER
from dafnet_addon.core.solids import BOX_TRIANGLES
from dafnet_addon.core.storage import packed, unpacked
from dafnet_addon.core.take import MODES
from dafnet_addon.core.weights import FORMAT, Weights, read_safetensors, write_safetensors
from kit.limits import bounded

pytestmark = pytest.mark.slow

hypothesis = pytest.importorskip("hypothesis")
st = pytest.importorskip("hypothesis.strategies")

FRAMES = 6
ALL = CleanUp(feet=1.0, reach=1.0, seat=1.0, clear=1.0, smooth=1.0)


# What is asked of every attempt.


@dataclass
class Tally:
    """How many mutations were tried, came past the parser, and were used to the end."""

    tried: int = 0
    past: int = 0
    used: int = 0

    def attempt(self, use: Callable[[], None], names: set[str]) -> None:
        """Interaction a mutation; if it is refused, the sentence has to name one of ``names``."""
        self.tried += 1
        try:
            with bounded(), np.errstate(all="ignore"):
                use()
        except DafnetError as error:
            said = str(error)
            assert (
                said.endswith(".") and ". " not in said and said.isprintable() and len(said) < 1200
            ), said
            assert any(name in said for name in names), f"{said} ({names})"
        else:
            self.used += 1

    def judge(self) -> None:
        """Enough was tried, enough of it came past the parser."""
        print(f"{self.tried} tried, {self.past} past the parser, {self.used} used")
        assert self.tried >= hypothesis.settings().max_examples and 3 * self.past >= self.tried


def sound(take: Take, frames: int = FRAMES) -> None:
    """Every number of the take is one."""
    assert (
        take.joints.shape == (frames, 22, 3)
        and np.isfinite(take.joints).all()
        and np.isfinite(take.rotations).all()
    )


# Things in order.


@dataclass(frozen=True)
class _Growing(Weights):
    """Weights that have every tensor which is asked for: small random ones."""

    def require(self, name: str, shape: tuple[int, ...] | None = None) -> np.ndarray:
        rng, size = np.random.default_rng(len(self.tensors)), shape or ()
        grown = 0.1 * rng.standard_normal(size)
        if name.endswith("_std"):
            grown = np.full(size, 0.3)
        elif (
            len(size) == 2
            and name.count(".") == 2
            and name.endswith(".weight")
            and size[0] == size[1]
        ):
            grown = np.eye(size[0]) + 0.1 * grown
        return self.tensors.setdefault(name, grown.astype(np.float32))


MODEL = {
    "actions": 3,
    "history": 2,
    "predictor_code": 4,
    "predictor_width": 6,
    "width": 8,
    "layers": 1,
    "code": 4,
    "steps_upper": 1,
    "steps_lower": 1,
    "shared_encoder": True,
    "mask": True,
    "ahead": 18,
    "action_temperature": 0.7,
}
CONFIG = {"model": MODEL, "fps": 30, "offsets": OFFSETS.tolist()}


def small() -> Weights:
    """Weights of a small model, untrained."""
    weights = _Growing({}, CONFIG, {}, Path("small.safetensors"))
    Sampler(weights)
    return Weights(weights.tensors, CONFIG, {}, weights.path)


SMALL = small()


def root(frames: int = FRAMES) -> np.ndarray:
    """A root (frames, 4, 4) that walks."""
    out = np.tile(np.eye(4), (frames, 1, 1))
    out[:, 1, 3] = 0.03 * np.arange(frames)
    return out


def asked() -> dict[str, Any]:
    """Arguments of ``Controls`` with every field."""
    given: dict[str, Any] = {
        "fps": 30.0,
        "root": root(),
        "mode": "EE",
        "upper_body": np.full((FRAMES, len(UPPER), 3), 0.9),
        "pelvis_given": True,
        "blend": 0.2,
        "scale": 1.0,
    }
    for name in END_EFFECTORS:
        if name in {each.name for each in fields(Controls)}:
            given |= {
                name: np.full((FRAMES, 3), 0.5),
                f"{name}_rotation": np.tile(np.eye(3), (FRAMES, 1, 1)),
                f"{name}_influence": np.linspace(0.0, 1.0, FRAMES),
            }
    return given


SEAT = Box([0.0, 0.5, 0.2], [0.2, 0.2, 0.2])
CORNERS = np.array([(x, y, z) for x in (-0.2, 0.2) for y in (0.3, 0.7) for z in (0.0, 0.45)])
SIDES = np.delete(BOX_TRIANGLES, [8, 9], axis=0)  # without a bottom


# Mutations.

VALUES = [
    math.nan,
    math.inf,
    -math.inf,
    1e300,
    -1e300,
    3e38,
    1e9,
    1e7,
    1e4,
    100.0,
    7.0,
    2.0,
    1.0,
    0.5,
    0.0,
    -0.0,
    1e-3,
    1e-30,
    5e-324,
    -1e-3,
    -1.0,
    -2.0,
    -50.0,
]
STRANGE = [
    None,
    True,
    False,
    0,
    1,
    -1,
    2,
    30,
    10**6,
    2**31,
    3_000_000_000,
    10**400,
    1.5,
    "",
    "FREE",
    "30",
    b"FREE",
    [],
    {},
    (),
    object(),
    [[1.0, 2.0], [3.0]],
    [None],
    ["EE"] * FRAMES,
    ["EE", 3],
    np.array("FREE"),
    np.array(None),
    np.zeros((0, 3)),
    np.int64(7),
    np.float32(24.0),
    np.zeros((2,) * 20),
    "\x1b[31m",
    "\ud800",
    1j,
    np.array([1 + 1j]),
    {"a": 1},
    *VALUES,
]
HARMLESS: list[Callable[[np.ndarray], Any]] = [
    lambda a: a.tolist(),
    lambda a: a.astype(np.float32),
    np.asfortranarray,
    lambda a: a.copy(),
    lambda a: tuple(a.tolist()),
    lambda a: a.astype(np.longdouble),
    lambda a: a[::-1],
]
SHAPES: list[Callable[[np.ndarray], Any]] = [
    lambda a: a[:-1],
    lambda a: a[None],
    lambda a: a.T,
    lambda a: a.reshape(-1),
    lambda a: a[..., :-1],
    lambda a: a[:0],
    lambda a: np.concatenate([a, a]),
    lambda a: a[..., None],
    lambda a: a[0],
    lambda a: np.zeros((len(a), 0)),
    lambda a: a.astype(object),
    lambda a: a.astype(complex),
    lambda a: a.astype(str),
    lambda a: a.astype(int),
    lambda a: [*a, None],
    lambda a: a.astype(bool),
    lambda a: a[1:],
    lambda a: a[:1],
    lambda a: a.astype(np.float16),
]


@st.composite
def arrays(draw: Any, good: np.ndarray) -> Any:
    """An array like the one that is in order, with something about it changed."""
    way = draw(
        st.sampled_from(["one", "one", "some", "all", "shape", *["harmless"] * 5, "strange"])
    )
    if way == "strange":
        return draw(st.sampled_from(STRANGE))
    if way in ("shape", "harmless"):
        return draw(st.sampled_from(SHAPES if way == "shape" else HARMLESS))(good)
    out = good.astype(float)
    value = draw(st.one_of(st.sampled_from(VALUES), st.floats(-3.0, 3.0)))
    if way == "all":
        return out * value if draw(st.booleans()) else out + value
    at = draw(st.lists(st.integers(0, out.size - 1), min_size=1, max_size=1 if way == "one" else 5))
    out.reshape(-1)[at] = value
    return out


@st.composite
def changed(draw: Any, good: dict[str, Any], most: int = 2) -> dict[str, Any]:
    """Other values for one or more of the fields."""
    names = draw(st.lists(st.sampled_from(sorted(good)), min_size=1, max_size=most, unique=True))
    return {
        name: draw(
            arrays(good[name])
            if isinstance(good[name], np.ndarray)
            else st.one_of(
                st.sampled_from(STRANGE),
                st.floats(0.0, 3.0),
                st.integers(1, 60),
                st.sampled_from(MODES),
            )
        )
        for name in names
    }


WORDS = {
    "fps": "frame rate",
    "lower_seed": "seed of the legs",
    "lower_temperature": "temperature of the legs",
}


def test_controls() -> None:
    tally, good = Tally(), asked()
    drawn = {"seed": 3, "lower_seed": 4, "temperature": 1.0, "lower_temperature": 0.5}

    @hypothesis.given(changed(good | drawn))
    def each(odd: dict[str, Any]) -> None:
        def use() -> None:
            given = good | drawn | odd
            draw = Draw(*(given.pop(name) for name in drawn))
            controls = Controls(**given)
            tally.past += 1
            sound(
                run_to_end(takes_steps(Scene([SEAT]), controls, SMALL, [draw], clean_up=ALL))[0],
                len(controls),
            )

        # Another root makes all else too long or too short.
        names = {WORDS.get(name, name) for name in (*odd, *(good if "root" in odd else ()))}
        tally.attempt(
            use, names | ({"upper body"} if {"mode", "upper_body"} & odd.keys() else set())
        )

    each()
    tally.judge()


def test_boxes() -> None:
    tally = Tally()
    turned = np.tile(np.eye(3), (FRAMES, 1, 1))
    still = {
        "center": SEAT.center,
        "half_size": SEAT.half_size,
        "rotation": np.eye(3),
        "name": "Seat",
    }
    moving = still | {"center": np.tile(SEAT.center, (FRAMES, 1)), "rotation": turned}

    @hypothesis.given(
        st.one_of(
            *(changed(each).map(lambda odd, each=each: (each, odd)) for each in (still, moving))
        )
    )
    def each(pair: tuple[dict[str, Any], dict[str, Any]]) -> None:
        good, odd = pair

        def use() -> None:
            box = Box(**good | odd)
            tally.past += 1
            sound(generate(Scene([box]), Controls(30, root()), SMALL, clean_up=ALL))

        tally.attempt(use, {*odd, "frames"} if {"center", "rotation"} & odd.keys() else {*odd})

    each()
    tally.judge()


def test_meshes() -> None:
    tally = Tally()
    still = {"vertices": CORNERS, "triangles": SIDES, "matrix": np.eye(4), "name": "Chair"}
    moving = still | {"matrix": root()}

    @hypothesis.given(
        st.one_of(
            *(changed(each).map(lambda odd, each=each: (each, odd)) for each in (still, moving))
        )
    )
    def each(pair: tuple[dict[str, Any], dict[str, Any]]) -> None:
        good, odd = pair

        def use() -> None:
            mesh = Mesh(**good | odd)
            tally.past += 1
            distance._cache.clear()  # so that every grid is made, and weighed
            sound(generate(Scene([mesh]), Controls(30, root()), SMALL, clean_up=ALL))

        tally.attempt(use, {*odd, "frames"} if "matrix" in odd else {*odd, "triangles"})

    each()
    tally.judge()


# Weights.

JSON_VALUES = [
    None,
    True,
    False,
    0,
    1,
    -1,
    2,
    3,
    8,
    18,
    30,
    256,
    65536,
    10**9,
    10**18,
    10**400,
    0.5,
    1.5,
    -1.0,
    1e308,
    math.nan,
    math.inf,
    "",
    "text",
    "\x1b[2J",
    "\ud800",
    "a" * 5000,
    [],
    [1],
    {},
    {"a": {}},
    [[[[[[[[[[0]]]]]]]]]],
]
WORDS_OF_FILES = [
    "",
    "\x1b[31m",
    "x" * 100_000,
    "[" * 20 + "]" * 20,
    "[" * 20_000 + "]" * 20_000,
    "{" * 9,
    "NaN",
    '"\\ud800"',
    "1" * 5000,
    "\u202e",
    '{"a": 1, "a": 2}',
    "\ud800",
]
PARTS = ("header", "tensors", "metadata", "config", "format", "scales")
"""Of a weights file, as a sentence names them."""
Change = Callable[[bytes], bytes]


@st.composite
def scratches(draw: Any) -> Change:
    """Some bytes other than they were, and the end cut off, or not."""
    places = draw(
        st.lists(
            st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)),
            min_size=1,
            max_size=4,
        )
    )
    early, kept = draw(st.booleans()), draw(st.sampled_from([1.0, 1.0, 1.0, 0.999, 0.5, 0.01]))

    def scratched(raw: bytes) -> bytes:
        out = bytearray(raw)
        for place, byte in places:
            out[int(place * (min(len(raw), 1500) if early else len(raw)))] = byte
        return bytes(out[: int(kept * len(out))])

    return scratched


@st.composite
def other_headers(draw: Any) -> Change:
    """One tensor described otherwise in the header of a weights file, or one more."""
    key = draw(st.sampled_from(["shape", "dtype", "data_offsets", "more", "empty", "empty"]))
    value = draw(
        st.sampled_from(
            [
                [],
                [0],
                [-1],
                [2**31],
                [1, 1],
                ["1"],
                None,
                "F8_E4M3",
                "I64",
                "BF16",
                {},
                [0, 2**62],
                [2**40, 0],
                [True],
                [1.5],
            ]
        )
    )
    sizes = [0, *draw(st.lists(st.sampled_from([1, 2, 2**16, 2**28, 2**31, 2**62, 0]), max_size=8))]

    def described(raw: bytes) -> bytes:
        length = int.from_bytes(raw[:8], "little")
        header, data = json.loads(raw[8 : 8 + length]), raw[8 + length :]
        if key == "empty":
            header["empty"] = {"dtype": "F32", "shape": sizes, "data_offsets": [len(data)] * 2}
        else:
            header["pose_mean"][key] = value
        text = json.dumps(header).encode()
        return len(text).to_bytes(8, "little") + text + data

    return described


@dataclass
class File:
    """A weights file to be: its content, what is then done to its bytes, and the fields that were
    changed.
    """

    tensors: dict[str, np.ndarray] = field(repr=False)
    metadata: dict[str, str] = field(repr=False)
    names: set[str]
    change: Change = bytes


@st.composite
def weights_files(draw: Any) -> File:
    """A weights file that is mutated."""
    tensors, config = dict(SMALL.tensors), json.loads(json.dumps(CONFIG))
    metadata = {"format": FORMAT, "licence": "CC0", "config": json.dumps(CONFIG)}
    way = draw(
        st.sampled_from(
            [
                "config",
                "config",
                "values",
                "values",
                "values",
                "tensor",
                "metadata",
                "bytes",
                "header",
            ]
        )
    )
    name = draw(st.sampled_from(sorted(tensors)))
    if way == "bytes":
        return File(tensors, metadata, {*tensors, *MODEL, *CONFIG, *PARTS}, draw(scratches()))
    if way == "header":
        return File(tensors, metadata, {"pose_mean", "header", "tensors"}, draw(other_headers()))
    if way == "metadata":
        key = draw(st.sampled_from(["format", "licence", "config", "\x1b]0;title\x07", "held_out"]))
        return File(
            tensors, metadata | {key: draw(st.sampled_from(WORDS_OF_FILES))}, {key, "header"}
        )
    if way == "config":
        key = draw(st.sampled_from([*MODEL, "system", *CONFIG]))
        place = config if key in CONFIG else config["model"]
        place[key] = draw(st.one_of(st.sampled_from(JSON_VALUES), st.integers(-2, 40), st.floats()))
        if draw(st.integers(0, 9)) == 0:
            del place[key]
        # Another size makes tensors too small or too large, or asks for further ones.
        parts = {"upper.", "lower.", "predictor.", "ahead_"} if key in MODEL else set()
        return File(tensors, metadata | {"config": json.dumps(config)}, {key, "config", *parts})
    tensor = tensors.pop(name)
    if way == "values":
        value = draw(st.sampled_from(VALUES))
        at = draw(st.integers(-tensor.size, tensor.size - 1))
        with np.errstate(over="ignore", invalid="ignore"):
            tensor = tensor * np.float32(value) if at < 0 else tensor.copy()
        if at >= 0:
            tensor.reshape(-1)[at] = value if abs(value) < 3.4e38 else math.inf
        return File(
            tensors | {name: tensor}, metadata, {name, name.rpartition(".")[0] or name, "poses"}
        )
    deed = draw(st.sampled_from(["drop", "rename", "shape", "dtype", "bytes"]))
    if deed == "rename":
        tensors[draw(st.sampled_from(["", "\x1b[31m", "\ud800", name + ".scale", "x" * 500]))] = (
            tensor
        )
    elif deed == "shape":
        tensors[name] = draw(
            st.sampled_from([tensor[:-1], tensor[None], tensor.T, tensor[..., None], tensor[:0]])
        )
    elif deed != "drop":
        tensors[name] = tensor.astype(
            draw(st.sampled_from([np.float64, np.int32, np.float16, np.int8, np.uint8]))
        )
    if deed == "bytes":
        tensors[name + ".scale"] = np.full(
            draw(st.integers(0, 9)), draw(st.sampled_from(VALUES[3:])), np.float32
        )
    return File(tensors, metadata, {name, name.rpartition(".")[0] or name, "poses", "header"})


def test_weights(tmp_path: Path) -> None:
    tally, path = Tally(), tmp_path / "odd.safetensors"

    @hypothesis.given(weights_files())
    def each(file: File) -> None:
        write_safetensors(path, file.tensors, file.metadata)
        path.write_bytes(file.change(path.read_bytes()))

        def use() -> None:
            read_safetensors(path)
            tally.past += 1
            sound(
                generate(Scene([SEAT]), Controls(30, root()), load_weights(path), temperature=1.0)
            )

        tally.attempt(use, file.names)

    each()
    tally.judge()


# Stored takes.


@pytest.fixture(scope="module")
def stored() -> bytes:
    """A take of the weights that ship, as a file keeps it."""
    controls = Controls(**asked() | {"mode": ["EE"] * 3 + ["FREE"] * (FRAMES - 3)})
    return packed(generate(Scene([SEAT]), controls, load_weights(), clean_up=ALL), controls)


def contents(data: bytes) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The arrays of a stored take, and what else it says."""
    with np.load(BytesIO(data)) as file:
        found = {name: file[name] for name in file.files}
    return found, json.loads(found.pop("plain").tobytes())


def put_together(found: dict[str, Any], plain: object) -> bytes:
    """Inverse of ``contents``, whatever is in it; bytes are an array's file as they are."""
    out = BytesIO()
    text = plain if isinstance(plain, bytes) else json.dumps(plain).encode()
    with ZipFile(out, "w", ZIP_DEFLATED) as file:
        for name, value in {"plain": np.frombuffer(text, np.uint8), **found}.items():
            raw = BytesIO()
            if not isinstance(value, bytes):
                np.save(
                    raw,
                    np.asarray(value, None if isinstance(value, np.ndarray) else object),
                    allow_pickle=True,
                )
            file.writestr(f"{name}.npy", value if isinstance(value, bytes) else raw.getvalue())
    return out.getvalue()


BOMB = put_together({"controls.root": np.zeros((2_000_000, 4, 4), np.float32)}, {})
"""128 MB of zeros in a few kilobytes."""


ALSO = {
    "take.path.position": {"root"},
    "take.path.yaw": {"root"},
    "take.unchanged": {"mode"},
    "controls.mode": {"mode"},
    "controls.blend": {"mode"},
    "controls.scale": {"size"},
    "take.scale": {"size"},
}
"""What a sentence may name instead, where two fields do not belong together."""


@st.composite
def other_takes(draw: Any, data: bytes) -> tuple[bytes, set[str]]:
    """A stored take that is mutated, and the fields that were changed."""
    found, plain = contents(data)
    ways = [
        "array",
        "array",
        "array",
        "plain",
        "plain",
        "plain",
        "text",
        "bytes",
        "header",
        "missing",
        "bomb",
    ]
    way = draw(st.sampled_from(ways))
    name, key = (
        draw(st.sampled_from(sorted(found))),
        draw(st.sampled_from([*sorted(plain), "take.path", "controls.head"])),
    )
    also = ALSO.get(key if way == "plain" else name, set())
    if way == "bytes":
        return draw(scratches())(data), {"damaged", "plain", *found}
    if way == "array":
        value = draw(arrays(found[name].astype(np.float64)))
        single = (
            isinstance(value, np.ndarray)
            and value.dtype.kind == "f"
            and draw(st.integers(0, 3)) > 0
        )
        with np.errstate(over="ignore"):
            found[name] = value.astype(np.float32) if single else value
        # The number of frames is that of the root, so that all others may be wrong then.
        return put_together(found, plain), {
            name,
            name.split(".")[1],
            *(found if name == "controls.root" else ()),
            *also,
        }
    if way == "header":
        raw = BytesIO()
        np.save(raw, found[name])
        found[name] = draw(scratches())(raw.getvalue()[:128]) + raw.getvalue()[128:]
        return put_together(found, plain), {
            name,
            *(found if name == "controls.root" else ()),
            *also,
        }
    if way == "plain":
        odd = [*JSON_VALUES, *WORDS_OF_FILES[:3], ["\x1b[1m"], {"jerk": "a"}]
        plain[key] = draw(st.one_of(st.sampled_from(odd), st.floats()))
        names = {key, WORDS.get(key.split(".")[-1], key.split(".")[-1]), "plain"}
        # The rate says how many frames the model made.
        rate = (
            {*found, "number of frames", "take.fps", "take.scale"}
            if "fps" in key or "scale" in key
            else set()
        )
        return put_together(found, plain), names | rate | also
    if way == "text":
        text = draw(st.sampled_from([*WORDS_OF_FILES[:-1], "[]", "3", "null"]))
        return put_together(found, text.encode()), {"plain", "version", "fps"}
    if way == "missing":
        del found[name]
        return put_together(found, plain), {name, *also}
    with ZipFile(BytesIO(BOMB)) as bomb:
        found[name] = bomb.read("controls.root.npy")
    return put_together(found, plain), {name, *found}


def test_stored_takes(stored: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    tally, arrays_of = Tally(), storage._arrays

    def counted(*given: Any) -> dict[str, np.ndarray]:
        """Who comes here is past the readers of ZIP and JSON."""
        tally.past += 1
        return arrays_of(*given)

    monkeypatch.setattr(storage, "_arrays", counted)

    @hypothesis.given(other_takes(stored))
    def each(pair: tuple[bytes, set[str]]) -> None:
        data, names = pair

        def use() -> None:
            take, controls = unpacked(data)
            sound(run_to_end(clean_again_steps(Scene([SEAT]), controls, take, ALL)))
            sound(generate(Scene([SEAT]), controls, SMALL, resume=take, resume_frame=3))

        tally.attempt(use, names)

    each()
    tally.judge()
