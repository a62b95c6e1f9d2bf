"""What is known about takes: a row for each in a character's list, and the settings of their
actions (``Action.dafnet``): how they were drawn, and how good they are.
"""

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..overridable import LOCALLY

__all__ = ["GROUPS", "TakeFinding", "TakeLink", "TakeSettings"]


class TakeFinding(bpy.types.PropertyGroup):
    """One thing that an eye sees of a take (``core.take.Finding``)."""

    word: StringProperty(name="Word", description="What it is, in short")
    text: StringProperty(name="Text", description="What it is, and what to do about it")
    good: BoolProperty(name="Good", description="Whether it is as it should be")


class TakeSettings(bpy.types.PropertyGroup):
    """What is known about an action that holds a take (``Action.dafnet``); the motion itself is
    packed into it as well (``takes``).
    """

    seed: IntProperty(name="Seed", options=set(), description="The seed that it was generated with")
    lower_seed: IntProperty(
        name="Legs' Seed", options=set(), description="The seed that its legs were generated with"
    )
    temperature: FloatProperty(
        name="Temperature", options=set(), description="The temperature that it was generated at"
    )
    lower_temperature: FloatProperty(
        name="Legs' Temperature",
        options=set(),
        description="The temperature that its legs were generated at",
    )
    held: BoolProperty(
        name="Held",
        options=set(),
        description="Whether its noise was the same all along the take",
    )
    whole: BoolProperty(
        name="Whole",
        options=set(),
        default=True,
        description="Its seed alone makes it again: no part is of another take or was recorded",
    )
    frame_start: IntProperty(name="Start", options=set(), description="The take's first frame")
    accepted: BoolProperty(name="Accepted", options=set(), description="Keep this take")
    ghost: BoolProperty(
        name="Ghost",
        options=set(),
        description="Show this take as a stick figure next to the one that plays",
    )
    log_likelihood: FloatProperty(
        name="Likelihood",
        options=set(),
        description=(
            "How likely the model finds its poses, in nats per frame; higher is more typical"
        ),
    )
    slide_cm: FloatProperty(
        name="Slide, cm",
        options=set(),
        precision=1,
        description=(
            "How far a foot slides over the floor at most, in centimetres; landing and rolling off "
            "do not count. From 2 on it is seen"
        ),
    )
    touching: FloatProperty(
        name="Touching, s",
        options=set(),
        precision=1,
        description="For how many seconds trunk, head, elbows or knees touch furniture",
    )
    miss_cm: FloatProperty(
        name="Miss, cm",
        options=set(),
        precision=1,
        description="How far head and hands are from their targets on average, in centimetres",
    )
    raw_slide_cm: FloatProperty(
        name="Slide before",
        options=set(),
        precision=1,
        description="How far a foot slid at most before the clean-up, in centimetres",
    )
    raw_touching: FloatProperty(
        name="Touching before",
        options=set(),
        precision=1,
        description="For how many seconds the body touched furniture before the clean-up",
    )
    raw_miss_cm: FloatProperty(
        name="Miss before",
        options=set(),
        precision=1,
        description="How far head and hands were from their targets before the clean-up, in cm",
    )
    sliding: FloatProperty(
        name="Sliding",
        options=set(),
        description=(
            "Low feet that move per frame, 0 to 2, as papers count them: landing and rolling off "
            "count as well"
        ),
    )
    collisions: FloatProperty(
        name="Collisions", options=set(), description="Joints that touch furniture, per frame"
    )
    jerk: FloatProperty(
        name="Jerk", options=set(), description="How jerky the motion is, in m/s\u00b3"
    )
    verdict: CollectionProperty(
        type=TakeFinding, name="Verdict", description="What an eye sees of it, the worst first"
    )
    raw_sliding: FloatProperty(
        name="Sliding before",
        options=set(),
        description="Sliding feet per frame before the clean-up",
    )
    raw_collisions: FloatProperty(
        name="Collisions before",
        options=set(),
        description="Joints that touch furniture, per frame, before the clean-up",
    )
    raw_jerk: FloatProperty(
        name="Jerk before",
        options=set(),
        description="How jerky the motion was before the clean-up",
    )


class TakeLink(bpy.types.PropertyGroup):
    """A row in a character's list of takes."""

    action: PointerProperty(type=bpy.types.Action, options=set(), override=LOCALLY)


GROUPS = (TakeFinding, TakeSettings, TakeLink)
"""In the order in which Blender is told of them."""
