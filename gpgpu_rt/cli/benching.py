"""``gpgpu-rt bench``: compare the speed of the methods and of today's ray tracing engines."""
from __future__ import annotations

import argparse
import copy
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..bench import (
    ENGINES, NOISY, RAY_SETS, Entry, load, race, ranked, table, told, too_noisy, uncertain
)
from ..bench.engines import EMBREE, Engine
from ..disk.files import check_writable
from ..errors import Error, OptionError, how_to_install, nearest_names
from ..gl.context import Gpu, open_gpu, threads_of
from ..gl.environment import run_facts
from ..methods import Method, find_method, methods, option_table, taking
from ..methods.choices import PASSING
from ..text_format import counted, number
from .shared import (
    NONE, Collect, Command, add_methods, add_options, given_options, names, options_for,
    print_json, print_stand_in, print_table, say, side_word, word_of
)


class Race(NamedTuple):
    """A finished race on one scene: the scene's facts and title, the kind of rays, the entries."""

    facts: dict[str, Any]
    title: str
    kind: str
    entries: list[Entry]


Races = list[Race]

SIZE = 1024
# Candidates that `bench` times without --methods, besides each quick method: the fastest in
# measurements. The second candidate also shares subtrees, which halves the memory.
_TREE = {"octants": True, "quantise_nodes": 16}
_EYE = {"packet": (4, 2), "interval_test": True, "entry_points": 32, **_TREE, "reinsertion": 3}
BEST = (("bvh-packet", _EYE),
        ("bvh-packet", {**_EYE, "shared_subtrees": 64}),
        ("bvh-packet", {"packet": (4, 2), **_TREE, "reinsertion": 3}),
        ("bvh-threaded", _TREE),
        ("bvh-packet", {"packet": (2, 2), "presort": True, **_TREE, "reinsertion": 3}))


def add_commands(command: Command) -> None:
    sub = command("bench", _bench, "time methods and today's engines on the same rays")
    sub.add_argument("scenes", nargs="+", metavar="scene", help="a scene's name or a mesh file")
    add_methods(sub, "all but " + ", ".join(row.name for row in methods()
                                            if not _is_quick(row)),
                "a name may have options of its own: -m 'bvh-packet octants packet=4x2'")
    sub.add_argument("--rays", type=names, default=["eye"], metavar="KIND,KIND,...",
                     help=f"kinds of rays: {', '.join(RAY_SETS)}, or all; default eye")
    sub.add_argument("--size", type=side_word, default=SIZE, metavar="PIXELS",
                     help="side of the square image that the rays belong to; default %(default)s")
    sub.add_argument("--runs", type=int, default=5, help="timed rounds after a warm-up round. In "
                     "a round, all methods and engines run one after another, each once untimed "
                     "and then once timed; default %(default)s")
    sub.add_argument("--engine", type=names, action=Collect, metavar="NAME,NAME,...",
                     help=f"time only these engines: {', '.join(_first_words())}; or none for no "
                     "engine; default: every installed engine")
    sub.add_argument("--plot", metavar="IMAGE.png", help="draw the rates as a chart, too")
    sub.add_argument("--table", metavar="FILE", help="write the races as a table, too: in LaTeX "
                     "if the name ends in .tex, or with more numbers in CSV if it ends in .csv")
    sub.instead["--csv"] = "; give --table FILE.csv"
    add_options(sub)


def _bench(chosen: argparse.Namespace) -> None:
    kinds = list(RAY_SETS) if chosen.rays == ["all"] else list(dict.fromkeys(chosen.rays))
    for kind in kinds:
        if kind not in RAY_SETS:
            raise OptionError(f"--rays {kind!r}{nearest_names(kind, RAY_SETS)}")
    if chosen.plot is not None:
        _chart(chosen.plot)
    if chosen.table is not None and (
            check_writable(chosen.table).suffix.lower() not in table.FORMATS):
        raise OptionError(f"--table {chosen.table}: end the file's name in "
                          f"{' or '.join(table.FORMATS)}")
    candidates, engines = _candidates(chosen), _engines(chosen.engine)
    count = bool(given_options(chosen).get("statistics"))
    for scene in chosen.scenes:      # report a wrong name before hours of timing
        load(scene)
    gpu = open_gpu(given_options(chosen).get("context"))
    found: Races = []
    try:
        for scene in chosen.scenes:
            print_stand_in(load(scene), chosen.json)
            for kind in kinds:
                entries = race(scene, RAY_SETS[kind], candidates, chosen.size, chosen.runs,
                               engines, say, count)
                found.append(Race(load(scene).facts(), load(scene).title, kind, entries))
                if not chosen.json:
                    _print(scene, kind, entries, chosen.size)
                _warn(scene, kind, entries)
    finally:    # print finished races even after an error
        if found:
            _end(chosen, gpu, found, engines)


def _end(chosen: argparse.Namespace, gpu: Gpu, found: Races, engines: Sequence[Engine]) -> None:
    run = run_facts(gpu, chosen.command)
    # Write the files first: the reader of the printed text may have gone, as with `| head`. Print
    # also if a file cannot be written, because the races may have taken hours.
    try:
        if chosen.table is not None:
            table.write(chosen.table, [(one.facts, one.kind, one.entries) for one in found],
                        _about(run, chosen, gpu))
        if chosen.plot is not None:
            _chart(chosen.plot)([(one.title, _rays(one.kind, chosen.size), one.entries)
                                 for one in found], chosen.plot, _renderer(gpu))
    finally:
        if chosen.json:
            _print_json(run, chosen, gpu, found, engines)
        else:
            _print_notes(gpu, found, engines)


def _print_json(run: dict[str, Any], chosen: argparse.Namespace, gpu: Gpu, found: Races,
                engines: Sequence[Engine]) -> None:
    print_json({**run, "size": chosen.size, "runs": chosen.runs,
                "threads": threads_of(gpu.renderer), "missing": _missing(engines),
                "robust": {one.name: one.robust for one in engines},
                "races": [{**one.facts, "rays": one.kind,
                           "too_noisy": too_noisy(one.entries) if _compared(one.entries) else "",
                           "uncertain": [entry.label for entry in uncertain(one.entries)],
                           "entries": [entry.to_dict() for entry in one.entries]}
                          for one in found]})


def _about(run: dict[str, Any], chosen: argparse.Namespace, gpu: Gpu) -> list[str]:
    """Return lines about the run for a table's readers."""
    here = run["environment"]
    commit = f", commit {here['commit']}" if here["commit"] else ""
    return [f"{run['command']}  ({run['date']})",
            f"gpgpu_rt {here['version']}{commit}; Python {here['python']}; {here['system']}",
            f"{_renderer(gpu)}, OpenGL {here['opengl']}; {here['processor']}",
            f"{counted(chosen.runs, 'round')}, {chosen.size} x {chosen.size} pixels"]


def _first_words() -> list[str]:
    return list(dict.fromkeys(engine.name.split()[0].rstrip(",") for engine in ENGINES))


def _engines(words: Sequence[str] | None) -> Sequence[Engine]:
    """Return the engines whose names begin with one of ``words``.

    Only whole words match; upper and lower case are alike. None means all engines, and the single
    word "none" means no engine. Raise OptionError if a word names no engine, or only engines that
    cannot run.
    """
    if words is None:
        return ENGINES
    if words == [NONE]:
        return ()
    chosen: list[Engine] = []
    for word in words:
        whole = re.compile(rf"{re.escape(word)}(?!\w)", re.IGNORECASE)
        named = [one for one in ENGINES if whole.match(one.name)]
        if not named:
            raise OptionError(f"--engine {word!r}{nearest_names(word, [*_first_words(), NONE])}")
        if all(one.missing for one in named):
            raise OptionError(f"--engine {word}: {named[0].missing}; install it or leave it out")
        chosen += named
    return [one for one in ENGINES if one in chosen]


def _candidates(chosen: argparse.Namespace) -> list[tuple[str, dict[str, Any]]]:
    """Return the methods to time, with their options.

    Methods that the user named must accept the given options. If the user named none, the result
    is BEST and the quick methods, without methods that do not accept the given options.
    """
    if chosen.methods:
        named = [_candidate(chosen, words) for words in chosen.methods]
        for name, options in named:
            find_method(name).resolved(options)
            options.pop("statistics", None)     # `race` counts work in an untimed trace
        return named
    given, quick = given_options(chosen), [row for row in methods() if _is_quick(row)]
    found = taking(given, quick)
    given.pop("statistics", None)
    if len(found) < len(quick):
        left = ", ".join(row.name for row in quick if row not in found)
        say(f"left out: {left} (they do not have these options)")
    plain = [(row.name, given) for row in found]
    best = [(name, {**own, **given}) for name, own in BEST
            if find_method(name).takes({**own, **given})]
    return [one for one in best if one not in plain] + plain


def _candidate(chosen: argparse.Namespace, words: str) -> tuple[str, dict[str, Any]]:
    """Return a method and its options. ``words`` is the method's name, and any options of its own
    as in the printed table: "bvh-packet octants packet=4x2"."""
    name, *own = words.split()
    asked, known = copy.copy(chosen), option_table(name)
    for word in own:
        key, given, text = word.lstrip("-").partition("=")
        key = key.replace("-", "_")
        if key in PASSING:
            raise OptionError(f"-m {words!r}: all methods share {word_of(key)}; give it apart "
                              "from the method")
        if key not in known:
            raise OptionError(f"-m {words!r}: method {name} has no option {key!r}"
                              + nearest_names(key, known))
        if not given and known[key].kind is not bool:
            raise OptionError(f"-m {words!r}: give {key}=VALUE")
        setattr(asked, "option_" + key, text if given else "true")
    return name, options_for(asked, name)


def _print(scene: str, kind: str, entries: list[Entry], size: int) -> None:
    noise = too_noisy(entries)
    print(f"{load(scene).name}, {len(load(scene)):,} triangles, "
          f"{entries[0].rays:,} {_rays(kind, size)}")
    compared = _compared(entries)
    heads = ["method", "options", "Mrays/s",
             *(["over embreex", "over embreex, with copies"] * compared),
             "spread", "bytes per triangle", *(["against embreex"] * compared)]
    rows = []
    for entry in ranked(entries):
        told = entry.to_dict()
        rows.append([
            entry.title, entry.words or "-", number(entry.rays_per_second / 1e6),
            *(number(told.get(name))
              for name in ("over_embree", "over_embree_wall") * compared),
            number(entry.spread),
            "-" if entry.bytes_a_triangle is None else f"{entry.bytes_a_triangle:.0f}",
            *(["-" if noise else entry.verdict() or "-"] * compared)])
    print_table(heads, rows)
    print()
    if worked := [entry for entry in ranked(entries) if entry.work]:
        counters = list(worked[0].work)
        print_table(["work per ray", "options", *(name.replace("_", " ") for name in counters)],
                    [[entry.title, entry.words or "-",
                      *(number(entry.work[name]) for name in counters)] for entry in worked])
        print("A packet's work is divided by the number of its rays\n")


def _warn(scene: str, kind: str, entries: Sequence[Entry]) -> None:
    """Print to stderr why rates of a race are uncertain, and why there is no verdict."""
    race_title, noise = f"{load(scene).name}, {told(RAY_SETS[kind])}", too_noisy(entries)
    if noise and any(entry.bytes_a_triangle is None for entry in entries):
        say(f"{race_title}: no verdict: {noise}")
    if unsteady := "; ".join(entry.label for entry in uncertain(entries)):
        say(f"{race_title}: uncertain rates, because the slowest run took more than {NOISY:g} "
            f"times the fastest; measure again on an idle machine: {unsteady}")


def _compared(entries: Sequence[Entry]) -> bool:
    """Return whether embreex ran, so that the entries have ratios."""
    return any(entry.over for entry in entries)


def _rays(kind: str, size: int) -> str:
    return f"{told(RAY_SETS[kind])} of {size} x {size} pixels"


def _renderer(gpu: Gpu) -> str:
    threads = threads_of(gpu.renderer)
    return gpu.renderer + ("" if threads is None else f", on {counted(threads, 'thread')}")


def _print_notes(gpu: Gpu, found: Races, engines: Sequence[Engine]) -> None:
    if any(_compared(one.entries) for one in found):
        print(f"over embreex: our rate divided by the rate of {EMBREE}, as the median "
              "of all rounds. Our time\n"
              f"is the time of the passes on {_renderer(gpu)},\n"
              "and of sorting rays on the host, if any, without copies of arrays. Rows are "
              "sorted by this column\n"
              "over embreex, with copies: the same ratio, but our time begins with rays in numpy "
              "arrays and ends with hits in numpy arrays\n"
              "against embreex: faster or slower, if all rounds agree")
    print("spread: time of the slowest round divided by the time of the fastest\n"
          "bytes per triangle: size of the method's tables divided by the number of triangles; "
          "without rays and hits")
    names = {entry.name for one in found for entry in one.entries}
    for promise, words in ((True, "robust (promise that no ray leaks at an edge or a vertex)"),
                           (False, "not robust")):
        if told := [one.name for one in ENGINES if one.name in names and one.robust == promise]:
            print(f"{words}: {'; '.join(told)}")
    missing = _missing(engines)
    for why in dict.fromkeys(missing.values()):
        print(f"left out because {why}: "
              + "; ".join(name for name, reason in missing.items() if reason == why))


def _missing(engines: Sequence[Engine]) -> dict[str, str]:
    return {engine.name: engine.missing for engine in engines if engine.missing}


def _chart(path: str) -> Callable[[list[tuple[str, str, list[Entry]]], str, str], None]:
    """Return the function that draws the chart. Raise Error without matplotlib, or if ``path``
    cannot be written."""
    try:
        from ..bench.chart import FORMATS, draw
    except ImportError as failure:
        raise Error(f"--plot draws with matplotlib; {how_to_install('figures')}") from failure
    if check_writable(path).suffix.lower() not in FORMATS:
        raise OptionError(f"--plot {path}: end the chart's name in {' or '.join(FORMATS)}")
    return draw


def _is_quick(row: Method) -> bool:
    """Return whether a method traces a million rays in seconds, not minutes."""
    return row.name != "brute-force" and "loop" in row.schedules
