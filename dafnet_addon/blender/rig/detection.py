"""Which map fits an armature: the best of those that are known, or one guessed by the names of its
bones.
"""

import re
from collections.abc import Iterable
from itertools import pairwise

import bpy

from ...core.errors import InputError
from .maps import NEEDED, RigMap, load_map, map_files, with_bone_names_of, without_prefix

__all__ = ["detect_map"]

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


def detect_map(armature: bpy.types.Object) -> RigMap:
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
        named = with_bone_names_of(rig_map, bones.keys())
        if len(named.known_by) == len(rig_map.known_by):
            found.append(((len(named.joints), len(rig_map.known_by), key.startswith("my_")), named))

    best = max(found, key=lambda each: each[0])[1] if found else None
    if best is not None and all(joint in best.joints for joint in NEEDED):
        return best

    guess = _guess_map(armature)
    return guess if best is None or len(guess.joints) > len(best.joints) else best


def _guess_map(armature: bpy.types.Object) -> RigMap:
    """A map guessed by the words in the bones' names; of several bones that fit, the one nearest to
    the root counts.
    """
    bones = sorted(armature.data.bones, key=lambda bone: len(bone.parent_recursive))
    split = ((bone.name, *_side_and_words(bone.name)) for bone in bones)
    names = [(name, side, words) for name, side, words in split if not words & _NEVER]

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


def _side_and_words(name: str) -> tuple[str | None, set[str]]:
    """A name's side and words, with neighbouring words joined as well ("UpperArm" gives upper, arm
    and upperarm).
    """
    spaced = re.sub(
        r"(?<=[a-z])(?=[A-Z])|(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", without_prefix(name)
    )
    words = [word.lower() for word in re.split(r"[^A-Za-z]+", spaced) if word]
    for k, word in enumerate(words):  # "leftarm" in one word
        for side in ("left", "right"):
            if word.startswith(side) and word != side:
                words[k : k + 1] = [side, word[len(side) :]]

    sides = [_SIDES[word] for word in words if word in _SIDES]
    words = [word for word in words if word not in _SIDES]
    return (sides[0] if sides else None), {*words, *(a + b for a, b in pairwise(words))}
