"""The command line: ``gpgpu-rt`` and ``python -m gpgpu_rt``."""
from __future__ import annotations

import argparse
import os
import shlex
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from .. import __version__
from ..disk.files import FULL
from ..errors import Error
from ..gl.environment import commit
from ..interrupts import STATUS
from ..methods import load_methods
from .parser import Parser
from .shared import print_any_name, say, spelled_out
from .streams import printed

# The module of each command, in the order of the help. To save time, only the module of the
# command that runs is imported.
MODULES = {
    "info": "listing", "methods": "listing", "scenes": "scenes", "render": "tracing",
    "trace": "tracing", "remesh": "remeshing", "bench": "benching", "conform": "conforming",
    "hardware": "hardware", "passes": "passes_heat", "heat": "passes_heat", "program": "program",
    "accuracy": "tuning", "tune": "tuning", "report": "report", "view": "view", "web": "web"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status. A user's mistake prints a line on stderr."""
    return printed(lambda: _main(arguments))


def import_command(arguments: Sequence[str]) -> None:
    """Import the module of the command that the arguments name; without a name, all modules.

    ``__main__.py`` calls this function before `main`. Until `main` begins, an interrupt ends the
    process without an exception, because an imported library might catch an exception.
    """
    named = next((MODULES[word] for word in arguments if word in MODULES), None)
    for module in MODULES.values() if named is None else [named]:
        import_module(f".{module}", __package__)


def _main(arguments: Sequence[str] | None) -> int:
    print_any_name()
    try:
        # Load the methods first, because methods declare most of the options.
        given = sys.argv[1:] if arguments is None else arguments
        arguments = _take_methods(given)
        if not arguments:
            command_parser().print_help()
            return 0
        only = arguments[0] if arguments[0] in MODULES else None
        parser = command_parser(only)
        chosen, unknown = parser.parse_known_args(spelled_out(arguments, parser.switches))
        if unknown:
            chosen.parser.refuse(unknown[0])
        chosen.command = shlex.join(["gpgpu-rt", *given])
        with warnings.catch_warnings():
            warnings.showwarning = _show
            for developers in (DeprecationWarning, PendingDeprecationWarning):
                warnings.simplefilter("ignore", developers)
            chosen.run(chosen)
        sys.stdout.flush()
        return 0
    except BrokenPipeError:
        raise
    except KeyboardInterrupt:
        return STATUS
    except (Error, ValueError, OSError, MemoryError) as failure:
        if os.environ.get("GPGPU_RT_TRACEBACK"):
            raise
        message = " ".join(str(failure).split()) or type(failure).__name__
        if getattr(failure, "filename", None) is None and getattr(failure, "errno", 0) in FULL:
            message = f"cannot write to the standard output: {os.strerror(failure.errno)}"
        if isinstance(failure, MemoryError):
            message += "; use a smaller picture, fewer samples or a smaller scene"
        print(f"gpgpu-rt: {message}", file=sys.stderr)
        return 1


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        made = commit()
        print(f"gpgpu-rt {__version__}" + (f" (commit {made})" if made else ""))
        parser.exit()


def _show(message: Warning | str, *where: Any, **more: Any) -> None:
    say(f"gpgpu-rt: note: {message}")


def _add_methods_from(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--methods-from", metavar="FOLDER", action="append", default=[],
                        help="load your own methods from this folder, too; the environment "
                        "variable GPGPU_RT_METHODS can name several folders "
                        "(docs/how-to/add-a-method.md)")


def _take_methods(arguments: Sequence[str]) -> list[str]:
    """Load the folders of every --methods-from, and return the other arguments."""
    first = Parser(prog="gpgpu-rt", add_help=False, allow_abbrev=False)
    _add_methods_from(first)
    chosen, others = first.parse_known_args(list(arguments))
    for folder in chosen.methods_from:
        load_methods(folder)
    return others


def command_parser(only: str | None = None) -> Parser:
    """Return the parser of all commands, or of the commands in the same module as the command
    ``only``. The parser's ``switches`` are the switches of all these commands."""
    parser = Parser(prog="gpgpu-rt", description="Ray tracing by fragment programs, as on the "
                    "graphics hardware of 2002-2007.")
    _add_methods_from(parser)
    parser.add_argument("--version", action=_Version, nargs=0, default=argparse.SUPPRESS,
                        help="print the version, with the commit in a checkout, and exit")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, run: Callable[[argparse.Namespace], None],
                text: str) -> Parser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run, parser=sub)
        sub.add_argument("--json", action="store_true", help="print JSON instead of text")
        return sub

    modules = MODULES.values() if only is None else [MODULES[only]]
    for module in dict.fromkeys(modules):
        import_module(f".{module}", __package__).add_commands(command)
    for sub in commands.choices.values():
        parser.switches |= sub.switches
    return parser
