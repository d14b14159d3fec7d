"""Era machine: tests how well the machine model predicts the times of the papers' cards.

This page sums up the predictions of Figures 12, 13, 16, 20 and 22, and varies the model's
assumptions.
"""
from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from pathlib import Path

from gpgpu_rt.hardware.machine_model import ASSUMED, Assumptions

from ..framework import predicted_times
from ..framework.cell import Cell
from ..framework.kendall import tau_b
from ..framework.predicted_times import PredictedRow
from ..survey.on_cards import ON_CARDS
from .era_machine_page import write_page

# A (figure, column) that the median leaves out: the column repeats numbers of Figure 16.
REPEATED = ("fig22", "kd-ropes-packet")


def cells(full: bool) -> list[Cell]:
    return list(dict.fromkeys(cell for figure in ON_CARDS
                              for cell in predicted_times.cells(figure, full)))


def rows(data: Path, full: bool) -> list[PredictedRow]:
    """Return a row for each published number and each form of the program (`program_forms`),
    if the counts of this form are measured."""
    return [row for figure in ON_CARDS for row in predicted_times.rows(figure, data, full)]


def scored(found: Sequence[PredictedRow]) -> list[PredictedRow]:
    """Return the scored rows (`PredictedRow.scored`) without the column REPEATED."""
    return [row for row in found
            if row.scored and (row.figure.name, row.column.label) != REPEATED]


def median_miss(found: Sequence[PredictedRow], assumed: Assumptions = ASSUMED) -> float:
    """Return the median of |log2(predicted / published)| over scored rows."""
    logs = [abs(math.log2(row.ratio(assumed))) for row in scored(found)]
    return statistics.median(logs) if logs else math.nan


def parts(found: Sequence[PredictedRow]) -> dict[str, tuple[int, float]]:
    """Return name -> (number of scored rows, `median_miss`), for three selections of the rows."""
    some = {"eye rays of a view that the scene's data set publishes":
            [row for row in found if row.published_view],
            "rays whose view or light is chosen here":
            [row for row in found if not row.published_view],
            "all but published times that are too short to test every triangle":
            [row for row in found if not row.ruled_out]}
    return {name: (len(scored(rows)), median_miss(rows)) for name, rows in some.items()}


def orders(found: Sequence[PredictedRow], assumed: Assumptions = ASSUMED) -> dict[
        tuple[str, str], float]:
    """Return tau-b (kendall.py) between the predicted and the published times of the scored rows,
    for each figure and panel.

    A panel whose published times give no order is left out.
    """
    groups: dict[tuple[str, str], list[PredictedRow]] = {}
    for row in found:
        if row.scored:
            groups.setdefault(row.group, []).append(row)
    taus = {group: tau_b([row.nanoseconds(assumed) for row in some],
                         [row.published for row in some]) for group, some in groups.items()}
    # Tau-b is NaN if all published times tie, or if there is a single method.
    return {group: tau for group, tau in taus.items() if not math.isnan(tau)}


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    misses = {"as stated": median_miss(found)}
    for name, (half, double) in ASSUMED.varied().items():
        misses |= {f"{name} halved": median_miss(found, half),
                   f"{name} doubled": median_miss(found, double)}
    write_page(found, misses, orders(found), parts(found), out)
