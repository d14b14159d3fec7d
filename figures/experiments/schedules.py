"""Schedules (survey, section 4.3): compares the times of the three schedules.

A pass runs one kernel (`kernels`), one or more steps of each ray (`step`), or all steps (`loop`).
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.charts import COLOURS, MARKERS, Series, dot_rows, legend_of

from ..framework.cell import Cell, timed_runs
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read

STEPS = (1, 4, 16, 64)
METHODS = ("bvh-threaded", "kd-restart")


def _cell(method: str, full: bool, **options: Any) -> Cell:
    return Cell("bunny", method, tuple(options.items()), 512 if full else 256,
                runs=timed_runs(full))


def _cells_of(method: str, full: bool) -> dict[str, Cell]:
    return {"loop": _cell(method, full, schedule="loop"),
            **{f"step, K = {k}": _cell(method, full, schedule="step", steps_per_pass=k)
               for k in reversed(STEPS)},
            "kernels": _cell(method, full, schedule="kernels")}


def cells(full: bool) -> list[Cell]:
    return [cell for method in METHODS for cell in _cells_of(method, full).values()]


def draw(data: Path, out: Path, full: bool) -> None:
    rows, renderer = [], "?"
    times: dict[str, dict[str, float]] = {}
    for method in METHODS:
        results = {label: read(c, data) for label, c in _cells_of(method, full).items()}
        loop = results["loop"]
        if loop is None:
            continue
        renderer = loop["gpu"]["renderer"]
        mine = [[method, label, r["median_ms"], r["median_ms"] / loop["median_ms"], r["wall_ms"],
                 r["statistics"]["passes"], r["statistics"]["draw_calls"],
                 r["statistics"]["queries"]] for label, r in results.items() if r is not None]
        rows += mine
        times[method] = {row[1]: row[3] for row in mine}
    heads = ("method", "schedule", "ms", "ms / ms of loop", "ms with upload and readback",
             "passes", "draw calls", "queries")
    write_csv(out / "schedules.csv", heads, rows)
    size = 512 if full else 256
    write_text(out / "schedules.md", f"# The three schedules\n\nbunny, {size}x{size} eye rays; "
               f"renderer: {renderer}. `kernels` issues a pass for each kernel, as Purcell and "
               "Foley do. In `step`, a pass runs K steps of each ray, and in each step a ray runs "
               "the kernel that it needs. `loop` is Horn's single pass. Every schedule gives the "
               "same "
               "hits.\n\n" + markdown_table(
                   heads, [[number(v) if isinstance(v, float) else v for v in row]
                           for row in rows]))
    labels = list(dict.fromkeys(label for mine in times.values() for label in mine))
    series = [Series(method, [mine.get(label) for label in labels], look)
              for (method, mine), look in zip(times.items(), zip(COLOURS, MARKERS))]
    figure, axis = plt.subplots(figsize=(8, 1.4 + 0.6 * len(labels)), layout="constrained")
    dot_rows(axis, labels, series, "time / time of loop (log)")
    figure.legend(handles=legend_of(series), frameon=False, fontsize=8, ncols=4,
                  loc="outside upper left")
    figure.get_layout_engine().set(rect=(0, 0.06, 1, 0.94))
    save_chart(figure, out / "schedules.png", f"Renderer: {renderer}. bunny, {size}x{size} eye "
               "rays.", "Dots show the time of each method under each schedule, divided by the "
               "method's time under the schedule loop")
