"""Predicted times: computes the machine model's times for the card of a figure's paper.

Mesa's compiler for the card compiles the kernels, and traces count how often the card issues each
kernel. No constant is fitted.
"""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gpgpu_rt.bench.workloads import EYE, SHADOW
from gpgpu_rt.hardware.cards import Card, find_card
from gpgpu_rt.hardware.machine_model import ASSUMED, Assumptions, CardTime, issue_slots
from gpgpu_rt.hardware.prediction import compiled, time_of_image
from gpgpu_rt.hardware.program_forms import FORMS, counted_as, forms_of
from gpgpu_rt.hardware.static_costs import StaticCost
from gpgpu_rt.scene.catalogue import mesh_path

from .cell import ISSUES, ON_CHIP, Cell
from .published_numbers import nanoseconds
from .published_views import VIEWS
from .results import read
from .trace_times import PICTURE

if TYPE_CHECKING:
    from .comparison import Comparison, MethodColumn, Panel

BUILT_IN = ("cornell", "tenk")     # scenes that need no mesh
# The fewest instructions of a triangle test: three dot products, for t, u and v. If all rays start
# at one point, everything else can be computed in advance per triangle.
LEAST_TEST = 3


@dataclass(frozen=True)
class PaperCard:
    """The card on which a paper measured, and ``size``, the pixels per side of its images."""

    chip: str
    size: int

    @property
    def card(self) -> Card:
        return find_card(self.chip)

    @property
    def forms(self) -> tuple[str, ...]:
        """How the card's programs can arrange kernels (program_forms.py); verdicts use the first
        form."""
        return FORMS[self.chip]

    def forms_of(self, method: str) -> tuple[str, ...]:
        """Return the forms in which a method runs on this card; the first is judged.

        The result is () for a method without an era form (docs/era.md), and for packets without
        compiled kernels.
        """
        return forms_of(method, self.chip)


@dataclass(frozen=True)
class PredictedRow:
    """A published time, and the counts that predict it.

    Attributes
    ----------
    figure : the figure, which has a ``paper_card``
    published : nanoseconds per ray, or per pixel of a picture
    counts : kind of rays -> result of `image_issues.measure`
    stand_in : whether the scene's mesh is missing; the prediction is then not scored
    """

    figure: Comparison
    panel: Panel
    column: MethodColumn
    form: str
    published: float
    counts: Mapping[str, dict[str, Any]]
    stand_in: bool

    @property
    def paper_card(self) -> PaperCard:
        assert self.figure.paper_card is not None
        return self.figure.paper_card

    @property
    def judged(self) -> bool:
        """Whether the figure's verdict uses this prediction."""
        return self.form == self.paper_card.forms_of(self.column.method)[0]

    @property
    def scored(self) -> bool:
        """Whether the verdict uses this prediction, and the scene is no stand-in."""
        return self.judged and not self.stand_in

    @property
    def published_view(self) -> bool:
        """Whether the rays are the eye rays of a view published with the scene."""
        return self.panel.scene in VIEWS and list(self.counts) == [EYE]

    @property
    def ruled_out(self) -> bool:
        """Whether a published time of brute force is too short for its triangle tests.

        False for other methods.
        """
        return self.column.method == "brute-force" and self.allowed < LEAST_TEST

    @property
    def group(self) -> tuple[str, str]:
        """The names of the figure and the panel. Only methods of the same group are compared."""
        return self.figure.name, self.panel.label

    def time(self, assumed: Assumptions = ASSUMED) -> CardTime:
        card, method = self.paper_card.card, self.column.method
        whole = [time_of_image(card, method, self.form, counts, kind == SHADOW, assumed,
                               self.column.options)
                 for kind, counts in self.counts.items()]
        total = whole[0] if len(whole) == 1 else whole[0] + whole[1]
        return total.scaled(1 / self._number)

    @property
    def per(self) -> str:
        """The unit that the published time is for: "a ray", or "a pixel" of a picture."""
        return "a ray" if len(self.counts) == 1 else "a pixel"

    @property
    def _number(self) -> float:
        counts = next(iter(self.counts.values()))
        return max(counts["rays" if list(self.counts) == [SHADOW] else "pixels"], 1)

    @property
    def runs(self) -> float:
        """Runs of kernels per ray or pixel; waiting lanes do not count."""
        return self._sum("runs", lambda cost: 1) / self._number

    @property
    def instructions(self) -> float:
        """The mean number of instructions of a run."""
        return self._sum("runs", issue_slots) / max(self._sum("runs", lambda cost: 1), 1)

    @property
    def issued_instructions(self) -> float:
        """A run's mean number of instructions, plus the instructions issued for waiting lanes."""
        return self._sum("lanes", issue_slots) / max(self._sum("runs", lambda cost: 1), 1)

    @property
    def allowed(self) -> float:
        """The number of instructions that the card can issue in the published time, per run of a
        kernel."""
        seconds = 1e-9 * self.published / max(self.runs, 1e-9)
        return float(seconds * self.paper_card.card.issue_rate)

    def _sum(self, field: str, weight: Callable[[StaticCost], float]) -> float:
        """Return the sum of ``field`` (runs or lanes) over kernels, weighted by kernel costs."""
        total = 0.0
        for kind, counts in self.counts.items():
            issued = counts["issued"][counted_as(self.form)]
            costs, _ = compiled(self.paper_card.card, self.column.method, self.form,
                                tuple(issued["kernels"]), kind == SHADOW, self.column.options)
            total += sum(number * weight(costs[kernel])
                         for kernel, number in zip(issued["kernels"], issued[field]))
        return total

    def nanoseconds(self, assumed: Assumptions = ASSUMED) -> float:
        """Return the predicted nanoseconds per ray, or per pixel of a picture."""
        return 1e9 * self.time(assumed).seconds

    def ratio(self, assumed: Assumptions = ASSUMED) -> float:
        """Return the predicted time divided by the published time."""
        return self.nanoseconds(assumed) / self.published


def counted_cell(scene: str, method: str, options: tuple[tuple[str, Any], ...], size: int,
                 rays: str, chip: str) -> Cell:
    """Return the cell (cell.py) that counts how often a card issues a method's kernels."""
    return Cell(scene, method, options, size, ISSUES + rays + ON_CHIP + chip, runs=1)


def cells(figure: Comparison, full: bool) -> list[Cell]:
    """Return the cells that count how often a figure's card would have issued each kernel.

    Stand-in scenes are left out, because they are never scored.
    """
    return list(dict.fromkeys(
        cell for panel, _, some in pairs(figure, full) for cell in some.values()
        if panel.scene in BUILT_IN or mesh_path(panel.scene)))


def rows(figure: Comparison, data: Path, full: bool) -> list[PredictedRow]:
    """Return a `PredictedRow` for each published time and each form with measured counts."""
    found = []
    for panel, column, some in pairs(figure, full):
        results = {kind: result for kind, cell in some.items()
                   if (result := read(cell, data)) is not None}
        published = nanoseconds(figure.published_row(panel, column))
        if len(results) < len(some) or published is None or figure.paper_card is None:
            continue
        counts = {kind: result["counts"] for kind, result in results.items()}
        stand_in = any(result["scene"]["stand_in"] for result in results.values())
        found += [PredictedRow(figure, panel, column, form, published, counts, stand_in)
                  for form in figure.paper_card.forms_of(column.method)
                  if all(counted_as(form) in one["issued"] for one in counts.values())]
    return found


def pairs(figure: Comparison,
          full: bool) -> Iterator[tuple[Panel, MethodColumn, dict[str, Cell]]]:
    """Yield each panel and column whose time is published and can be predicted, with a cell
    (cell.py) for each kind of rays."""
    paper = figure.paper_card
    for panel, column in figure.pairs(full) if paper is not None else ():
        if (paper is None or not paper.forms_of(column.method)
                or figure.published_row(panel, column) is None):
            continue
        asked = figure.cell(panel, column, False)
        kinds = (EYE, SHADOW) if asked.work == PICTURE else (asked.work,)
        yield panel, column, {kind: counted_cell(
            panel.scene, column.method, asked.options, paper.size, kind, paper.chip)
            for kind in kinds}
