"""Period: predicted times beside the published times of Figures 12, 13, 16, 20 and 22.

Period hardware is the graphics cards on which the papers measured. The times on these cards are
predicted from counted work and from the cards' own data.
"""
from __future__ import annotations

import math
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE, SHADOW
from gpgpu_rt.hardware.cards import Card, find_card
from gpgpu_rt.hardware.model import Counted, Prediction, kernel_work, loop_work, predict, share_of
from gpgpu_rt.scene.catalogue import mesh_path

from ..framework.cell import ON_CPU, Cell
from ..framework.comparison import Comparison, MethodColumn, Panel
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import nanoseconds, published_row
from ..framework.results import read
from ..survey import fig12_eye_rays as fig12
from ..survey import fig13_horn_improvements as fig13
from ..survey import fig16_ropes_and_packets as fig16
from ..survey import fig20_whole_images as fig20
from ..survey import fig22_large_scenes as fig22
from .period_misses import miss, missed, other_editions, reasons, tau_of, turned_round
from .period_notes import NOTES, TWICE_PRINTED
from .period_work import KERNELS, SQUARES, WORK, counted_rays, image_scale

WARP_PACKET = (4, 4)
# The quick size leaves these scenes out if no mesh file is named for them.
STAND_INS = ("shirley6", "fairyforest", "cows", "sodahall", "powerplant")
# Targets: tau-b of every scene, and tau-b of scenes with at least ENOUGH methods.
TAU, HIGH_TAU, ENOUGH = 0.6, 0.8, 5
COLOURS = {"fig12": "#8c8c8c", "fig13": "#4b2a70", "fig16": "#b33a3a", "fig20": "#3d8b57",
           "fig22": "#2f6db3"}


@dataclass(frozen=True)
class Experiment:
    """A figure, the chip that it was measured on, its pixels per side, and how work is counted."""

    figure: Comparison
    chip: str
    size: int
    manner: str = ""                  # how work is counted: "", SQUARES or KERNELS
    left_out: tuple[str, ...] = ()    # columns that are not in the paper

    @property
    def card(self) -> Card:
        return find_card(self.chip)

    def pairs(self) -> Iterator[tuple[Panel, MethodColumn]]:
        """Yield the panels and columns that have a published number measured on a card."""
        for panel, column in self.figure.pairs(full=True):
            if (panel.scene not in fig22.HUGE and column.method != ON_CPU
                    and column.label not in self.left_out
                    and self.published(panel, column) is not None):
                yield panel, column

    def published(self, panel: Panel, column: MethodColumn) -> dict[str, str] | None:
        return published_row(self.figure.name, panel.scene, column.method,
                             column.published_options, panel.rays)

    def cells(self, panel: Panel, column: MethodColumn) -> list[Cell]:
        """The cells of a published number, one for each kind of rays that the number covers."""
        options = self.figure.cell(panel, column, False).options
        if self.warps(column):
            options += (("packet", WARP_PACKET),)
        return [Cell(panel.scene, column.method, options, self.size, WORK + kind + self.manner,
                     runs=1) for kind in self.kinds(panel)]

    def warps(self, column: MethodColumn) -> bool:
        """Whether the rays of a packet are lanes of a warp, instead of sharing one lane."""
        return self.chip == "G80" and column.label.endswith("-packet")

    def width(self, column: MethodColumn) -> int:
        """The number of fragments that branch together."""
        return self.card.branch_width // (math.prod(WARP_PACKET) if self.warps(column) else 1)

    def kinds(self, panel: Panel) -> tuple[str, ...]:
        if panel.rays == "shadow":
            return (SHADOW,)
        if panel.rays is None and self.figure.name == "fig20" or "+" in (panel.rays or ""):
            return (EYE, SHADOW)
        return (EYE,)


EXPERIMENTS = (
    Experiment(fig12.FIGURE, "R420", 512, KERNELS),
    Experiment(fig13.FIGURE, "R580", 1024),
    Experiment(fig16.FIGURE, "G80", 1024),
    Experiment(fig20.FIGURE, "NV40", 512, SQUARES),
    Experiment(fig22.FIGURE, "G80", 1024, left_out=(fig22.FAST,)),
)


@dataclass
class PredictedCell:
    """A cell of a figure: its published and predicted nanoseconds per ray.

    For a picture the times are per pixel.
    """

    experiment: Experiment
    panel: Panel
    column: MethodColumn
    published: float
    works: list[tuple[Counted, dict[str, Any]]]
    stand_in: bool
    triangles: int
    ns: float = 0.0
    instructions: float = 0.0    # per ray, including instructions of waiting lanes
    prediction: Prediction | None = None

    @property
    def scored(self) -> bool:
        """Whether the cell is scored: its scene is no stand-in, and its number is not repeated."""
        return not self.stand_in and (self.experiment.figure.name, self.column.label
                                      ) not in TWICE_PRINTED

    @property
    def ratio(self) -> float:
        return self.ns / self.published

    @property
    def total(self) -> Counted:
        return sum((work for work, _ in self.works[1:]), self.works[0][0])

    @property
    def count(self) -> float:
        """The number of rays that the work covers; for a picture, the number of pixels."""
        of_picture = len(self.works) > 1 or self.experiment.figure.name == "fig20"
        first = self.works[0][1]
        return max(first["pixels"] if of_picture else counted_rays(first), 1)

    @property
    def share(self) -> float:
        """The share of the card's rates at which the prediction equals the published time."""
        return share_of(self.experiment.card, self.total, 1e-9 * self.published * self.count)

    def predict(self, share: float) -> None:
        """Predict the cell with a card's constant, the ``share`` of its rates that is reached."""
        self.prediction = predict(self.experiment.card, self.total, share)
        self.ns = 1e9 * self.prediction.seconds / self.count
        self.instructions = self.total.instructions / self.count

    @property
    def utilisation(self) -> float:
        """The share of lanes that work instead of waiting.

        If the rays of a packet are lanes of a warp, all rays of a working packet count as working.
        """
        work = self.works[0][1]
        width = self.experiment.width(self.column)
        kind = "scalar" if self.experiment.card.scalar_units else "vector"
        alone, bound = (sum(r[kind] * r["runs"][str(w)] * w for r in work["regions"])
                        for w in (1, width))
        return alone / bound


def cells(full: bool, chip: str | None = None) -> list[Cell]:
    """The cells of all experiments, or those of one chip.

    The quick size leaves out the scenes of which only a stand-in exists.
    """
    return list(dict.fromkeys(cell for one in EXPERIMENTS if chip in (None, one.chip)
                              for panel, column in one.pairs()
                              if full or panel.scene not in STAND_INS or mesh_path(panel.scene)
                              for cell in one.cells(panel, column)))


def rows(data: Path) -> list[PredictedCell]:
    """Every cell whose work is measured. The cells have no prediction yet."""
    found = []
    for one in EXPERIMENTS:
        for panel, column in one.pairs():
            results = [read(cell, data) for cell in one.cells(panel, column)]
            if any(result is None for result in results):
                continue
            published = nanoseconds(one.published(panel, column))
            assert published is not None
            found_work = [r["work"] for r in results if r is not None]
            works = [(_counted(one, column, work).scaled(image_scale(work)), work)
                     for work in found_work]
            found.append(PredictedCell(one, panel, column, published, works,
                                       bool(results[0]["scene"]["stand_in"]),
                                       results[0]["scene"]["triangles"]))
    return found


def _counted(one: Experiment, column: MethodColumn, work: dict[str, Any]) -> Counted:
    if one.manner == KERNELS:
        return kernel_work(work)
    return loop_work(one.card, work, one.width(column))


@dataclass(frozen=True)
class Fit:
    """A card's constant: the share of its rates that programs reach.

    Attributes
    ----------
    share : the share at which as many cells are predicted too fast as too slow
    cells : the number of cells that the share is fitted to
    stand_ins : whether no scored cell is measured, so that stand-ins or repeated numbers are used
    """

    share: float
    cells: int
    stand_ins: bool

    def says(self) -> str:
        return f"{self.cells} cells" + (", none of them scored" if self.stand_ins else "")


def fit(found: list[PredictedCell]) -> dict[str, Fit]:
    """Fit each chip's constant to its scored cells, and predict every cell with it."""
    fits = {}
    for chip in dict.fromkeys(row.experiment.chip for row in found):
        mine = [row for row in found if row.experiment.chip == chip]
        scored = [row for row in mine if row.scored]
        chosen = scored or mine
        fits[chip] = Fit(statistics.median(row.share for row in chosen), len(chosen), not scored)
        for row in mine:
            row.predict(fits[chip].share)
    return fits


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/period.csv, .md and .png."""
    found = rows(data)
    fits = fit(found)
    heads = ("figure", "card", "scene", "rays", "method", "stand_in", "scored", "published_ns",
             "predicted_ns", "ratio", "bound", "utilisation")
    write_csv(out / "period.csv", heads, [
        (r.experiment.figure.name, r.experiment.card.name, r.panel.scene, r.panel.rays,
         r.column.label, r.stand_in, r.scored, r.published, r.ns, r.ratio, r.prediction.bound,
         r.utilisation) for r in found if r.prediction])
    write_text(out / "period.md", _page(found, fits))
    if found:
        _chart(found, out)


def misses(found: list[PredictedCell]) -> float:
    """The median of |log2(predicted / published)| over scored cells."""
    logs = [abs(math.log2(row.ratio)) for row in found if row.scored]
    return statistics.median(logs) if logs else math.nan


def _page(found: list[PredictedCell], fits: dict[str, Fit]) -> str:
    parts = ["# Period hardware: predicted times beside the published times\n",
             "Period hardware is the graphics cards on which the papers measured. Work is counted "
             "by emulating the compiled fragment programs on tiles of the image, at the width at "
             "which the card's pixels branch. Rays of the whole image may take more or fewer "
             "steps than rays of the tiles. The work is therefore multiplied by the ratio of "
             "these steps, which the shaders' counters measure. `gpgpu-rt hardware` prints the "
             "cards' data and their sources. One constant is fitted for each card: the share of "
             "its peak rates that programs reach.\n",
             markdown_table(("card", "share", "fitted to"), [
                 (find_card(chip).name, number(one.share), one.says())
                 for chip, one in fits.items()]),
             *(["A share above 1 means that the paper's programs took fewer instructions than "
                "ours, or that the stated peak of the card is too low.\n"]
               if any(one.share > 1 for one in fits.values()) else []),
             "A cell is a method on a scene with a kind of rays. The median of "
             f"|log2(predicted / published)| over {sum(r.scored for r in found)} scored "
             f"cells is **{number(misses(found))}** (the target is at most 1). By figure: "
             + ", ".join(
                 f"{name} {number(misses([r for r in found if r.experiment.figure.name == name]))}"
                 for name in COLOURS) + ".\n", _orders(found)]
    for one in EXPERIMENTS:
        name = one.figure.name
        mine = [row for row in found if row.experiment is one]
        parts.append(f"## {one.figure.title}; on the {one.card.name}\n")
        parts += [f"{note}\n" for note in (*NOTES.get(name, ()), *other_editions(mine))]
        for panel in dict.fromkeys(row.panel for row in mine):
            chosen = [row for row in mine if row.panel == panel]
            tau, count = tau_of(found, name, panel)
            kind = " (stand-in, not scored)" if chosen[0].stand_in else ""
            parts.append(f"### {panel.label}{kind}: tau-b {number(tau, 2)} of {count} methods\n")
            parts.append(markdown_table(
                ("method", "published ns", "predicted ns", "predicted / published", "bound by",
                 "lanes used"),
                [(r.column.label, number(r.published), number(r.ns), number(r.ratio),
                  r.prediction.bound, f"{100 * r.utilisation:.0f} %")
                 for r in chosen if r.prediction]))
    far = missed(found)
    parts.append(f"## Misses: {len(far)} scored cells off by more than a factor of two\n")
    parts.append("\n".join(f"* {line}" for line in [*reasons(found), *map(miss, far)]) + "\n")
    turned = turned_round(found, TAU)
    parts.append(f"## Orders missed: {len(turned)} scored scenes below tau-b {TAU}\n")
    parts.append("\n".join(f"* {line}" for line in turned) + "\n")
    return "\n".join(parts)


def _orders(found: list[PredictedCell]) -> str:
    """Sentences on how many scenes' methods have the published order, and on the targets."""
    taus = {}
    for row in found:
        name = row.experiment.figure.name
        if row.scored and (name, row.panel) not in taus:
            taus[name, row.panel] = tau_of(found, name, row.panel)
    taus = {key: (tau, count) for key, (tau, count) in taus.items() if tau == tau}
    low = [f"{name} {panel.label} ({number(tau, 2)} of {count})"
           for (name, panel), (tau, count) in taus.items() if tau < TAU]
    many = [tau for tau, count in taus.values() if count >= ENOUGH]
    high = sum(tau >= HIGH_TAU for tau in many)
    return (f"tau-b is {TAU} or more in {len(taus) - len(low)} of {len(taus)} scored scenes (the "
            f"target is all), and {HIGH_TAU} or more in {high} of {len(many)} scenes with "
            f"{ENOUGH} or more methods (the target is two thirds)."
            + (f" Scenes below {TAU}: " + ", ".join(low) + "." if low else "")
            + "\n")


def _chart(found: list[PredictedCell], out: Path) -> None:
    figure, axis = plt.subplots(figsize=(7, 6.4))
    for name, colour in COLOURS.items():
        mine = [r for r in found if r.experiment.figure.name == name]
        for scored in (True, False):
            some = [r for r in mine if r.scored is scored]
            label = f"{name} ({mine[0].experiment.card.chip})" if scored and some else None
            axis.plot([r.published for r in some], [r.ns for r in some], "o", color=colour,
                      markerfacecolor=colour if scored else "none", markersize=5, alpha=0.85,
                      label=label)
    low = 0.7 * min(min(r.published, r.ns) for r in found)
    high = 1.4 * max(max(r.published, r.ns) for r in found)
    for factor, style in ((1, "-"), (2, ":"), (0.5, ":")):
        axis.plot([low, high], [factor * low, factor * high], style, color="#555555", linewidth=1)
    axis.set(xscale="log", yscale="log", xlim=(low, high), ylim=(low, high),
             xlabel="published, nanoseconds a ray", ylabel="predicted, nanoseconds a ray")
    axis.legend(frameon=False, loc="upper left")
    axis.spines[["top", "right"]].set_visible(False)
    figure.suptitle("Period hardware: predicted and published times\nhollow: stand-ins and "
                    "repeated numbers, not scored; dotted: a factor of two", fontsize=11)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "period.png", "One constant per card is fitted; the median of "
               f"|log2(predicted / published)| is {number(misses(found))} over "
               f"{sum(r.scored for r in found)} scored cells.")
