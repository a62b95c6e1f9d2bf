"""Which bone of an armature is which of our joints: maps by name, one JSON file each, those that
ship (``shipped_maps``) and the user's own. A new rig that many people have gets a new file there.

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
from pathlib import Path
from typing import Any

import bpy

from ...core.errors import InputError
from ...core.files import portable_name, save_text
from ...core.skeleton import JOINTS
from ..preferences import ADDON

__all__ = [
    "NEEDED",
    "RigMap",
    "as_text",
    "with_bones",
    "from_text",
    "with_bone_names_of",
    "load_map",
    "map_files",
    "require_usable",
    "save_map",
    "user_folder",
    "without_prefix",
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
    """Files of all maps by unique names: those that ship, then the user's ("my_" before the
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
            f"'{file.name}' cannot be read as a rig preset; delete it and save the preset again."
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
    stem = portable_name(bpy.path.clean_name(name.strip()).lower())
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


def with_bone_names_of(rig_map: RigMap, bones: Iterable[str]) -> RigMap:
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


def with_bones(rig_map: RigMap, root: str | None, joints: dict[str, str]) -> RigMap:
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


def require_usable(armature: bpy.types.Object, rig_map: RigMap) -> None:
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


def without_prefix(name: str) -> str:
    """A bone's name without the prefix that a file or an importer has put before it."""
    return _PREFIX.sub("", name)


def _plain(name: str) -> str:
    return without_prefix(name).lower()
