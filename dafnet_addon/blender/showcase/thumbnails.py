"""Small pictures of rendered frames, for reports."""

import tempfile
from pathlib import Path

import bpy

from ...core.errors import InputError

__all__ = ["thumbnail"]

_WIDTH = 240  # pixels


def thumbnail(frame: Path) -> bytes:
    """A small JPEG of a picture's file. Raises InputError where it cannot be read."""
    try:
        image = bpy.data.images.load(str(frame))
    except RuntimeError as error:
        raise InputError(f"'{frame}' is not a picture; render it again.") from error
    try:
        wide, high = image.size
        if not wide:
            raise InputError(f"'{frame}' is not a picture; render it again.")
        image.scale(_WIDTH, max(1, round(high * _WIDTH / wide)))
        with tempfile.TemporaryDirectory() as folder:
            small = Path(folder, "small.jpg")
            image.file_format = "JPEG"
            image.save(filepath=str(small), quality=80)
            return small.read_bytes()
    finally:
        bpy.data.images.remove(image)
