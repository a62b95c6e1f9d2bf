"""A body on a seat: lengths of one of 1.75 m, in metres to its front, its back and its sides."""

__all__ = [
    "BACK_HIGH",
    "BEFORE_BACK",
    "ELBOWS",
    "HIPS",
    "LEANS",
    "ON_IT",
    "RISES",
    "SHORTEST",
    "SHOULDERS",
    "THIGH",
]

BEFORE_BACK = 0.22
"""Between the pelvis and the back that it leans against."""
THIGH = 0.36
"""Between the pelvis and the edge, at most: shins hang before it."""
LEANS = 0.62
"""Between the pelvis and a back, at most; one leans no further, but sits as at a bed's edge."""
ON_IT = 0.12
"""Of seat before the pelvis, however shallow the seat is."""
HIPS = 0.10
"""To each side; what carries them."""
ELBOWS = 0.28
"""To each side, that a body needs between arms and from a wide seat's ends."""
SHORTEST = 0.15
"""Of the shallowest seat from back to edge."""
RISES = 0.12
"""Over the seat: what is higher is a back or an arm."""
BACK_HIGH = 0.60
"""Over the seat, up to which a back is one."""
SHOULDERS = 0.15
"""To each side, that are free of arms and backs."""
