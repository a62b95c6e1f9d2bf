"""DAFNet: a character that walks up to furniture and uses it, driven by an animated root; NumPy
only, without Blender.

>>> import numpy as np
>>> from dafnet_addon import Box, Controls, Scene, generate, load_weights
>>> from dafnet_addon.core.paths import Stop, route
>>> stool = Box(center=np.array([0.0, 0.0, 0.225]), half_size=np.array([0.2, 0.2, 0.225]))
>>> seat = Stop((0.0, 0.0), yaw=0.0, seconds=2.0, seated=True)
>>> walked = route(Stop((1.5, 1.5), yaw=3.1, seconds=0.5), seat, fps=24)
>>> take = generate(Scene([stool]), Controls(fps=24, root=walked.path.matrices()), load_weights())
>>> take.joints.shape == (len(walked.path), 22, 3)
True
>>> bool(abs(take.joints[-1, 0, 2] - 0.59) < 0.05)  # the pelvis, 14 cm over a stool of 45 cm
True

``generate_steps`` does the same and yields its progress on the way.
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
