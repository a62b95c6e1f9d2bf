"""Live: its buttons, and how it goes."""

import bpy

from ..dafnet_addon.blender.live.listening import LiveState
from ..operators.live import DAFNET_OT_live, DAFNET_OT_live_draw, DAFNET_OT_live_record

__all__ = ["draw_live"]


def draw_live(layout: bpy.types.UILayout, state: LiveState) -> None:
    """Draw what can be done while Live runs, and how long a step takes."""
    session = state.session
    layout.label(text=session.settings.armature, icon="ARMATURE_DATA", translate=False)
    row = layout.row(align=True)
    row.scale_y = 1.5
    row.operator(DAFNET_OT_live.bl_idname, text="End Live", icon="PAUSE", depress=True)
    row.operator(DAFNET_OT_live_record.bl_idname, icon="REC", depress=session.recording)
    layout.operator(DAFNET_OT_live_draw.bl_idname, icon="GREASEPENCIL", depress=state.draws)
    if session.there:  # it may be drawn before a tick finds that the character was deleted
        layout.prop(session.armature.dafnet, "temperature", slider=True)

    if session.recording:
        seconds = len(session.clips[-1].played) / 30.0
        layout.label(text=f"{seconds:.0f} s", icon="REC", translate=False)
    else:
        layout.label(text="Drag the root with G", icon="INFO")
    layout.label(text=f"{session.milliseconds:.0f} ms a frame", icon="TIME", translate=False)
    if session.lost:
        row = layout.row()
        row.alert = True
        row.label(text=f"{session.lost} frames too late", icon="ERROR", translate=False)
