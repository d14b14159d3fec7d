"""Figure 8: a teapot in a stadium. The cells of a uniform grid are too coarse for the teapot."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.charts import COLOURS, MARKERS, log_axis
from gpgpu_rt.disk.files import replacing

from ..framework import verdicts
from ..framework.cell import Cell, timed_runs
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished, read

RATIOS = (1.0, 1e-1, 1e-2, 1e-3, 1e-4)
GRID, KD_TREES = "grid", ("kd-restart", "kd-backtrack")
METHODS = ((GRID, (("resolution", 50),)), *((tree, ()) for tree in KD_TREES),
           ("bvh-threaded", ()))


def scene_of(ratio: float) -> str:
    return f"stadium:{ratio:g}"


def cell(ratio: float, method: str, options: tuple, full: bool) -> Cell:
    return Cell(scene_of(ratio), method, options, 512 if full else 192, runs=timed_runs(full))


def cells(full: bool) -> list[Cell]:
    return [cell(ratio, *method, full) for ratio in RATIOS for method in METHODS]


TIMES = 8    # the survey: the kd-trees are "up to 8 times" faster than the grid
# Every claim compares the grid with both kd-trees, at every size of the teapot.
SCENES = tuple(map(scene_of, RATIOS))
PAIRS = tuple(verdicts.Pair(scene, EYE, GRID, tree) for scene in SCENES for tree in KD_TREES)


def results_of(ratio: float, data: Path, full: bool) -> dict[str, dict[str, Any] | None]:
    """The results for one size of the teapot, by method."""
    return {name: read(cell(ratio, name, options, full), data) for name, options in METHODS}


def gain(results: dict[str, dict[str, Any] | None]) -> float | None:
    """The grid's time divided by the time of the faster kd-tree."""
    times = [found["ns_per_ray"] for name in (GRID, *KD_TREES)
             if (found := results[name]) is not None]
    return times[0] / min(times[1:]) if len(times) == 3 else None


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """The verdict on whether the grid falls behind as the teapot shrinks."""
    gains = [g for ratio in RATIOS if (g := gain(results_of(ratio, data, full))) is not None]
    if len(gains) < len(RATIOS):
        return verdicts.of_claims([])
    said = ", ".join(number(g) for g in gains)
    return verdicts.of_claims(verdicts.Claim(says, holds, SCENES, PAIRS) for says, holds in (
        (f"as the pot shrinks, the grid takes {said} times the faster kd-tree's time, and is "
         "slower in the end", gains[-1] > 1),
        ("the grid falls farther behind with the smallest pot than with the largest",
         gains[-1] > gains[0]),
        (f"for some sizes of the pot, the grid takes {TIMES} or more times the kd-tree's time",
         max(gains) >= TIMES)))


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/fig08.csv, .md, .png and the picture fig08-stadium.png."""
    rows, gains = [], []
    for ratio in RATIOS:
        results = results_of(ratio, data, full)
        for name, result in results.items():
            if result is not None:
                rows.append([ratio, name, result["ns_per_ray"], result["counters"]["steps"],
                             result["counters"]["nodes_visited"],
                             result["counters"]["triangles_tested"]])
        found = gain(results)
        if found is not None:
            gains.append((ratio, found))
    heads = ("teapot / stadium", "method", "ns a ray", "steps a ray", "nodes a ray",
             "triangles a ray")
    write_csv(out / "fig08.csv", heads, rows)
    renderer = next((r["gpu"]["renderer"] for _, r in finished(cells(full), data)), "?")
    text = [f"# Figure 8: a teapot in a stadium\n\nRenderer: {renderer}. The camera keeps the pot "
            "equally large in view while its surroundings grow. The grid has 50 cells per axis. "
            "The first column is the size of the teapot divided by the size of the stadium.\n",
            markdown_table(heads, [[number(v) if isinstance(v, float) else v for v in row]
                                   for row in rows]),
            "The next table shows, for each size of the teapot, the grid's time divided by the "
            f"faster kd-tree's time. The survey says \"up to {TIMES} times\" for its scenes.\n",
            markdown_table([f"{r:g}" for r, _ in gains], [[number(g) for _, g in gains]])]
    write_text(out / "fig08.md", "\n".join(text))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.6))
    for (name, _), colour, marker in zip(METHODS, COLOURS, MARKERS):
        mine = [row for row in rows if row[1] == name]
        for axis, column in ((left, 2), (right, 5)):
            axis.plot([row[0] for row in mine], [row[column] for row in mine], f"{marker}-",
                      color=colour, label=name)
    for axis, label in ((left, "nanoseconds a ray"), (right, "triangles tested a ray")):
        log_axis(axis, "x")
        log_axis(axis, "y")
        axis.set(xlabel="size of the teapot / size of the stadium (log)", ylabel=f"{label} (log)")
        axis.invert_xaxis()
        axis.spines[["top", "right"]].set_visible(False)
    left.legend(frameon=False)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "fig08.png",
               f"Renderer: {renderer}. Eye rays, under the schedule `loop`.",
               "Lines show the nanoseconds and the tested triangles of a ray, by the size of a "
               "teapot in a stadium, for a grid, kd-trees and a BVH")
    with rt.Tracer("stadium:0.1") as tracer, replacing(out / "fig08-stadium.png") as path:
        tracer.render(size=(512, 512)).save(path)
