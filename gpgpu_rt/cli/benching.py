"""``gpgpu-rt bench``: methods beside the engines that users would pick instead."""
from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from ..bench import ENGINES, RAY_SETS, Entry, Peaks, peaks, race, too_noisy
from ..bench.roofline import FLOPS_AN_INSTRUCTION
from ..bench.work import Work
from ..errors import Error, OptionError, nearest_names
from ..files import check_writable
from ..gpu import open_gpu
from ..methods import Method, find_method, methods, taking
from ..scene import load_scene
from ..words import number
from .shared import (
    Command, add_methods, add_options, given_options, names, options_for, print_json, print_table,
    say, side_word
)

Races = list[tuple[str, str, list[Entry]]]

SIZE = 1024
# Those that were fastest, by options that are not their defaults.
BEST = (("bvh-packet", {"packet": (4, 2), "octants": True, "interval_test": True,
                        "quantise_nodes": 16, "entry_points": 32}),
        ("bvh-packet", {"packet": (4, 2), "octants": True, "quantise_nodes": 16}),
        ("bvh-threaded", {"octants": True, "quantise_nodes": 16}),
        ("bvh-packet", {"packet": (2, 2), "octants": True, "quantise_nodes": 16,
                        "presort": True}))


def add_command(command: Command) -> None:
    sub = command("bench", _bench, "methods and today's engines on the same rays")
    sub.add_argument("scenes", nargs="+", metavar="scene", help="a scene's name or a mesh file")
    add_methods(sub, "all but " + " and ".join(row.name for row in methods()
                                               if not _is_quick(row)))
    sub.add_argument("--rays", type=names, default=["eye"], metavar="KIND,KIND,...",
                     help=f"of {', '.join(RAY_SETS)}, or all; default eye")
    sub.add_argument("--size", type=side_word, default=SIZE, metavar="PIXELS",
                     help="a side of the image that the rays belong to; default %(default)s")
    sub.add_argument("--runs", type=int, default=5, help="timed runs of each after a warm-up, "
                     "taking turns; default %(default)s")
    sub.add_argument("--plot", metavar="IMAGE.png", help="draw the rates as well")
    add_options(sub)


def _bench(chosen: argparse.Namespace) -> None:
    kinds = list(RAY_SETS) if chosen.rays == ["all"] else chosen.rays
    for kind in kinds:
        if kind not in RAY_SETS:
            raise OptionError(f"--rays {kind!r}{nearest_names(kind, RAY_SETS)}")
    if chosen.plot is not None:
        _chart(chosen.plot)
    candidates = _candidates(chosen)
    for scene in chosen.scenes:      # what is misspelt is found before hours are spent
        load_scene(scene)
    gpu = open_gpu(given_options(chosen).get("context"))
    found, peak = [], None
    for scene in chosen.scenes:
        for kind in kinds:
            entries = race(scene, RAY_SETS[kind], candidates, chosen.size, chosen.runs,
                           report=say)
            peak = peak or peaks(gpu)     # when the first race has found nothing to refuse
            found.append((scene, kind, entries))
            if not chosen.json:
                _print(scene, kind, entries, chosen.size, peak)
    assert peak is not None
    if chosen.json:
        print_json({"gpu": gpu.info(), "peaks": peak.to_dict(), "size": chosen.size,
                    "missing": _missing(),
                    "races": [{"scene": scene, "rays": kind, "too_noisy": too_noisy(entries),
                               "entries": [{**entry.to_dict(), **_shares(entry, peak)}
                                           for entry in entries]}
                              for scene, kind, entries in found]})
    else:
        _print_peaks(gpu.renderer, peak)
    if chosen.plot is not None:
        _chart(chosen.plot)(found, chosen.plot)


def _candidates(chosen: argparse.Namespace) -> list[tuple[str, dict[str, Any]]]:
    """Methods with the options that were given: of the default ones, those that take them."""
    if chosen.methods:
        named = [(name, options_for(chosen, name)) for name in chosen.methods]
        for name, options in named:
            find_method(name).resolved(options)
        return named
    given, quick = given_options(chosen), [row for row in methods() if _is_quick(row)]
    found = taking(given, quick)
    if len(found) < len(quick):
        left = ", ".join(row.name for row in quick if row not in found)
        say(f"without {left}: they do not take these options")
    plain = [(row.name, given) for row in found]
    best = [(name, {**own, **given}) for name, own in BEST
            if find_method(name).takes({**own, **given})]
    return [one for one in best if one not in plain] + plain


def _shares(entry: Entry, peak: Peaks) -> dict[str, float | None]:
    """Of the renderer's peaks; of an engine nothing is known."""
    return (entry.work or Work(unknown="an engine")).shares(peak, entry.rays_per_second)


def _print(scene: str, kind: str, entries: list[Entry], size: int, peak: Peaks) -> None:
    noise = too_noisy(entries)
    print(f"{load_scene(scene).name}, {len(load_scene(scene)):,} triangles, "
          f"{entries[0].rays:,} {RAY_SETS[kind]} of {size} x {size} pixels")
    heads = ["method", "options", "Mrays/s", "over embreex", "arrays in to out", "spread",
             "bytes a triangle", "fetches of peak", "arithmetic of peak",
             "against embreex"]
    rows = []
    for entry in sorted(entries, key=lambda e: -e.rays_per_second):
        told, shares = entry.to_dict(), _shares(entry, peak)
        rows.append([
            entry.name, _words(entry.options), number(entry.rays_per_second / 1e6),
            *(number(told.get(name))
              for name in ("over_embree", "over_embree_wall")),
            number(entry.spread),
            "-" if entry.bytes_a_triangle is None else f"{entry.bytes_a_triangle:.0f}",
            *("-" if shares.get(name) is None else f"{shares[name]:.1%}"
              for name in ("fetch_share", "arithmetic_share")),
            "-" if noise else entry.verdict() or "-"])
    print_table(heads, rows)
    for why in dict.fromkeys(entry.work.unknown for entry in entries if entry.work is not None):
        if why:
            names = [e.name for e in entries if e.work is not None and e.work.unknown == why]
            print(f"no share of the peaks for {', '.join(names)}: {why}")
    print(f"no verdict: {noise}\n" if noise else "")


def _words(options: dict[str, Any]) -> str:
    return " ".join(f"{name}={value}" for name, value in options.items()) or "-"


def _print_peaks(renderer: str, peak: Peaks) -> None:
    print("over embreex: times the rate of embreex on one thread, the median over turns, our "
          "passes alone;\narrays in to out: the same from numpy arrays to numpy arrays; spread: "
          "slowest turn over fastest")
    print(f"peaks of {renderer}, by programs that do nothing else: "
          f"{peak.near_texels / 1e9:.2f} G texels/s fetched from a cache, "
          f"{peak.far_texels / 1e9:.3f} from all over 64 MiB, {peak.flops / 1e9:.1f} GFLOP/s, "
          f"{FLOPS_AN_INSTRUCTION} of them\na multiply-add, which counts one instruction")
    if _missing():
        print("not installed, and so not here: " + "; ".join(_missing()))


def _missing() -> list[str]:
    return [engine.name for engine in ENGINES if engine.missing]


def _chart(path: str) -> Callable[[Races, str], None]:
    """What draws a chart into such a file; Error where nothing can."""
    try:
        from ..bench.chart import FORMATS, draw
    except ImportError as failure:
        raise Error("--plot draws with matplotlib: pip install 'gpgpu_rt[figures]'") from failure
    if check_writable(path).suffix.lower() not in FORMATS:
        raise OptionError(f"--plot {path}: a chart's name ends in {', '.join(FORMATS)}")
    return draw


def _is_quick(row: Method) -> bool:
    """Whether a method takes a million rays in seconds, not in minutes a run."""
    return row.name != "brute-force" and "loop" in row.schedules
