"""Era time: the time that a card of 2002-2006 would have taken for passes that ran here."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..gl.pass_log import PassLog, logged
from ..statistics import Statistics
from ..tracer import Tracer
from .cards import Card, cards
from .issue import KernelIssues
from .machine_model import CardTime, time_of_passes
from .static_costs import compiled_costs, static_cost


@dataclass(frozen=True)
class EraTime:
    """The traversal passes of calls in the era form.

    Attributes
    ----------
    tracer : the tracer, with the option ``era``
    log : the passes
    """

    tracer: Tracer
    log: PassLog

    def on_card(self) -> tuple[Card, CardTime] | None:
        """Return the card and the predicted time of the traversal's passes.

        Passes of shading are not predicted. Return None if the card's figures are not known, or if
        its compiler has not seen these kernels.
        """
        chip, method = str(self.tracer.options["era"]), self.tracer.method
        card = next((one for one in cards() if one.chip.lower() == chip), None)
        own = {o.name: self.tracer.options[o.name] for o in method.options
               if self.tracer.options[o.name] != o.default}
        if card is None or own or not compiled_costs(chip).programs:
            return None
        found = {entry["name"]: entry for entry in self.log.to_list()
                 if entry["name"] in method.kernels}
        names = tuple(found)
        runs = tuple(found[name]["fragments"] for name in names)
        draws = tuple(found[name]["draws"] for name in names)
        issued = KernelIssues(names, runs, runs, passes=draws, queries=self.log.queries)
        costs = {name: static_cost(chip, method.name, name) for name in names}
        buffers = self.tracer.session.buffers.rays
        assert buffers is not None
        return card, time_of_passes(card, issued, costs, buffers.size[0] * buffers.size[1])


@contextmanager
def era_timed(tracer: Tracer) -> Iterator[EraTime]:
    """Log the passes within the block."""
    with tracer.gpu, logged(tracer.gpu, Statistics()) as log:
        yield EraTime(tracer, log)
