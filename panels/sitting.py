"""More ways to sit down on what is selected."""

import bpy

from ..operators.walk_to import DAFNET_OT_walk_to

__all__ = ["DAFNET_MT_sit"]


class DAFNET_MT_sit(bpy.types.Menu):
    """Sit down where a table is in the way, or on one"""

    bl_idname = "DAFNET_MT_sit"
    bl_label = "Sit, and …"

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw them."""

        def entry(text: str, **values: str | bool) -> None:
            chosen = self.layout.operator(DAFNET_OT_walk_to.bl_idname, text=text)
            for name, value in {"goal": "SEAT", **values}.items():
                setattr(chosen, name, value)

        entry("Pull Out", pull_out="MOVED")
        entry("Pull Out, with Keys", pull_out="KEYED")
        entry("On a Table", tables=True)
        entry("Mark the Seat for glTF", mark_seat=True)
