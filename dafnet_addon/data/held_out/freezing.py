"""How the frozen tests are written: as text that shows what changed, by a command that no user
needs.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ...core.errors import InputError
from ...core.files import save_text
from .captured import frozen_text

__all__ = ["freeze"]


def freeze(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    make: Callable[[argparse.Namespace], dict[str, Any]],
    file: Path,
) -> int:
    """Write into ``file`` what is made for the arguments; 0 if all went well, else 1 and a sentence
    on standard error.
    """
    parser.description = "Makes the test set anew."
    options = parser.parse_args(arguments)
    try:
        frozen = make(options)
    except InputError as error:
        print(error, file=sys.stderr)
        return 1

    save_text(file, frozen_text(frozen))
    return 0
