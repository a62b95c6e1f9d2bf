"""What the operators that send a character somewhere share."""

from typing import Any, ClassVar

from ..dafnet_addon.blender.character.walk_rows import MANNER
from ..dafnet_addon.blender.directing.walking import Walk
from ..dafnet_addon.blender.overlay import display
from .long import LongOperator

__all__ = ["WalkOperator"]


class WalkOperator(LongOperator):
    """An operator that looks for a way and keys it on the character's root."""

    seconds_before_modal: ClassVar[float] = 0.1

    def report_result(self, result: Walk) -> None:
        """Draw the path, say where the root was keyed, and pass the warnings on."""
        display.suggest("path")
        for warning in result.warnings:
            self.report({"WARNING"}, warning)
        ended = ", the range now ends there" if result.extended else ""
        self.report({"INFO"}, f"Keyed the root from frame {result.first} to {result.last}{ended}.")

    def take_manner(self, character: Any) -> None:
        """Set what the caller has left open as the panel says it for the character."""
        given: Any = self.properties  # type: ignore[attr-defined]
        for name in MANNER:
            if name in given.bl_rna.properties and not given.is_property_set(name):
                setattr(self, name, getattr(character.dafnet, name))
