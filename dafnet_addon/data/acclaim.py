"""Reads Acclaim motion: a skeleton of bones (.asf) and, for it, the bones' angles in every frame (.amc)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from .recording import Recording, posed, rotation_about

__all__ = ["Skeleton", "read_asf", "read_amc", "bones_of_amc"]

_INCH = 0.0254


@dataclass(frozen=True)
class Skeleton:
    """An .asf file: ``bones`` (the root first, parents before children), each with its vector (3,) in the file's units, its
    axis rotation (3, 3) and the degrees of freedom it has in the .amc, in order. ``unit``: metres of one unit.
    """

    bones: tuple[str, ...]
    parents: tuple[int, ...]
    vectors: np.ndarray
    axes: np.ndarray
    freedoms: tuple[tuple[str, ...], ...]
    position: np.ndarray
    unit: float
    degrees: bool


def _sections(text: str) -> dict[str, list[list[str]]]:
    """The lines of a file, as words, under each of its ``:keyword`` lines; what follows the keyword is the first line."""
    sections: dict[str, list[list[str]]] = {}
    lines: list[list[str]] = []
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if words and words[0].startswith(":"):
            lines = sections.setdefault(words[0][1:].lower(), [])
            words = words[1:]
        if words:
            lines.append(words)
    return sections


def _turn(words: list[str], order: str, degrees: bool) -> np.ndarray:
    """The rotation of three angles; the first axis named turns first, about fixed axes."""
    out = np.eye(3)
    for word, axis in zip(words, order.lower(), strict=True):
        angle = float(word)
        out = rotation_about(axis, np.array(np.radians(angle) if degrees else angle)) @ out
    return out


def read_asf(file: Path) -> Skeleton:
    """The skeleton in an .asf file. Raises InputError where it is not whole."""
    try:
        return _skeleton(_sections(file.read_text(encoding="latin-1")))
    except (KeyError, IndexError, ValueError) as error:
        raise InputError(
            f"The ASF file '{file}' is damaged or breaks off (near: {error}); get it again from where it came."
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
            bones[current["name"][0]] = current
        else:
            current[key] = words[1:]

    names, parents = ["root"], [-1]
    for words in sections["hierarchy"]:
        if words[0].lower() not in ("begin", "end"):
            parent = names.index(words[0])
            names += words[1:]
            parents += [parent] * len(words[1:])
    vectors, axes, freedoms = [np.zeros(3)], [_turn(root["orientation"], root["axis"][0], degrees)], []
    freedoms.append(tuple(word.lower() for word in root["order"]))
    for name in names[1:]:
        bone = bones[name]
        vectors.append(np.array([float(x) for x in bone["direction"]]) * float(bone["length"][0]))
        axes.append(_turn(bone["axis"][:3], bone["axis"][3], degrees))
        freedoms.append(tuple(word.lower() for word in bone.get("dof", [])))
    known = {"tx", "ty", "tz", "rx", "ry", "rz", "l"}
    if not set().union(*freedoms) <= known or any(len(v) != 3 for v in vectors):
        raise ValueError("dof or direction")
    return Skeleton(
        tuple(names), tuple(parents), np.stack(vectors), np.stack(axes), tuple(freedoms),
        np.array([float(x) for x in root["position"]]), _INCH / float(units.get("length", "1")), degrees,
    )


def _amc_lines(file: Path) -> list[list[str]]:
    lines = [line.split("#")[0].split() for line in file.read_text(encoding="latin-1").splitlines()]
    return [words for words in lines if words]


def bones_of_amc(file: Path) -> set[str]:
    """Names of the bones that an .amc file moves."""
    return {words[0] for words in _amc_lines(file) if not words[0].startswith(":") and not words[0].isdigit()}


def read_amc(file: Path, skeleton: Skeleton) -> Recording:
    """The recording in an .amc file of a skeleton. Joints are called by the bone that begins there, ends of leaf bones
    "<bone> end". Raises InputError where the file is not whole or is another skeleton's.
    """
    rate, degrees, frames = None, skeleton.degrees, 0
    values: dict[str, list[list[str]]] = {}
    for words in _amc_lines(file):
        key = words[0].lower()
        if key == ":samples-per-second" and len(words) > 1:
            rate = float(words[1])
        elif key in (":degrees", ":radians"):
            degrees = key == ":degrees"
        elif key.isdigit():
            frames += 1
        elif not key.startswith(":"):
            values.setdefault(words[0], []).append(words[1:])
    strangers = sorted(set(values) - set(skeleton.bones))
    if strangers:
        raise InputError(
            f"The AMC file '{file}' moves the bone '{strangers[0]}', which its .asf does not have; put it beside its own .asf."
        )
    moved: dict[str, np.ndarray] = {}
    for bone, freedoms in zip(skeleton.bones, skeleton.freedoms, strict=True):
        try:
            moved[bone] = np.array(values.get(bone, [["0"] * len(freedoms)] * frames), dtype=float)
        except ValueError:
            moved[bone] = np.zeros(0)
        if frames < 1 or moved[bone].shape != (frames, len(freedoms)) or not np.isfinite(moved[bone]).all():
            raise InputError(
                f"The AMC file '{file}' does not give the bone '{bone}' {len(freedoms)} numbers in each of its {frames} "
                "frames, so that it has broken off or is another skeleton's; get it again from where it came."
            )
    return _recording(skeleton, moved, frames, degrees, rate)


def _recording(
    skeleton: Skeleton, moved: dict[str, np.ndarray], frames: int, degrees: bool, rate: float | None
) -> Recording:
    bones = list(skeleton.bones)
    leaves = [b for b in range(1, len(bones)) if b not in skeleton.parents]
    names = (*bones, *(f"{bones[b]} end" for b in leaves))
    parents = (*skeleton.parents, *leaves)
    # A joint lies at the beginning of its bone, which is the end of the bone before it.
    begins = np.concatenate([np.zeros((1, 3)), skeleton.vectors[list(parents[1:])]])
    offsets = np.repeat(begins[None], frames, axis=0)
    offsets[:, 0] = skeleton.position
    local = np.tile(np.eye(3), (frames, len(names), 1, 1))
    for b, (bone, axis) in enumerate(zip(bones, skeleton.axes, strict=True)):
        turn = np.tile(np.eye(3), (frames, 1, 1))
        for freedom, column in zip(skeleton.freedoms[b], moved[bone].T, strict=True):
            if freedom[0] == "r":
                turn = rotation_about(freedom[1], np.radians(column) if degrees else column) @ turn
            elif freedom[0] == "t" and b == 0:
                offsets[:, 0, "xyz".index(freedom[1])] += column
        local[:, b] = axis @ turn @ axis.T
    rest = posed(parents, begins[None], np.tile(np.eye(3), (1, len(names), 1, 1)))[0]
    return Recording(names, parents, posed(parents, offsets, local), rest, rate, skeleton.unit)
