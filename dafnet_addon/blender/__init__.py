"""The only readers and writers of Blender data.

Lengths are metres here; Blender's own units stay at the outermost edge.
"""

import bpy  # noqa: F401  bmesh and mathutils can be imported only once it is
