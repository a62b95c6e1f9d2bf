"""What a viewer would see to be off in a bake onto a rig."""

from collections.abc import Iterator

from .baker import Baked

__all__ = ["doubts"]

_FAR = 0.02
"""Metres of mean error above which the user is warned."""
_TURNED = 8.0
"""Degrees of mean error above which the user is warned."""


def doubts(baked: Baked) -> Iterator[str]:
    """Sentences for the user, with what to do; none where all is as the character does it."""
    if baked.ratio != 1.0:
        yield (
            f"The motion was made for a body of another size, and scaled by {baked.ratio:.2f}: it "
            "may miss seats, tables and targets; press Size Character as Rig, and generate it again"
        )

    if off := _deviations(baked):
        bones = ", ".join(f"'{bone}'" for bone in baked.overruled[:3])
        why = (
            f"mute the constraints and drivers of {bones} and bake again"
            if bones
            else "its proportions differ"
        )
        yield f"The rig deviates from the character's motion, {off}: {why}"


def _deviations(baked: Baked) -> str:
    places = [
        f"{part} by {100 * mean:.0f} cm" for part, (mean, _) in baked.errors.items() if mean > _FAR
    ]
    limbs = [
        f"{limb} by {mean:.0f} degrees"
        for limb, (mean, _) in baked.angles.items()
        if mean > _TURNED
    ]
    return ", ".join(limbs + places)
