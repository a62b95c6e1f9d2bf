"""What the animator sets, kept on the character's armature (``Object.dafnet``) and on the actions
of its takes (``Action.dafnet``).
"""

import atexit

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.solids import SOFTEST
from .. import overridable
from ..overridable import LOCALLY, ROWS_LOCALLY
from ..rig import properties as rig_properties
from .settings import AS_IT_IS, COMES_AND_GOES, HELD, MAX_TAKES, STANDING
from .take_rows import GROUPS as TAKE_GROUPS
from .take_rows import TakeLink, TakeSettings
from .takes import PACKED
from .task_rows import LEAN, TaskRow
from .walk_rows import GROUPS as WALK_GROUPS
from .walk_rows import MANNER, WalkRow, manner_counts, manner_of, set_manner

__all__ = ["CharacterSettings", "ensure_registered", "register", "unregister"]


def _is_armature(_settings: "CharacterSettings", candidate: bpy.types.Object) -> bool:
    return candidate.type == "ARMATURE" and candidate != _settings.id_data


def _is_take(_settings: "CharacterSettings", candidate: bpy.types.Action) -> bool:
    return PACKED in candidate


def _is_not_the_character(settings: "CharacterSettings", candidate: bpy.types.Object) -> bool:
    return candidate != settings.id_data


def _walk_chosen(settings: "CharacterSettings", _context: bpy.types.Context) -> None:
    """Show how the chosen walk is gone, where it can be changed."""
    if 0 <= settings.active_walk < len(settings.walks):
        row = settings.walks[settings.active_walk]
        set_manner(settings, manner_of(row), manner_counts(row))


class CharacterSettings(bpy.types.PropertyGroup):
    """Settings of one character."""

    chosen: BoolProperty(
        override=LOCALLY,
        options={"HIDDEN"},
        description="Whether the tab belongs to this character while no other is selected",
    )
    mode: EnumProperty(
        override=LOCALLY,
        name="Mode",
        default="FREE",
        description="What drives the upper body. Keyframe it to change it during the shot",
        items=[
            ("FREE", "FREE", "Only the root is given; the whole body follows from it"),
            (
                "EE",
                "EE",
                "End effectors: the head, hands and feet reach for their targets. Any of them may "
                "be left empty",
            ),
            (
                "FULL",
                "FULL",
                "The whole upper body is copied from another armature; only the legs are generated",
            ),
        ],
    )
    furniture: PointerProperty(
        override=LOCALLY,
        name="Furniture",
        type=bpy.types.Collection,
        options=set(),
        description=(
            "Collection of everything the character may touch or must avoid. Leave it empty for a "
            "bare floor"
        ),
    )
    root: PointerProperty(
        override=LOCALLY,
        name="Root",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description="Animated object on the ground under the pelvis: X right, Y forward, Z up",
    )
    head: PointerProperty(
        override=LOCALLY,
        name="Head",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the head joint. Once it is rotated, it turns the head as well: Y is where "
            "the face looks, Z points to the crown"
        ),
    )
    hand_left: PointerProperty(
        override=LOCALLY,
        name="Left Hand",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the left wrist. Once it is rotated, it turns the hand as well: Y points "
            "along the fingers, Z out of the back of the hand"
        ),
    )
    hand_right: PointerProperty(
        override=LOCALLY,
        name="Right Hand",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the right wrist. Once it is rotated, it turns the hand as well: Y points "
            "along the fingers, Z out of the back of the hand"
        ),
    )
    foot_left: PointerProperty(
        override=LOCALLY,
        name="Left Foot",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the left ankle, in the modes EE and FULL. Once it is rotated, it turns "
            "the foot as well: Y points along the toes, Z out of the back of the foot"
        ),
    )
    foot_right: PointerProperty(
        override=LOCALLY,
        name="Right Foot",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "Target of the right ankle, in the modes EE and FULL. Once it is rotated, it turns "
            "the foot as well: Y points along the toes, Z out of the back of the foot"
        ),
    )
    look_at: PointerProperty(
        override=LOCALLY,
        name="Look At",
        type=bpy.types.Object,
        poll=_is_not_the_character,
        options=set(),
        description=(
            "What the character looks at, in any mode: an empty, a piece of furniture, somebody. "
            "The head turns to it, and the chest where that is not enough, as far and as fast as "
            "people do; the body stays where it is"
        ),
    )
    look_at_influence: FloatProperty(
        override=LOCALLY,
        name="Look At Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How much what is looked at counts; at 0 the head turns as it likes. Keyframe it to "
            "look at something and away again"
        ),
    )
    upper_body_source: PointerProperty(
        override=LOCALLY,
        name="Source",
        type=bpy.types.Object,
        poll=_is_armature,
        options=set(),
        description=(
            "Armature whose upper body is copied: another character, or any rig whose bones are "
            "mapped (see Your Rig)"
        ),
    )
    upper_body_take: PointerProperty(
        override=LOCALLY,
        name="Take",
        type=bpy.types.Action,
        poll=_is_take,
        options=set(),
        description="Take whose upper body is copied when no source armature is chosen",
    )
    lower_body_source: PointerProperty(
        override=LOCALLY,
        name="Lower Body",
        type=bpy.types.Object,
        poll=_is_armature,
        options=set(),
        description=(
            "Armature whose legs are copied, in the mode FULL: another character, or any rig whose "
            "bones are mapped. Leave it empty to have them generated"
        ),
    )
    source_offset: IntProperty(
        override=LOCALLY,
        name="Offset",
        default=0,
        options=set(),
        description="Frames by which the source plays later here than in the scene",
    )
    source_loops: BoolProperty(
        override=LOCALLY,
        name="Loop",
        default=False,
        options=set(),
        description="Play the source's action over and over, from its first frame to its last",
    )
    use_scene_range: BoolProperty(
        override=LOCALLY,
        name="Scene Range",
        default=True,
        options=set(),
        description="Generate the frames from the scene's start to its end",
    )
    frame_start: IntProperty(
        override=LOCALLY,
        name="Start",
        default=1,
        options=set(),
        description="First frame to generate",
    )
    frame_end: IntProperty(
        override=LOCALLY,
        name="End",
        default=250,
        options=set(),
        description="Last frame to generate",
    )
    begins: EnumProperty(
        override=LOCALLY,
        name="Begins",
        default=STANDING,
        options=set(),
        description="What takes begin with",
        items=[
            (
                STANDING,
                "Standing",
                "The character stands at the root before the first frame; over a seat it has sat "
                "down there",
            ),
            (
                AS_IT_IS,
                "As It Is",
                "With the pose and the motion that the character has in the first frame and before "
                "it: go on from another take, from an animation, or from a pose",
            ),
        ],
    )
    seed: IntProperty(
        override=LOCALLY,
        name="Seed",
        default=0,
        min=0,
        options=set(),
        description=("Another number gives another take, if the temperature is above zero"),
    )
    take_count: IntProperty(
        override=LOCALLY,
        name="Takes",
        default=1,
        min=1,
        max=MAX_TAKES,
        soft_max=16,
        options=set(),
        description=(
            "How many takes to generate at once. Each further take uses the next seed, and "
            "temperature 1 if the temperature is 0"
        ),
    )
    takes: CollectionProperty(
        type=TakeLink,
        options=set(),
        override=ROWS_LOCALLY,
        description="Takes of this character",
    )
    active_take: IntProperty(
        override=LOCALLY,
        name="Take",
        options=set(),
        description="The take that the buttons below act on",
    )
    tasks: CollectionProperty(
        override=ROWS_LOCALLY,
        type=TaskRow,
        options=set(),
        description="What this character is to do, in this order",
    )
    active_task: IntProperty(
        override=LOCALLY,
        name="Task",
        options=set(),
        description="The task that the buttons below act on",
    )
    already_there: BoolProperty(
        override=LOCALLY,
        name="Already There",
        options=set(),
        description=(
            "At first the character is where its first task is done, seated for example, instead "
            "of where its root stands"
        ),
    )
    stood: FloatVectorProperty(
        override=LOCALLY,
        options={"HIDDEN"},
        size=4,
        description="Place and heading of the body, when it last stood at its root",
    )
    speed: FloatProperty(override=LOCALLY, options=set(), **MANNER["speed"])
    seconds: FloatProperty(override=LOCALLY, options=set(), **MANNER["seconds"])
    sits_down: FloatProperty(override=LOCALLY, options=set(), **MANNER["sits_down"])
    gets_up: FloatProperty(override=LOCALLY, options=set(), **MANNER["gets_up"])
    lean: FloatProperty(override=LOCALLY, **LEAN)
    walks: CollectionProperty(
        override=ROWS_LOCALLY,
        type=WalkRow,
        options=set(),
        description="The walks that the root was keyed for, in the order of time",
    )
    active_walk: IntProperty(
        override=LOCALLY,
        name="Walk",
        options=set(),
        update=_walk_chosen,
        description="The walk that is made again, with those after it",
    )
    planned: StringProperty(
        override=LOCALLY,
        options={"HIDDEN"},
        description="What tells the keys that were planned from edited ones",
    )
    blend_frames: IntProperty(
        override=LOCALLY,
        name="Blend",
        default=10,
        min=0,
        max=120,
        options=set(),
        description="Number of frames over which the body blends into the new mode",
    )
    head_influence: FloatProperty(
        override=LOCALLY,
        name="Head Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How much the head's target counts; at 0 the head is free. Keyframe it to reach for a "
            "target and to let go of it"
        ),
    )
    head_follows: EnumProperty(
        override=LOCALLY,
        name="Head Follows",
        default="ALL",
        description="What of the head's target counts. Keyframe it to change it during the shot",
        items=[
            ("ALL", "Place and Turn", "Its place, and its rotation once it is rotated"),
            ("PLACE", "Place", "Only its place; the head turns as it likes"),
            ("TURN", "Turn", "Only its rotation; the head stays where the body brings it"),
        ],
    )
    hand_left_influence: FloatProperty(
        override=LOCALLY,
        name="Left Hand Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How much the left hand's target counts; at 0 the hand is free. Keyframe it to reach "
            "for the target and to let go of it"
        ),
    )
    hand_right_influence: FloatProperty(
        override=LOCALLY,
        name="Right Hand Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How much the right hand's target counts; at 0 the hand is free. Keyframe it to reach "
            "for the target and to let go of it"
        ),
    )
    foot_left_influence: FloatProperty(
        override=LOCALLY,
        name="Left Foot Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How much the left foot's target counts; at 0 the foot is free. Keyframe it to "
            "step onto the target and to let go of it"
        ),
    )
    foot_right_influence: FloatProperty(
        override=LOCALLY,
        name="Right Foot Influence",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        description=(
            "How much the right foot's target counts; at 0 the foot is free. Keyframe it to "
            "step onto the target and to let go of it"
        ),
    )
    temperature: FloatProperty(
        override=LOCALLY,
        name="Temperature",
        default=0.0,
        min=0.0,
        max=2.5,
        step=10,
        precision=2,
        options=set(),
        description=(
            "How much takes differ: 0 always gives the same calm take, 1 gives as much variety as "
            "real motion has, above 2 they become strange"
        ),
    )
    noise: EnumProperty(
        override=LOCALLY,
        name="Noise",
        default=COMES_AND_GOES,
        options=set(),
        description="What makes takes differ, where the temperature is above zero",
        items=[
            (
                COMES_AND_GOES,
                "Comes and Goes",
                "It varies during the take, as in real motion, so that a body at rest looks alive. "
                "Weights that have not learnt this hold it",
            ),
            (HELD, "Held", "It is the same all along the take, so that a body at rest is calm"),
        ],
    )
    guess_softness: BoolProperty(
        override=LOCALLY,
        name="Guess Softness",
        default=True,
        options=set(),
        description="Guess how soft this piece of furniture is from its name and shape",
    )
    softness: FloatProperty(
        override=LOCALLY,
        name="Softness",
        default=0.0,
        min=0.0,
        max=100.0 * SOFTEST,
        soft_max=12.0,
        step=100,
        precision=1,
        options=set(),
        description=(
            "Centimetres by which this piece of furniture gives way under a body, compared with a "
            "hard bench: 3 for wooden chairs, 7 for office and arm chairs, 11 for sofas and beds"
        ),
    )
    plant_feet: FloatProperty(
        override=LOCALLY,
        name="Plant Feet",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How firmly a standing foot is held in place, so that it does not slide; 0 leaves the "
            "raw motion"
        ),
    )
    rest_on_seats: FloatProperty(
        override=LOCALLY,
        name="Rest on Seats",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How far a body that sinks into a seat, or hovers over it, is brought to where the "
            "seat carries it; 0 leaves the raw motion"
        ),
    )
    reach_targets: FloatProperty(
        override=LOCALLY,
        name="Reach Targets",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How exactly the head, hands and feet are brought onto their targets, as far as limbs "
            "and back allow; 0 leaves the raw motion"
        ),
    )
    clear_furniture: FloatProperty(
        override=LOCALLY,
        name="Clear Furniture",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How far hands and feet that are inside furniture are moved out of it; 0 leaves the "
            "raw motion"
        ),
    )
    smooth: FloatProperty(
        override=LOCALLY,
        name="Smooth",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        description=(
            "How much abrupt changes of the motion are smoothed out, before feet and hands are "
            "put in place; 0 leaves the raw motion"
        ),
    )


_GROUPS = (*TAKE_GROUPS, TaskRow, *WALK_GROUPS, CharacterSettings)


def register() -> None:
    """Add the settings to every object and every action."""
    for cls in _GROUPS:
        bpy.utils.register_class(cls)
    bpy.types.Object.dafnet = PointerProperty(
        type=CharacterSettings, name="DAFNet", override=LOCALLY
    )
    bpy.types.Action.dafnet = PointerProperty(type=TakeSettings, name="DAFNet")
    rig_properties.register()
    overridable.register()


def unregister() -> None:
    """Undo ``register``."""
    overridable.unregister()
    rig_properties.unregister()
    del bpy.types.Action.dafnet
    del bpy.types.Object.dafnet
    for cls in reversed(_GROUPS):
        bpy.utils.unregister_class(cls)


def ensure_registered() -> None:
    """Register the settings where no add-on has done so, as with the ``bpy`` module outside
    Blender; undone at exit.
    """
    if not hasattr(bpy.types.Object, "dafnet"):
        register()
        atexit.register(unregister)
