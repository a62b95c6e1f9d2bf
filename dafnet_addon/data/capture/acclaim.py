"""Reads Acclaim motion: a skeleton of bones (.asf) and, for it, the bones' angles in every frame
(.amc).

Bones are told apart without regard to case, and a comma may be the decimal point.
"""

from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from .recording import (
    MAX_JOINTS,
    Recording,
    check_size,
    posed,
    posed_in_blocks,
    printable,
    rotation_about,
    sound,
    text_of,
)

__all__ = ["Skeleton", "read_asf", "read_amc", "bones_of_amc"]

_INCH = 0.0254
_PER_BONE = 2000  # characters of an .asf; real ones take about 200


@dataclass(frozen=True)
class Skeleton:
    """An .asf file: ``bones`` (the root first, parents before children), each with its vector (3,)
    in the file's units, its axis rotation (3, 3) and the degrees of freedom it has in the .amc, in
    order. ``unit``: metres of one unit.
    """

    bones: tuple[str, ...]
    parents: tuple[int, ...]
    vectors: np.ndarray
    axes: np.ndarray
    freedoms: tuple[tuple[str, ...], ...]
    position: np.ndarray
    unit: float
    degrees: bool


def _lines(text: str) -> Iterator[list[str]]:
    """Lines as words, without comments and empty lines, with decimal points."""
    for line in StringIO(text, newline=None):
        line = line.split("#")[0]
        if "," in line:
            line = line.replace(",", " " if "." in line else ".")
        words = line.split()
        if words:
            yield words


def _sections(text: str) -> dict[str, list[list[str]]]:
    """The lines of a file, as words, under each of its ``:keyword`` lines; what follows the keyword
    is the first line.
    """
    sections: dict[str, list[list[str]]] = {}
    lines: list[list[str]] = []
    for words in _lines(text):
        if words[0].startswith(":"):
            lines = sections.setdefault(words[0][1:].lower(), [])
            words = words[1:]
        if words:
            lines.append(words)

    return sections


def _numbers(words: list[str], count: int) -> np.ndarray:
    """So many numbers (count,). Raises ValueError where they are not."""
    found = np.array([float(word) for word in words])
    if len(found) != count or not sound(found):
        raise ValueError(f"'{printable(' '.join(words))}'")
    return found


def _turn(words: list[str], order: str, degrees: bool) -> np.ndarray:
    """The rotation of three angles; the first axis named turns first, about fixed axes."""
    out = np.eye(3)
    for angle, axis in zip(_numbers(words, 3), order.lower(), strict=True):
        out = rotation_about(axis, np.radians(angle) if degrees else angle) @ out
    return out


def read_asf(file: Path) -> Skeleton:
    """The skeleton in an .asf file. Raises InputError where it is not whole."""
    text = text_of(file)
    try:
        if len(text) > MAX_JOINTS * _PER_BONE:
            raise ValueError("its skeleton is not a body's")
        return _skeleton(_sections(text))
    except (KeyError, IndexError, ValueError) as error:
        raise InputError(
            f"The ASF file '{file}' is damaged or breaks off (near: {str(error)[:120]}); get it "
            "again from where it came."
        ) from None


def _skeleton(sections: dict[str, list[list[str]]]) -> Skeleton:
    units = {words[0].lower(): words[1] for words in sections["units"]}
    degrees = units.get("angle", "deg").lower().startswith("deg")
    root = {words[0].lower(): words[1:] for words in sections["root"]}
    bones: dict[str, dict[str, list[str]]] = {}
    current: dict[str, list[str]] = {}
    for words in sections["bonedata"]:
        key = words[0].lower()
        if key == "begin":
            current = {}
        elif key == "end":
            bones[current["name"][0].lower()] = current
        else:
            current[key] = words[1:]

    place, parents = {"root": 0}, [-1]
    names = ["root"]
    for words in sections["hierarchy"]:
        if words[0].lower() in ("begin", "end"):
            continue
        parent = place[words[0].lower()]
        for name in words[1:]:
            if name.lower() in place:
                raise ValueError(f"'{printable(name)}' hangs from several bones")
            place[name.lower()] = len(names)
            names.append(printable(name))
            parents.append(parent)

    vectors, axes = [np.zeros(3)], [_turn(root["orientation"], root["axis"][0], degrees)]
    freedoms = [tuple(word.lower() for word in root["order"])]
    for name in list(place)[1:]:
        bone = bones[name]
        vectors.append(_numbers(bone["direction"], 3) * _numbers(bone["length"], 1))
        axes.append(_turn(bone["axis"][:3], bone["axis"][3], degrees))
        freedoms.append(tuple(word.lower() for word in bone.get("dof", [])))

    known = {"tx", "ty", "tz", "rx", "ry", "rz", "l"}
    if not set().union(*freedoms) <= known:
        raise ValueError("dof")

    length = float(_numbers([units.get("length", "1")], 1)[0])
    if length <= 0:
        raise ValueError("the unit of length")

    return Skeleton(
        tuple(names),
        tuple(parents),
        np.stack(vectors),
        np.stack(axes),
        tuple(freedoms),
        _numbers(root["position"], 3),
        _INCH / length,
        degrees,
    )


def bones_of_amc(file: Path) -> set[str]:
    """Names of the bones, in lower case, that an .amc file moves."""
    return {
        words[0].lower()
        for words in _lines(text_of(file))
        if not words[0].startswith(":") and not words[0].isdigit()
    }


def read_amc(file: Path, skeleton: Skeleton) -> Recording:
    """The recording in an .amc file of a skeleton. Joints are called by the bone that begins there,
    ends of leaf bones "<bone> end". Raises InputError where the file is not whole or is another
    skeleton's.
    """
    rate, degrees, frames = None, skeleton.degrees, 0
    freedoms = {
        bone.lower(): len(own) for bone, own in zip(skeleton.bones, skeleton.freedoms, strict=True)
    }
    values = {bone: array("d") for bone in freedoms}
    for words in _lines(text_of(file)):
        key = words[0].lower()
        if key == ":samples-per-second":
            rate = _rate(words[1:], file)
        elif key in (":degrees", ":radians"):
            degrees = key == ":degrees"
        elif key.isdigit():
            frames += 1
        elif key in values:
            count, before = len(words) - 1, len(values[key])
            try:
                values[key].extend(map(float, words[1:]))
            except ValueError:
                count = 0
            if count != freedoms[key] or before != (frames - 1) * count:
                raise _broken(file, words[0], freedoms[key], frames)
        elif not key.startswith(":"):
            raise InputError(
                f"The AMC file '{file}' moves the bone '{printable(words[0])}', which its .asf "
                "does not have; put it beside "
                "its own .asf."
            )

    check_size(file, frames, 2 * len(skeleton.bones), sum(map(len, values.values())))
    moved = []
    for bone, numbers in values.items():
        numbers = numbers or array("d", bytes(8 * frames * freedoms[bone]))
        angles = np.array(numbers)
        if frames < 1 or len(numbers) != frames * freedoms[bone] or not sound(angles):
            raise _broken(file, bone, freedoms[bone], frames)

        moved.append(angles.reshape(frames, freedoms[bone]))

    return _recording(skeleton, moved, degrees, rate)


def _rate(words: list[str], file: Path) -> float:
    try:
        return float(_numbers(words, 1)[0])
    except ValueError:
        raise InputError(
            f"The AMC file '{file}' gives no number as its samples per second; mend its line "
            ":SAMPLES-PER-SECOND."
        ) from None


def _broken(file: Path, bone: str, count: int, frames: int) -> InputError:
    return InputError(
        f"The AMC file '{file}' does not give the bone '{printable(bone)}' {count} numbers in "
        f"each of its {frames} frames, so "
        "that it has broken off or is another skeleton's; get it again from where it came."
    )


def _recording(
    skeleton: Skeleton, moved: list[np.ndarray], degrees: bool, rate: float | None
) -> Recording:
    bones = list(skeleton.bones)
    leaves = sorted({*range(1, len(bones))} - {*skeleton.parents})
    names = (*bones, *(f"{bones[b]} end" for b in leaves))
    parents = (*skeleton.parents, *leaves)
    # A joint lies at the beginning of its bone, which is the end of the bone before it.
    begins = np.concatenate([np.zeros((1, 3)), skeleton.vectors[list(parents[1:])]])

    def pose(rows: slice) -> tuple[np.ndarray, np.ndarray]:
        frames = len(moved[0][rows])
        offsets = np.repeat(begins[None], frames, axis=0)
        offsets[:, 0] = skeleton.position
        local = np.tile(np.eye(3), (frames, len(names), 1, 1))
        for b, axis in enumerate(skeleton.axes):
            turn = np.tile(np.eye(3), (frames, 1, 1))
            for freedom, column in zip(skeleton.freedoms[b], moved[b][rows].T, strict=True):
                if freedom[0] == "r":
                    turn = (
                        rotation_about(freedom[1], np.radians(column) if degrees else column) @ turn
                    )
                elif freedom[0] == "t" and b == 0:
                    offsets[:, 0, "xyz".index(freedom[1])] += column
            local[:, b] = axis @ turn @ axis.T

        return offsets, local

    rest = posed(parents, begins[None], np.tile(np.eye(3), (1, len(names), 1, 1)))[0]
    positions = posed_in_blocks(parents, len(moved[0]), pose)
    return Recording(names, parents, positions, rest, rate, skeleton.unit)
