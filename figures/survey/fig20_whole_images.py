"""Figure 20: whole images by grid, kd-tree and threaded BVH (Thrane and Simonsen 2005)."""
from __future__ import annotations

from ..framework.cell import Cell, timed_runs
from ..framework.comparison import Comparison, MethodColumn, Panel, Results
from ..framework.output import number
from ..framework.predicted_times import PaperCard
from ..framework.published_numbers import published
from .fig12_eye_rays import GRID


def _cell(panel: Panel, column: MethodColumn, full: bool) -> Cell:
    options = column.options
    if column.method == "grid":
        options = (("resolution", GRID.get(panel.scene, 50)),)
    return Cell(panel.scene, column.method, options, 512 if full else 256, "picture",
                timed_runs(full))


def _bvh(build: str) -> MethodColumn:
    return MethodColumn(f"bvh-threaded {build}", "bvh-threaded", (("build", build),),
                        f"build={build}")


def _remarks(results: Results) -> list[str]:
    lines = []
    for panel in FIGURE.panels:
        found = {label: results.get((panel, label)) for label in
                 ("kd-restart", "kd-backtrack", KAY_KAJIYA.label)}
        if None in found.values():
            continue
        base = found.pop(KAY_KAJIYA.label)
        their_base = published("fig20", panel.scene, KAY_KAJIYA.method,
                               KAY_KAJIYA.published_options)
        for label, result in found.items():
            theirs = published("fig20", panel.scene, label)
            nodes = result["counters"]["nodes_visited"] / base["counters"]["nodes_visited"]
            lines.append(
                f"{panel.scene}: {label} visits {number(nodes)} times as many nodes as "
                f"{KAY_KAJIYA.label} and takes {number(result['ns_per_ray'] / base['ns_per_ray'])}"
                " times the BVH's time; in the paper it takes "
                f"{number(theirs / their_base)} times the BVH's time.")
    return lines


KAY_KAJIYA = _bvh("kay-kajiya")
FIGURE = Comparison(
    "fig20", "Figure 20: whole images, time by method (Thrane and Simonsen 2005)",
    "Thrane and Simonsen 2005, 512x512, GeForce 6800 Ultra",
    tuple(map(Panel, ("cows", "robots", "kitchen", "bunny", "cornell"))),
    (*(MethodColumn(name, name) for name in ("grid", "kd-restart", "kd-backtrack")),
     KAY_KAJIYA, _bvh("goldsmith-salmon")),
    _cell,
    ("A picture here is eye rays, one point light and its shadow rays. The survey does not say "
     "what the thesis shaded. Counters are of the eye rays.",
     "The prediction's loop runs one step of each ray per iteration. BVH code that follows the "
     "thesis has this form; for the other methods the form is an assumption. On the card "
     "1024 pixels branch together, so an inner loop for each kernel would make all 1024 wait "
     "for the slowest ray.",
     "Our schedule is `loop`; grids have 50 cells an axis (2 for cornell), as in Figure 12.",
     "Our kd-trees are built by the surface area heuristic over clipped triangles, with a bonus "
     "for cutting off empty space. A ray ends in the first leaf that contains a hit. A threaded "
     "hierarchy has the same order for every direction, so a ray may meet far boxes before near "
     "ones. The survey does not say how the thesis built its kd-trees."),
    _remarks,
    paper_card=PaperCard("NV40", 512))
