"""Figure 26: every method at 10,000 triangles, relative to the Ray Engine.

The page compares four speeds of a method: measured here; predicted for a GeForce 8800 GTX; scaled
to this card from the papers' rates, as the survey scales them; and published in the survey.
"""
from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, replace
from pathlib import Path

from gpgpu_rt.charts import (
    COLOURS, HERE, MARKERS, PREDICTED, PUBLISHED, Series, dot_rows, legend_of
)
from gpgpu_rt.gl.context import is_software
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.prediction import time_of_image

from ..framework import verdicts
from ..framework.cell import Cell
from ..framework.comparison import TESTED_BY
from ..framework.kendall import tau_b
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read
from .ray_engine_work import predicted_seconds
from .scaled import scaled, speeds
from .surveyed import BASE, CHIP, SCENE, SurveyedMethod, entries, published_speed, rays_of_columns

ON_SOFTWARE = ("Measured on a software renderer, where rasterising, blending and transfers cost "
               "as much as other memory accesses.")
# Column -> its name and its look in the chart.
COLUMNS = {"published": ("published", PUBLISHED),
           "scaled": ("scaled again, by arithmetic and by bandwidth", (COLOURS[4], MARKERS[4])),
           "predicted": ("predicted", PREDICTED), "measured": ("measured", HERE)}
NOTES = (
    "The survey gives at most one number per paper. It does not say which of the paper's "
    "methods the number belongs to, or from which scenes the number was computed. The survey's "
    "figure prints no numbers, so the published numbers are those of Table 1.",
    "`tenk` has 24 balls on a floor, 10,000 triangles.",
    TESTED_BY,
    "Predicted: the machine model of [era_machine](era_machine.md), with kernels that Mesa "
    "compiled for the card. A packet's rays are the lanes of a warp, and each lane runs the "
    "kernels of a single ray. kd-stack runs the kernels of kd-texture-stack in a loop. Speeds of "
    "methods without kernels in the era form (docs/era.md), and of kd-texture-stack, which needs "
    "a pass for each push, are not predicted. The prediction for "
    "the Ray Engine counts only its passes and transfers, and leaves out the work of its host. "
    "The Ray Engine is therefore predicted too fast, and all other methods too slow relative to "
    "it.",
    "Measured: the host part of the Ray Engine runs in numpy, not in C as in the paper.",
    "Zhou's paper is about building kd-trees. Its row is therefore the kd-tree with a full stack, "
    "built by Zhou's method.")


@dataclass(frozen=True)
class MethodSpeed:
    """A method's nanoseconds per ray, measured and predicted, and its speeds.

    ``bound`` names the part that takes most of the predicted time. The last four fields are
    relative to the Ray Engine; ``scaled`` has a speed by arithmetic and a speed by bandwidth.
    """

    entry: SurveyedMethod
    measured_ns: float | None
    predicted_ns: float | None
    bound: str
    measured: float | None = None
    predicted: float | None = None
    scaled: tuple[float, float] | None = None
    published: float | None = None


def cells(full: bool) -> list[Cell]:
    return [cell for entry in entries() for cell in (entry.measured(full), entry.counted())
            if cell is not None]


def predicted_ns(entry: SurveyedMethod, data: Path) -> tuple[float | None, str]:
    """Return the predicted nanoseconds per ray, and the part that takes most of the time."""
    cell, card = entry.counted(), find_card(CHIP)
    result = None if cell is None else read(cell, data)
    if result is None:
        return None, "-"
    if entry.form is None:
        seconds, bound = predicted_seconds(card, result["engine"])
        rays = result["engine"]["rays"]
    else:
        counts = result["counts"]
        time = time_of_image(card, entry.method, entry.form, counts, any_hit=False,
                             options=entry.options)
        seconds, bound = time.seconds, max(time.parts, key=time.parts.__getitem__)
        rays = counts["rays"]
    return 1e9 * seconds / max(rays, 1), bound


def rows(data: Path, full: bool) -> list[MethodSpeed]:
    """Return the speeds of every entry with a measurement or a prediction."""
    found = []
    for entry in entries():
        timed, (ns, bound) = read(entry.measured(full), data), predicted_ns(entry, data)
        if timed is not None or ns is not None:
            found.append(MethodSpeed(entry, timed["ns_per_ray"] if timed else None, ns, bound))
    base = next((row for row in found if row.entry.source == BASE), None)
    again = speeds(scaled())
    return [MethodSpeed(row.entry, row.measured_ns, row.predicted_ns, row.bound,
                        _over(base.measured_ns if base else None, row.measured_ns),
                        _over(base.predicted_ns if base else None, row.predicted_ns),
                        again.get(row.entry.source or ""), published_speed(row.entry.source))
            for row in found]


def _over(base: float | None, ns: float | None) -> float | None:
    return base / ns if base and ns else None


def value(row: MethodSpeed, column: str) -> float | None:
    """Return the speed in a column; for "scaled", the geometric mean of both scalings."""
    if column == "scaled":
        return math.sqrt(math.prod(row.scaled)) if row.scaled else None
    return getattr(row, column)


def agreement(found: list[MethodSpeed], one: str, other: str) -> tuple[float, float, int]:
    """Return tau-b and `verdicts.off_by` of two columns, and the number of methods."""
    pairs = [(a, b) for row in found
             if (a := value(row, one)) and (b := value(row, other))]
    if len(pairs) < 2:
        return math.nan, math.nan, len(pairs)
    ours, theirs = zip(*pairs)
    return tau_b(ours, theirs), verdicts.off_by(ours, theirs), len(pairs)


def claims(found: list[MethodSpeed], column: str) -> list[str]:
    """Return sentences that compare a column with the survey's conclusions from Figure 26."""
    lines = []
    for says, chosen in (("packets compared with single rays", lambda row: row.entry.row.packet),
                         ("methods with a stack compared with methods without",
                          lambda row: row.entry.row.stack)):
        # Compare only methods over trees. Other methods with a published speed have neither
        # packets nor stacks.
        sides = {side: [v for row in found if (v := value(row, column)) and row.published
                        and _tree(row) and chosen(row) is side] for side in (True, False)}
        if all(sides.values()):
            a, b = (statistics.geometric_mean(sides[side]) for side in (True, False))
            lines.append(f"{column}, {says}: {number(a / b)} times as fast in the geometric mean "
                         f"({len(sides[True])} and {len(sides[False])} methods over trees)")
    return lines


def _tree(row: MethodSpeed) -> bool:
    return row.entry.method.startswith(("kd-", "bvh-", "bih"))


def packet_pairs(found: list[MethodSpeed]) -> list[str]:
    """Return sentences that compare packets with single rays through the same structure."""
    by_name = {row.entry.method: row for row in found if row.entry.method != "kd-stack"}
    lines = []
    for packet, single in (("kd-packet", "kd-short-stack"), ("kd-ropes-packet", "kd-ropes"),
                           ("bvh-packet", "bvh-stack")):
        if packet in by_name and single in by_name:
            gains = [_over(getattr(by_name[single], name), getattr(by_name[packet], name))
                     for name in ("measured_ns", "predicted_ns")]
            lines.append(f"{packet} compared with {single}: {number(gains[0])} times as fast by "
                         "measurement" + (f", {number(gains[1])} times by prediction"
                                          if gains[1] else ""))
    return lines


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """Return the verdict on the predicted column. The verdict also cites the measured column."""
    found = rows(data, full)
    said, here = (_judge(found, column) for column in ("predicted", "measured"))
    said = verdicts.on_card(find_card(CHIP).name, said, here)
    return replace(said, why=f"{said.why} Scaled again: "
                   f"{_agreed(found, 'scaled', 'published')}.")


def _judge(found: list[MethodSpeed], column: str) -> verdicts.Verdict:
    pairs = [(1 / ours, 1 / row.published) for row in found
             if (ours := value(row, column)) and row.published]
    return verdicts.of_groups([verdicts.MethodTimes(SCENE, "all methods", *zip(*pairs))]
                              if pairs else [])


def _agreed(found: list[MethodSpeed], one: str, other: str) -> str:
    tau, off, count = agreement(found, one, other)
    return f"tau-b {number(tau, 2)}, off by a factor of {number(off)}, {count} methods"


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    heads = ("source", "method", "measured_ns", "predicted_ns", "bound", "measured", "predicted",
             "scaled_by_arithmetic", "scaled_by_bandwidth", "published")
    write_csv(out / "fig26.csv", heads, [
        (row.entry.source, row.entry.label, row.measured_ns, row.predicted_ns, row.bound,
         row.measured, row.predicted, *(row.scaled or (None, None)), row.published)
        for row in found])
    write_text(out / "fig26.md", _page(found, data, full))
    if any(row.measured for row in found):
        _chart(found, out)


def _page(found: list[MethodSpeed], data: Path, full: bool) -> str:
    known = next((r for e in entries() if (r := read(e.measured(full), data))), None)
    table = [[row.entry.source or "-", row.entry.label, number(row.measured_ns),
              number(row.predicted_ns), row.bound, number(row.measured), number(row.predicted),
              "-" if row.scaled is None else " to ".join(map(number, sorted(row.scaled))),
              number(row.published)] for row in found]
    cards = [[row.source, row.card.name, number(row.rate / 1e6), ", ".join(row.scenes)]
             for row in scaled()]
    pairs = [("measured", "published"), ("predicted", "published"), ("scaled", "published"),
             ("measured", "predicted")]
    parts = [
        "# Figure 26: every method at 10,000 triangles, relative to the Ray Engine\n",
        "" if known is None else f"Measured on: {known['gpu']['renderer']}, {known['date']}. "
        f"Predicted and scaled to: {find_card(CHIP).name}.\n",
        markdown_table(("source", "method here", "measured ns a ray", "predicted ns a ray",
                        "bound by", "measured", "predicted", "scaled again", "published"), table),
        "The last four columns are speeds relative to the Ray Engine. \"Scaled again\" repeats "
        "the survey's scaling in two ways: the rate that the survey prints for a paper is "
        "multiplied by the ratio of the cards' arithmetic rates, or by the ratio of their "
        "bandwidths. The column shows both results. The rate at 10,000 triangles is "
        "interpolated between "
        "scenes:\n",
        markdown_table(("source", "card", "Mrays/s at 10,000 triangles, or at the nearest count",
                        "scenes"), cards),
        "## How the columns agree\n",
        markdown_table(("", "", "tau-b", "ratios off by a factor of", "methods"), [
            [one, other, number(tau, 2), number(off), count] for one, other in pairs
            for tau, off, count in (agreement(found, one, other),)]),
        "## What the survey concludes from its figure\n",
        "The survey says that packets generally outperform single rays, and that methods with and "
        "without a stack have similar performance (section 4.1). The columns say:\n",
        *(f"* {line}." for name in COLUMNS for line in claims(found, name)),
        *(f"* {line}." for line in packet_pairs(found)), "",
        "## Notes\n", *(f"* {note}" for note in (rays_of_columns(full), *NOTES)),
        *([f"* {ON_SOFTWARE}"] if known and is_software(known["gpu"]["renderer"]) else []), ""]
    return "\n".join(parts)


def _chart(found: list[MethodSpeed], out: Path) -> None:
    some = [row for row in found if row.entry.source]
    rest = [row for row in found if not row.entry.source]
    shown = sorted(some, key=lambda row: -(row.published or 0)) + rest
    series = [Series(name, [value(row, column) for row in shown], look,
                     [row.scaled for row in shown] if column == "scaled" else ())
              for column, (name, look) in COLUMNS.items()]
    figure, axis = plt.subplots(figsize=(9, 1.6 + 0.56 * len(shown)), layout="constrained")
    dot_rows(axis, [row.entry.label + (f"\n{row.entry.source}" if row.entry.source else "")
                    for row in shown], series, "speed relative to the Ray Engine (log)")
    axis.axvline(1, color="#555555", linewidth=0.8)
    axis.axhline(len(some) - 0.5, color="#555555", linewidth=0.8)
    figure.legend(handles=legend_of(series), frameon=False, fontsize=8, ncols=2,
                  loc="outside upper left")
    figure.get_layout_engine().set(rect=(0, 0.03, 1, 0.97))
    save_chart(figure, out / "fig26.png", "Above the line: the survey's rows; below: all "
               "other methods. Measured against published: "
               f"{_agreed(found, 'measured', 'published')}; "
               f"predicted: {_agreed(found, 'predicted', 'published')}",
               "Dots show the speed of each method for eye rays at 10,000 triangles, relative to "
               "the Ray Engine: measured, predicted, scaled again and published")
