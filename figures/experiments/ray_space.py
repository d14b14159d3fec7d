"""Ray space: tests whether tables over rays suit graphics hardware (survey, Table 1).

The figure compares ray classification and the visibility field with a kd-tree and a BVH by memory,
by rates, and by candidates (the triangles that a ray tests).
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE, SHADOW, mirror
from gpgpu_rt.charts import COLOURS, MARKERS, direct_labels, log_axis

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read

MIB = 1 << 20
SCENES = ("cornell", "bunny", "kitchen")
WORK = (EYE, SHADOW, mirror(1))
TABLES = ("ray-classification", "visibility-field")
TREES = ("kd-restart", "bvh-threaded")
BUDGETS = (32, 128)     # MiB
RUNS = 3


def columns() -> list[tuple[str, str, tuple[tuple[str, Any], ...]]]:
    """Label, method and options of each column."""
    tables = [(f"{method}, {budget} MiB", method, (("budget", float(budget)),))
              for method in TABLES for budget in BUDGETS]
    return tables + [(method, method, ()) for method in TREES]


def cell(scene: str, work: str, method: str, options: tuple[tuple[str, Any], ...],
         full: bool) -> Cell:
    return Cell(scene, method, options, 128 if full else 64, work, RUNS)


def cells(full: bool) -> list[Cell]:
    return [cell(scene, work, method, options, full) for scene in _scenes(full) for work in WORK
            for _, method, options in columns()]


def draw(data: Path, out: Path, full: bool) -> None:
    rows, notes = [], []
    for scene in _scenes(full):
        for work in WORK:
            for label, method, options in columns():
                result = read(cell(scene, work, method, options, full), data)
                if result is None:
                    continue
                rows.append(_row(scene, work, label, result))
                about = result["scene"]
                notes.append(f"Renderer: {result['gpu']['renderer']}; images of "
                             f"{result['settings']['size']}x{result['settings']['size']}.")
                if about["stand_in"]:
                    notes.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
    notes = list(dict.fromkeys(notes))
    write_csv(out / "ray_space.csv", list(rows[0]) if rows else [],
              [list(row.values()) for row in rows])
    write_text(out / "ray_space.md", _markdown(rows, notes))
    if rows:
        _chart(rows, notes, out)


def _scenes(full: bool) -> tuple[str, ...]:
    return SCENES if full else SCENES[:2]


def _row(scene: str, work: str, label: str, result: dict[str, Any]) -> dict[str, Any]:
    cost, counters = result["statistics"], result["counters"]
    tables = cost["table_bytes"]
    return {"scene": scene, "rays": work, "triangles": result["scene"]["triangles"],
            "method": label,
            "mib": sum(b for name, b in tables.items() if name != "triangle") / MIB,
            "build_seconds": cost["build_seconds"],
            "grow_seconds": cost["driver"].get("grow_seconds", 0.0),
            "lists": cost["driver"].get("boxes"),
            "tested": counters["triangles_tested"], "visited": counters["nodes_visited"],
            "rays_per_second": 1e9 / result["ns_per_ray"]}


def findings(rows: list[dict[str, Any]]) -> list[str]:
    """Sentences that compare each table over rays with the faster tree."""
    found = []
    for row in rows:
        trees = [r for r in rows if r["method"] in TREES
                 and (r["scene"], r["rays"]) == (row["scene"], row["rays"])]
        if row["method"] in TREES or not trees:
            continue
        best = max(trees, key=lambda r: r["rays_per_second"])
        found.append(
            f"{row['scene']}, {row['rays']}: {row['method']} traces "
            f"{number(row['rays_per_second'] / best['rays_per_second'])} times as many rays per "
            f"second as {best['method']}. It tests "
            f"{number(row['tested'] / max(best['tested'], 1e-9))} times as many triangles, and "
            f"needs {number(row['mib'] / max(best['mib'], 1e-9))} times the memory.")
    return found


def _markdown(rows: list[dict[str, Any]], notes: list[str]) -> str:
    parts = ["# Do tables over rays suit graphics hardware?\n",
             "Ray classification (Arvo and Kirk 1987) and the visibility field (Mortensen et al. "
             "2007) need one dependent lookup to find the list of all triangles that a ray may "
             "hit. They then walk the list in order. They need no stack, and no branch except the "
             "end of the list. The price is that every triangle is in many lists. MiB is "
             "the memory of all tables except the triangles. Candidates are the triangles that a "
             "ray tests. The rate leaves out building, which has its own column. For ray "
             "classification, the rate also leaves out the time for the lists that the first call "
             "requests.\n"]
    for scene, work in dict.fromkeys((row["scene"], row["rays"]) for row in rows):
        chosen = [row for row in rows if (row["scene"], row["rays"]) == (scene, work)]
        parts.append(f"## {scene}, {chosen[0]['triangles']:,} triangles, {work}\n")
        parts.append(markdown_table(
            ("method", "MiB", "build, s", "lists on demand, s", "candidates a ray",
             "rays a second"),
            [[row["method"], number(row["mib"]), number(row["build_seconds"]),
              number(row["grow_seconds"]), number(row["tested"]),
              f"{row['rays_per_second']:,.0f}"] for row in chosen]))
    for head, lines in (("Compared with the faster tree", findings(rows)), ("Notes", notes)):
        if lines:
            parts.append(f"{head}:\n\n" + "\n".join(f"* {line}" for line in lines) + "\n")
    return "\n".join(parts)


def _chart(rows: list[dict[str, Any]], notes: list[str], out: Path) -> None:
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure, axes = plt.subplots(1, len(scenes), squeeze=False, figsize=(4.6 * len(scenes), 5))
    markers = dict(zip(WORK, MARKERS))
    colours = dict(zip((label for label, _, _ in columns()), COLOURS))
    for axis, scene in zip(axes[0], scenes):
        for row in (row for row in rows if row["scene"] == scene):
            axis.plot(row["tested"], row["rays_per_second"] / 1e6, markers[row["rays"]],
                      color=colours[row["method"]], markersize=3 + 1.6 * max(row["mib"], 1) ** 0.5
                      / 1.2)
        log_axis(axis, "x")
        log_axis(axis, "y")
        axis.margins(0.2)
        axis.set(xlabel="candidates a ray (log)", title=scene)
        axis.spines[["top", "right"]].set_visible(False)
    axes[0, 0].set_ylabel("million rays a second (log)")
    figure.legend(handles=[plt.Line2D([], [], marker=marker, linestyle="", color="#555555",
                                      label=work) for work, marker in markers.items()],
                  loc="upper left", ncols=3, frameon=False, fontsize=8)
    figure.tight_layout(rect=(0, 0.08, 1, 0.94))
    for axis, scene in zip(axes[0], scenes):
        some = [row for row in rows if row["scene"] == scene]
        points = [(row["tested"], row["rays_per_second"] / 1e6, row["method"]) for row in some]
        named = {row["method"]: point for row, point in zip(some[::-1], points[::-1])}
        direct_labels(axis, list(named.values()), size=7, avoid=[point[:2] for point in points])
    save_chart(figure, out / "ray_space.png", "The larger the mark, the more memory the method "
               "needs. All marks of a method have the same colour; its name stands beside one of "
               "them, where there is space. " + " ".join(notes),
               "Marks show how many rays per second a method traces, over the number of "
               "candidates that a ray tests, for eye, shadow and mirror rays")
