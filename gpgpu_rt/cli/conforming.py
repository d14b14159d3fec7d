"""``gpgpu-rt conform``: test ray tracers with extreme rays whose exact answers are known."""
from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..conform.export import export
from ..conform.families import FAMILIES
from ..conform.page import write_page
from ..conform.runner import SECONDS, Runner
from ..conform.shrink import minimal_cases
from ..conform.spec import COMMAND, METHOD, Spec
from ..conform.suite import (
    CRASH, KINDS, RAYS, SEED, Known, Row, family_names, installed, not_loaded, notes_of, run
)
from ..disk.files import check_writable, replacing
from ..errors import Error, OptionError, how_to_install
from ..methods import find_method, methods
from ..text_format import counted, number
from .progress import show_progress, tenths
from .shared import NONE, Command, add_methods, names, print_json, print_table, say


def add_commands(command: Command) -> None:
    sub = command("conform", _conform, "test ray tracers with extreme rays whose exact answers "
                  "are known")
    add_methods(sub, "bvh-threaded; 'all' for every method, 'none' for only engines")
    sub.add_argument("--schedules", action="store_true", help="run each method under every "
                     "schedule that it has")
    sub.add_argument("--engine", action="append", default=[], metavar="NAME|MODULE:FUNCTION",
                     help="an engine that --list prints, or a function (triangles, origins, "
                     "directions) -> (t, triangle) of a Python module in sys.path or in this "
                     "folder; may be repeated; default: every installed engine. 'none' for no "
                     "engine")
    sub.add_argument("--command", dest="program", metavar="'PROGRAM {cases} {answers}'",
                     help="a program that reads a family's triangles and rays from the JSON file "
                     "{cases} and writes the lists triangle, t and any_hit to {answers}")
    sub.add_argument("--family", type=names, default=[], metavar="NAME,NAME,...",
                     help="families of cases; default: all. --list prints their names")
    sub.add_argument("--list", action="store_true", help="list the families and the engines")
    sub.add_argument("--rays", type=int, default=RAYS, help="number of rays of each family; "
                     "default %(default)s. Families with slow scenes have fewer rays")
    sub.add_argument("--seed", type=int, default=SEED, help="seed of the rays and of random "
                     "scenes; default %(default)s")
    sub.add_argument("--time-limit", type=float, default=SECONDS, metavar="SECONDS",
                     help="an engine that needs more time for a family counts as crashed; "
                     "default %(default)s")
    sub.add_argument("--check", action="store_true", help="end with exit status 1 if an answer is "
                     "wrong")
    sub.add_argument("--plot", metavar="IMAGE.png", help="draw the table as a chart, too")
    sub.add_argument("--page", metavar="PAGE.html", help="write the table as a page, too")
    sub.add_argument("--export", metavar="FOLDER", help="write the suite as plain data instead of "
                     "running it: a .json and an .npz file for each family, their schema, and a "
                     "program that judges a tracer's answers")
    sub.add_argument("--shrink", metavar="FOLDER", help="write a minimal case for each kind of "
                     "wrong answer of each engine, as Python text")


def _conform(chosen: argparse.Namespace) -> None:
    if chosen.rays < 1:
        raise OptionError(f"--rays {chosen.rays} judges nothing; give 1 or more")
    if chosen.seed < 0:
        raise OptionError(f"--seed {chosen.seed} is negative; give 0 or more")
    if not chosen.time_limit > 0:
        raise OptionError(f"--time-limit {chosen.time_limit:g} leaves no time; give a number "
                          "above 0")
    families = family_names(chosen.family)
    if chosen.list:
        return _print_lists()
    if chosen.export is not None:
        return _export(chosen, families)
    specs, missing = _specs(chosen)
    drawing = None if chosen.plot is None else _chart(chosen.plot)
    if chosen.page is not None:
        check_writable(chosen.page)
    if chosen.shrink is not None:
        _folder(chosen.shrink, "--shrink")
    rows: list[Row] = []
    with show_progress("result", tenths("result")) as report:
        try:
            for row in run(specs, families, chosen.rays, chosen.seed, chosen.time_limit):
                rows.append(row)
                report(len(rows), len(specs) * len(families), f"{row.engine}, {row.family}")
        except KeyboardInterrupt:
            _tell(rows, missing, chosen)
            say(f"interrupted after {len(rows)} of {len(specs) * len(families)} results")
            raise
    _tell(rows, missing, chosen)
    if drawing is not None:
        drawing(rows, chosen.plot)
    if chosen.page is not None:
        write_page(rows, missing, chosen.page)
    if chosen.shrink is not None:
        _shrink(specs, rows, chosen)
    wrong = sum(row.wrong_rays for row in rows)
    if chosen.check and wrong:
        raise Error(f"--check found {counted(wrong, 'wrong answer')}")
    if chosen.check and (idle := not_loaded(rows)):
        raise Error(f"--check could not run {', '.join(idle)}; install again, or run without "
                    "this engine")


def _tell(rows: list[Row], missing: dict[str, str], chosen: argparse.Namespace) -> None:
    if chosen.json:
        print_json([row.to_dict() for row in rows])
    elif rows:
        _print(rows, missing)


def _specs(chosen: argparse.Namespace) -> tuple[list[Spec], dict[str, str]]:
    """Return the methods and engines to run, and name -> reason for engines that cannot run."""
    missing: dict[str, str] = {}
    named = [word for word in chosen.engine if word != NONE]
    given = bool(named or chosen.program)
    words = chosen.methods or ([NONE] if given else ["bvh-threaded"])
    if words == ["all"]:
        words = [row.name for row in methods()]
    found = []
    for name in words if words != [NONE] else ():
        schedules: Sequence[str] = find_method(name).schedules if chosen.schedules else ("",)
        found += [Spec(METHOD, name, schedule) for schedule in schedules]
    found += [Spec.of(word) for word in named]
    if not chosen.engine and not given:
        engines, missing = installed()
        found += engines
    if chosen.program:
        found.append(Spec(COMMAND, chosen.program))
    for spec in found:
        if spec.engine.missing:
            raise Error(f"{spec.name} cannot run: {spec.engine.missing}; "
                        f"{how_to_install('conform')}")
    if not found:
        raise OptionError("nothing to run; give a method, --engine or --command")
    return found, missing


def _print_lists() -> None:
    print_table(["family", "row", "scene and rays"],
                [[name, str(one.row), one.what] for name, one in FAMILIES.items()])
    print()
    engines, missing = installed()
    print_table(["engine", "version"], [[one.name, one.engine.version] for one in engines])
    for name, reason in missing.items():
        print(f"{name}: {reason}")


def _print(rows: list[Row], missing: dict[str, str]) -> None:
    engines = list(dict.fromkeys(row.engine for row in rows))
    cells = {(row.engine, row.family): row for row in rows}
    none = Row("", "", "", 0, 0, {}, 0.0)       # for results that an interrupt prevented
    print("Wrong rays out of rays cast. A dash: the engine does not support the t_min or t_max of "
          "the family's rays, it gave no answer in an earlier family, it cannot be loaded, or the "
          "run was interrupted.")
    print_table(["family", *engines],
                [[name, *(_cell(cells.get((engine, name), none)) for engine in engines)]
                 for name in dict.fromkeys(row.family for row in rows)])
    print()
    print_table(["engine", "version", "rays", "undecidable", "wrong", *KINDS, "wrapper's own",
                 "seconds"],
                [_sum([row for row in rows if row.engine == engine]) for engine in engines])
    for line in notes_of(rows, missing):
        print(line)
    print("The rays are chosen to be difficult, so counts say nothing about ordinary rays. "
          "docs/conformance.md explains when an answer is wrong.")


def _cell(row: Row) -> str:
    if not row.rays:
        return "-"
    return row.failure or (f"{row.wrong_rays}/{row.rays}" if row.wrong_rays else "0")


def _sum(rows: list[Row]) -> list[Any]:
    own = [row.own for row in rows if row.own is not None]
    return [rows[0].engine, rows[0].version, sum(row.rays for row in rows),
            sum(row.undecidable for row in rows), sum(row.wrong_rays for row in rows),
            *(sum(row.wrong[kind] for row in rows) for kind in KINDS),
            sum(own) if own else "-", number(sum(row.seconds for row in rows))]


def _export(chosen: argparse.Namespace, families: list[str]) -> None:
    for name in export(_folder(chosen.export, "--export"), families, chosen.rays, chosen.seed):
        say(f"wrote {name}")
    print(f"wrote {'1 family' if len(families) == 1 else f'{len(families)} families'} to "
          f"{chosen.export}")


def _shrink(specs: list[Spec], rows: list[Row], chosen: argparse.Namespace) -> None:
    folder = Path(chosen.shrink)
    done: set[tuple[str, str]] = set()
    with Runner() as runner:
        for row in rows:
            kinds = {kind for kind, count in row.wrong.items() if count and kind != CRASH}
            if not kinds - {kind for engine, kind in done if engine == row.engine}:
                continue
            spec = next(spec for spec in specs if spec.title == row.engine)
            for one in minimal_cases(spec, Known.of(row.family, chosen.rays, chosen.seed), runner):
                if (one.engine, one.kind) in done:
                    continue
                done.add((one.engine, one.kind))
                words = re.sub(r"\W+", "-", f"{one.engine} {one.kind}").strip("-")
                with replacing(folder / f"{words}.py") as file:
                    file.write_text(one.to_python(), encoding="utf-8")
                say(f"{one.engine}: {one.kind} with "
                    f"{counted(len(one.case.triangles), 'triangle')} ({row.family})")
    print(f"wrote {counted(len(done), 'minimal case')} to {folder}")


def _folder(name: str, option: str) -> Path:
    folder = Path(name)
    if folder.exists() and not folder.is_dir():
        raise Error(f"{folder} is not a folder; give {option} a folder to write into")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise Error(f"{option} {folder}: {failure.strerror}") from failure
    return folder


def _chart(path: str) -> Any:
    try:
        from ..conform.chart import FORMATS, draw  # matplotlib is optional
    except ImportError as failure:
        raise Error(f"--plot needs matplotlib; {how_to_install('figures')}") from failure
    if Path(path).suffix.lower() not in FORMATS:
        raise OptionError(f"--plot {path}: the name must end in {', '.join(FORMATS)}")
    check_writable(path)
    return draw
