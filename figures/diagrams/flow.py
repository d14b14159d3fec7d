"""Flow: draws the passes of a trace as a box per kernel, with the kernel's tables and streams."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.patches import FancyBboxPatch

from .issued_passes import Issued, kinds_of
from .plan import INK, PALE, SPLITS, TRIANGLE, VISITED

ROW = 1.0


def draw_flow(axis: Any, passes: Sequence[Issued], words: Mapping[str, str]) -> None:
    """Draw a box for each kernel, in the order of the kernels' first passes.

    A record that kernels write and read is a stream, drawn on the right. Records that no kernel
    writes are tables, on the left.

    Parameters
    ----------
    words : kernel -> a line that says what the kernel does
    """
    kinds = kinds_of(passes)
    rows = {kernel: -ROW * at for at, kernel in enumerate(kinds)}
    writers: dict[str, list[str]] = {}
    for kernel, (one, _) in kinds.items():
        for record in one.writes:
            writers.setdefault(record, []).append(kernel)
    lanes: dict[str, float] = {}
    for kernel, (one, count) in kinds.items():
        y = rows[kernel]
        axis.add_patch(FancyBboxPatch((0, y - 0.3), 4.4, 0.6, facecolor=VISITED, edgecolor=INK,
                                      boxstyle="round,pad=0,rounding_size=0.08"))
        axis.text(2.2, y + 0.11, f"{kernel}  x{count}", ha="center", va="center", fontsize=9)
        axis.text(2.2, y - 0.14, words.get(kernel, ""), ha="center", va="center", fontsize=7)
        tables = [record for record in one.reads if record not in writers]
        if tables:
            axis.annotate("", (0, y), (-0.5, y), arrowprops={"arrowstyle": "-|>",
                                                             "color": TRIANGLE})
            axis.text(-0.55, y, "\n".join(tables), ha="right", va="center", fontsize=7.5,
                      color=TRIANGLE)
        for record in one.reads:
            if record in writers and record not in lanes:
                lanes[record] = 4.9 + 0.62 * len(lanes)
    for record, x in lanes.items():
        uses = [rows[kernel] for kernel in kinds
                if record in kinds[kernel][0].reads or record in kinds[kernel][0].writes]
        axis.plot([x, x], [min(uses) - 0.12, max(uses) + 0.12], color=PALE, linewidth=1.2,
                  zorder=0)
        axis.text(x, 0.45, record, rotation=60, ha="left", va="bottom", fontsize=7.5,
                  color=INK)
    for kernel, (one, _) in kinds.items():
        for records, aside, colour in ((one.writes, 0.12, SPLITS[0]),
                                       (one.reads, -0.12, SPLITS[1])):
            _join(axis, [lanes[record] for record in records if record in lanes],
                  rows[kernel] + aside, colour, aside > 0)
    axis.set(xlim=(-2.6, 5.4 + 0.62 * max(1, len(lanes))), ylim=(min(rows.values()) - 0.5, 1.4))
    axis.axis("off")


def _join(axis: Any, lanes: list[float], y: float, colour: str, outward: bool) -> None:
    if not lanes:
        return
    axis.plot([4.45, max(lanes)], [y, y], color=colour, linewidth=0.9, zorder=1)
    axis.plot(lanes, [y] * len(lanes), "o", color=colour, markersize=4.5, zorder=2)
    tip = (min(lanes), 4.6) if outward else (4.4, 4.6)
    axis.annotate("", (tip[0], y), (tip[1], y), arrowprops={
        "arrowstyle": "-|>", "color": colour, "lw": 0.9, "shrinkA": 0,
        "shrinkB": 4 if outward else 0})


def table_rows(passes: Sequence[Issued], words: Mapping[str, str]) -> list[list[str]]:
    """Return the rows of a page's table, with the columns HEADS and a row for each kernel."""
    return [[kernel, words.get(kernel, ""), str(count), ", ".join(one.reads) or "-",
             ", ".join(one.writes)] for kernel, (one, count) in kinds_of(passes).items()]


HEADS = ("pass", "what it does", "draws", "reads", "writes")
