"""Reads a folder of motion capture, whatever its files are: the compact form, BVH, ASF/AMC and AMASS archives.

The compact form (.npz) holds positions of the 22 joints as 16-bit millimetre differences, and says itself whose they are.
For other files a ``clips.json`` in the folder says it, or a ``clips.csv`` (columns ``file`` and the same words):

    {"*": {"licence": "CC0"}, "s2/*.bvh": {"subject": "s2", "split": "test", "category": "sit-stand"}}

Names are file names or patterns relative to the folder; later lines win. A clip whose licence nobody states is read, but is of
no split, so that nothing is ever trained on it.
"""

import csv
import json
import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from ..core.errors import InputError
from .acclaim import bones_of_amc, read_amc, read_asf
from .amass import is_amass, read_amass
from .bvh import read_bvh
from .recording import Recording
from .rigs import mapped
from .world import at_model_rate, floor_height, unit_of, uprightness, z_up

__all__ = ["Clip", "UNSTATED", "read_clips"]

UNSTATED = "unknown"
"""The licence of a clip of which nobody says under what licence it is."""

_FIELDS = {"source", "subject", "description", "category", "split", "licence", "fps", "up"}
_FORMS = {"split": "|train|test", "up": "|y|z", "fps": r"|[1-9]\d*(\.\d+)?"}  # nothing, or what else it may be
_AMC_RATE = 120.0  # CMU's and HDM05's; .amc files seldom say
_CATEGORIES = {  # the first that has a word of the file's name
    "sit-stand": "sit sits sitting sitdown seat seated chair stool standup",
    "lying": "lie lying lies laying liedown sleep bed",
    "reach-hand-task": "reach grab pick place put deposit take wash write type wipe box carry lift drink move",
    "greeting": "wave waving greet handshake bow hello",
    "locomotion": "walk walking run running jog step turn turning forward backward sidestep",
    "standing": "stand standing idle wait",
}


@dataclass(frozen=True)
class Clip:
    """``joints`` (T, 22, 3): world, metres, z up, 30 fps, in the source's own proportions; the rest says what it is."""

    name: str
    source: str
    subject: str
    description: str
    category: str
    split: str
    licence: str
    joints: np.ndarray


def read_clips(folder: Path) -> Iterator[Clip]:
    """Every clip of every motion file in ``folder`` and its subfolders: first the folder's own .npz files by name.

    Raises InputError where there is none, or one cannot be read.
    """
    folder = Path(folder)
    stated = _stated(folder)
    files = sorted(
        (f for f in folder.rglob("*") if f.suffix.lower() in (".npz", ".bvh", ".amc")),
        key=lambda f: (len(f.relative_to(folder).parts), f.suffix.lower() != ".npz", f),
    )
    found = False
    raw: dict[Path, list[tuple[Path, Recording]]] = defaultdict(list)
    for file in files:
        arrays = _arrays(file) if file.suffix.lower() == ".npz" else []
        if "delta_mm" in arrays:
            found = True
            yield from _compact(file)
        elif not arrays or is_amass(arrays):
            raw[file.parent].append((file, _recorded(file)))
    for recordings in raw.values():
        found = True
        yield from _clips(folder, recordings, stated)
    if not found:
        raise InputError(
            f"The folder '{folder}' holds no motion files (.npz, .bvh, or .amc with its .asf); give the folder that holds them."
        )


def _arrays(file: Path) -> list[str]:
    """Names of the arrays in an archive."""
    try:
        with np.load(file) as z:
            return list(z.files)
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise InputError(f"The archive '{file}' cannot be read ({error}); download it again.") from None


def _compact(file: Path) -> Iterator[Clip]:
    with np.load(file) as z:
        infos = json.loads(str(z["clips"]))
        first, delta, frames = z["first_mm"], z["delta_mm"], z["frames"]
    ends = np.concatenate([[0], np.cumsum(frames - 1)])
    for i, info in enumerate(infos):
        steps = delta[ends[i] : ends[i + 1]].astype(np.int32)
        millimetres = np.concatenate([first[i][None].astype(np.int32), steps]).cumsum(0)
        yield Clip(
            info["clip"], file.stem, info["subject"], info["description"], info["category"], info["split"],
            info["licence"], millimetres / 1000.0,
        )


def _stated(folder: Path) -> list[tuple[str, dict[str, str]]]:
    """What ``clips.json`` or ``clips.csv`` states: patterns of file names, with the fields given for them, in order."""
    as_json, as_csv = folder / "clips.json", folder / "clips.csv"
    file = as_json if as_json.exists() else as_csv
    rows: list[tuple[str, dict[str, str]]] = []
    try:
        if as_json.exists():
            stated = json.loads(file.read_text(encoding="utf-8"))
            rows = [(name, {k: str(v) for k, v in fields.items()}) for name, fields in stated.items()]
        elif as_csv.exists():
            with file.open(newline="", encoding="utf-8") as lines:
                rows = [(row.pop("file"), {str(k): v for k, v in row.items() if v}) for row in csv.DictReader(lines)]
    except (ValueError, AttributeError, KeyError) as error:
        raise InputError(
            f"The file '{file}' does not list clips by file name ({error}); write it like "
            """{"*.bvh": {"licence": "CC0", "subject": "s1"}}, or as CSV with a column 'file'."""
        ) from None
    for pattern, fields in rows:
        wrong = sorted(set(fields) - _FIELDS)
        wrong += [k for k, form in _FORMS.items() if not re.fullmatch(form, fields.get(k, ""))]
        if wrong:
            raise InputError(
                f"The file '{file}' states for '{pattern}' what cannot be used ({', '.join(wrong)}); give any of "
                f"{', '.join(sorted(_FIELDS))}, with split 'train' or 'test', up 'y' or 'z' and fps a number."
            )
    return rows


def _recorded(file: Path) -> Recording:
    """The recording in a file that is not of the compact form."""
    kind = file.suffix.lower()
    if kind == ".bvh":
        return read_bvh(file)
    if kind == ".npz":
        return read_amass(file)
    moved = bones_of_amc(file)
    skeletons = {asf: read_asf(asf) for asf in sorted(file.parent.glob("*.[aA][sS][fF]"))}
    fitting = {asf: skeleton for asf, skeleton in skeletons.items() if moved <= set(skeleton.bones)}
    # CMU's 01.asf belongs to 01_01.amc, HDM05's HDM_bd.asf to HDM_bd_01-01_01_120.amc.
    named = sorted((asf for asf in fitting if file.stem.startswith(asf.stem)), key=lambda asf: len(asf.stem))
    if not named and len(fitting) != 1:
        raise InputError(
            f"The file '{file}' needs its skeleton, but {len(fitting)} .asf files beside it have its bones; put its own there, "
            "named as the .amc begins."
        )
    return read_amc(file, fitting[named[-1]] if named else next(iter(fitting.values())))


def _category(name: str) -> str:
    words = set(re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()))
    return next((category for category, telling in _CATEGORIES.items() if words & set(telling.split())), "other")


def _clips(
    folder: Path, recordings: list[tuple[Path, Recording]], stated: list[tuple[str, dict[str, str]]]
) -> Iterator[Clip]:
    """Clips of one folder's recordings, which share a way up: one that only lies does not show it."""
    ours = [(file, recording, *mapped(recording, file)) for file, recording in recordings]
    evidence = sum((uprightness(joints, rest) for *_, joints, rest in ours), np.zeros(2))
    for file, recording, joints, _ in ours:
        path = file.relative_to(folder)
        fields: dict[str, str] = {}
        for pattern, given in stated:
            if fnmatch(path.as_posix(), pattern):
                fields |= given
        up = fields.get("up", "z" if evidence[1] > evidence[0] else "y")
        rate = float(fields.get("fps", recording.rate or (_AMC_RATE if file.suffix.lower() == ".amc" else 0.0)))
        if rate <= 0:
            raise InputError(f"The file '{file}' does not say its frame rate; state it as 'fps' in {folder / 'clips.json'}.")
        joints = z_up(at_model_rate(joints * unit_of(joints, recording.unit, file), rate), up)
        licence = fields.get("licence", UNSTATED)
        yield Clip(
            path.with_suffix("").as_posix(), fields.get("source", folder.resolve().name),
            fields.get("subject", path.parent.as_posix() if len(path.parts) > 1 else folder.resolve().name),
            fields.get("description", file.stem), fields.get("category", _category(file.stem)),
            fields.get("split", "train") if licence != UNSTATED else "", licence, joints - (0.0, 0.0, floor_height(joints)),
        )
