"""``dafnet info``: what a weights file is."""

import argparse
import json
from pathlib import Path
from typing import Any

from ..core.text import printable
from .command import Command, Progress, Result
from .console import MAX_SHOWN

__all__ = ["COMMAND"]


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "weights", type=Path, nargs="?", metavar="WEIGHTS", help="the weights that ship if left out"
    )


def _run(options: argparse.Namespace, _progress: Progress) -> Result:
    from ..core.weights import load_weights

    weights = load_weights(options.weights)
    described: dict[str, Any] = {
        "file": str(weights.path),
        "bytes": weights.path.stat().st_size,
        "parameters": sum(int(tensor.size) for tensor in weights.tensors.values()),
    }
    described |= {
        key: weights.says(key) for key in sorted(weights.metadata) if key not in described
    }
    return described, "\n".join(
        f"{printable(key)}: "
        f"{printable(value if isinstance(value, str) else json.dumps(value), MAX_SHOWN)}"
        for key, value in described.items()
    )


COMMAND = Command(
    name="info", summary="describe a weights file", add_arguments=_add_arguments, run=_run
)
