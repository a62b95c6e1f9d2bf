"""The commands of ``dafnet``, a file each: its arguments, what it needs, and the function that
runs.
"""

from . import (
    bake,
    batch,
    bench,
    carry,
    cool,
    demo,
    evaluate,
    figures,
    info,
    populate,
    prepare,
    train,
    validate,
)
from .command import Command

__all__ = ["COMMANDS", "Command"]

COMMANDS = (
    demo.COMMAND,
    bake.COMMAND,
    populate.COMMAND,
    batch.COMMAND,
    info.COMMAND,
    prepare.COMMAND,
    train.COMMAND,
    carry.COMMAND,
    validate.COMMAND,
    cool.COMMAND,
    evaluate.COMMAND,
    bench.COMMAND,
    figures.COMMAND,
)
"""In the order in which ``--help`` lists them."""
