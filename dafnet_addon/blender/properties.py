"""What the animator sets, kept on the character's armature (``Object.dafnet``), and the add-on's
preferences.
"""

import atexit
import importlib.util
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.checks import MOST_FRAMES, MOST_SEED, whole
from ..core.errors import InputError
from ..core.take import MODES
from . import rig_properties

__all__ = [
    "ADDON",
    "CLEAN_UP",
    "PACKED",
    "CharacterSettings",
    "Preferences",
    "Settings",
    "TakeSettings",
    "settings_of",
    "find_scene",
    "find_object",
    "find_action",
    "find_collection",
    "names_in_use",
    "device_of",
    "register",
    "unregister",
    "ensure_registered",
    "weights_path",
]

ADDON = (__package__ or "").removesuffix(".dafnet_addon.blender")
"""Name under which Blender knows the extension."""


_MOST_TAKES = 64
_LAST_FRAME = 1_048_574
"""The last one that Blender knows; the first one is as far below zero."""


def _is_armature(_settings: "CharacterSettings", candidate: bpy.types.Object) -> bool:
    return candidate.type == "ARMATURE" and candidate != _settings.id_data


def _is_take(_settings: "CharacterSettings", candidate: bpy.types.Action) -> bool:
    return PACKED in candidate


def _is_not_the_character(settings: "CharacterSettings", candidate: bpy.types.Object) -> bool:
    return candidate != settings.id_data


_GUIDE = Path(__file__).parents[2] / "docs" / "guide.md"
PACKED = "dafnet_take"
"""The property of an action that holds its take (``blender.takes``)."""
CLEAN_UP = {
    "plant_feet": "feet",
    "reach_targets": "reach",
    "rest_on_seats": "seat",
    "clear_furniture": "clear",
    "smooth": "smooth",
}
"""The strengths of ``core.cleanup.CleanUp`` by the names of the settings."""


class TakeSettings(bpy.types.PropertyGroup):
    """What is known of an action that holds a take (``Action.dafnet``); the motion itself is packed
    beside it (``takes``).
    """

    seed: IntProperty(name="Seed", options=set(), description="Seed that it was drawn with")
    lower_seed: IntProperty(
        name="Legs' Seed", options=set(), description="Seed that its legs were drawn with"
    )
    temperature: FloatProperty(
        name="Temperature", options=set(), description="How far from the calm take it was drawn"
    )
    lower_temperature: FloatProperty(
        name="Legs' Temperature", options=set(), description="How far its legs were"
    )
    frame_start: IntProperty(name="Start", options=set(), description="Its first frame")
    accepted: BoolProperty(name="Accepted", options=set(), description="A take to keep")
    ghost: BoolProperty(
        name="Ghost",
        options=set(),
        description="Show this take as a figure of lines beside what plays",
    )
    log_likelihood: FloatProperty(
        name="Likelihood",
        options=set(),
        description="How likely the model finds its poses, in nats a frame: more is more usual",
    )
    sliding: FloatProperty(
        name="Sliding", options=set(), description="Feet that slide in a frame, 0 to 2"
    )
    collisions: FloatProperty(
        name="Collisions", options=set(), description="Joints that touch furniture in a frame"
    )
    miss: FloatProperty(
        name="Miss",
        options=set(),
        subtype="DISTANCE",
        description="Mean distance of head and hands from their targets",
    )
    jerk: FloatProperty(name="Jerk", options=set(), description="How abrupt it moves, in m/s\u00b3")
    raw_sliding: FloatProperty(
        name="Sliding before", options=set(), description="Feet that slide before the clean-up"
    )
    raw_collisions: FloatProperty(
        name="Collisions before", options=set(), description="Joints that touch furniture before it"
    )
    raw_miss: FloatProperty(
        name="Miss before", options=set(), subtype="DISTANCE", description="The distance before it"
    )
    raw_jerk: FloatProperty(
        name="Jerk before", options=set(), description="How abrupt it moved before it"
    )


class TakeLink(bpy.types.PropertyGroup):
    """A row in a character's list of takes."""

    action: PointerProperty(type=bpy.types.Action, options=set())


class CharacterSettings(bpy.types.PropertyGroup):
    """Settings of one character."""

    mode: EnumProperty(
        name="Mode",
        default="FREE",
        description="What drives the upper body. Keyframe it to change it during the shot",
        items=[
            ("FREE", "FREE", "Only the root is given; the whole body follows from it"),
            (
                "EE",
                "EE",
                "End effectors: head and hands reach for their targets; each of them that is set "
                "counts",
            ),
            (
                "FULL",
                "FULL",
                "The whole upper body is copied from another armature; only the legs are generated",
            ),
        ],
    )
    furniture: PointerProperty(
        name="Furniture",
        type=bpy.types.Collection,
        options=set(),
        description=(
            "Collection of everything the character may touch or must avoid; empty for a bare floor"
        ),
    )
    root: PointerProperty(
        name="Root",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description="Animated object on the ground under the pelvis: X right, Y forward, Z up",
    )
    head: PointerProperty(
        name="Head",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the head joint. Once rotated, it turns the head: Y where the face looks, Z "
            "to the crown"
        ),
    )
    hand_left: PointerProperty(
        name="Left Hand",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the left wrist. Once rotated, it turns the hand: Y to the fingers, Z out "
            "of its back"
        ),
    )
    hand_right: PointerProperty(
        name="Right Hand",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the right wrist. Once rotated, it turns the hand: Y to the fingers, Z out "
            "of its back"
        ),
    )
    upper_body_source: PointerProperty(
        name="Source",
        type=bpy.types.Object,
        poll=_is_armature,
        options=set(),
        description=(
            "Armature whose upper body is copied: another character, or any rig whose bones are "
            "known (Your Rig)"
        ),
    )
    upper_body_take: PointerProperty(
        name="Take",
        type=bpy.types.Action,
        poll=_is_take,
        options=set(),
        description="Take whose upper body is copied, where no source armature is chosen",
    )
    use_scene_range: BoolProperty(
        name="Scene Range",
        default=True,
        options=set(),
        description="Generate the frames from the scene's start to its end",
    )
    frame_start: IntProperty(
        name="Start", default=1, options=set(), description="First frame to generate"
    )
    frame_end: IntProperty(
        name="End", default=250, options=set(), description="Last frame to generate"
    )
    seed: IntProperty(
        name="Seed",
        default=0,
        min=0,
        options=set(),
        description=(
            "Another number gives another take. It matters where the temperature is above zero"
        ),
    )
    take_count: IntProperty(
        name="Takes",
        default=1,
        min=1,
        max=_MOST_TAKES,
        soft_max=16,
        options=set(),
        description=(
            "How many takes to generate at once; each further one has the next seed, and "
            "temperature 1 where it is 0"
        ),
    )
    takes: CollectionProperty(type=TakeLink, options=set(), description="Takes of this character")
    active_take: IntProperty(
        name="Take", options=set(), description="The take that the buttons below are for"
    )
    blend_frames: IntProperty(
        name="Blend",
        default=10,
        min=0,
        max=120,
        options=set(),
        description="Frames in which the body comes over to the new mode where it changes",
    )
    head_influence: FloatProperty(
        name="Head Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How far the head's target counts; at 0 the head is free. Keyframe it to come to a "
            "target and leave it"
        ),
    )
    hand_left_influence: FloatProperty(
        name="Left Hand Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How far the left hand's target counts; at 0 the hand is free. Keyframe it to come to "
            "it and leave it"
        ),
    )
    hand_right_influence: FloatProperty(
        name="Right Hand Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How far the right hand's target counts; at 0 the hand is free. Keyframe it to come "
            "to it and leave it"
        ),
    )
    temperature: FloatProperty(
        name="Temperature",
        default=0.0,
        min=0.0,
        max=2.5,
        step=10,
        precision=2,
        options=set(),
        description=(
            "How far takes differ: 0 gives the one calm take, 1 as far as real ones do, above 2 "
            "strange ones"
        ),
    )
    plant_feet: FloatProperty(
        name="Plant Feet",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How firmly a foot that stands is held where it stands, so that it does not slide; 0 "
            "is the raw motion"
        ),
    )
    rest_on_seats: FloatProperty(
        name="Rest on Seats",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How far a pelvis that has sunk into a seat is lifted out of it; 0 is the raw motion"
        ),
    )
    reach_targets: FloatProperty(
        name="Reach Targets",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How exactly head and hands are put onto their targets, as far as arms and back "
            "allow; 0 is the raw motion"
        ),
    )
    clear_furniture: FloatProperty(
        name="Clear Furniture",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How far hands and feet that have got into furniture are brought out of it; 0 is the "
            "raw motion"
        ),
    )
    smooth: FloatProperty(
        name="Smooth",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How much quick changes of the motion are evened out, before feet and hands are put "
            "in place; 0 is none"
        ),
    )


class Preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = ADDON

    weights: StringProperty(
        name="Weights",
        subtype="FILE_PATH",
        description="File of trained weights; leave it empty for the weights that ship",
    )

    engine: EnumProperty(
        name="Engine",
        default="NUMPY",
        description="What runs the network",
        items=[
            ("NUMPY", "NumPy", "Comes with Blender, and as fast as anything for one take"),
            ("cpu", "PyTorch on the CPU", "Where PyTorch is installed in Blender's Python"),
            (
                "cuda",
                "PyTorch on a GPU (CUDA)",
                "For many takes at once, where PyTorch is installed in Blender's Python",
            ),
            (
                "mps",
                "PyTorch on a GPU (Metal)",
                "For many takes at once, where PyTorch is installed in Blender's Python",
            ),
        ],
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Show them."""
        self.layout.use_property_split = True
        self.layout.prop(self, "weights")
        self.layout.prop(self, "engine")
        self.layout.operator("wm.path_open", text="Open the Guide", icon="HELP").filepath = str(
            _GUIDE
        )


@dataclass(frozen=True)
class Settings:
    """A plain copy of what one generation needs; objects, actions and the collection by
    ``name_full``, None where unset.

    ``mode``: None takes the armature's property frame by frame, a word overrules it.
    ``frame_start`` and ``frame_end`` are both generated. ``take_count``: takes to make;
    ``lower_seed``, ``lower_temperature``: the legs' own, None as the body's. ``kept``: the action
    of a take whose motion stays before the scene's frame ``kept_until``. ``plant_feet`` and those
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
    upper_body_take: str | None = None
    mode: str | None = None
    frame_start: int = 1
    frame_end: int = 250
    seed: int = 0
    lower_seed: int | None = None
    temperature: float = 0.0
    lower_temperature: float | None = None
    take_count: int = 1
    kept: str | None = None
    kept_until: int = 0
    blend_frames: int = 10
    plant_feet: float = 1.0
    rest_on_seats: float = 1.0
    reach_targets: float = 1.0
    clear_furniture: float = 0.0
    smooth: float = 0.0

    def __post_init__(self) -> None:
        if self.mode is not None and self.mode not in MODES:
            raise InputError(f"The mode '{self.mode}' is unknown; choose {', '.join(MODES)}.")
        for frame in (self.frame_start, self.frame_end):
            whole(frame, "A frame of the range", -_LAST_FRAME, _LAST_FRAME)
        if self.frame_end < self.frame_start:
            raise InputError(
                f"The frame range ends at {self.frame_end}, before its start at "
                f"{self.frame_start}; "
                "set the end after the start."
            )
        whole(
            self.frame_end - self.frame_start + 1, "The length of the frame range", 1, MOST_FRAMES
        )
        whole(self.take_count, "The number of takes", 1, _MOST_TAKES)
        for seed in (self.seed, self.lower_seed or 0):
            whole(seed, "The seed", 0, MOST_SEED)
        whole(self.seed + self.take_count - 1, "The last take's seed", 0, MOST_SEED)


def settings_of(armature: bpy.types.Object, scene: bpy.types.Scene, **overrides: Any) -> Settings:
    """The settings of a character (``Object.dafnet``) in a scene; ``overrides`` replace fields of
    ``Settings``.
    """
    own = armature.dafnet
    links = (
        "root",
        "furniture",
        "head",
        "hand_left",
        "hand_right",
        "upper_body_source",
        "upper_body_take",
    )
    values: dict[str, Any] = {
        name: target.name_full if (target := getattr(own, name)) else None for name in links
    }
    values |= {
        "frame_start": scene.frame_start if own.use_scene_range else own.frame_start,
        "frame_end": scene.frame_end if own.use_scene_range else own.frame_end,
        **{
            name: getattr(own, name)
            for name in ("seed", "temperature", "take_count", "blend_frames", *CLEAN_UP)
        },
    }
    return Settings(armature=armature.name_full, scene=scene.name_full, **(values | overrides))


def find_scene(settings: Settings) -> bpy.types.Scene:
    """The scene of the settings; ``InputError`` where it is gone."""
    scene = next((s for s in bpy.data.scenes if s.name_full == settings.scene), None)
    if scene is None:
        raise InputError(
            f"The scene '{settings.scene}' is not in this file any more; generate again from "
            "another."
        )
    return scene


def find_object(settings: Settings, name: str, role: str) -> bpy.types.Object:
    """The scene's object of this ``name_full``; ``role`` says in the ``InputError`` what it was
    for.

    An object that was deleted in the scene may live on in the file as long as a property names it:
    it counts as gone.
    """
    found = next((o for o in find_scene(settings).objects if o.name_full == name), None)
    if found is None:
        raise InputError(
            f"The {role} '{name}' is not in the scene; choose another one in the DAFNet panel."
        )
    return found


def find_action(name: str) -> bpy.types.Action:
    """The action of this ``name_full``; ``InputError`` where it is gone."""
    found = next((a for a in bpy.data.actions if a.name_full == name), None)
    if found is None:
        raise InputError(
            f"The take '{name}' is not in this file any more; choose another one in the list."
        )
    return found


def find_collection(name: str) -> bpy.types.Collection:
    """The collection of this ``name_full``; ``InputError`` where it is gone."""
    found = next((c for c in bpy.data.collections if c.name_full == name), None)
    if found is None:
        raise InputError(
            f"The furniture collection '{name}' is not in this file; choose another in the DAFNet "
            "panel."
        )
    return found


def names_in_use(settings: Settings) -> set[str]:
    """Names of all that a generation with these settings uses and that is there: objects,
    furniture, its collection.
    """
    named = {
        settings.armature,
        settings.root,
        settings.head,
        settings.hand_left,
        settings.hand_right,
    }
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


_GROUPS = (TakeSettings, TakeLink, CharacterSettings)


def device_of(context: bpy.types.Context) -> str | None:
    """The torch device chosen in the preferences, or None for NumPy. ``InputError`` where there is
    no torch, or not for it.
    """
    addon = context.preferences.addons.get(ADDON)
    engine = addon.preferences.engine if addon else "NUMPY"
    if engine == "NUMPY":
        return None
    if importlib.util.find_spec("torch") is None:
        raise InputError(
            "PyTorch is not installed in Blender's Python; set the engine in the add-on's "
            "preferences to NumPy."
        )
    import torch

    there = {
        "cpu": True,
        "cuda": torch.cuda.is_available(),
        "mps": torch.backends.mps.is_available(),
    }
    if not there[engine]:
        raise InputError(
            f"PyTorch finds no device '{engine}'; choose another engine in the add-on's "
            "preferences."
        )
    return engine


def register() -> None:
    """Add the settings to every object and the preferences to the add-on."""
    bpy.utils.register_class(Preferences)
    _register_settings()


def _register_settings() -> None:
    for cls in _GROUPS:
        bpy.utils.register_class(cls)
    bpy.types.Object.dafnet = PointerProperty(type=CharacterSettings, name="DAFNet")
    bpy.types.Action.dafnet = PointerProperty(type=TakeSettings, name="DAFNet")
    rig_properties.register()


def _unregister_settings() -> None:
    rig_properties.unregister()
    del bpy.types.Action.dafnet
    del bpy.types.Object.dafnet
    for cls in reversed(_GROUPS):
        bpy.utils.unregister_class(cls)


def unregister() -> None:
    """Undo ``register``."""
    _unregister_settings()
    bpy.utils.unregister_class(Preferences)


def ensure_registered() -> None:
    """Register the settings where no add-on has done so, as with the ``bpy`` module outside
    Blender; undone at exit.
    """
    if not hasattr(bpy.types.Object, "dafnet"):
        _register_settings()
        atexit.register(_unregister_settings)
