"""What the animator sees. Panels draw and change nothing."""

from .main import DAFNET_PT_character

__all__ = ["CLASSES"]

CLASSES = (DAFNET_PT_character,)
