"""Reads Biovision hierarchies (.bvh): a skeleton of offsets, and channels of angles in degrees for every frame."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from .recording import Recording, posed, rotation_about

__all__ = ["read_bvh"]


@dataclass
class _Joint:
    name: str
    parent: int
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    channels: list[str] = field(default_factory=list)


def _hierarchy(tokens: list[str]) -> tuple[list[_Joint], int]:
    """Joints, parents first, and the index of the token MOTION. Raises IndexError or ValueError where it breaks off."""
    joints: list[_Joint] = []
    open_joints: list[int] = []
    i = 1
    while tokens[i].upper() != "MOTION":
        word = tokens[i].upper()
        if word in ("ROOT", "JOINT", "END"):
            start = tokens.index("{", i)
            parent = open_joints[-1] if open_joints else -1
            name = f"{joints[parent].name} end" if word == "END" else " ".join(tokens[i + 1 : start])
            joints.append(_Joint(name, parent))
            open_joints.append(len(joints) - 1)
            i = start + 1
        elif word == "OFFSET":
            joints[open_joints[-1]].offset = tuple(float(t) for t in tokens[i + 1 : i + 4])
            i += 4
        elif word == "CHANNELS":
            count = int(tokens[i + 1])
            joints[open_joints[-1]].channels = [c.lower() for c in tokens[i + 2 : i + 2 + count]]
            i += 2 + count
        elif word == "}":
            open_joints.pop()
            i += 1
        else:
            raise ValueError(tokens[i])
    if open_joints or not joints:
        raise ValueError("braces")
    return joints, i


def read_bvh(file: Path) -> Recording:
    """The recording in a .bvh file; end sites are joints called "<parent> end".

    Channels turn in the order they are listed (the first is the outermost rotation); a position channel stands in for that
    part of its joint's offset. Raises InputError where the file is not whole.
    """
    tokens = file.read_text(encoding="latin-1").split()
    if not tokens or tokens[0].upper() != "HIERARCHY":
        raise InputError(f"The file '{file}' does not begin with HIERARCHY as a BVH file does; export it again as BVH.")
    try:
        joints, motion = _hierarchy(tokens)
        kinds = [c for joint in joints for c in joint.channels]
        known = {axis + what for axis in "xyz" for what in ("position", "rotation")}
        if not set(kinds) <= known or tokens[motion + 1].lower() != "frames:" or tokens[motion + 4].lower() != "time:":
            raise ValueError("header")
        frames, step = int(tokens[motion + 2]), float(tokens[motion + 5])
        values = np.array(tokens[motion + 6 :], dtype=float)
    except (IndexError, ValueError) as error:
        raise InputError(
            f"The BVH file '{file}' is damaged or breaks off (near: {error}); export it again from where it came."
        ) from None
    if frames < 1 or step <= 0 or len(values) != frames * len(kinds) or not np.isfinite(values).all():
        raise InputError(
            f"The BVH file '{file}' announces {frames} frames of {len(kinds)} numbers, {step} s apart, but holds {len(values)} "
            "numbers; export it again from where it came."
        )
    values = values.reshape(frames, len(kinds))

    parents = tuple(joint.parent for joint in joints)
    rest_offsets = np.array([joint.offset for joint in joints])
    offsets = np.repeat(rest_offsets[None], frames, axis=0)
    local = np.tile(np.eye(3), (frames, len(joints), 1, 1))
    column = 0
    for j, joint in enumerate(joints):
        for channel in joint.channels:
            axis = channel[0]
            if channel.endswith("position"):
                offsets[:, j, "xyz".index(axis)] = values[:, column]
            else:
                local[:, j] = local[:, j] @ rotation_about(axis, np.radians(values[:, column]))
            column += 1
    rest = posed(parents, rest_offsets[None], np.tile(np.eye(3), (1, len(joints), 1, 1)))[0]
    # Frame times are written with few digits: 0.0333333 is 30 a second.
    return Recording(tuple(j.name for j in joints), parents, posed(parents, offsets, local), rest, round(1.0 / step, 2))
