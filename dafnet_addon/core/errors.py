"""What can go wrong, said in one sentence that tells the user what to do."""

from .text import printable

__all__ = ["DafnetError", "InputError", "WeightsError"]

_LONGEST = 1000  # characters; a path may be as long


class DafnetError(Exception):
    """Root of every error raised on purpose; its text is one sentence for the user, safe to show
    whatever names are in it.
    """

    def __init__(self, sentence: str) -> None:
        super().__init__(printable(sentence, _LONGEST))


class InputError(DafnetError):
    """Something in the scene, the controls or the options cannot be used as it is."""


class WeightsError(DafnetError):
    """A weights file is missing, damaged, hostile or made for another version."""
