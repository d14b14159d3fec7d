"""Figure 12: primary rays by brute force, grid, kd-restart and kd-backtrack (Foley 2005)."""
from __future__ import annotations

from .comparison import Column, Comparison, Panel
from .measure import Cell

GRID = {"cornell": 2}   # cells an axis, as published; 50 for the other scenes


def _cell(panel: Panel, column: Column, full: bool) -> Cell:
    options = (("resolution", GRID.get(panel.scene, 50)),) if column.method == "grid" else ()
    slow = column.method == "brute-force" and panel.scene != "cornell"
    size = 512 if full else (64 if slow else 256)
    return Cell(panel.scene, column.method, options, size, runs=3 if slow else 5)


FIGURE = Comparison(
    "fig12", "Figure 12: eye rays, time by method (Foley and Sugerman 2005)",
    "Foley and Sugerman 2005, 512x512, card not named in the survey",
    tuple(map(Panel, ("cornell", "bunny", "robots", "kitchen"))),
    tuple(Column(name, name) for name in ("brute-force", "grid", "kd-restart", "kd-backtrack")),
    _cell,
    ("Our schedule is `loop`, the whole traversal in a pass; the paper's passes are our "
     "`kernels` (see schedules.md for what that costs).",
     "At the quick size brute force is measured with fewer rays; compare by time a ray."))
