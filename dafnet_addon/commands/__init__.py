"""The commands of ``dafnet``, a file each: its arguments, what it needs, and the function that
runs.

The extension's zip lacks those that train and measure; what is not there is not offered.
"""

from importlib import import_module
from importlib.util import find_spec

from .command import Command

__all__ = ["COMMANDS", "Command"]

_NAMES = (
    "demo",
    "bake",
    "populate",
    "batch",
    "info",
    "prepare",
    "train",
    "carry",
    "validate",
    "cool",
    "evaluate",
    "bench",
    "figures",
)

COMMANDS: tuple[Command, ...] = tuple(
    import_module(f".{name}", __name__).COMMAND
    for name in _NAMES
    if find_spec(f".{name}", __name__)
)
"""In the order in which ``--help`` lists them."""
