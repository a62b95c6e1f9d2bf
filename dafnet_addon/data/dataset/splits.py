"""Who trains, who chooses weights, and who tells how good they are: whole bodies, and whole makers
of furniture.

What is told must not have been chosen by, and what chooses must not have been trained on. A clip's
own file says "train" or "test"; here stands what overrules it.
"""

from ..capture.mocap import Clip

__all__ = ["TRAINED_ON_PARTLY", "role_of_body", "role_of_clip", "role_of_maker"]

_CHOOSING_BODIES = {("mhad", "MHAD_s09"), ("mhad", "MHAD_s10")}
_NAMELESS = {"cmu_expmap"}  # whose people may be those of the test
TRAINED_ON_PARTLY = {"cmu69", "snu_tiling/wd2(dir 1)", "snu_ys2010", "gazebo_actors"}
"""Bodies with clips on both sides of the split: their test clips help to choose (who walks among
those that do not train?).
"""

_CHOOSING_MAKERS = {"Voodoc", "Jay-Artist", "MatBot", "TripleJ", "Aymanslman", "Derte21"}
_TELLING_MAKERS = {"Kator Legaz"}


def role_of_clip(clip: Clip) -> str:
    """Whether a clip is there to "train", "choose" or "tell"; "" where it is not used."""
    if clip.source in _NAMELESS:
        return ""
    if (clip.source, clip.subject) in _CHOOSING_BODIES:
        return "choose"
    return role_of_body(clip.source, clip.subject) if clip.split == "test" else clip.split


def role_of_body(source: str, subject: str) -> str:
    """Whether the test clips of a body "choose" or "tell"."""
    partly = source in TRAINED_ON_PARTLY or f"{source}/{subject}" in TRAINED_ON_PARTLY
    return "choose" if partly or (source, subject) in _CHOOSING_BODIES else "tell"


def role_of_maker(maker: str) -> str:
    """ "train", "choose" or "tell": pieces of one maker resemble each other, so makers are held out
    whole, with what they made together with others ("Ann & Bob").
    """
    makers = set(maker.split(" & "))
    if makers & _TELLING_MAKERS:
        return "tell"
    return "choose" if makers & _CHOOSING_MAKERS else "train"
