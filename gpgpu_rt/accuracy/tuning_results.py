"""Tuning results: the candidates that `tune` measured, and the outcome of each."""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from ..methods.choices import Choice
from ..methods.settings import Settings
from .candidates import Candidate
from .error_targets import Finding, Promise


@dataclass
class Trial:
    """A candidate and its measurements.

    Attributes
    ----------
    rates : Rays per second, by the number of rays that were timed together.
    texture_bytes : Bytes with 2^18 rays in flight.
    finding : Errors against the reference; None if they were not measured.
    misses : For each bound that is not kept, the measured value divided by the bound.
    outcome : "chosen", "missed", "slower", "not possible" or "not reached"
    note : the reason for the outcome, as text
    """

    candidate: Candidate
    rates: dict[int, float] = field(default_factory=dict)
    texture_bytes: int = 0
    finding: Finding | None = None
    misses: dict[str, float] = field(default_factory=dict)
    outcome: str = "not reached"
    note: str = ""

    @property
    def rays_per_second(self) -> float:
        """The rate at the largest number of rays; 0 if the candidate was not timed."""
        return self.rates[max(self.rates)] if self.rates else 0.0

    def times_slower(self, other: Trial) -> float | None:
        """Return how many times slower this trial is than another, at the largest number of rays
        with which both were timed; None if there is no such number.
        """
        common = set(self.rates) & set(other.rates)
        return other.rates[max(common)] / self.rates[max(common)] if common else None

    def compare(self, chosen: Trial) -> None:
        """Set the outcome "slower", or, if this trial was faster than ``chosen``, only note the
        ratio of the rates. The outcome must be "not reached"."""
        slower = self.times_slower(chosen)
        if slower is not None and slower < 1:
            self.note = self.note or f"{1 / slower:.2f} times faster where both were timed"
            return
        self.outcome = "slower"
        if slower is not None:
            self.note = self.note or f"{slower:.2f} times slower"

    def to_dict(self) -> dict[str, Any]:
        found = self.finding
        return {"method": self.candidate.method, "options": dict(self.candidate.options),
                "outcome": self.outcome, "note": self.note,
                "rates": self.rates, "texture_bytes": self.texture_bytes,
                "misses": self.misses,     # t_error is None if infinite: JSON has no infinity
                "t_error": None if found is None or math.isinf(found.t_error) else found.t_error,
                "score": None if found is None else found.score.to_dict()}


@dataclass
class Search:
    """The result of `tune` for coherent, incoherent or all rays.

    Attributes
    ----------
    rays_of : "coherent", "incoherent", or "all" if there is one choice for all rays
    promise : the bounds for the rays of ``rays_of``
    rays : number of rays that prove a candidate's bounds
    seed : seed of all rays
    notes : remarks on the search
    trials : all trials, the fastest on SCREEN rays (tune.py) first
    chosen : the chosen trial; None if no candidate keeps the bounds
    choice : the chosen trial, in the form in which it is saved
    """

    rays_of: str
    promise: Promise
    rays: int
    seed: int
    notes: list[str]
    trials: list[Trial]
    chosen: Trial | None
    choice: Choice | None

    @property
    def closest(self) -> Trial | None:
        """The trial that comes nearest to keeping the bounds, by its largest ratio in ``misses``;
        None if no trial missed a bound.
        """
        missed = [t for t in self.trials if t.misses]
        return min(missed, key=lambda t: max(t.misses.values()), default=None)

    def to_dict(self) -> dict[str, Any]:
        return {"rays_of": self.rays_of, "promise": self.promise.to_dict(), "rays": self.rays,
                "seed": self.seed, "notes": self.notes,
                "trials": [t.to_dict() for t in self.trials],
                "chosen": None if self.chosen is None else self.chosen.to_dict()}


@dataclass
class Tuning:
    """The result of `tune`: its searches, coherent rays first, and the settings.

    If a search chooses no candidate, `tune` ends with this search, and the settings are None.
    """

    searches: list[Search]
    settings: Settings | None

    def to_dict(self) -> dict[str, Any]:
        return {"searches": [search.to_dict() for search in self.searches]}
