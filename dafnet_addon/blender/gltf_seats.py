"""glTF's OMI_seat, which Blender does not know: kept as a custom property of that name when a file
is imported, and written when one is exported.

Blender looks for these two classes in the module of every add-on. The property holds what the file
says, in the node's own frame, y up, metres: ``back``, ``foot``, ``knee`` (3 numbers each) and
perhaps ``angle`` (radians).
"""

from contextlib import suppress
from typing import Any

__all__ = ["NAME", "glTF2ExportUserExtension", "glTF2ImportUserExtension"]

NAME = "OMI_seat"
"""Of the extension, and of the property."""


class glTF2ImportUserExtension:
    """Keeps seats of a file on the objects that are made of its nodes."""

    def gather_import_node_after_hook(self, _vnode: Any, node: Any, made: Any, _gltf: Any) -> None:
        """Called when a node has become an object."""
        seat = (getattr(node, "extensions", None) or {}).get(NAME)
        if isinstance(seat, dict) and made is not None:
            with suppress(TypeError, OverflowError, ValueError):  # what no property can hold
                made[NAME] = seat


class glTF2ExportUserExtension:
    """Writes the seats of objects into a file."""

    def gather_node_hook(self, node: Any, source: Any, settings: dict[str, Any]) -> None:
        """Called when a node is made of an object or a bone."""
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        seat = source.get(NAME) if hasattr(source, "get") else None
        if seat is None or not hasattr(seat, "to_dict") or not settings.get("gltf_yup", True):
            return
        node.extensions = {
            **(node.extensions or {}),
            NAME: Extension(name=NAME, extension=seat.to_dict(), required=False),
        }
