"""Draws the bench's chart: a bar for the rate of each entry in every race. Needs matplotlib."""
from __future__ import annotations

import statistics
from collections.abc import Sequence

from ..charts import COLOURS, FORMATS, GREY, linear_axis, plain, plt, save
from ..text_format import number
from .engines import ENGINES
from .race import Entry, ranked, too_noisy

__all__ = ["FORMATS", "draw"]

_THEIRS = {engine.name for engine in ENGINES}


def draw(found: Sequence[tuple[str, str, list[Entry]]], path: str, about: str) -> None:
    """Write a chart of races to the file ``path``.

    A bar ends at the median rate. Its error bar goes from the slowest to the fastest round.

    Parameters
    ----------
    found : (title, rays, entries) of each race, from the top of the chart. ``rays`` is a text. The
        entries of a race are drawn by speed, the fastest at the top
    path : the file to write
    about : a line for the top of the chart, such as the renderer's name
    """
    most = max(len(entries) for _, _, entries in found)
    figure, axes = plt.subplots(len(found), 1, squeeze=False,
                                figsize=(9, len(found) * (1.0 + 0.27 * most) + 0.2))
    for axis, (scene, rays, entries) in zip(axes[:, 0], found):
        ordered = ranked(entries)[::-1]
        rates = [entry.rays_per_second / 1e6 for entry in ordered]
        ends = [[rate - entry.rays / max(entry.seconds) / 1e6
                 for rate, entry in zip(rates, ordered)],
                [entry.rays / min(entry.seconds) / 1e6 - rate
                 for rate, entry in zip(rates, ordered)]]
        axis.barh(range(len(ordered)), rates, xerr=ends, ecolor="#555555", capsize=2,
                  color=[GREY if entry.name in _THEIRS else COLOURS[0] for entry in ordered])
        axis.set_yticks(range(len(ordered)), [entry.label for entry in ordered], fontsize=7)
        for at, (entry, rate) in enumerate(zip(ordered, rates)):
            over = f" ({number(statistics.median(entry.over))})" if entry.over else ""
            # Write the value at the end of the bar, above the line of the error bar.
            axis.annotate(f" {plain(rate)}{over}", (rate, at), va="bottom", fontsize=7)
        axis.margins(x=0.18, y=0.01)
        linear_axis(axis, "x")
        axis.set_title(f"{scene}, {rays}", fontsize=10)
        axis.set_xlabel(_axis(entries), fontsize=8)
        axis.spines[["top", "right"]].set_visible(False)
    figure.text(0.01, 0.995, about, fontsize=8, va="top")
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.25 / figure.get_figheight()))
    save(figure, path, "Bars show the rays per second of each method and each ray tracer of "
         "today, by scene and kind of rays")


def _axis(entries: Sequence[Entry]) -> str:
    """Return the label of the axis. If the times allow no comparison, the label says why."""
    over = ("\nin brackets: the ratio to the rate of embreex on one thread"
            if any(entry.over for entry in entries) else "")
    noise = too_noisy(entries)
    return ("million rays per second: the median of the rounds, and a line from the slowest to "
            f"the fastest round{over}") + (f"\nno verdict: {noise}" if noise else "")
