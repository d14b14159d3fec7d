"""``gpgpu-rt program``: print the GLSL text that a method runs."""
from __future__ import annotations

import argparse
from pathlib import Path

from ..disk.files import check_writable, replacing
from ..errors import ContextError, OptionError
from ..hardware.static_costs import COMPILERS
from ..inspect.traced_programs import (
    SCENE, TracedProgram, find_program, method_files, traced_programs
)
from ..methods import file_of, find_method
from ..options import TRACER_OPTIONS
from ..text_format import counted
from .card_programs import card_costs, card_text, check_alone, chip_of
from .shared import Command, add_options, options_for, print_json, print_table, say

PACKAGE = Path(__file__).parents[1]
LIST_ALONE = "--list prints a table and writes no program; leave --output or --list out"


def add_commands(command: Command) -> None:
    sub = command("program", _program, "print the GLSL text that a method runs: "
                  "conditionals resolved, each part under the name of its file")
    sub.add_argument("method", metavar="METHOD", help="a method's name")
    which = sub.add_mutually_exclusive_group()
    which.add_argument("--list", action="store_true", help="list all programs that a trace "
                       "compiles: names, lines and files")
    which.add_argument("--all", action="store_true", help="print all programs; default: the "
                       "programs that traverse (a single program under the schedule loop)")
    which.add_argument("--only", metavar="NAME", help="print only the program of this name, for "
                       "example the kernel down under the schedule kernels")
    sub.add_argument("-o", "--output", metavar="FILE", help="write the text to a file")
    sub.add_argument("--card", metavar="CHIP", type=chip_of, help="print the kernels as "
                     "compiled by Mesa's driver for this chip: counts, limits and the compiled "
                     "program; with --list, only counts and limits. CHIP is "
                     + ", ".join(COMPILERS))
    sub.add_argument("--scene", default=SCENE, help="scene whose tree determines sizes, such as "
                     "the size of a stack; default %(default)s")
    add_options(sub, words=())


def _program(chosen: argparse.Namespace) -> None:
    method = find_method(chosen.method).name
    if chosen.card:
        return _card_program(method, chosen)
    options = options_for(chosen, method)
    if chosen.output and chosen.list:
        raise OptionError(LIST_ALONE)
    if chosen.output:
        check_writable(chosen.output)
    programs = traced_programs(method, options, chosen.scene)
    if chosen.only:
        programs = [find_program(programs, chosen.only)]
    elif not (chosen.all or chosen.list):
        programs = [one for one in programs if one.traverses]
    if chosen.output:
        with replacing(chosen.output) as path:
            path.write_text(_joined(programs))
    if chosen.json:
        return print_json([one.to_dict() for one in programs])
    if chosen.list:
        return print_table(("program", "lines", "file", "made of"), [
            (one.name, str(len(one.text.splitlines())), one.file,
             counted(len(one.files), "file")) for one in programs])
    if chosen.output:
        return say(f"wrote {counted(len(programs), 'program')} to {chosen.output}")
    print(_joined(programs), end="")


def _card_program(method: str, chosen: argparse.Namespace) -> None:
    options = options_for(chosen, method)
    of_tracer = {one.name: one.name in options for one in TRACER_OPTIONS}
    check_alone({"all": chosen.all, **of_tracer})
    if chosen.output and chosen.list:
        raise OptionError(LIST_ALONE)
    costs = card_costs(method, chosen.card, options, chosen.only)
    if chosen.json:
        return print_json([{name: value for name, value in one.to_dict().items()
                            if not (chosen.list and name == "listing")} for one in costs])
    if not chosen.output:
        return print(card_text(costs, listing=not chosen.list), end="")
    check_writable(chosen.output)
    with replacing(chosen.output) as path:
        path.write_text(card_text(costs))
    say(f"wrote {counted(len(costs), 'kernel')} to {chosen.output}")


def _joined(programs: list[TracedProgram]) -> str:
    return "\n".join(one.text for one in programs)


def files_of_method(name: str) -> list[tuple[str, str]]:
    """Return (file, purpose) for each file of a method. The first file is the Python file of the
    method's row in the method table.

    Without an OpenGL context, includes cannot be resolved. The result then has only the Python
    file and the method's file of kernels.
    """
    row, file = find_method(name), file_of(name)
    found = [] if file is None else [(_shown(file), "row")]
    try:
        used = method_files(name)
    except ContextError:
        return [*found, (str(row.glsl), "kernels")]
    everywhere = tuple(row.schedules)
    rows = [(used_file, "all schedules" if schedules == everywhere else ", ".join(schedules))
            for used_file, schedules in used.items()]
    return found + sorted(rows, key=lambda pair: not pair[0].startswith("glsl/methods/"))


def _shown(file: Path) -> str:
    try:
        return str(file.relative_to(PACKAGE.parent))
    except ValueError:
        return str(file)
