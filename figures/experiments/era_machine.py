"""Era machine: times that the machine model predicts for the papers' cards, and published times.

The kernels are compiled by the cards' own compilers, their issues are counted in traces, and no
constant is fitted.
"""
from __future__ import annotations

import functools
import math
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpgpu_rt.hardware.issue import STEP, WHILE_WHILE, KernelIssues
from gpgpu_rt.hardware.machine_model import (
    ASSUMED, Assumptions, CardTime, stream_fetches, time_of_loop, time_of_passes
)
from gpgpu_rt.hardware.static_costs import StaticCost, era_methods, static_cost
from gpgpu_rt.scene.catalogue import mesh_path

from ..framework.cell import Cell
from ..framework.comparison import MethodColumn, Panel
from ..framework.kendall import tau_b
from ..framework.published_numbers import nanoseconds
from ..framework.results import read
from .era_counts import ON, PASSES, WORK
from .era_machine_page import write_page
from .period import EXPERIMENTS, STAND_INS, Experiment

# The forms of each figure's programs. The first form is scored. A card without branches runs a
# kernel a pass. Code that follows the thesis of Figure 20 runs one step of a ray an iteration (for
# its BVH). The papers of Figures 13 and 16 do not publish the order of their loops.
FORMS = {"fig12": (PASSES,), "fig13": (WHILE_WHILE, STEP, PASSES),
         "fig16": (WHILE_WHILE, STEP), "fig20": (STEP, WHILE_WHILE, PASSES)}


@dataclass(frozen=True)
class PredictedRow:
    """A published number, and the counts that predict it.

    Attributes
    ----------
    form : PASSES or an order of a loop.
    published : Nanoseconds a ray, or a pixel of a picture.
    counts : Of `era_counts.measure`, an entry for each kind of rays.
    stand_in : Whether the scene's mesh is missing, so that the row is not scored.
    """

    experiment: Experiment
    panel: Panel
    column: MethodColumn
    form: str
    published: float
    counts: tuple[dict[str, Any], ...]
    stand_in: bool

    @property
    def scored(self) -> bool:
        return not self.stand_in and self.form == FORMS[self.experiment.figure.name][0]

    @property
    def group(self) -> tuple[str, str]:
        """The figure and the panel, within which methods are ordered."""
        return self.experiment.figure.name, self.panel.label

    def time(self, assumed: Assumptions = ASSUMED) -> CardTime:
        """Return the predicted time a ray, or a pixel of a picture."""
        whole = [self._image(counts, assumed) for counts in self.counts]
        per = "rays" if self.panel.rays == "shadow" else "pixels"
        total = whole[0] if len(whole) == 1 else whole[0] + whole[1]
        return total.scaled(1 / max(self.counts[0][per], 1))

    def ratio(self, assumed: Assumptions = ASSUMED) -> float:
        """Return predicted over published."""
        return 1e9 * self.time(assumed).seconds / self.published

    def _image(self, counts: dict[str, Any], assumed: Assumptions) -> CardTime:
        card, method = self.experiment.card, self.column.method
        found = {name: tuple(value) if isinstance(value, list) else value
                 for name, value in counts["issued"][self.form].items()}
        issued = KernelIssues(**found)
        costs, streams = _compiled(card.chip.lower(), method, issued.kernels)
        if self.form == PASSES:
            return time_of_passes(card, issued, costs, counts["pixels"], assumed)
        return time_of_loop(card, issued, costs, streams, counts["pixels"], assumed)


@functools.cache
def _compiled(chip: str, method: str, kernels: tuple[str, ...]) -> tuple[
        dict[str, StaticCost], dict[str, int]]:
    """Return the static cost and the fetches of streams of each kernel."""
    return ({name: static_cost(chip, method, name) for name in kernels},
            {name: stream_fetches(method, name) for name in kernels})


def _pairs() -> Iterator[tuple[Experiment, Panel, MethodColumn, list[Cell]]]:
    for one in EXPERIMENTS:
        for panel, column in one.pairs() if one.figure.name in FORMS else ():
            if column.method not in era_methods():
                continue
            options = one.figure.cell(panel, column, False).options
            yield one, panel, column, [
                Cell(panel.scene, column.method, options, one.size, WORK + kind + ON + one.chip,
                     runs=1) for kind in one.kinds(panel)]


def cells(full: bool) -> list[Cell]:
    """The counted cells. The quick size leaves out scenes of which only a stand-in exists."""
    return list(dict.fromkeys(
        cell for _, panel, _, some in _pairs() for cell in some
        if full or panel.scene not in STAND_INS or mesh_path(panel.scene)))


def rows(data: Path) -> list[PredictedRow]:
    """Return a row for each published number and form whose counts are measured."""
    found = []
    for one, panel, column, some in _pairs():
        results = [result for cell in some if (result := read(cell, data)) is not None]
        published = nanoseconds(one.published(panel, column))
        if len(results) < len(some) or published is None:
            continue
        counts = tuple(result["counts"] for result in results)
        forms = (PASSES,) if column.method == "brute-force" else FORMS[one.figure.name]
        found += [PredictedRow(one, panel, column, form, published, counts,
                               bool(results[0]["scene"]["stand_in"])) for form in forms]
    return found


def median_miss(found: list[PredictedRow], assumed: Assumptions = ASSUMED) -> float:
    """Return the median of |log2(predicted / published)| over scored rows."""
    logs = [abs(math.log2(row.ratio(assumed))) for row in found if row.scored]
    return statistics.median(logs) if logs else math.nan


def orders(found: list[PredictedRow], assumed: Assumptions = ASSUMED) -> dict[
        tuple[str, str], float]:
    """Return tau-b of each figure and panel with at least two scored methods."""
    groups: dict[tuple[str, str], list[PredictedRow]] = {}
    for row in found:
        if row.scored:
            groups.setdefault(row.group, []).append(row)
    return {group: tau_b([row.time(assumed).seconds for row in some],
                         [row.published for row in some])
            for group, some in groups.items() if len(some) > 1}


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/era_machine.csv, .md and .png."""
    found = rows(data)
    misses = {"as stated": median_miss(found)}
    for name, (half, double) in ASSUMED.varied().items():
        misses |= {f"{name} halved": median_miss(found, half),
                   f"{name} doubled": median_miss(found, double)}
    write_page(found, misses, orders(found), out)
