"""Figure 13: Horn's improvements of kd-restart, added one after another (Horn et al. 2007)."""
from __future__ import annotations

from gpgpu_rt.bench.workloads import EYE, SHADOW

from ..framework.cell import Cell, timed_runs
from ..framework.comparison import Comparison, MethodColumn, Panel, Results
from ..framework.output import number
from ..framework.predicted_times import PaperCard

WORK = {"primary": EYE, "shadow": SHADOW}
PLAIN, PACKETS, PUSH_DOWN, SHORT_STACK = LABELS = (
    "kd-restart", "packets", "+ push-down", "+ short stack")
SETTINGS: tuple[tuple[tuple[str, object], ...], ...] = (
    (("push_down", False), ("stack_size", 0)), (("push_down", True), ("stack_size", 0)),
    (("push_down", True), ("stack_size", 3)))
# The published rows improve kd-restart, which visits empty leaves, so the packets in these rows
# visit empty leaves too. The row SKIPPING is our own. It differs from SHORT_STACK in that packets
# skip empty leaves.
VISITED = (("skip_empty_leaves", False),)
SKIPPING = "+ empty leaves skipped"


def size(scene: str, full: bool) -> int:
    """Return the pixels per side: the published number at full size, and a smaller number at the
    quick size."""
    return 1024 if full else 512 if scene == "cornell" else 256


def _cell(panel: Panel, column: MethodColumn, full: bool) -> Cell:
    assert panel.rays is not None
    return Cell(panel.scene, column.method, column.options, size(panel.scene, full),
                WORK[panel.rays], timed_runs(full))


def _published(settings: tuple[tuple[str, object], ...]) -> str:
    """Return the settings as text, in the form of the table of published numbers."""
    return " ".join(f"{name}={value}" for name, value in settings)


def _remarks(results: Results) -> list[str]:
    lines = []
    for panel in FIGURE.panels:
        found = [results.get((panel, label)) for label in LABELS]
        if None in found:
            continue
        nodes = [r["counters"]["nodes_visited"] for r in found]
        times = [r["ns_per_ray"] for r in found]
        shared = 4 * nodes[1] / max(nodes[0], 1e-9)
        lines.append(
            f"{panel.label}: in the order of the rows, a ray fetches "
            f"{', '.join(number(n) for n in nodes)} nodes, and the rate is "
            f"{', '.join(number(times[0] / t) for t in times)} times kd-restart's. A packet "
            f"visits {number(shared)} times as many nodes as one of its rays alone, and fetches a "
            f"node once for four rays. Push-down saves {_spared(nodes[1], nodes[2])} of these "
            f"nodes; the short stack saves {_spared(nodes[2], nodes[3])} of the remaining nodes.")
        skipping = results.get((panel, SKIPPING))
        if skipping is not None:
            spared = _spared(nodes[3], skipping["counters"]["nodes_visited"])
            lines[-1] += (f" Packets that also skip empty leaves fetch {spared} fewer nodes than "
                          "the packets of the row above, at "
                          f"{number(times[3] / skipping['ns_per_ray'])} times their rate.")
    return lines


def _spared(before: float, after: float) -> str:
    return f"{100 * (1 - after / before) if before else 0:.0f} %"


FIGURE = Comparison(
    "fig13", "Figure 13: restart, packets, push-down, short stack (Horn et al. 2007)",
    "Horn et al. 2007, 1024x1024, ATI Radeon X1900 XTX",
    tuple(Panel(scene, rays) for scene in ("cornell", "kitchen", "robots", "conference")
          for rays in WORK),
    (MethodColumn(PLAIN, "kd-restart"),
     *(MethodColumn(label, "kd-packet", (*settings, *VISITED), _published(settings))
       for label, settings in zip(LABELS[1:], SETTINGS)),
     MethodColumn(SKIPPING, "kd-packet", published_options="not published")),
    _cell,
    ("Each row includes the improvements of the rows above it. Packets are 2x2. In the published "
     "rows all methods visit empty leaves. The last row is not in the paper: its packets skip "
     "empty leaves, which their parents mark (`skip_empty_leaves`, this program's default).",
     "At the quick size neighbouring rays are two to four times as far apart as at 1024x1024, so "
     "the rays of a packet share fewer nodes.",
     "A shadow ray goes from each hit that faces the light to the one point light. Times are per "
     "ray that exists, not per pixel. Nodes, triangles and steps of a packet are divided among "
     "its rays.",
     "For cornell's primary rays the survey prints 17.5 Mrays/s for packets, less than the 38.3 "
     "of kd-restart, and then 88.8 for push-down. For shadow rays packets are not slower. The "
     "17.5 may be a misprint, so the rank correlation tau-b may mislead for cornell's eye rays."),
    _remarks,
    # The paper does not say whether its loop is while-while or runs one step per iteration, so
    # both are predicted. For kd-restart, a program without a loop (`passes`) is predicted too.
    paper_card=PaperCard("R580", 1024))
