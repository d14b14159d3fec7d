"""Era time: predicts how long a card of 2002-2006 would take for rays that were traced here."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..errors import OptionError
from ..tracer import Tracer
from .cards import Card, Refusal, find_card
from .era_rays import KeptRays
from .image_issues import count_issues
from .issue import WHILE_WHILE
from .machine_model import CardTime
from .methods_on_cards import ERA, era_refusals, era_size
from .prediction import checked_form, time_of_image
from .program_forms import PASSES


@dataclass(frozen=True)
class EraTime:
    """The rays of a tracer that runs an era form (docs/era.md).

    Attributes
    ----------
    tracer : the tracer, with the option ``era``
    kept : the observer that keeps samples of the rays of each call
    """

    tracer: Tracer
    kept: KeptRays

    @property
    def ran(self) -> str:
        """The form in which the kernels ran here."""
        return WHILE_WHILE if self.tracer.method.era_packets is not None else PASSES

    @cached_property
    def forms(self) -> tuple[str, ...]:
        """The card's usual form, and the form in which the kernels ran here if it differs.

        The figures compare times in the usual form with the papers' times.

        Raises
        ------
        OptionError
            if no time is predicted for the method on the card, as for a user's own method
        """
        usual = checked_form(self.card, self.tracer.method.name)
        return tuple(dict.fromkeys((usual, self.ran)))

    @property
    def rays(self) -> tuple[str, ...]:
        """The kinds of rays that were traced, in words."""
        words = {False: "eye rays and other nearest-hit rays", True: "shadow rays"}
        return tuple(words[any_hit] for any_hit in sorted(self.kept.pixels))

    @property
    def card(self) -> Card:
        return find_card(str(self.tracer.options["era"]))

    @cached_property
    def refusals(self) -> list[Refusal]:
        """Why the card could not have run the kernels; empty if it could."""
        method = self.tracer.method.name
        return era_refusals(self.card, {method: era_size(self.tracer)})[method, ERA]

    def on_card(self, form: str | None = None) -> CardTime:
        """Return the predicted time of the traversal's passes, without shading.

        Parameters
        ----------
        form : a form of `program_forms`; None for the first of ``forms``

        Raises
        ------
        OptionError
            if the kernels were not compiled for the card, the card could not have run them, no
            rays were traced, or ``form`` is not in ``forms``
        """
        if not self.kept.calls:
            raise OptionError("no rays were traced, so no time is predicted; trace rays inside "
                              "`with era_timed(tracer)`")
        form = form or self.forms[0]
        if form not in self.forms:
            raise OptionError(f"no time is predicted for form {form!r}; give one of "
                              + ", ".join(map(repr, self.forms)))
        method, card = self.tracer.method.name, self.card
        if self.refusals:
            raise OptionError(f"the {card.name} could not have run the method, which "
                              f"{self.refusals[0].says}")
        times = [time_of_image(card, method, form, counts, any_hit,
                               options=tuple(self._own.items()))
                 .scaled(1 / self.kept.share(any_hit)) for any_hit, counts in self._counts]
        return sum(times[1:], start=times[0])

    @cached_property
    def _counts(self) -> list[tuple[bool, dict[str, Any]]]:
        """Whether any hit is enough, and the result of `count_issues`, for each kept call."""
        options = {**self._own, "context": self.tracer.options["context"]}
        return [(one.any_hit, count_issues(self.tracer.scene, one.samples, self.tracer.method.name,
                                           options, self.card.chip, self.forms))
                for one in self.kept.calls]

    @property
    def _own(self) -> dict[str, Any]:
        """The options of the tracer's method."""
        return {option.name: self.tracer.options[option.name]
                for option in self.tracer.method.options}


@contextmanager
def era_timed(tracer: Tracer) -> Iterator[EraTime]:
    """Keep samples of the rays that the tracer traces in the block."""
    kept = KeptRays(tracer)
    with tracer.gpu, tracer.gpu.observed(kept):
        yield EraTime(tracer, kept)
