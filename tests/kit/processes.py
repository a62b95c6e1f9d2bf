"""What a process said, without what Blender says of the machine it runs on."""

__all__ = ["without_blenders"]

# where /etc/mtab is missing; 5.0 begins otherwise than 4.5
_BLENDERS = "ould not get a list of mounted file-systems"


def without_blenders(text: str) -> str:
    """The lines of a standard error that are not Blender's own of its machine."""
    return "".join(line for line in text.splitlines(keepends=True) if _BLENDERS not in line)
