"""Figure 12: primary rays by brute force, grid and kd-trees (Foley and Sugerman 2005)."""
from __future__ import annotations

from ..framework.cell import Cell, timed_runs
from ..framework.comparison import Comparison, MethodColumn, Panel, Results
from ..framework.output import number
from ..framework.predicted_times import PaperCard
from ..framework.published_numbers import published

GRID = {"cornell": 2}   # cells per axis, as published; 50 for other scenes


def _cell(panel: Panel, column: MethodColumn, full: bool) -> Cell:
    options = (("resolution", GRID.get(panel.scene, 50)),) if column.method == "grid" else ()
    slow = column.method == "brute-force" and panel.scene != "cornell"
    size = 512 if full else (32 if slow else 256)
    return Cell(panel.scene, column.method, options, size, runs=3 if slow else timed_runs(full))


def _remarks(results: Results) -> list[str]:
    lines = []
    for panel in FIGURE.panels:
        restart, backtrack = (results.get((panel, f"kd-{name}")) for name in ("restart",
                                                                              "backtrack"))
        if restart is None or backtrack is None:
            continue
        theirs = [published("fig12", panel.scene, f"kd-{name}") for name in ("backtrack",
                                                                             "restart")]
        nodes, time = (_over(backtrack, restart, key) for key in ("nodes_visited", "ns_per_ray"))
        lines.append(f"{panel.scene}: kd-backtrack visits {number(nodes)} times as many nodes as "
                     f"kd-restart (with the nodes of climbs), and takes {number(time)} times "
                     "kd-restart's time. In the paper, kd-backtrack takes "
                     f"{number(theirs[0] / theirs[1])} times kd-restart's time.")
    return lines


def _over(one: dict, other: dict, key: str) -> float:
    return one["counters"].get(key, one.get(key)) / other["counters"].get(key, other.get(key))


FIGURE = Comparison(
    "fig12", "Figure 12: eye rays, time by method (Foley and Sugerman 2005)",
    "Foley and Sugerman 2005, 512x512, card not named in the survey",
    tuple(map(Panel, ("cornell", "bunny", "robots", "kitchen"))),
    tuple(MethodColumn(name, name)
          for name in ("brute-force", "grid", "kd-restart", "kd-backtrack")),
    _cell,
    ("The survey does not name the card; the Radeon X800 XT PE is an assumption. The card cannot "
     "branch, so each kernel is a separate pass on the card.",
     "Our schedule is `loop`, which runs the whole traversal in one pass. The paper ran one "
     "kernel per pass, as our schedule `kernels` does; schedules.md shows the cost of such "
     "passes.",
     "At the quick size brute force traces fewer rays, so compare times per ray.",
     "At each node to which kd-backtrack climbs, it fetches the node's box and parent. No other "
     "step fetches these."),
    _remarks,
    paper_card=PaperCard("R420", 512))
