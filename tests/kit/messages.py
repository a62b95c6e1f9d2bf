"""What was said: by an error, and by a process."""

import pytest

from dafnet_addon.core.errors import InputError

__all__ = ["one_sentence", "without_blenders"]

# where /etc/mtab is missing; 5.0 begins otherwise than 4.5
_BLENDERS = "ould not get a list of mounted file-systems"


def one_sentence(error: pytest.ExceptionInfo[InputError]) -> None:
    text = str(error.value)
    assert text.endswith(".") and "\n" not in text and ";" in text and len(text) < 500, text


def without_blenders(text: str) -> str:
    """The lines of a standard error that are not Blender's own of its machine."""
    return "".join(line for line in text.splitlines(keepends=True) if _BLENDERS not in line)
