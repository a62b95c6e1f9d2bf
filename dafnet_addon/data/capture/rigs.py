"""Which joint of a captured skeleton is which of ours: maps by name, one file each in ``rigs/``,
checked on the skeleton.

A map says for each of our 22 joints the source's joint, or several with weights that sum to one
where ours lies between them. ``known_by`` lists further names that tell the convention from others.
Names are compared without case, spaces, underscores, a prefix that ends in a colon, and one that
the pelvis has before its name, as in ``mixamorig1_Hips``.
"""

import json
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.skeleton import JOINTS, PARENTS, joint
from .recording import Recording

__all__ = ["Rig", "rigs", "rig_of", "mapped"]


_PREFIXES = 8  # tried at most


@dataclass(frozen=True)
class Rig:
    """One convention: ``joints`` gives each of our joints as source names (normalised) and
    weights.
    """

    name: str
    about: str
    known_by: frozenset[str]
    joints: dict[str, dict[str, float]]

    @property
    def needs(self) -> frozenset[str]:
        """Every source name without which the map does not hold."""
        return self.known_by | {name for weights in self.joints.values() for name in weights}


def _plain(name: str) -> str:
    return name.rsplit(":", 1)[-1].replace("_", "").replace(" ", "").lower()


@cache
def rigs() -> tuple[Rig, ...]:
    """Every convention that is known, those that ask for most names first."""
    found = []
    for file in sorted((Path(__file__).parent / "rigs").glob("*.json")):
        data = json.loads(file.read_text(encoding="utf-8"))
        joints = {
            ours: {
                _plain(name): weight
                for name, weight in (theirs if isinstance(theirs, dict) else {theirs: 1.0}).items()
            }
            for ours, theirs in data["joints"].items()
        }
        found.append(
            Rig(file.stem, data["about"], frozenset(_plain(n) for n in data["known_by"]), joints)
        )

    return tuple(sorted(found, key=lambda rig: (-len(rig.needs), rig.name)))


def _called(names: tuple[str, ...], rig: Rig) -> dict[str, int]:
    """Joints by the names that a convention may know them by: without the prefix that leaves it the
    most.
    """
    plain = {_plain(name): i for i, name in reversed(list(enumerate(names)))}
    if "root" in plain:
        plain.setdefault("hips", 0)  # the root has no name of its own in an .asf file
    pelvis = max(rig.joints["pelvis"], key=lambda name: rig.joints["pelvis"][name])
    prefixes = {"", *(name.removesuffix(pelvis) for name in plain if name.endswith(pelvis))}
    likely = sorted(prefixes, key=lambda prefix: (len(prefix), prefix))[:_PREFIXES]
    called = [{name.removeprefix(prefix): i for name, i in plain.items()} for prefix in likely]
    return max(called, key=lambda own: len(rig.needs & own.keys()))


def rig_of(recording: Recording, file: Path) -> tuple[Rig, dict[str, int]]:
    """The convention of a recording's skeleton, and its joints by the names that it knows them by.

    Raises InputError, naming the joints that are missing, where there is none.
    """
    found = [(rig, _called(recording.names, rig)) for rig in rigs()]
    for rig, index in found:
        if rig.needs <= index.keys():
            return rig, index

    nearest, index = min(
        found, key=lambda pair: len(pair[0].needs - pair[1].keys()) / len(pair[0].needs)
    )
    lacking = [ours for ours, theirs in nearest.joints.items() if not theirs.keys() <= index.keys()]
    wanted = sorted({n for ours in lacking for n in nearest.joints[ours]} - index.keys())
    wanted = wanted or sorted(nearest.known_by - index.keys())
    raise InputError(
        f"The skeleton of '{file}' is of no known convention: to be read as '{nearest.name}' it "
        f"lacks {', '.join(wanted)} (for "
        f"{', '.join(lacking) or 'telling it apart'}); rename its joints, or add a map to "
        "dafnet_addon/data/capture/rigs."
    )


def _check(
    recording: Recording, rig: Rig, index: dict[str, int], joints: np.ndarray, file: Path
) -> None:
    """Raises InputError where names match but the skeleton is not hung together, or not built, as a
    body is.
    """

    def above(source: int) -> set[int]:
        chain: set[int] = set()
        while source >= 0:
            chain.add(source)
            source = recording.parents[source]
        return chain

    main = [index[max(rig.joints[name], key=lambda n: rig.joints[name][n])] for name in JOINTS]
    for name in JOINTS[1:]:
        whole = [j for j in (joint(name), PARENTS[joint(name)]) if len(rig.joints[JOINTS[j]]) == 1]
        if len(whole) == 2 and main[whole[1]] not in above(main[whole[0]]):
            child, parent = (recording.names[main[j]] for j in whole)
            raise InputError(
                f"The skeleton of '{file}' matches '{rig.name}' by name, but its joint '{child}' "
                "does not hang from "
                f"'{parent}'; mend its hierarchy."
            )

    def length(*chain: str) -> float:
        bones = [joints[:, joint(a)] - joints[:, joint(b)] for a, b in pairwise(chain)]
        return float(sum(np.median(np.linalg.norm(bone, axis=-1)) for bone in bones))

    leg = length("left_hip", "left_knee", "left_ankle")
    checks = [
        ("legs differ in length", length("right_hip", "right_knee", "right_ankle"), (0.85, 1.18)),
        ("thigh is no match for its leg", length("left_hip", "left_knee"), (0.35, 0.65)),
        ("trunk is no match for its legs", length("pelvis", "neck"), (0.30, 0.85)),
        (
            "arm is no match for its legs",
            length("left_shoulder", "left_elbow", "left_wrist"),
            (0.40, 0.90),
        ),
        (
            "arms differ in length",
            length("right_shoulder", "right_elbow", "right_wrist"),
            (0.40, 0.90),
        ),
        ("hips lie too far apart", length("left_hip", "right_hip"), (0.08, 0.45)),
    ]
    for what, found, (least, most) in checks:
        if not least * leg <= found <= most * leg:
            raise InputError(
                f"The skeleton of '{file}' matches '{rig.name}' by name, but its {what} "
                f"({found / max(leg, 1e-9):.2f} of the "
                f"left leg's length, a body has {least} to {most}); rename its joints to what "
                "they are."
            )


def mapped(recording: Recording, file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Our joints (T, 22, 3) of a recording, and (22, 3) of its rest pose, in its own units and
    axes.

    Raises InputError where its skeleton is of no known convention, or is not a body's.
    """
    rig, index = rig_of(recording, file)
    weights = np.zeros((len(JOINTS), len(recording.names)))
    for ours, theirs in rig.joints.items():
        for name, weight in theirs.items():
            weights[joint(ours), index[name]] = weight
    joints = weights @ recording.positions
    _check(recording, rig, index, joints, file)
    return joints, weights @ recording.rest
