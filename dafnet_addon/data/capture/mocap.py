"""Reads a folder of motion capture, whatever its files are: the compact form, BVH, ASF/AMC and
AMASS archives.

The compact form (.npz) holds positions of the 22 joints as 16-bit millimetre differences, and says
itself whose they are. For other files a ``clips.json`` or ``clips.csv`` says it (see ``stated``). A
clip whose licence nobody states is read, but is of no split, so that nothing is ever trained on it.
"""

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from .acclaim import Skeleton, bones_of_amc, read_amc, read_asf
from .amass import AMASS, read_amass
from .archive import names_in, read_arrays
from .bvh import read_bvh
from .recording import Recording
from .rigs import mapped
from .stated import Stated
from .world import at_model_rate, floor_height, unit_of, uprightness, z_up

__all__ = ["Clip", "UNSTATED", "leaving_out", "read_clips"]

UNSTATED = "unknown"
"""The licence of a clip of which nobody says under what licence it is."""

_COMPACT = {"first_mm", "delta_mm"}  # arrays that the compact form is known by
_RATES = (1.0, 1000.0)  # frames a second
_LONGEST = 3600  # seconds of a clip
_AMC_RATE = 120.0  # CMU's and HDM05's; .amc files seldom say
_CATEGORIES = {  # the first that has a word of the file's name
    "sit-stand": "sit sits sitting sitdown seat seated chair stool standup",
    "lying": "lie lying lies laying liedown sleep bed",
    "reach-hand-task": "reach grab pick place put deposit take wash write type "
    "wipe box carry lift drink move",
    "greeting": "wave waving greet handshake bow hello",
    "locomotion": "walk walking run running jog step turn turning forward backward sidestep",
    "standing": "stand standing idle wait",
}


@dataclass(frozen=True)
class Clip:
    """``joints`` (T, 22, 3): world, metres, z up, 30 fps, in the source's own proportions; the rest
    says what it is.
    """

    name: str
    source: str
    subject: str
    description: str
    category: str
    split: str
    licence: str
    joints: np.ndarray


@contextmanager
def leaving_out(left_out: list[str] | None) -> Iterator[None]:
    """Where a list is given, an InputError ends what is inside and its sentence is noted; otherwise
    it goes on up.
    """
    try:
        yield
    except InputError as error:
        if left_out is None:
            raise
        left_out.append(str(error))


def read_clips(folder: Path, left_out: list[str] | None = None) -> Iterator[Clip]:
    """Every clip of every motion file in ``folder`` and its subfolders: first the compact ones by
    name.

    Where a list is given, a sentence is added to it for all that cannot be used, and the rest is
    read; otherwise the first such file raises InputError. Raises it, too, where nothing is found.
    Hidden files are passed over, such as those that a Mac puts beside others.
    """
    folder = Path(folder)
    stated = Stated(folder)
    files = sorted(
        (
            f
            for f in folder.rglob("*")
            if f.suffix.lower() in (".npz", ".bvh", ".amc") and _is_there(f, folder)
        ),
        key=lambda f: (len(f.relative_to(folder).parts), f.suffix.lower() != ".npz", f),
    )
    found = False
    raw: dict[Path, list[Path]] = defaultdict(list)
    for file in files:
        with leaving_out(left_out):
            arrays = set(names_in(file)) if file.suffix.lower() == ".npz" else set(AMASS)
            if arrays & _COMPACT:
                for clip in _compact(file, left_out):
                    found = True
                    yield clip
            elif arrays >= AMASS:
                raw[file.parent].append(file)
            elif left_out is not None and arrays & AMASS:
                left_out.append(
                    f"The archive '{file}' is not a motion, since it lacks "
                    f"{', '.join(sorted(AMASS - arrays))}."
                )

    for own in raw.values():
        for clip in _clips(folder, own, stated, left_out):
            found = True
            yield clip

    if not found:
        raise InputError(
            f"None of the motion files in the folder '{folder}' can be used; of the first: "
            f"{left_out[0]}"
            if left_out
            else (
                f"The folder '{folder}' holds no motion files (.npz, .bvh, or .amc with its "
                ".asf); give the folder that holds them."
            )
        )

    if left_out is not None:
        left_out += stated.unmet([file.relative_to(folder) for file in files])


def _is_there(file: Path, folder: Path) -> bool:
    """Whether it is a file, or a link that may be broken, and nothing hidden."""
    hidden = any(
        part.startswith(".") or part == "__MACOSX" for part in file.relative_to(folder).parts
    )
    return not hidden and (file.is_file() or file.is_symlink())


def _compact(file: Path, left_out: list[str] | None) -> Iterator[Clip]:
    """The clips of an archive of the compact form. Raises InputError where it is not whole."""
    words, first, delta, frames = read_arrays(file, "clips", "first_mm", "delta_mm", "frames")
    try:
        infos = [dict(info) for info in json.loads(str(words))]
    except (ValueError, TypeError, RecursionError):
        infos = []

    counted = (
        frames.ndim == 1 and frames.dtype.kind in "iu" and frames.size > 0 and int(frames.min()) > 0
    )
    shapes = (len(infos), 22, 3), (int(frames.sum()) - len(frames) if counted else -1, 22, 3)
    if (
        (first.shape, delta.shape) != shapes
        or len(frames) != len(infos)
        or not (_whole(first) and _whole(delta))
    ):
        raise InputError(
            f"The archive '{file}' does not hold the joints of as many clips and frames as it "
            "says; get it again from where "
            "it came."
        )

    ends = np.concatenate([[0], np.cumsum(frames.astype(np.int64) - 1)])
    for i, info in enumerate(infos):
        with leaving_out(left_out):
            steps = delta[ends[i] : ends[i + 1]].astype(np.int64)
            joints = np.concatenate([first[i][None].astype(np.int64), steps]).cumsum(0) / 1000.0
            name = str(info.get("clip", f"{file.stem} {i}"))
            if unit_of(joints, 1.0, file / name) != 1.0:
                raise InputError(
                    f"The body in '{file / name}' is not a grown person's in metres; scale it."
                )
            yield _clip(name, file.stem, file.stem, {"split": "", **info}, joints)


def _whole(numbers: np.ndarray) -> bool:
    """Whether all are whole numbers of millimetres that 32 bits hold."""
    return numbers.dtype.kind in "iu" and (
        not numbers.size or (int(numbers.min()) > -(2**31) and int(numbers.max()) < 2**31)
    )


def _clip(name: str, source: str, subject: str, fields: dict[str, Any], joints: np.ndarray) -> Clip:
    """A clip by what is stated of it: ``source`` and ``subject`` where nothing else is; without a
    licence, of no split.
    """
    file = name.rsplit("/", 1)[-1]
    licence = str(fields.get("licence") or UNSTATED)
    split = str(fields.get("split", "train"))
    return Clip(
        name=name,
        source=str(fields.get("source", source)),
        subject=str(fields.get("subject", subject)),
        description=str(fields.get("description", file)),
        category=str(fields.get("category", _category(file))),
        split=split if split in ("train", "test") and licence != UNSTATED else "",
        licence=licence,
        joints=joints,
    )


def _recorded(file: Path, skeletons: dict[Path, Skeleton | InputError]) -> Recording:
    """The recording in a file that is not of the compact form; ``skeletons`` are those of the .asf
    files beside it.
    """
    kind = file.suffix.lower()
    if kind == ".bvh":
        return read_bvh(file)
    if kind == ".npz":
        return read_amass(file)

    moved = bones_of_amc(file)
    whole = {asf: found for asf, found in skeletons.items() if isinstance(found, Skeleton)}
    fitting = {
        asf: found
        for asf, found in whole.items()
        if moved <= {bone.lower() for bone in found.bones}
    }
    # CMU's 01.asf belongs to 01_01.amc, HDM05's HDM_bd.asf to HDM_bd_01-01_01_120.amc.
    named = sorted(
        (asf for asf in fitting if file.stem.startswith(asf.stem)), key=lambda asf: len(asf.stem)
    )
    if not named and len(fitting) != 1:
        for broken in skeletons.values():
            if isinstance(broken, InputError):
                raise broken
        raise InputError(
            f"The file '{file}' needs its skeleton, but {len(fitting)} .asf files beside it have "
            "its bones; put its own there, "
            "named as the .amc begins."
        )

    return read_amc(file, fitting[named[-1]] if named else next(iter(fitting.values())))


def _skeletons(folder: Path) -> dict[Path, Skeleton | InputError]:
    """The skeletons of a folder's .asf files, or why they cannot be used."""
    found: dict[Path, Skeleton | InputError] = {}
    for asf in sorted(
        f for f in folder.iterdir() if f.suffix.lower() == ".asf" and _is_there(f, folder)
    ):
        try:
            found[asf] = read_asf(asf)
        except InputError as error:
            found[asf] = error

    return found


def _category(name: str) -> str:
    words = set(re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()))
    return next(
        (category for category, telling in _CATEGORIES.items() if words & set(telling.split())),
        "other",
    )


@dataclass(frozen=True)
class _Read:
    """A recording's joints (T, 22, 3), metres, 30 fps, along the file's axes, and what speaks for y
    and z as the way up.
    """

    path: Path
    fields: dict[str, str]
    joints: np.ndarray
    upright: np.ndarray


def _read(
    file: Path, folder: Path, stated: Stated, skeletons: dict[Path, Skeleton | InputError]
) -> _Read:
    path = file.relative_to(folder)
    fields = stated.of(path)
    recording = _recorded(file, skeletons)
    joints, rest = mapped(recording, file)
    rate = float(
        fields.get("fps", recording.rate or (_AMC_RATE if file.suffix.lower() == ".amc" else 0.0))
    )
    if not _RATES[0] <= rate <= _RATES[1] or len(joints) > rate * _LONGEST:
        raise InputError(
            f"The file '{file}' has {len(joints)} frames at {rate:g} a second, which no motion "
            "has; state its right rate as "
            f"'fps' in {folder / 'clips.json'}."
            if rate
            else (
                f"The file '{file}' does not say its frame rate; state it as 'fps' in "
                f"{folder / 'clips.json'}."
            )
        )

    metres = joints * unit_of(joints, recording.unit, file)
    return _Read(path, fields, at_model_rate(metres, rate), uprightness(joints, rest))


def _clips(
    folder: Path, files: list[Path], stated: Stated, left_out: list[str] | None
) -> Iterator[Clip]:
    """Clips of the files of one folder, which share a way up: one that only lies does not show
    it.
    """
    skeletons = _skeletons(files[0].parent)
    ours = []
    for file in files:
        with leaving_out(left_out):
            ours.append(_read(file, folder, stated, skeletons))

    evidence = sum((read.upright for read in ours), np.zeros(2))
    for read in ours:
        joints = z_up(read.joints, read.fields.get("up", "z" if evidence[1] > evidence[0] else "y"))
        source, parent = folder.resolve().name, read.path.parent.as_posix()
        yield _clip(
            read.path.with_suffix("").as_posix(),
            source,
            source if parent == "." else parent,
            read.fields,
            joints - (0.0, 0.0, floor_height(joints)),
        )
