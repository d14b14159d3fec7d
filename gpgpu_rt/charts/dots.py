"""Dots: draws rows of numbers as dots on a logarithmic axis, each number beside its dot."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from matplotlib.lines import Line2D

from .axes import log_axis, plain
from .palette import COLOURS, MARKERS

_SPREAD = 0.72      # share of a row's height that its series occupy


@dataclass
class Series:
    """Numbers of one kind, one for each row of a chart.

    Attributes
    ----------
    name : the name in the legend
    values : the numbers; None where there is no number
    look : colour and marker
    ends : (lowest, highest) for each row, drawn as a line; None for a row without a line
    texts : the texts beside the dots; by default the numbers
    """

    name: str
    values: Sequence[float | None]
    look: tuple[str, str] = (COLOURS[0], MARKERS[0])
    ends: Sequence[tuple[float, float] | None] = ()
    texts: Sequence[str] = field(default_factory=tuple)


def dot_rows(axis: Any, rows: Sequence[str], series: Sequence[Series], label: str,
             size: float = 7.5) -> None:
    """Draw a row for each name in ``rows``, with a dot for each series.

    Parameters
    ----------
    axis : the matplotlib Axes, whose x axis becomes logarithmic
    rows : names of the rows, from the top
    label : name of the x axis, with its unit
    size : size of the numbers in points
    """
    series = [one for one in series if any(one.values)]
    step = _SPREAD / max(len(series), 1)
    for at, one in enumerate(series):
        colour, marker = one.look
        for row, value in enumerate(one.values):
            if not value:       # a logarithmic axis has no place for 0
                continue
            y = row + step * (at - (len(series) - 1) / 2)
            end = value
            if one.ends and one.ends[row] is not None:
                axis.plot(one.ends[row], (y, y), color=colour, linewidth=1, zorder=2)
                end = max(value, *one.ends[row])
            axis.plot(value, y, marker, color=colour, markersize=4.5, zorder=3)
            note = axis.annotate(one.texts[row] if one.texts else plain(value), (end, y),
                                 xytext=(5, 0), textcoords="offset points", va="center",
                                 fontsize=size)
            note.set_in_layout(False)       # `_leave_space` makes space for the text
    for row in range(0, len(rows), 2):
        axis.axhspan(row - 0.5, row + 0.5, color="#f4f4f4", linewidth=0, zorder=0)
    axis.set_yticks(range(len(rows)), rows, fontsize=8)
    axis.set_ylim(len(rows) - 0.5, -0.5)
    axis.tick_params(axis="y", length=0)
    log_axis(axis, "x")
    axis.set_xlabel(label, fontsize=8)
    axis.tick_params(axis="x", labelsize=8)
    axis.grid(axis="x", color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.margins(x=0.08)
    _leave_space(axis)
    axis.spines[["top", "right", "left"]].set_visible(False)


def legend_of(series: Sequence[Series]) -> list[Any]:
    return [Line2D([], [], linestyle="", color=one.look[0], marker=one.look[1], markersize=5,
                   label=one.name) for one in series if any(one.values)]


def _leave_space(axis: Any) -> None:
    """Widen the x axis for the texts beside the last dots."""
    low, high = axis.get_xlim()
    if 0 < low < high:
        axis.set_xlim(low, high * (high / low) ** 0.22)
