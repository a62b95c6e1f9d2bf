"""``python -m dafnet_addon``: the command ``dafnet``."""

from .core.stopping import Stop

with Stop() as loading:  # a start of NumPy that is broken off looks like a damaged one
    from .cli import run

run(loading)
