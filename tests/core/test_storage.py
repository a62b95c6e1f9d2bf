"""Takes as a file keeps them: they come back as they were, and what is damaged or hostile is
refused before it is unpacked.
"""

import json
import tracemalloc
from dataclasses import fields, replace
from io import BytesIO
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_LZMA, ZipFile

import numpy as np
import pytest

from dafnet_addon import Box, CleanUp, Controls, InputError, Scene, Take, generate, load_weights
from dafnet_addon.core.draws import Draw
from dafnet_addon.core.skeleton import UPPER
from dafnet_addon.core.storage import packed, unpacked

FRAMES = 5


@pytest.fixture(scope="module")
def made() -> tuple[Take, Controls]:
    """A take, and controls of which every field is set."""
    root, place = np.tile(np.eye(4), (FRAMES, 1, 1)), np.tile([0.3, 0.4, 1.1], (FRAMES, 1))
    place[0] = np.nan
    controls = Controls(
        25.0,
        root,
        ["EE"] * (FRAMES - 1) + ["FREE"],
        head=place,
        hand_left=place,
        hand_right=place,
        upper_body=np.zeros((FRAMES, len(UPPER), 3)),
        head_rotation=np.tile(np.eye(3), (FRAMES, 1, 1)),
        hand_left_influence=np.linspace(0, 1, FRAMES),
        pelvis_given=False,
        blend=0.1,
        scale=0.9,
    )
    scene = Scene([Box([0.0, 1.0, 0.2], [0.2, 0.2, 0.2])])
    take = generate(scene, controls, load_weights(), seed=7, clean_up=CleanUp(feet=1.0))
    return replace(take, draw=Draw(7, 8, 0.5, 0.25, held=True)), controls


def _members(data: bytes) -> dict[str, bytes]:
    with ZipFile(BytesIO(data)) as file:
        return {name.removesuffix(".npy"): file.read(name) for name in file.namelist()}


def _file(members: dict[str, bytes], compression: int = ZIP_DEFLATED) -> bytes:
    out = BytesIO()
    with ZipFile(out, "w", compression) as file:
        for name, data in members.items():
            file.writestr(f"{name}.npy", data)
    return out.getvalue()


def _npy(array: np.ndarray) -> bytes:
    out = BytesIO()
    np.save(out, array, allow_pickle=True)
    return out.getvalue()


def _words(**changes: Any) -> Any:
    """A change of what is not an array; None takes the word out."""

    def change(members: dict[str, bytes]) -> dict[str, bytes]:
        said = json.loads(np.load(BytesIO(members["plain"])).tobytes())
        said.update({name.replace("__", "."): value for name, value in changes.items()})
        said = {name: value for name, value in said.items() if value is not None}
        return {**members, "plain": _npy(np.frombuffer(json.dumps(said).encode(), np.uint8))}

    return change


def test_a_take_comes_back_as_it_was(made: tuple[Take, Controls]) -> None:
    for before, after in zip(made, unpacked(packed(*made)), strict=True):
        for each in fields(before):
            one, other = getattr(before, each.name), getattr(after, each.name)
            if each.name == "path":
                one, other = np.c_[one.position, one.yaw], np.c_[other.position, other.yaw]
            if isinstance(one, np.ndarray):
                np.testing.assert_array_equal(
                    one.astype(np.float32), other.astype(np.float32), err_msg=each.name
                )
            else:
                assert one == other, each.name


def test_what_was_packed_before_there_were_versions_is_read(made: tuple[Take, Controls]) -> None:
    assert len(unpacked(_file(_words(version=None)(_members(packed(*made)))))[0]) == FRAMES


def test_what_was_packed_before_the_draw_was_noted_is_read(made: tuple[Take, Controls]) -> None:
    older = _file(_words(take__draw=None)(_members(packed(*made))))
    assert unpacked(older)[0].draw == Draw()


def test_figures_that_are_no_numbers_are_kept_as_unknown(made: tuple[Take, Controls]) -> None:
    odd = replace(
        made[0], log_likelihood=float("nan"), metrics={"jerk": float("inf"), "skate_cm": None}
    )
    take, _ = unpacked(packed(odd, made[1]))
    assert np.isnan(take.log_likelihood) and take.metrics == {"jerk": None, "skate_cm": None}


DAMAGED: dict[str, tuple[Any, str]] = {
    "no bytes": (lambda m: None, "damaged"),
    "a newer version": (_words(version=2), "'version' is 2"),
    "a version in words": (_words(version="1"), "'version' is 1"),
    "no rate": (_words(controls__fps=None), "'controls.fps' is None"),
    "an endless rate": (_words(controls__fps=1e300), "'controls.fps'"),
    "another rate": (_words(take__fps=30.0), "'take.fps'"),
    "no warnings": (_words(take__warnings=None), "'take.warnings'"),
    "warnings of numbers": (_words(take__warnings=[1]), "'take.warnings'"),
    "figures of words": (_words(take__metrics={"jerk": "high"}), "'take.metrics'"),
    "a draw of words": (_words(take__draw="any"), "'take.draw'"),
    "a draw of more": (_words(take__draw={"seed": 1, "luck": 2}), "'take.draw'"),
    "a seed below zero": (_words(take__draw={"seed": -1}), "'take.draw'"),
    "an unknown mode": (_words(controls__mode="HALF"), "mode 'HALF'"),
    "a blend of words": (_words(controls__blend="long"), "blend"),
    "no JSON": (
        lambda m: {**m, "plain": _npy(np.frombuffer(b"{'a'", np.uint8))},
        "'plain' is not JSON",
    ),
    "no text": (
        lambda m: {**m, "plain": _npy(np.frombuffer(b"\xff", np.uint8))},
        "'plain' is not text",
    ),
    "a list": (
        lambda m: {**m, "plain": _npy(np.frombuffer(b"[]", np.uint8))},
        "'plain' is not an object",
    ),
    "poses missing": (
        lambda m: {n: d for n, d in m.items() if n != "take.poses"},
        "'take.poses' is missing",
    ),
    "joints of one frame": (
        lambda m: {**m, "take.joints": _npy(np.zeros((1, 22, 3), np.float32))},
        "'take.joints' has the shape",
    ),
    "a path too short": (
        lambda m: {**m, "take.path.yaw": _npy(np.zeros(2, np.float32))},
        "'take.path.yaw' has the shape",
    ),
    "numbers that are none": (
        lambda m: {**m, "take.root": _npy(np.full((FRAMES, 4, 4), np.nan, np.float32))},
        "'take.root' holds what is not a number",
    ),
    "objects": (lambda m: {**m, "take.action": _npy(np.array([None]))}, "'take.action' holds |O"),
    "doubles": (
        lambda m: {**m, "take.action": _npy(np.zeros((FRAMES, 10)))},
        "'take.action' holds <f8",
    ),
    "a header that lies": (
        lambda m: {**m, "take.root": m["take.root"].replace(b"(5, 4, 4), ", b"(9, 4, 4), ")},
        "the size of 'take.root' is not that of its shape",
    ),
    "a rotation that is none": (
        lambda m: {**m, "controls.head_rotation": _npy(np.ones((FRAMES, 3, 3), np.float32))},
        "'head_rotation' holds a matrix",
    ),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_what_is_damaged_is_told_by_its_field(made: tuple[Take, Controls], case: str) -> None:
    change, words = DAMAGED[case]
    members = change(_members(packed(*made)))
    with pytest.raises(InputError) as caught:
        unpacked(b"no take" if members is None else _file(members))
    said = str(caught.value)
    assert words in said and said.startswith(
        "The motion that the take was made of cannot be read ("
    )
    assert said.endswith("; generate it again.") and said.count(". ") == 0


@pytest.mark.parametrize(
    "name", ["take.joints", "controls.root", "plain", "controls.hand_left", "something.else"]
)
def test_what_unpacks_to_more_than_its_frames_ask_for_stays_packed(
    made: tuple[Take, Controls], name: str
) -> None:
    members, zeros = _members(packed(*made)), bytes(1 << 20)
    members.pop(name, None)
    out = BytesIO(_file(members))
    with ZipFile(out, "a", ZIP_DEFLATED) as file, file.open(f"{name}.npy", "w") as member:
        member.write(
            _npy(np.zeros((0, 4, 4), np.float32)).replace(b"(0, 4, 4)", b"(1048576, 4, 4)".ljust(9))
        )
        for _ in range(64):
            member.write(zeros)
    data = out.getvalue()
    assert len(data) < 1 << 18, "64 MB in a quarter of one"
    tracemalloc.start()
    try:
        if name == "something.else":
            unpacked(data)  # nobody asks for it
        else:
            with pytest.raises(InputError, match=f"'{name}' is larger than"):
                unpacked(data)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


def test_other_ways_to_compress_are_refused(made: tuple[Take, Controls]) -> None:
    with pytest.raises(InputError, match="compressed in another way"):
        unpacked(_file(_members(packed(*made)), ZIP_LZMA))
