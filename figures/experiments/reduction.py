"""Reduction: compares stream reduction by blocks and over the whole stream.

Stream reduction removes elements from a stream and closes the gaps. The reduction of a whole
stream begins with a scan of the elements' flags. This scan is also measured alone.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from .reduction_times import rates

HEADS = ("elements", "kept", "scan alone, M/s", "by blocks, M/s", "whole stream, M/s",
         "blocks / scan", "blocks / whole stream")
KEPT = (0.05, 0.25, 0.5, 1.0)


def cells(full: bool) -> list[Cell]:
    return [Cell("streams", "blocks", (("kept", kept),), side, "reduction")
            for side in ((256, 1024, 2048) if full else (256, 1024)) for kept in KEPT]


def rows(data: Path, full: bool) -> list[list[Any]]:
    found = []
    for cell, result in finished(cells(full), data):
        rate = rates(cell.size ** 2, result["seconds"])
        found.append([cell.size ** 2, dict(cell.options)["kept"],
                      *(rate[name] / 1e6 for name in ("scan", "blocks", "whole")),
                      rate["over scan"], rate["over whole"]])
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    write_csv(out / "reduction.csv", HEADS, found)
    shown = [[f"{row[0]:,}", *map(number, row[1:])] for row in found]
    write_text(out / "reduction.md", (
        "# Stream reduction by blocks\n\n"
        "Roger et al. (2007b) scan within blocks of 64 elements. They draw a line for each block "
        "at the block's place in the result. Each fragment of the line is a place of the result, "
        "and searches the block for the element that goes there. Horn (2005) scans the whole "
        "stream, and each fragment searches the whole scan. A scan of the "
        "flags alone, the first part of Horn's method, is shown for comparison. The rates are in "
        "million elements of the unreduced stream per second, from medians of alternating runs in "
        "one process.\n\n" + markdown_table(HEADS, shown)))
    if not found:
        return
    figure, axis = plt.subplots(figsize=(7.2, 3.8))
    names = [f"{row[0]:,}\n{row[1]:.0%} kept" for row in found]
    for k, (label, colour) in enumerate((("scan alone", "#8c8c8c"), ("by blocks", "#2f6db3"),
                                         ("whole stream", "#c98a1b"))):
        axis.bar([i + 0.27 * (k - 1) for i in range(len(found))], [row[2 + k] for row in found],
                 0.25, label=label, color=colour)
    axis.set_xticks(range(len(found)), names, fontsize=7)
    axis.set_ylabel("million elements a second")
    axis.legend(fontsize=8, frameon=False)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "reduction.png", "The rates count the elements before the reduction.",
               "Bars show the rates of stream reduction by blocks and over the whole stream, and "
               "of a scan alone, by the size of the stream and the share of kept elements")
