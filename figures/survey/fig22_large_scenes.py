"""Figure 22: packets over a BVH and along ropes, from small scenes to very large ones."""
from __future__ import annotations

from gpgpu_rt.bench.engines import EMBREE as CPU
from gpgpu_rt.bench.workloads import EYE

from ..framework.cell import ON_CPU, Cell, timed_runs
from ..framework.comparison import Comparison, MethodColumn, Panel, Results
from ..framework.output import number
from ..framework.predicted_times import PaperCard

WORK = {"primary": EYE, "primary+shadow": "picture", "primary+secondary": "picture"}
BVH, ROPES = "bvh-packet", "kd-ropes-packet"
FAST = "bvh-packet, interval test"
HUGE = ("sodahall", "powerplant")   # measured at full size only, because builds take minutes


def _cell(panel: Panel, column: MethodColumn, full: bool) -> Cell:
    assert panel.rays is not None
    runs = 3 if panel.scene in HUGE else timed_runs(full)
    return Cell(panel.scene, column.method, column.options, 1024 if full else 512,
                WORK[panel.rays], runs)


def _remarks(results: Results) -> list[str]:
    lines = []
    for panel in FIGURE.panels:
        bvh, ropes, fast, cpu = (results.get((panel, label)) for label in (BVH, ROPES, FAST, CPU))
        if bvh is None:
            continue
        triangles = bvh["scene"]["triangles"]
        fetched = bvh["counters"]["nodes_visited"]
        line = (f"{panel.label}, {triangles:,} triangles: bvh-packet fetches {number(fetched)} "
                "nodes per ray, each of two boxes")
        if ropes is not None:
            line += (f", and has {number(ropes['ns_per_ray'] / bvh['ns_per_ray'])} times the rate "
                     f"of kd-ropes-packet, which fetches {number(_nodes(ropes))}")
        if fast is not None:
            line += (f"; bvh-packet with 4x2 rays, quantised nodes and the interval test is "
                     f"{number(bvh['ns_per_ray'] / fast['ns_per_ray'])} times as fast")
        if cpu is not None:
            line += (f"; plain bvh-packet has {number(cpu['ns_per_ray'] / bvh['ns_per_ray'])} "
                     f"times the rate of {CPU}")
        lines.append(line + ".")
    return lines


def _nodes(result: dict) -> float:
    return float(result["counters"]["nodes_visited"])


FIGURE = Comparison(
    "fig22", "Figure 22: packets with a shared stack (Günther et al. 2007) and along ropes",
    "Günther et al. 2007 and Popov et al. 2007, 1024x1024, GeForce 8800 GTX",
    tuple(Panel(scene, rays) for rays in WORK
          for scene in (("fairyforest", "conference") if rays == "primary+secondary"
                        else ("fairyforest", "conference", *HUGE))),
    (MethodColumn(CPU, ON_CPU, only="primary"),
     MethodColumn(ROPES, ROPES, only="primary", skips=HUGE),
     MethodColumn(ROPES, ROPES, only="primary+secondary"),
     MethodColumn(BVH, BVH, only="primary"),
     MethodColumn(BVH, BVH, only="primary+shadow"),
     MethodColumn(FAST, BVH, (("interval_test", True), ("packet", (4, 2)), ("quantise_nodes", 16)),
                  only="primary", published_options="interval")),
    _cell,
    ("The survey prints two numbers for eye rays of bvh-packet; this table shows the first. The "
     "survey does not say what the number in parentheses means.",
     "\"Primary+shadow\" and \"primary+secondary\" are whole pictures here: eye rays, shading and "
     "a shadow ray per hit. Counters are of the eye rays.",
     "Each ray of a bvh-packet votes on which child the packet enters first, as published. A "
     "packet here has only 2x2 rays. The row with the interval test is ours: its nodes are "
     "quantised, and a box is tested once for a whole packet of 4x2 rays.",
     "Soda Hall and the Power Plant are measured at full size only."),
    _remarks, full_only=HUGE,
    paper_card=PaperCard("G80", 1024))
