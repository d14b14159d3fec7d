"""Surveyed: maps the methods of the survey's Table 1 and Figure 26 to rows of our method table.

The survey prints at most one speed per paper, and does not say which of the paper's methods has
this speed. Here the paper's final method stands for the paper. The other rows of our method table
are measured too.
"""
from __future__ import annotations

import csv
import functools
import importlib.resources
from dataclasses import dataclass
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.hardware.program_forms import forms_of

from ..framework.cell import PERIOD_TEST, Cell, timed_runs
from ..framework.predicted_times import counted_cell
from . import ray_engine_work

SCENE = "tenk"            # 10,000 triangles, as in Table 1
BASE = "Carr et al. 2002"    # the Ray Engine: all speeds are relative to it
CHIP = "G80"              # the chip of the GeForce 8800 GTX, to which the survey scales all rates
# Pixels per side of the image for predictions. Its rays are about as dense as in most papers.
PREDICTED_SIZE = 1024
Options = tuple[tuple[str, Any], ...]

# Source, as the survey names it -> the method and options that stand for the source.
STANDS_FOR: dict[str, tuple[str, Options]] = {
    "Purcell et al. 2002": ("grid", ()),
    "Carr et al. 2002": ("ray-engine", ()),
    "Thrane and Simonsen 2005": ("bvh-threaded", (("build", "goldsmith-salmon"),)),
    "Foley and Sugerman 2005": ("kd-restart", ()),
    "Carr et al. 2006": ("geometry-image", ()),
    "Szecsi 2006": ("ray-tiles", ()),
    "Roger et al. 2007": ("ray-hierarchy", ()),
    "Günther et al. 2007": ("bvh-packet", ()),
    "Horn et al. 2007": ("kd-packet", ()),
    "Popov et al. 2007": ("kd-ropes-packet", ()),
    "Budge et al. 2008": ("kd-stack", ()),
    "Zhou et al. 2008": ("kd-stack", (("build", "zhou"),)),
}


@dataclass(frozen=True)
class SurveyedMethod:
    """A method with options. ``source`` is the row of Table 1 for which it stands, or None."""

    method: str
    options: Options = ()
    source: str | None = None

    @property
    def label(self) -> str:
        return " ".join((self.method, *(str(value) for _, value in self.options)))

    @property
    def row(self) -> rt.Method:
        return next(row for row in rt.methods() if row.name == self.method)

    def measured(self, full: bool) -> Cell:
        """Return the cell (cell.py) that times eye rays of the scene on this machine."""
        return Cell(SCENE, self.method, (*self.options, PERIOD_TEST), measured_size(full), EYE,
                    runs=timed_runs(full))

    @property
    def form(self) -> str | None:
        """The form (program_forms.py) in which CHIP runs the method; None if CHIP cannot."""
        return next(iter(forms_of(self.method, CHIP)), None)

    def counted(self) -> Cell | None:
        """Return the cell that counts CHIP's work, from which the method's time is predicted.

        None for a method without a prediction.
        """
        options = (*self.options, PERIOD_TEST)
        if self.method == ray_engine_work.METHOD:
            return Cell(SCENE, self.method, options, PREDICTED_SIZE, ray_engine_work.WORK + EYE,
                        runs=1)
        return counted_cell(SCENE, self.method, options, PREDICTED_SIZE, EYE,
                            CHIP) if self.form else None


def measured_size(full: bool) -> int:
    """Return the pixels per side of the image whose rays are timed."""
    return 512 if full else 256


def rays_of_columns(full: bool) -> str:
    timed, counted = (f"{size ** 2:,} eye rays ({size}x{size})"
                      for size in (measured_size(full), PREDICTED_SIZE))
    return (f"All methods of a column trace the same rays of `{SCENE}`: {timed} for the measured "
            f"column, {counted} for the predicted column.")


def entries() -> list[SurveyedMethod]:
    """Return the survey's rows in order, then every other method of our table."""
    surveyed = [SurveyedMethod(method, options, source)
                for source, (method, options) in STANDS_FOR.items()]
    known = {entry.method for entry in surveyed}
    return surveyed + [SurveyedMethod(row.name) for row in rt.methods() if row.name not in known]


@functools.cache
def table1() -> dict[str, dict[str, str]]:
    """Return the survey's printed Table 1: source -> column -> text."""
    file = importlib.resources.files("gpgpu_rt.figures") / "published" / "table1.csv"
    with file.open(newline="", encoding="utf-8") as lines:
        return {row["source"]: row for row in csv.DictReader(lines)}


def published_speed(source: str | None) -> float | None:
    """Return the speed relative to the Ray Engine that the survey prints, or None."""
    value = table1()[source]["relative_performance"] if source else ""
    return float(value) if value else None


def updated(entry: SurveyedMethod) -> Cell:
    """Return the cell (cell.py) that times a method's update after triangles moved."""
    return Cell(SCENE, entry.method, entry.options, 0, "updates", runs=3)
