"""First hits from the rasteriser (survey, section 5), compared with traced hits.

"rasterised" hits are proved to be the traced hits. A "verified" hit is a hit of its ray, but
perhaps not the nearest. The figure shows the cost of the proof, and the errors without a proof.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished, read
from .first_hit_times import ratio

SCENES = ("bunny", "robots", "kitchen", "conference")
METHOD, OPTIONS = "bvh-packet", (("packet", (4, 4)), ("octants", True))
KINDS = ("rasterised", "verified")
HEADS = ("scene", "triangles", "triangles drawn", "first hits", "ms", "traced, ms",
         "times as fast", "rays in doubt", "share in doubt", "wrong hits", "share wrong")


def cells(full: bool) -> list[Cell]:
    return [Cell(name, METHOD, OPTIONS, 1024 if full else 256, "first hits", 9 if full else 3)
            for name in SCENES]


def rows(data: Path, full: bool) -> list[list[Any]]:
    found = []
    for cell, result in finished(cells(full), data):
        for kind in KINDS:
            hits, traced = result["first_hits"][kind], result["first_hits"]["traced"]
            rays, wrong = cell.size ** 2, len(hits["wrong"])
            found.append([cell.scene, result["scene"]["triangles"], hits["drawn"], kind,
                          1e3 * float(np.median(hits["seconds"])),
                          1e3 * float(np.median(traced["seconds"])),
                          ratio(result["first_hits"], kind), hits["retraced"],
                          hits["retraced"] / rays, wrong, wrong / rays])
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    if not found:
        return
    write_csv(out / "rasterised.csv", HEADS, found)
    shown = [[row[0], f"{row[1]:,}", f"{row[2]:,}", row[3], *map(number, row[4:7]), row[7],
              f"{row[8]:.4%}", row[9], f"{row[10]:.4%}"] for row in found]
    result = finished(cells(full), data)[0][1]
    note = (f"{result['gpu']['renderer']}, {result['settings']['size']} pixels a side; traced "
            f"rays and rays in doubt are traced by {METHOD} 4x4 with octants; medians of "
            "alternating runs.")
    write_text(out / "rasterised.md", (
        "# First hits from the rasteriser\n\n"
        "Rasterised hits equal the traced hits to the bit, which is proved for each pixel. A ray "
        "whose proof fails is in doubt, and is traced. A verified hit is a hit of its ray, but "
        "nothing checks whether the rasteriser missed a triangle that the ray hits earlier. "
        "Triangles are drawn "
        "only if a ray can hit them. " + note + "\n\n"
        + markdown_table(HEADS, shown)))
    figure, (left, *maps) = plt.subplots(1, 3, figsize=(13, 4.4))
    for k, (kind, colour) in enumerate(zip(KINDS, ("#2f6db3", "#c98a1b"))):
        some = [row for row in found if row[3] == kind]
        left.bar([i + 0.38 * k - 0.19 for i in range(len(some))], [row[6] for row in some], 0.36,
                 label=kind, color=colour)
        left.set_xticks(range(len(some)), [row[0] for row in some])
    left.axhline(1, color="#8c8c8c", linewidth=0.8)
    left.set_ylabel("times as fast as traced")
    left.legend(fontsize=8, frameon=False)
    for axis, cell in zip(maps, (cells(full)[0], cells(full)[-1])):
        _draw_map(axis, cell, read(cell, data))
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "rasterised.png", note,
               "Bars show how many times as fast as tracing the rasteriser finds first hits. Two "
               "maps show the pixels where a verified hit is not the first")


def _draw_map(axis: Any, cell: Cell, result: dict[str, Any] | None) -> None:
    """Draw where verified hits are wrong: at silhouettes, and where surfaces nearly coincide."""
    axis.set_xticks([])
    axis.set_yticks([])
    axis.set_xlim(0, cell.size)
    axis.set_ylim(cell.size, 0)
    axis.set_aspect("equal")
    if result is not None:
        wrong = np.array(result["first_hits"]["verified"]["wrong"], int)
        axis.scatter(wrong % cell.size, wrong // cell.size, s=3, color="#b33a3a", linewidths=0)
        axis.set_title(f"{cell.scene}: {len(wrong)} verified hits that are not the first",
                       fontsize=9)
