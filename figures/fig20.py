"""Figure 20: whole images by grid, kd-tree and threaded BVH (Thrane and Simonsen 2005)."""
from __future__ import annotations

from .comparison import Column, Comparison, Panel
from .fig12 import GRID
from .measure import Cell


def _cell(panel: Panel, column: Column, full: bool) -> Cell:
    options = column.options
    if column.method == "grid":
        options = (("resolution", GRID.get(panel.scene, 50)),)
    return Cell(panel.scene, column.method, options, 512 if full else 256, "picture")


def _bvh(build: str) -> Column:
    return Column(f"bvh-threaded {build}", "bvh-threaded", (("build", build),), f"build={build}")


FIGURE = Comparison(
    "fig20", "Figure 20: whole images, time by method (Thrane and Simonsen 2005)",
    "Thrane and Simonsen 2005, 512x512, GeForce 6800 Ultra",
    tuple(map(Panel, ("cows", "robots", "kitchen", "bunny", "cornell"))),
    (*(Column(name, name) for name in ("grid", "kd-restart", "kd-backtrack")),
     _bvh("kay-kajiya"), _bvh("goldsmith-salmon")),
    _cell,
    ("A picture here is eye rays, one point light and its shadow rays; what the thesis shaded is "
     "not stated in the survey. Counters are of the eye rays.",
     "Our schedule is `loop`; grids have 50 cells an axis (2 for cornell), as in Figure 12."))
