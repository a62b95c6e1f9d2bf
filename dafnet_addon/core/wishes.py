"""What is to be delivered of a shot, besides the scene with its keys: the words of the command line
and of files, checked.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from .checks import MAX_FRAMES, whole
from .errors import InputError
from .text import nearest_known, printable

__all__ = ["EXPORTED", "RENDERED", "ROOT_MOTIONS", "Wishes"]

RENDERED = ("frames", "masks", "depth")
EXPORTED = ("fbx", "gltf", "usd", "bvh")
ROOT_MOTIONS = ("bone", "hips")


@dataclass(frozen=True)
class Wishes:
    """``truth``: joints, contacts and what else is known, as numbers. ``render``: some of
    ``RENDERED``, of all the scene's cameras in every ``every``-th frame. ``export``: some of
    ``EXPORTED``, one file a character, whose way through the room is in ``root_motion``: a root
    bone, or the hips. ``rig``: what the motion is put onto before that, the name of an armature in
    the scene.

    One word may be given for several; capitals do not matter. Raises InputError for a word that is
    not known, which it names with the nearest one.
    """

    truth: bool = False
    render: tuple[str, ...] = ()
    every: int = 1
    export: tuple[str, ...] = ()
    root_motion: str = "bone"
    rig: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.truth, bool):
            raise InputError(f"'truth' is {printable(self.truth, 40)}; write true or false.")
        if self.rig is not None and not (isinstance(self.rig, str) and self.rig.strip()):
            raise InputError("'rig' is not a name; give that of an armature in the scene.")

        hold = object.__setattr__
        hold(self, "render", _words(self.render, "render", RENDERED))
        hold(self, "every", whole(self.every, "'every'", 1, MAX_FRAMES))
        hold(self, "export", _words(self.export, "export", EXPORTED))
        hold(self, "root_motion", _word(self.root_motion, "root_motion", ROOT_MOTIONS))

    @property
    def anything(self) -> bool:
        """Whether files are to be written at all."""
        return bool(self.truth or self.render or self.export)


def _words(value: object, option: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the known words that are given, in the order of the known ones."""
    given = [value] if isinstance(value, str) else value
    if not isinstance(given, Iterable):
        raise InputError(f"'{option}' is {printable(value, 40)}; give a list of words.")
    found = {_word(each, option, known) for each in given}
    return tuple(word for word in known if word in found)


def _word(value: object, option: str, known: tuple[str, ...]) -> str:
    word = value.lower() if isinstance(value, str) else value
    if word not in known:
        raise InputError(
            f"'{option}' does not know '{printable(value, 40)}'; "
            f"{nearest_known(printable(value, 40), known)}"
        )
    return str(word)
