"""DAFNet: a character that walks up to furniture and uses it, driven by an animated root; NumPy
only, without Blender.

``generate(Scene(…), Controls(…), load_weights())`` gives a ``Take``; ``generate_steps`` does the
same and yields its progress on the way.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .core.cleanup import CleanUp
    from .core.errors import DafnetError, InputError, WeightsError
    from .core.generate import generate, generate_steps
    from .core.solids import Box, Mesh, Scene
    from .core.take import Controls, Take
    from .core.weights import load_weights

__all__ = [
    "Box",
    "CleanUp",
    "Controls",
    "DafnetError",
    "InputError",
    "Mesh",
    "Scene",
    "Take",
    "WeightsError",
    "generate",
    "generate_steps",
    "load_weights",
]

_MODULES = ("errors", "take", "solids", "cleanup", "weights", "generate")


def __getattr__(name: str) -> Any:
    """What the core offers, which is loaded when it is asked for: the command has to be there for
    Ctrl-C before NumPy is.
    """
    for module in _MODULES if name in __all__ else ():
        if name in (found := import_module(f".core.{module}", __name__)).__all__:
            return getattr(found, name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
