"""``python -m dafnet_addon``: the command ``dafnet``."""

from .cli import run

run()
