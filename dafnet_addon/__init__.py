"""DAFNet: a character that walks up to furniture and uses it, driven by an animated root; NumPy only, without Blender.

``generate(Scene(…), Controls(…), load_weights())`` gives a ``Take``; ``generate_steps`` does the same and yields its
progress on the way.
"""

from .core.cleanup import CleanUp
from .core.errors import DafnetError, InputError, WeightsError
from .core.generate import generate, generate_steps
from .core.solids import Box, Mesh, Scene
from .core.take import Controls, Take
from .core.weights import load_weights

__all__ = [
    "Box", "CleanUp", "Controls", "DafnetError", "InputError", "Mesh", "Scene", "Take", "WeightsError", "generate",
    "generate_steps", "load_weights",
]
