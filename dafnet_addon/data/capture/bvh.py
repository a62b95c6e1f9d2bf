"""Reads Biovision hierarchies (.bvh): a skeleton of offsets, and channels of angles in degrees for
every frame.

Exporters take liberties, all of which are read: case, spaces, tabs and blank lines as they come,
decimal commas, end sites of any name, one frame more or less than is announced.
"""

import re
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from .recording import (
    MAX_JOINTS,
    Recording,
    check_size,
    numbers_in,
    posed,
    posed_in_blocks,
    printable,
    rotation_about,
    sound,
    text_of,
)

__all__ = ["read_bvh"]

_CHANNELS = {axis + what for axis in "xyz" for what in ("position", "rotation")}
_MOTION = re.compile(r"\bMOTION\s+(?=Frames)", re.IGNORECASE)
_TIMES = re.compile(r"Frames\s*:?\s*(\S+)\s+Frame\s*Time\s*:?\s*(\S+)", re.IGNORECASE)
_TIMES_WITHIN = 1000  # characters
_PER_JOINT = 1000  # characters of the hierarchy; real ones take about 150


@dataclass
class _Joint:
    name: str
    parent: int
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    channels: list[str] = field(default_factory=list)


def _hierarchy(text: str) -> list[_Joint]:
    """Joints, parents first. Raises ValueError, which says what is wrong, where it breaks off."""
    tokens = re.sub(r"([{}])", r" \1 ", text).split()
    joints: list[_Joint] = []
    open_joints: list[int] = []
    i = 1
    while i < len(tokens):
        word = tokens[i].upper()
        if word in ("ROOT", "JOINT", "END", "ENDSITE"):
            if joints and not open_joints:
                raise ValueError("it holds several skeletons")
            start = tokens.index("{", i)
            parent = open_joints[-1] if open_joints else -1
            named = (
                f"{joints[parent].name} end"
                if word.startswith("END")
                else " ".join(tokens[i + 1 : start])
            )
            joints.append(_Joint(printable(named), parent))
            open_joints.append(len(joints) - 1)
            i = start + 1
        elif word == "OFFSET" and open_joints:
            offset = numbers_in(" ".join(tokens[i + 1 : i + 4]))
            if len(offset) != 3 or not sound(offset):
                raise ValueError(f"the offset of '{joints[open_joints[-1]].name}'")
            joints[open_joints[-1]].offset = tuple(offset.tolist())
            i += 4
        elif word == "CHANNELS" and open_joints:
            channels = list(
                takewhile(
                    _CHANNELS.__contains__, (token.lower() for token in tokens[i + 2 : i + 8])
                )
            )
            if tokens[i + 1 : i + 2] != [str(len(channels))]:
                raise ValueError(f"the channels of '{joints[open_joints[-1]].name}'")
            joints[open_joints[-1]].channels = channels
            i += 2 + len(channels)
        elif word == "}" and open_joints:
            open_joints.pop()
            i += 1
        else:
            raise ValueError(f"'{printable(tokens[i])}'")

    if open_joints or not joints:
        raise ValueError("its braces")

    return joints


def _parts(text: str) -> tuple[list[_Joint], int, float, np.ndarray]:
    """The joints, the frames and the seconds between them as announced, and all numbers (N,).
    Raises ValueError.
    """
    motion = _MOTION.search(text)
    times = _TIMES.match(text[motion.end() : motion.end() + _TIMES_WITHIN]) if motion else None
    if motion is None or times is None:
        raise ValueError("it has no MOTION with Frames and Frame Time")
    if motion.start() > MAX_JOINTS * _PER_JOINT:
        raise ValueError("its skeleton is not a body's")

    announced, (step,) = int(times[1]), numbers_in(times[2])
    return (
        _hierarchy(text[: motion.start()]),
        announced,
        float(step),
        numbers_in(text[motion.end() + times.end() :]),
    )


def read_bvh(file: Path) -> Recording:
    """The recording in a .bvh file; end sites are joints called "<parent> end".

    Channels turn in the order they are listed (the first is the outermost rotation); a position
    channel stands in for that part of its joint's offset. Raises InputError where the file is not
    whole.
    """
    text = text_of(file)
    if not re.match(r"\s*HIERARCHY\b", text, re.IGNORECASE):
        raise InputError(
            f"The file '{file}' does not begin with HIERARCHY as a BVH file does; export it again "
            "as BVH."
        )

    try:
        joints, announced, step, values = _parts(text)
    except ValueError as error:
        raise InputError(
            f"The BVH file '{file}' is damaged or breaks off (near: {str(error)[:120]}); export "
            "it again from where it came."
        ) from None

    kinds = sum(len(joint.channels) for joint in joints)
    frames = len(values) // max(kinds, 1)
    # Several exporters count the rest pose, or forget it.
    if (
        frames < 1
        or abs(frames - announced) > 1
        or len(values) != frames * kinds
        or not sound(values)
    ):
        raise InputError(
            f"The BVH file '{file}' announces {announced} frames of {kinds} numbers, but holds "
            f"{len(values)} numbers, or some "
            "that no motion has; export it again from where it came."
        )

    check_size(file, frames, len(joints), len(values))
    return _recording(joints, values.reshape(frames, kinds), step)


def _recording(joints: list[_Joint], values: np.ndarray, step: float) -> Recording:
    parents = tuple(joint.parent for joint in joints)
    rest_offsets = np.array([joint.offset for joint in joints])

    def pose(rows: slice) -> tuple[np.ndarray, np.ndarray]:
        frames = len(values[rows])
        offsets = np.repeat(rest_offsets[None], frames, axis=0)
        local = np.tile(np.eye(3), (frames, len(joints), 1, 1))
        columns = iter(values[rows].T)
        for j, joint in enumerate(joints):
            for channel, column in zip(joint.channels, columns, strict=False):
                axis = channel[0]
                if channel.endswith("position"):
                    offsets[:, j, "xyz".index(axis)] = column
                else:
                    local[:, j] = local[:, j] @ rotation_about(axis, np.radians(column))

        return offsets, local

    rest = posed(parents, rest_offsets[None], np.tile(np.eye(3), (1, len(joints), 1, 1)))[0]
    # Frame times are written with few digits: 0.0333333 is 30 a second.
    rate = round(1.0 / step, 2) if step > 0 else None
    return Recording(
        tuple(j.name for j in joints),
        parents,
        posed_in_blocks(parents, len(values), pose),
        rest,
        rate,
    )
