"""Figure 16: ropes for single rays and for packets (Popov et al. 2007)."""
from __future__ import annotations

from gpgpu_rt.bench.engines import EMBREE as CPU
from gpgpu_rt.bench.workloads import EYE

from ..framework.cell import ON_CPU, Cell, timed_runs
from ..framework.comparison import Comparison, MethodColumn, Panel, Results
from ..framework.output import number
from ..framework.predicted_times import PaperCard
from ..framework.published_numbers import published

WORK = {"primary": EYE, "primary+secondary": "picture"}
SINGLE, PACKET = "kd-ropes", "kd-ropes-packet"
SCENES = ("shirley6", "bunny", "fairyforest", "conference")
STAND_IN = ("fairyforest",)
LEFT_OUT = ("The fairy forest is measured at full size only. If its mesh is missing, a procedural "
            "stand-in of the same triangle count replaces it.")


def _cell(panel: Panel, column: MethodColumn, full: bool) -> Cell:
    assert panel.rays is not None
    return Cell(panel.scene, column.method, (), 1024 if full else 512, WORK[panel.rays],
                timed_runs(full))


def _remarks(results: Results) -> list[str]:
    lines = []
    for panel in FIGURE.panels:
        single, packet = (results.get((panel, label)) for label in (SINGLE, PACKET))
        if single is None or packet is None:
            continue
        ours = single["ns_per_ray"] / packet["ns_per_ray"]
        theirs = _rate(panel, PACKET) / _rate(panel, SINGLE)
        fetched = [r["counters"]["nodes_visited"] for r in (single, packet)]
        lines.append(f"{panel.label}: packets have {number(ours)} times the rate of single rays, "
                     f"{number(theirs)} times in the paper. Per eye ray, single rays "
                     f"fetch {number(fetched[0])} nodes and packets {number(fetched[1])}.")
        cpu = results.get((panel, CPU))
        if cpu is not None:
            over = [cpu["ns_per_ray"] / r["ns_per_ray"] for r in (single, packet)]
            paper = [_rate(panel, label) / _rate(panel, "rope-single-cpu")
                     for label in (SINGLE, PACKET)]
            frustum = published("fig16", panel.scene, "openrt-frustum-packet")
            lines.append(
                f"{panel.label}: single rays have {number(over[0])} times and packets "
                f"{number(over[1])} times the rate of {CPU}. In the paper, single rays on the "
                f"GPU have {number(paper[0])} times and packets {number(paper[1])} times the rate "
                "of single rays along ropes on an Opteron" + (
                    "." if frustum is None else
                    f". They have {number(_rate(panel, SINGLE) / frustum)} and "
                    f"{number(_rate(panel, PACKET) / frustum)} times the rate of OpenRT's frustum "
                    "packets."))
    return lines


def _rate(panel: Panel, method: str) -> float:
    rate = published("fig16", panel.scene, method, rays=panel.rays)
    assert rate is not None
    return rate


FIGURE = Comparison(
    "fig16", "Figure 16: ropes, single rays and packets (Popov et al. 2007)",
    "Popov et al. 2007, 1024x1024, GeForce 8800 GTX and Opteron 2.6 GHz",
    tuple(Panel(scene, rays) for scene in SCENES for rays in WORK),
    (MethodColumn(CPU, ON_CPU, published_method="rope-single-cpu", only="primary"),
     MethodColumn(SINGLE, SINGLE), MethodColumn(PACKET, PACKET)),
    _cell,
    ("The CPU is today's, and so is its ray tracer: Embree's BVH through embreex, on one thread, "
     "without ropes. In this row, the published number belongs to another method: Popov's "
     "single rays along ropes on an Opteron. So the comparison of orders (tau-b) leaves the row "
     "out. On a software renderer our methods run on the same CPU as Embree.",
     "\"Primary+secondary\" is a whole picture here: eye rays, shading and a shadow ray per hit. "
     "The survey does not say which secondary rays the paper traced. Counters are of the eye "
     "rays, and times are per pixel. A packet's counters are divided among its rays.",
     "Measured packets are 2x2. The prediction scales the counts of 4x4 packets to the paper's "
     "packets, which have the 32 rays of a warp. At the quick size neighbouring rays are twice as "
     "far apart as at 1024x1024, so the rays of a packet share fewer nodes.", LEFT_OUT),
    _remarks, full_only=STAND_IN,
    # The paper does not say whether its loop is while-while or runs one step per iteration, so
    # both loops are predicted. The third prediction is for while-while with uncoalesced loads.
    paper_card=PaperCard("G80", 1024))
