"""Trials: the candidates that `tune` measured, and what became of each."""
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
    """A candidate and what was found of it.

    Attributes
    ----------
    rates : rays timed together -> rays per second
    texture_bytes : with 2^18 rays in flight
    finding : against the reference, None where it was not asked
    misses : bound -> how many times too large
    outcome : "chosen", "missed", "slower", "not possible" or "not reached"
    note : why, in words
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
        """At the largest number of rays it was timed with; 0 where it was not."""
        return self.rates[max(self.rates)] if self.rates else 0.0

    def times_slower(self, other: Trial) -> float | None:
        """Than another trial, at the largest number of rays both were timed with."""
        common = set(self.rates) & set(other.rates)
        return other.rates[max(common)] / self.rates[max(common)] if common else None

    def compare(self, chosen: Trial) -> None:
        """Say of a trial that was not judged that it is slower, if it was timed so."""
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
                "misses": self.misses,     # JSON knows no infinity: too few rays to tell
                "t_error": None if found is None or math.isinf(found.t_error) else found.t_error,
                "score": None if found is None else found.score.to_dict()}


@dataclass
class Search:
    """What `tune` found for one sort of rays.

    Attributes
    ----------
    rays_of : "coherent", "incoherent", or "all" where one choice serves both
    promise : of the kinds of rays among them
    rays : each proof took
    trials : fastest on ``SCREEN`` rays first
    chosen : None where the promise cannot be kept
    choice : the same as settings hold it
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
        """The trial that misses its worst bound by least; None where there was none."""
        missed = [t for t in self.trials if t.misses]
        return min(missed, key=lambda t: max(t.misses.values()), default=None)

    def to_dict(self) -> dict[str, Any]:
        return {"rays_of": self.rays_of, "promise": self.promise.to_dict(), "rays": self.rays,
                "seed": self.seed, "notes": self.notes,
                "trials": [t.to_dict() for t in self.trials],
                "chosen": None if self.chosen is None else self.chosen.to_dict()}


@dataclass
class Tuning:
    """What `tune` found: the searches that were made, coherent rays first, and the settings; None
    where a search, the last one then, chose nothing."""

    searches: list[Search]
    settings: Settings | None

    def to_dict(self) -> dict[str, Any]:
        return {"searches": [search.to_dict() for search in self.searches]}
