"""What the animator sets, kept on the character's armature (``Object.dafnet``), and the add-on's preferences."""

import atexit
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core.errors import InputError
from ..core.take import MODES

__all__ = [
    "ADDON", "CharacterSettings", "Preferences", "Settings", "settings_of", "find_scene", "find_object",
    "find_collection", "names_in_use", "register", "unregister", "ensure_registered", "weights_path",
]

ADDON = (__package__ or "").removesuffix(".dafnet_addon.blender")
"""Name under which Blender knows the extension."""


def _is_armature(_settings: "CharacterSettings", candidate: bpy.types.Object) -> bool:
    return candidate.type == "ARMATURE" and candidate != _settings.id_data


def _is_not_the_character(settings: "CharacterSettings", candidate: bpy.types.Object) -> bool:
    return candidate != settings.id_data


class CharacterSettings(bpy.types.PropertyGroup):
    """Settings of one character."""

    mode: EnumProperty(
        name="Mode", default="FREE",
        description="What drives the upper body. Keyframe it to change it during the shot",
        items=[
            ("FREE", "FREE", "Only the root is given; the whole body follows from it"),
            ("EE", "EE", "End effectors: head and hands reach for their targets; each of them that is set counts"),
            ("FULL", "FULL", "The whole upper body is copied from another armature; only the legs are generated"),
        ],
    )
    furniture: PointerProperty(
        name="Furniture", type=bpy.types.Collection, options=set(),
        description="Collection of everything the character may touch or must avoid; empty for a bare floor",
    )
    root: PointerProperty(
        name="Root", type=bpy.types.Object, poll=_is_not_the_character, options=set(),
        description="Animated object on the ground under the pelvis: X right, Y forward, Z up",
    )
    head: PointerProperty(
        name="Head", type=bpy.types.Object, poll=_is_not_the_character, options=set(),
        description="Target of the head joint. Once rotated, it turns the head: Y where the face looks, Z to the crown",
    )
    hand_left: PointerProperty(
        name="Left Hand", type=bpy.types.Object, poll=_is_not_the_character, options=set(),
        description="Target of the left wrist. Once rotated, it turns the hand: Y to the fingers, Z out of its back",
    )
    hand_right: PointerProperty(
        name="Right Hand", type=bpy.types.Object, poll=_is_not_the_character, options=set(),
        description="Target of the right wrist. Once rotated, it turns the hand: Y to the fingers, Z out of its back",
    )
    upper_body_source: PointerProperty(
        name="Source", type=bpy.types.Object, poll=_is_armature, options=set(),
        description="Armature with the character's bone names whose upper body is copied",
    )
    use_scene_range: BoolProperty(
        name="Scene Range", default=True, options=set(),
        description="Generate the frames from the scene's start to its end",
    )
    frame_start: IntProperty(name="Start", default=1, options=set(), description="First frame to generate")
    frame_end: IntProperty(name="End", default=250, options=set(), description="Last frame to generate")
    seed: IntProperty(
        name="Seed", default=0, min=0, options=set(),
        description="Another number gives another take. It matters where the temperature is above zero",
    )
    use_lower_seed: BoolProperty(
        name="Vary the Legs", default=False, options=set(),
        description="Give the legs a seed of their own, so that they change while the upper body stays",
    )
    lower_seed: IntProperty(
        name="Legs' Seed", default=0, min=0, options=set(), description="Seed of the legs alone",
    )
    temperature: FloatProperty(
        name="Temperature", default=0.0, min=0.0, max=2.5, step=10, precision=2, options=set(),
        description="How far takes differ: 0 gives the one calm take, 1 as far as real ones do, above 2 strange ones",
    )
    plant_feet: FloatProperty(
        name="Plant Feet", default=1.0, min=0.0, max=1.0, subtype="FACTOR", options=set(),
        description="How firmly a foot that stands is held where it stands, so that it does not slide; 0 is the raw motion",
    )
    rest_on_seats: FloatProperty(
        name="Rest on Seats", default=1.0, min=0.0, max=1.0, subtype="FACTOR", options=set(),
        description="How far a pelvis that has sunk into a seat is lifted out of it; 0 is the raw motion",
    )
    reach_targets: FloatProperty(
        name="Reach Targets", default=1.0, min=0.0, max=1.0, subtype="FACTOR", options=set(),
        description="How exactly head and hands are put onto their targets, as far as arms and back allow; 0 is the raw motion",
    )


class Preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = ADDON

    weights: StringProperty(
        name="Weights", subtype="FILE_PATH",
        description="File of trained weights; leave it empty for the weights that ship",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the one preference."""
        self.layout.prop(self, "weights")


@dataclass(frozen=True)
class Settings:
    """A plain copy of what one generation needs; objects and the collection by ``name_full``, None where unset.

    ``mode``: None takes the armature's property frame by frame, a word overrules it. ``frame_start`` and ``frame_end``
    are both generated. ``lower_seed``: None goes with ``seed``. ``plant_feet`` and those
    below it: strengths of the clean-up.
    """

    armature: str
    scene: str
    root: str | None
    furniture: str | None = None
    head: str | None = None
    hand_left: str | None = None
    hand_right: str | None = None
    upper_body_source: str | None = None
    mode: str | None = None
    frame_start: int = 1
    frame_end: int = 250
    seed: int = 0
    lower_seed: int | None = None
    temperature: float = 0.0
    plant_feet: float = 1.0
    rest_on_seats: float = 1.0
    reach_targets: float = 1.0

    def __post_init__(self) -> None:
        if self.mode is not None and self.mode not in MODES:
            raise InputError(f"The mode '{self.mode}' is unknown; choose {', '.join(MODES)}.")
        if self.frame_end < self.frame_start:
            raise InputError(
                f"The frame range ends at {self.frame_end}, before its start at {self.frame_start}; "
                "set the end after the start."
            )


def settings_of(armature: bpy.types.Object, scene: bpy.types.Scene, **overrides: Any) -> Settings:
    """The settings of a character (``Object.dafnet``) in a scene; ``overrides`` replace fields of ``Settings``."""
    own = armature.dafnet
    links = ("root", "furniture", "head", "hand_left", "hand_right", "upper_body_source")
    values: dict[str, Any] = {name: target.name_full if (target := getattr(own, name)) else None for name in links}
    values |= {
        "frame_start": scene.frame_start if own.use_scene_range else own.frame_start,
        "frame_end": scene.frame_end if own.use_scene_range else own.frame_end,
        "seed": own.seed, "lower_seed": own.lower_seed if own.use_lower_seed else None, "temperature": own.temperature,
        "plant_feet": own.plant_feet, "rest_on_seats": own.rest_on_seats, "reach_targets": own.reach_targets,
    }
    return Settings(armature=armature.name_full, scene=scene.name_full, **(values | overrides))


def find_scene(settings: Settings) -> bpy.types.Scene:
    """The scene of the settings; ``InputError`` where it is gone."""
    scene = next((s for s in bpy.data.scenes if s.name_full == settings.scene), None)
    if scene is None:
        raise InputError(f"The scene '{settings.scene}' is not in this file any more; generate again from another.")
    return scene


def find_object(settings: Settings, name: str, role: str) -> bpy.types.Object:
    """The scene's object of this ``name_full``; ``role`` says in the ``InputError`` what it was for.

    An object that was deleted in the scene may live on in the file as long as a property names it: it counts as gone.
    """
    found = next((o for o in find_scene(settings).objects if o.name_full == name), None)
    if found is None:
        raise InputError(f"The {role} '{name}' is not in the scene; choose another one in the DAFNet panel.")
    return found


def find_collection(name: str) -> bpy.types.Collection:
    """The collection of this ``name_full``; ``InputError`` where it is gone."""
    found = next((c for c in bpy.data.collections if c.name_full == name), None)
    if found is None:
        raise InputError(f"The furniture collection '{name}' is not in this file; choose another in the DAFNet panel.")
    return found


def names_in_use(settings: Settings) -> set[str]:
    """Names of all that a generation with these settings uses and that is there: objects, furniture, its collection."""
    named = {settings.armature, settings.root, settings.head, settings.hand_left, settings.hand_right}
    named.add(settings.upper_body_source)
    used = {o.name_full for o in find_scene(settings).objects if o.name_full in named}
    for collection in bpy.data.collections:
        if collection.name_full == settings.furniture:
            used |= {collection.name_full, *(o.name_full for o in collection.all_objects)}
    return used


def weights_path(context: bpy.types.Context) -> str | None:
    """The weights file chosen in the preferences, or None for the shipped weights."""
    addon = context.preferences.addons.get(ADDON)
    return bpy.path.abspath(addon.preferences.weights) or None if addon else None


def register() -> None:
    """Add the settings to every object and the preferences to the add-on."""
    bpy.utils.register_class(CharacterSettings)
    bpy.utils.register_class(Preferences)
    bpy.types.Object.dafnet = PointerProperty(type=CharacterSettings, name="DAFNet")


def unregister() -> None:
    """Undo ``register``."""
    del bpy.types.Object.dafnet
    bpy.utils.unregister_class(Preferences)
    bpy.utils.unregister_class(CharacterSettings)


def ensure_registered() -> None:
    """Register the settings where no add-on has done so, as with the ``bpy`` module outside Blender; undone at exit."""
    if not hasattr(bpy.types.Object, "dafnet"):
        bpy.utils.register_class(CharacterSettings)
        bpy.types.Object.dafnet = PointerProperty(type=CharacterSettings, name="DAFNet")
        atexit.register(_forget)


def _forget() -> None:
    del bpy.types.Object.dafnet
    bpy.utils.unregister_class(CharacterSettings)
