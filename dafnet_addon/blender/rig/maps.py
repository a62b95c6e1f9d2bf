"""Which bone of an armature is which of our joints: maps by name, one JSON file each, those that
ship and the user's own.

A map's ``joints`` name the bones that are keyed. Where those are controls whose own poses are not
the body's, ``places`` name the bones that lie as the body does; ``limbs`` name the controls of
inverse kinematics, ``settings`` what has to be set on the rig, and ``known_by`` the bones that tell
the convention. Names are compared without case and without a prefix that ends in a colon (or
``mixamorig1_`` and the like).
"""

import json
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import bpy

from ...core.errors import InputError
from ...core.files import save_text
from ...core.skeleton import JOINTS
from ..preferences import ADDON

__all__ = [
    "NEEDED",
    "RigMap",
    "as_text",
    "detected",
    "edited",
    "from_text",
    "in_names_of",
    "load_map",
    "map_files",
    "required",
    "save_map",
    "user_folder",
]

NEEDED = tuple(
    name
    for name in JOINTS
    if not name.startswith("spine") and name != "neck" and not name.endswith(("_collar", "_foot"))
)
"""Joints without which a rig cannot be used."""

_PREFIX = re.compile(r"^(.*:|mixamorig\d*_)")
_SHIPPED = Path(__file__).parent / "shipped_maps"


@dataclass(frozen=True)
class RigMap:
    """One convention of names, or one armature's own.

    ``joints``: the bones to key, by joint. ``root``: the bone that carries the whole rig, or None.
    ``places``: the bones at whose heads joints lie, where those are others. ``limbs``: for a limb
    the bones ``end``, ``pole`` and perhaps ``toe``. ``settings``: (bone, custom property, value) to
    be set for limbs in ``FK``, in ``IK`` and in ``BOTH``.
    """

    name: str
    about: str = ""
    known_by: tuple[str, ...] = ()
    root: str | None = None
    joints: dict[str, str] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    limbs: dict[str, dict[str, str]] = field(default_factory=dict)
    settings: dict[str, tuple[tuple[str, str, float], ...]] = field(default_factory=dict)

    def place(self, joint: str) -> str | None:
        """The bone at whose head a joint lies."""
        return self.places.get(joint) or self.joints.get(joint)


def user_folder(create: bool = False) -> Path:
    """Where the user's own maps are kept: the extension's folder, or Blender's configuration where
    there is no extension.
    """
    if ADDON.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(ADDON, path="rig_maps", create=create))
    return Path(bpy.utils.user_resource("CONFIG", path="dafnet/rig_maps", create=create))


def map_files() -> dict[str, Path]:
    """Files of all maps by a name of their own: those that ship, then the user's ("my_" before the
    file's name).
    """
    shipped = {file.stem: file for file in sorted(_SHIPPED.glob("*.json"))}
    return shipped | {f"my_{file.stem}": file for file in sorted(user_folder().glob("*.json"))}


def load_map(file: Path) -> RigMap:
    """A map from its file; ``InputError`` where it cannot be read as one."""
    try:
        return from_text(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"'{file.name}' is not a rig preset that can be read; delete it and save the preset "
            "again."
        ) from error


def as_text(rig_map: RigMap) -> str:
    """A map as the JSON of its file."""
    return json.dumps(asdict(rig_map), indent=2)


def from_text(text: str) -> RigMap:
    """The inverse of ``as_text``; for any other text, ``ValueError``, ``KeyError``, ``TypeError``
    or ``AttributeError``.
    """
    data: dict[str, Any] = json.loads(text)
    settings = {
        kind: tuple((str(bone), str(key), float(value)) for bone, key, value in rows)
        for kind, rows in data.get("settings", {}).items()
    }
    return RigMap(
        name=str(data["name"]),
        about=str(data.get("about", "")),
        known_by=tuple(map(str, data.get("known_by", ()))),
        root=data.get("root"),
        settings=settings,
        joints={joint: str(bone) for joint, bone in data["joints"].items() if joint in JOINTS},
        places={
            joint: str(bone) for joint, bone in data.get("places", {}).items() if joint in JOINTS
        },
        limbs={limb: dict(bones) for limb, bones in data.get("limbs", {}).items()},
    )


def save_map(rig_map: RigMap, name: str) -> Path:
    """Write a map as the user's own preset of this name, over an older one.

    ``InputError``: the name is empty, or nothing can be written there.
    """
    stem = bpy.path.clean_name(name.strip()).lower()
    if not stem.strip("_"):
        raise InputError("The preset has no name; enter one.")

    text = as_text(replace(rig_map, name=name.strip(), known_by=tuple(rig_map.joints.values())))
    try:
        file = user_folder(create=True) / f"{stem}.json"
        save_text(file, text)
    except OSError as error:
        raise InputError(
            f"The preset cannot be written: {error.strerror}; check Blender's user folder."
        ) from error

    return file


def detected(armature: bpy.types.Object) -> RigMap:
    """The map that fits the armature's bones best, in its own names; without ``joints`` where
    nothing fits at all.

    A user's map counts before one that ships, and where no convention gives all the joints needed,
    the names are guessed at.
    """
    bones = armature.data.bones
    found: list[tuple[tuple[int, int, bool], RigMap]] = []
    for key, file in map_files().items():
        try:
            rig_map = load_map(file)
        except InputError:
            continue
        named = in_names_of(rig_map, bones.keys())
        if len(named.known_by) == len(rig_map.known_by):
            found.append(((len(named.joints), len(rig_map.known_by), key.startswith("my_")), named))

    best = max(found, key=lambda each: each[0])[1] if found else None
    if best is not None and all(joint in best.joints for joint in NEEDED):
        return best

    guess = _guessed(armature)
    return guess if best is None or len(guess.joints) > len(best.joints) else best


def in_names_of(rig_map: RigMap, bones: Iterable[str]) -> RigMap:
    """The map with the names as the bones have them; what is not among the bones is left out."""
    bones = list(bones)
    plain = {_plain(bone): bone for bone in reversed(bones)} | {bone: bone for bone in bones}

    def own(name: str | None) -> str | None:
        return None if not name else plain.get(name) or plain.get(_plain(name))

    def kept(names: dict[str, str]) -> dict[str, str]:
        return {key: bone for key, name in names.items() if (bone := own(name))}

    limbs = {limb: kept(names) for limb, names in rig_map.limbs.items()}
    return replace(
        rig_map,
        root=own(rig_map.root),
        joints=kept(rig_map.joints),
        places=kept(rig_map.places),
        known_by=tuple(bone for name in rig_map.known_by if (bone := own(name))),
        limbs={limb: names for limb, names in limbs.items() if {"end", "pole"} <= names.keys()},
        settings={
            kind: tuple((bone, key, value) for name, key, value in rows if (bone := own(name)))
            for kind, rows in rig_map.settings.items()
        },
    )


def edited(rig_map: RigMap, root: str | None, joints: dict[str, str]) -> RigMap:
    """The map with other bones; the controls and places of joints whose bone has changed are
    dropped.
    """
    changed = {joint for joint in JOINTS if rig_map.joints.get(joint) != joints.get(joint)}
    ends = {
        "left_arm": "left_wrist",
        "right_arm": "right_wrist",
        "left_leg": "left_ankle",
        "right_leg": "right_ankle",
    }
    return replace(
        rig_map,
        root=root,
        joints=joints,
        places={joint: bone for joint, bone in rig_map.places.items() if joint not in changed},
        limbs={
            limb: names for limb, names in rig_map.limbs.items() if ends.get(limb) not in changed
        },
    )


def required(armature: bpy.types.Object, rig_map: RigMap) -> None:
    """``InputError`` where the map lacks a joint, or names a bone that the armature lacks or that
    is named twice.
    """
    if armature.mode == "EDIT":
        raise InputError(f"The armature '{armature.name}' is in edit mode; leave it and try again.")

    for joint in NEEDED:
        if not rig_map.joints.get(joint):
            raise InputError(
                f"'{armature.name}' has no bone for the {joint.replace('_', ' ')} yet; choose one "
                "in the Your Rig panel."
            )

    seen: dict[str, str] = {}
    for joint, bone in rig_map.joints.items():
        if bone not in armature.data.bones:
            raise InputError(
                f"'{armature.name}' has no bone '{bone}'; choose another for the "
                f"{joint.replace('_', ' ')}."
            )
        if bone in seen:
            raise InputError(
                f"The bone '{bone}' is both {seen[bone]} and {joint}; choose another for one of "
                "them."
            )
        seen[bone] = joint


def _plain(name: str) -> str:
    return _PREFIX.sub("", name).lower()


_WORDS = {
    "pelvis": {"pelvis", "hips", "cog"},
    "spine": {"spine", "chest", "upperchest", "torso", "abdomen", "waist", "back"},
    "neck": {"neck"},
    "head": {"head", "skull"},
    "collar": {"clavicle", "collar", "collarbone", "clav"},
    "shoulder": {"upperarm", "uparm", "shldr", "bicep", "humerus"},
    "elbow": {"forearm", "lowerarm", "lowarm", "loarm", "elbow", "ulna"},
    "wrist": {"hand", "wrist", "palm"},
    "hip": {"thigh", "upleg", "upperleg", "femur"},
    "knee": {"shin", "calf", "lowerleg", "lowleg", "loleg", "knee", "crus"},
    "ankle": {"foot", "ankle"},
    "foot": {"toe", "toes", "toebase", "ball"},
}
_NEVER = {
    "twist",
    "roll",
    "ik",
    "pole",
    "target",
    "tweak",
    "end",
    "nub",
    "tip",
    "thumb",
    "index",
    "middle",
    "ring",
    "pinky",
    "finger",
    "mch",
    "org",
    "eye",
    "jaw",
    "helper",
    "breast",
    "heel",
    "socket",
    "prop",
    "weapon",
    "hair",
}
_SIDES = {
    "l": "left",
    "left": "left",
    "lft": "left",
    "r": "right",
    "right": "right",
    "rgt": "right",
    "rt": "right",
}


def _split(name: str) -> tuple[str | None, set[str]]:
    """A name's side and words, with neighbouring words joined as well ("UpperArm" gives upper, arm
    and upperarm).
    """
    spaced = re.sub(
        r"(?<=[a-z])(?=[A-Z])|(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", _PREFIX.sub("", name)
    )
    words = [word.lower() for word in re.split(r"[^A-Za-z]+", spaced) if word]
    for k, word in enumerate(words):  # "leftarm" in one word
        for side in ("left", "right"):
            if word.startswith(side) and word != side:
                words[k : k + 1] = [side, word[len(side) :]]

    sides = [_SIDES[word] for word in words if word in _SIDES]
    words = [word for word in words if word not in _SIDES]
    return (sides[0] if sides else None), {*words, *(a + b for a, b in pairwise(words))}


def _guessed(armature: bpy.types.Object) -> RigMap:
    """A map guessed by the words in the bones' names; of several bones that fit, the one nearest to
    the root counts.
    """
    bones = sorted(armature.data.bones, key=lambda bone: len(bone.parent_recursive))
    names = [(bone.name, *_split(bone.name)) for bone in bones if not _split(bone.name)[1] & _NEVER]

    def first(side: str | None, words: set[str], used: Iterable[str] = ()) -> str | None:
        return next(
            (
                name
                for name, own_side, own_words in names
                if own_side == side and own_words & words and name not in used
            ),
            None,
        )

    joints: dict[str, str] = {}

    def put(joint: str, bone: str | None) -> None:
        if bone is not None:
            joints[joint] = bone

    put("pelvis", first(None, _WORDS["pelvis"]) or first(None, {"hip"}))
    column = [
        name
        for name, side, words in names
        if side is None and words & _WORDS["spine"] and name not in joints.values()
    ]
    if "pelvis" not in joints and column:
        put("pelvis", column.pop(0))
    if len(column) > 2:
        column = [column[0], column[(len(column) - 1) // 2], column[-1]]

    spine = {1: ["spine2"], 2: ["spine1", "spine3"]}.get(
        len(column), ["spine1", "spine2", "spine3"]
    )
    for joint, bone in zip(spine, column, strict=False):
        put(joint, bone)

    put("neck", first(None, _WORDS["neck"]))
    put("head", first(None, _WORDS["head"]))
    for side in ("left", "right"):
        upper = first(side, _WORDS["shoulder"]) or first(side, {"arm"})
        put(
            f"{side}_collar",
            first(side, _WORDS["collar"]) or (first(side, {"shoulder"}) if upper else None),
        )
        put(f"{side}_shoulder", upper or first(side, {"shoulder"}))
        thigh = first(side, _WORDS["hip"]) or first(side, {"hip"}) or first(side, {"leg"})
        put(f"{side}_hip", thigh)
        put(f"{side}_knee", first(side, _WORDS["knee"]) or first(side, {"leg"}, {thigh or ""}))
        for joint in ("elbow", "wrist", "ankle", "foot"):
            put(f"{side}_{joint}", first(side, _WORDS[joint], joints.values()))

    above = [
        joints[joint]
        for joint in ("spine1", "spine2", "neck", "left_hip", "right_hip")
        if joint in joints
    ]
    put("pelvis", _carrier(armature, joints.get("pelvis"), above))
    return RigMap(
        "Guessed", joints=joints, root=first(None, {"root", "master"}, [joints.get("pelvis", "")])
    )


def _carrier(armature: bpy.types.Object, bone: str | None, others: list[str]) -> str | None:
    """The bone itself, or the nearest one above it of which all the others are descendants; itself
    where there is none.

    Some rigs have a bone for the hips' own rotation next to the trunk, and both hang on the one
    that moves the body.
    """
    if bone is None:
        return None

    own = armature.data.bones
    return next(
        (
            each.name
            for each in (own[bone], *own[bone].parent_recursive)
            if all(each in own[other].parent_recursive for other in others)
        ),
        bone,
    )
