"""The command ``dafnet``: one parser behind ``python -m dafnet_addon …`` and ``blender [file]
--command dafnet …``; what it can do is in ``commands``.

Results go to standard output, for machines with ``--json``; progress and errors go to standard
error. Exit codes: 0 done, 1 an error said in one sentence, 2 a wrong command line, 128 and its
number for a signal: 130 for Ctrl-C.
"""

import argparse
import importlib.util
import json
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import ExitStack, redirect_stdout

from .commands import COMMANDS, Command
from .commands.console import (
    ProgressBar,
    claim_stdout,
    complain,
    escape_unprintable,
    flush_streams,
    open_streams,
    say,
)
from .core.errors import DafnetError, InputError
from .core.stopping import Stop, end_with_stdin

__all__ = ["main", "run", "run_in_blender"]

_PACKAGES = {"PIL": "pillow"}
"""The packages to install for modules that have other names than their package."""


def main(
    argv: Sequence[str] | None = None, in_blender: bool = False, loading: Stop | None = None
) -> int:
    """Run one command and return its exit code.

    ``in_blender``: the file that Blender has open is the scene. ``loading``: knows whether a stop
    was requested while the program was being loaded.
    """
    escape_unprintable()
    end_with_stdin()
    try:
        if loading:
            loading.now()

        options = _parser(in_blender).parse_args(argv)
        command: Command = options.command
        needed = command.needs(options)
        _require(needed)

        with ExitStack() as stack:
            # A command that runs Blender stops between two steps, any other wherever it is.
            stop_if_asked = stack.enter_context(Stop()).now if "bpy" in needed else _never_stop
            with redirect_stdout(sys.stderr), ProgressBar(stop_if_asked) as progress:
                found = command.run(options, progress)
            if found is not None:
                say(json.dumps(found[0], indent=2) if options.json else found[1])

        return 0
    except SystemExit as stop:  # argparse has said why
        say("")
        return int(stop.code or 0)
    except DafnetError as error:
        complain(f"dafnet: {error}")
        return 1
    except OSError as error:
        complain(
            f"dafnet: {error.filename or 'A file'} cannot be used ({error.strerror}); check its "
            "path."
        )
        return 1
    except KeyboardInterrupt as stop:
        complain("dafnet: stopped.")
        return 128 + (stop.args[0] if stop.args else signal.SIGINT)


def run_in_blender(arguments: Sequence[str]) -> int:
    """``main`` as ``blender [file] --command dafnet``, after which Blender ends."""
    open_streams()
    claim_stdout()
    code = main(arguments, in_blender=True)
    flush_streams()
    return code


def run(loading: Stop | None = None) -> None:
    """``main`` as a process."""
    open_streams()
    claim_stdout()
    code = main(loading=loading)
    flush_streams()

    if "bpy" in sys.modules:
        # The module of Blender 4.2 crashes at exit once a property with a poll function was
        # registered, unregistered or not.
        os._exit(code)

    sys.exit(code)


def _parser(in_blender: bool) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dafnet",
        description="A character that walks up to furniture and uses it, from an animated root.",
    )
    subparsers = parser.add_subparsers(metavar="command", required=True)
    for command in COMMANDS:
        added = subparsers.add_parser(
            command.name, help=command.summary, description=command.summary
        )
        added.set_defaults(command=command, in_blender=in_blender)
        added.add_argument(
            "--json", action="store_true", help="print the result as JSON on standard output"
        )
        command.add_arguments(added)

    return parser


def _require(modules: Sequence[str]) -> None:
    """Raise InputError where this Python lacks a module."""
    missing = [_PACKAGES.get(name, name) for name in modules if not _is_installed(name)]
    if missing:
        inside = ", or run it inside Blender" if missing == ["bpy"] else ""
        raise InputError(
            f"This command needs {' and '.join(missing)}, which this Python does not have; "
            f"install it{inside}."
        )


def _is_installed(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def _never_stop() -> None:
    """A command that is stopped by an exception need not ask whether to stop."""
