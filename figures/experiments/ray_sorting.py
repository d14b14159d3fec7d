"""Ray sorting (survey, section 4.3): times with and without sorting, and the rays' coherence.

The survey proposes to sort rays on the GPU, but measures nothing.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE, RANDOM, SHADOW, diffuse, mirror
from gpgpu_rt.charts import COLOURS

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read
from ..framework.works import COHERENCE

SCENE = "kitchen"
METHODS = ("bvh-threaded", "bvh-packet")
ALIKE_WORK = (EYE, SHADOW, mirror(1), diffuse(1), diffuse(2))
WORK = (*ALIKE_WORK, RANDOM)
SORTERS = {"passes": "sort_rays", "host": "presort"}    # sorter -> option
HEADS = ("rays", "method", "sorted by", "unsorted ms", "sorted ms", "ms of the sort",
         "trace alone, times as fast", "sort and trace, times as fast")
ALIKE = ("rays", "nodes a ray", "nodes a tile", "nodes a tile, sorted",
         "nodes a tile, unsorted / sorted", "waiting", "waiting, sorted",
         "idle steps, unsorted / sorted")


def size(full: bool) -> int:
    """Pixels per side."""
    return 512 if full else 128


def _timed(method: str, work: str, options: tuple, full: bool) -> Cell:
    return Cell(SCENE, method, options, size(full), work, 5 if full else 3)


def _alike(work: str, full: bool) -> Cell:
    return Cell(SCENE, "bvh-threaded", (), size(full), COHERENCE + work, 1)


def cells(full: bool) -> list[Cell]:
    return [cell for work in WORK for cell in (
        *(_timed(method, work, options, full) for method in METHODS
          for options in ((), *(((option, True),) for option in SORTERS.values()))),
        *([_alike(work, full)] if work in ALIKE_WORK else []))]


def draw(data: Path, out: Path, full: bool) -> None:
    times, alike, heading = [], [], None
    for work in WORK:
        for method in METHODS:
            plain = read(_timed(method, work, (), full), data)
            for sorter, option in SORTERS.items():
                ordered = read(_timed(method, work, ((option, True),), full), data)
                if plain and ordered:
                    times.append((work, method, sorter, plain["median_ms"],
                                  ordered["median_ms"], ordered["sort_ms"]))
                    heading = plain
        found = read(_alike(work, full), data) if work in ALIKE_WORK else None
        if found:
            alike.append((work, found["coherence"]))
    if heading is None:
        return
    write_csv(out / "ray_sorting.csv", ("rays", "method", "sorted_by", "unsorted_ms", "sorted_ms",
                                        "sort_ms"),
              times)
    note = (f"{heading['gpu']['renderer']}, {SCENE}, {size(full)} x {size(full)} rays of a kind."
            + (f" {SCENE} is a procedural stand-in for {heading['scene']['stand_in']}."
               if heading["scene"]["stand_in"] else ""))
    write_text(out / "ray_sorting.md", _page(times, alike, note))
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 7.5))
    _draw_times(left, times)
    _draw_nodes(right, alike)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "ray_sorting.png", note, "Bars show the time to trace rays unsorted "
               "and sorted, with the time of the sort, and the different nodes that a tile of 64 "
               "rays must visit in each order")


def _page(times: list[tuple], alike: list[tuple[str, dict[str, float]]], note: str) -> str:
    rows = [[work, method, sorter, number(plain), number(ordered), number(sort),
             number(plain / max(ordered - sort, 1e-9)), number(plain / ordered)]
            for work, method, sorter, plain, ordered, sort in times]
    tiles = [[work, number(c["nodes_a_ray"]), number(c["distinct_as_they_come"]),
              number(c["distinct_sorted"]),
              number(c["distinct_as_they_come"] / max(c["distinct_sorted"], 1e-9)),
              number(c["waiting_as_they_come"]), number(c["waiting_sorted"]),
              number((c["waiting_as_they_come"] - 1) / max(c["waiting_sorted"] - 1, 1e-9))]
             for work, c in alike]
    return ("# Ray sorting\n\n" + note + " The order of the rays changes no hit in any bit. It "
            "changes the number of a ray's steps only if rays form packets. Fragment passes sort "
            "rays that are in textures (`--sort-rays`); the host sorts arrays of rays before it "
            "uploads them (`--presort`).\n\n" + markdown_table(HEADS, rows)
            + "\nThe next table shows how coherent rays are. A tile is 64 rays: 8x8 pixels, or 64 "
            "consecutive rays of the sorted order. \"Nodes a tile\" counts the different nodes of "
            "`bvh-threaded`'s tree that the rays of a tile need, because they meet the nodes' "
            "boxes before their hits. \"Waiting\" is the number of steps if all rays of a tile "
            "wait for its longest ray, divided by the rays' own steps; it is 1 if no ray waits. "
            "Idle steps are the steps during which rays wait.\n\n"
            + markdown_table(ALIKE, tiles))


def _draw_times(axis: Any, times: list[tuple]) -> None:
    bars: list[tuple[str, float, float, str]] = []     # label, ms of trace and sort, colour
    for work, method, sorter, plain, ordered, sort in times:
        if (label := f"{work}, {method}") not in [bar[0] for bar in bars]:
            bars.append((label, plain, 0.0, "#c8c8c8"))
        bars.append((f"by {sorter}", ordered - sort, sort, COLOURS[METHODS.index(method)]))
    for at, (_, trace, sort, colour) in enumerate(bars):
        axis.barh(at, trace, 0.8, color=colour)
        axis.barh(at, sort, 0.8, left=trace, color=colour, alpha=0.35)
    axis.set_yticks(range(len(bars)), [label for label, *_ in bars], fontsize=7)
    axis.invert_yaxis()
    axis.set_xlabel("ms; grey: unsorted, full colour: trace of sorted rays, pale: the sort")
    axis.spines[["top", "right"]].set_visible(False)


def _draw_nodes(axis: Any, alike: list[tuple[str, dict[str, float]]]) -> None:
    for at, (_, c) in enumerate(alike):
        axis.barh(at - 0.2, c["distinct_as_they_come"], 0.38, color="#c8c8c8")
        axis.barh(at + 0.2, c["distinct_sorted"], 0.38, color=COLOURS[0])
        axis.plot([c["nodes_a_ray"]] * 2, [at - 0.4, at + 0.4], color=COLOURS[1])
    axis.set_yticks(range(len(alike)), [work for work, _ in alike], fontsize=8)
    axis.invert_yaxis()
    axis.set_xlabel("different nodes a tile of 64 rays (grey: unsorted, blue: sorted); orange: "
                    "nodes a ray", fontsize=8)
    axis.spines[["top", "right"]].set_visible(False)
