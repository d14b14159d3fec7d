"""``gpgpu-rt info`` and ``methods``: list the OpenGL contexts and the methods."""
from __future__ import annotations

import argparse
import sys
from typing import Any

from ..errors import Error
from ..gl.context import hint, open_gpu, probe
from ..methods import find_method, methods
from ..methods.references import reference
from ..options import spell
from ..traversal.method import Method
from .help import described
from .program import files_of_method
from .shared import Command, print_json, print_table, word_of


def add_commands(command: Command) -> None:
    command("info", _info, "list the OpenGL contexts of this machine, their renderers and limits")
    sub = command("methods", _methods, "list the methods, or a method's options and files")
    sub.add_argument("names", nargs="*", metavar="NAME", help="list the options and files of "
                     "these methods")


def _info(chosen: argparse.Namespace) -> None:
    rows: list[dict[str, Any]] = []
    for backend, found in probe():
        rows.append({"backend": backend, "missing": str(found)} if isinstance(found, Error)
                    else found.info())
    some = not all("missing" in row for row in rows)
    if chosen.json:
        taken = open_gpu().backend if some else None
        return print_json([{**row, "taken": row["backend"] == taken} for row in rows])
    for row in rows:
        if "missing" in row:
            print(f"{row['backend']}: not available ({row['missing']})"
                  + ("; not needed, because another context is available" if some else ""))
        else:
            print(f"{row['backend']}: {row['renderer']}\n    OpenGL {row['version']}\n"
                  f"    largest texture {row['max_texture_size']}, "
                  f"{row['max_draw_buffers']} render targets")
    if not some:
        raise Error(f"no OpenGL context is available; {hint()}")
    # Show the table even if `open_gpu` fails because of an environment variable.
    sys.stdout.flush()
    print(f"used without --context: {open_gpu().backend}")


def _methods(chosen: argparse.Namespace) -> None:
    rows = [find_method(name) for name in chosen.names] or list(methods())
    if chosen.json:
        return print_json([row.to_dict() for row in rows] if not chosen.names else [
            {**row.to_dict(), "reference": reference(row.citation),
             "files": dict(files_of_method(row.name))} for row in rows])
    if not chosen.names:
        print_table(("method", "era", "paper", "what it does"),
                    [(row.name, _era_word(row), row.citation, row.summary) for row in rows])
        print("\nera: whether --era can run the method (docs/era.md); loop: only on a card with "
              "loops.\n`gpgpu-rt methods NAME` lists a method's own options and files.")
    for row in rows if chosen.names else ():
        print(f"{row.name}: {row.summary} ({row.citation})\n"
              f"reference: {reference(row.citation)}\n"
              f"schedules: {', '.join(row.schedules)}\n"
              "era form (docs/era.md): "
              f"{row.why_no_era_form() and 'no, ' + row.why_no_era_form() or 'yes'}")
        print_table(("option", "default", "meaning"), [
            (word_of(o.name), "no" if o.default is False else
             "-" if o.default is None else spell(o.default), described(o))
            for o in row.options] or [("none", "-", "")])
        print()
        print_table(("file", "used by"), files_of_method(row.name))
        print()


def _era_word(row: Method) -> str:
    if row.why_no_era_form():
        return "-"
    return "yes" if row.era_packets is None else "loop"
