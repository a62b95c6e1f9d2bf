"""What can go wrong, said in one sentence that tells the user what to do."""

__all__ = ["DafnetError", "InputError", "WeightsError"]


class DafnetError(Exception):
    """Root of every error raised on purpose; its text is one sentence for the user."""


class InputError(DafnetError):
    """Something in the scene, the controls or the options cannot be used as it is."""


class WeightsError(DafnetError):
    """A weights file is missing, damaged, hostile or made for another version."""
