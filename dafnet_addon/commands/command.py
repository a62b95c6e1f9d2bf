"""What a command is, and the arguments that several of them take."""

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.checks import MAX_SEED
from ..core.wishes import EXPORTED, RENDERED, ROOT_MOTIONS

__all__ = [
    "MAX_PROCESSES",
    "Command",
    "Progress",
    "Result",
    "add_noise",
    "add_weights",
    "add_wishes",
    "frame_range",
    "number",
    "wished",
]

Progress = Callable[[float], None]
"""Is called with the part done, in [0, 1], at every step; raises where the command is to stop."""

Result = tuple[Any, str] | None
"""What a command found, for ``--json`` and as text."""

MAX_PROCESSES = 1024
"""More than any machine has cores."""


@dataclass(frozen=True)
class Command:
    """One word of ``dafnet``, what it takes and what it does.

    ``add_arguments`` declares what ``run`` reads from its options. ``needs``: the modules besides
    NumPy that it imports, which may depend on the options.
    """

    name: str
    summary: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace, Progress], Result]
    needs: Callable[[argparse.Namespace], Sequence[str]] = lambda _options: ()


def add_noise(parser: argparse.ArgumentParser, temperature: float | None) -> None:
    """``--seed`` and ``--temperature``. Without a default ``temperature`` both are None where they
    are left out.
    """
    parser.add_argument(
        "--seed",
        type=number(int, 0, MAX_SEED),
        default=None if temperature is None else 0,
        help="seed of the noise",
    )
    parser.add_argument(
        "--temperature",
        type=number(float, 0.0),
        default=temperature,
        help="0 gives the calm take, 1 is as lively as real motion",
    )


def add_weights(parser: argparse.ArgumentParser) -> None:
    """``--weights``."""
    parser.add_argument(
        "--weights",
        type=Path,
        metavar="FILE",
        help="trained weights; the ones that ship if left out",
    )


def add_wishes(parser: argparse.ArgumentParser) -> None:
    """What is delivered of a shot besides the scene; ``wished`` reads it."""
    parser.add_argument(
        "--truth",
        action="store_true",
        default=None,
        help="ground truth: joints, contacts, tasks … as numbers",
    )
    parser.add_argument(
        "--render",
        nargs="+",
        metavar="WHAT",
        help=f"pictures by the scene's cameras: {', '.join(RENDERED)}",
    )
    parser.add_argument(
        "--every",
        type=number(int, 1),
        metavar="N",
        help="cameras look at every N-th frame only",
    )
    parser.add_argument(
        "--export",
        nargs="+",
        metavar="FORMAT",
        help=f"a file for each character and take: {', '.join(EXPORTED)}",
    )
    parser.add_argument(
        "--root-motion",
        choices=ROOT_MOTIONS,
        help="with --export: what carries the character over the floor; a bone if left out",
    )


def wished(options: argparse.Namespace) -> dict[str, Any]:
    """The words of ``Wishes`` that the options of ``add_wishes`` say."""
    words = ("truth", "render", "every", "export", "root_motion")
    return {word: value for word in words if (value := getattr(options, word)) is not None}


def number(
    kind: type[int] | type[float], low: float, high: float = math.inf
) -> Callable[[str], float]:
    """A reader of an argument that is a finite number of this kind, from ``low`` to ``high``."""
    what = "whole number" if kind is int else "number"
    limits = f"from {low:g} to {high:.10g}" if high < math.inf else f"of at least {low:g}"

    def read(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high or value == math.inf:
            raise argparse.ArgumentTypeError(f"'{text}' is not a {what} {limits}")
        return value

    return read


def frame_range(text: str) -> tuple[int, int]:
    """Reads FIRST:LAST, both included."""
    first, _, last = text.partition(":")
    try:
        return int(first), int(last)
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a range; write it as FIRST:LAST"
        ) from error
