"""Entry points and rasterised bounds: passes at low resolution that shorten the search of rays.

Multi-level entry points are by Reshetov et al. (2005), for CPUs. Section 5 of the survey proposes
bounds by rasterisation, but measures nothing.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.charts import COLOURS

from ..framework.cell import Cell, timed_runs
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read

SCENES = ("bunny", "robots", "kitchen", "conference")
METHODS = (("bvh-threaded", "bvh-threaded", ()),
           ("bvh-threaded, octants", "bvh-threaded", (("octants", True),)),
           ("kd-restart", "kd-restart", ()), ("kd-short-stack", "kd-short-stack", ()))
BOUNDED = METHODS[1:]
ENTRIES = (("entry_points", 16),)
BOUNDS = (("rasterised_bounds", 8),)
HEADS = ("scene", "method", "nodes a ray", "nodes with entries", "nodes of beams", "fewer by",
         "entries a tile", "ms", "ms with entries", "ms of beams", "faster by")
BOUND_HEADS = ("scene", "method", "nodes a ray", "nodes with bounds", "fewer by", "ms",
               "ms with bounds", "faster by")


def cell(scene: str, method: str, options: tuple[tuple[str, Any], ...], full: bool) -> Cell:
    return Cell(scene, method, options, 512 if full else 128, runs=timed_runs(full))


def cells(full: bool) -> list[Cell]:
    found = []
    for scene in SCENES:
        for methods, treatment in ((METHODS, ENTRIES), (BOUNDED, BOUNDS)):
            for _, method, options in methods:
                found += [cell(scene, method, options, full),
                          cell(scene, method, options + treatment, full)]
    return list(dict.fromkeys(found))


def row(scene: str, label: str, plain: dict[str, Any], treated: dict[str, Any]
        ) -> dict[str, Any]:
    """Return the page's row for two measurements, one of them with entry points or bounds.

    A beam holds the rays of a tile. ``nodes_of_beams`` is the number of nodes that all beams
    visit, divided by the number of rays. For bounds, which have no beams, it is 0.
    """
    nodes, left = (each["counters"]["nodes_visited"] for each in (plain, treated))
    driver = treated["driver"]
    beams = driver.get("entry_nodes_visited", 0.0)
    return {"scene": scene, "method": label, "nodes": nodes, "nodes_left": left,
            "nodes_of_beams": beams, "fewer_by": nodes / (left + beams),
            "entries": driver.get("entries"), "ms": plain["median_ms"],
            "ms_treated": treated["median_ms"],
            "ms_of_beams": treated.get("beams_ms"),
            "faster_by": plain["median_ms"] / treated["median_ms"]}


def draw(data: Path, out: Path, full: bool) -> None:
    parts: dict[str, list[dict[str, Any]]] = {}
    notes = []
    for name, methods, treatment in (("entry points", METHODS, ENTRIES),
                                     ("bounds", BOUNDED, BOUNDS)):
        parts[name] = rows = []
        for scene in SCENES:
            for label, method, options in methods:
                plain, treated = (read(cell(scene, method, chosen, full), data)
                                  for chosen in (options, options + treatment))
                if plain and treated:
                    rows.append(row(scene, label, plain, treated))
                    about = plain["scene"]
                    notes.append(f"{plain['gpu']['renderer']}, eye rays, "
                                 f"{cell(scene, method, (), full).size} pixels a side.")
                    notes += ([f"{scene} is a procedural stand-in."] if about["stand_in"] else [])
    rows = [{"by": name, **each} for name, found in parts.items() for each in found]
    if not rows:
        return
    note = " ".join(dict.fromkeys(notes))
    write_csv(out / "entry_points.csv", list(rows[0]), [list(each.values()) for each in rows])
    write_text(out / "entry_points.md", _page(parts["entry points"], parts["bounds"], note))
    figure, axes = plt.subplots(1, 2, figsize=(12, 5.2))
    for axis, (name, found) in zip(axes, parts.items()):
        _bars(axis, name, found)
    figure.legend(*axes[0].get_legend_handles_labels(), frameon=False, fontsize=8, ncols=3,
                  loc="upper left")
    figure.tight_layout(rect=(0, 0.04, 1, 0.95))
    save_chart(figure, out / "entry_points.png", note,
               "Bars show the nodes that a ray visits without and with entry points or bounds "
               "from a pass at low resolution")


def _page(entries: list[dict[str, Any]], bounds: list[dict[str, Any]], note: str) -> str:
    first = [[r["scene"], r["method"], *(number(r[k]) for k in (
        "nodes", "nodes_left", "nodes_of_beams", "fewer_by", "entries", "ms", "ms_treated",
        "ms_of_beams", "faster_by"))] for r in entries]
    second = [[r["scene"], r["method"], *(number(r[k]) for k in (
        "nodes", "nodes_left", "fewer_by", "ms", "ms_treated", "faster_by"))] for r in bounds]
    return ("# Entry points and rasterised bounds\n\n" + note + " In all measurements the hits "
            "equal the hits without entries or bounds, to the bit.\n\n"
            "## Entry points\n\nBeams around tiles of 16x16 rays, and then around tiles of 4x4 "
            "rays, traverse the tree first. They write a list of entries for each tile: the "
            "subtrees that the tile's rays must search. \"Nodes with entries\" are the nodes that "
            "a ray then visits. \"Nodes of beams\" are the nodes that all beams visit, divided "
            "among the rays. \"Fewer by\" is the number of nodes that a ray visits without "
            "entries, divided by the sum of \"nodes with entries\" and \"nodes of beams\". "
            "\"Faster by\" is the time "
            "without entries divided by the time with entries, beams included.\n\n"
            + markdown_table(HEADS, first)
            + "\n## Rasterised bounds\n\nTriangles are first drawn over tiles of 8x8 pixels. "
            "The depths of these triangles limit the interval of t in which the rays of a tile "
            "search. Drawing visits no node of the tree; the times include the time "
            "of drawing.\n\n" + markdown_table(BOUND_HEADS, second))


def _bars(axis: Any, name: str, rows: list[dict[str, Any]]) -> None:
    for at, r in enumerate(rows):
        for y, key, start, colour, says in (
                (at - 0.2, "nodes", 0, "#c8c8c8", "nodes of rays alone"),
                (at + 0.2, "nodes_left", 0, COLOURS[0], "nodes of rays after the pass"),
                (at + 0.2, "nodes_of_beams", r["nodes_left"], COLOURS[4], "nodes of beams")):
            axis.barh(y, r[key], 0.38, left=start, color=colour, label=None if at else says)
        axis.text(r["nodes_left"] + r["nodes_of_beams"] + 1, at + 0.2,
                  f"{number(r['fewer_by'], 2)} times fewer, "
                  f"{number(r['faster_by'], 2)} times as fast", fontsize=7, va="center")
    axis.set_yticks(range(len(rows)), [f"{r['scene']}, {r['method']}" for r in rows], fontsize=8)
    axis.set_xlim(0, 1.35 * max((r["nodes"] for r in rows), default=1))
    axis.invert_yaxis()
    axis.set_title(name, fontsize=10)
    axis.set_xlabel("nodes a ray")
    axis.spines[["top", "right"]].set_visible(False)
