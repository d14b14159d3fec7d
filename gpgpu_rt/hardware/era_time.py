"""Era time: predicts how long a card of 2002-2006 would take for passes that ran here."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

from ..errors import OptionError
from ..gl.pass_log import PassLog, logged
from ..statistics import Statistics
from ..tracer import Tracer
from .cards import INDEX, Card, Refusal, find_card
from .era_packet_time import time_of_packets
from .era_rays import ANY_HIT, KeptRays
from .issue import KernelIssues, issued_in_passes
from .machine_model import CardTime, host_time, stream_fetches, time_of_passes
from .methods_on_cards import ERA, era_refusals
from .static_costs import static_cost

# (any_hit, kernel) -> runs of the kernel and occupied lanes, per fragment that ran its program.
_Occupied = dict[tuple[bool, str], tuple[float, float]]


@dataclass(frozen=True)
class EraTime:
    """The passes of a tracer that runs an era form (docs/era.md).

    Attributes
    ----------
    tracer : the tracer, with the option ``era``
    log : the passes
    kept : the observer that keeps the rays of each call
    """

    tracer: Tracer
    log: PassLog
    kept: KeptRays

    @property
    def form(self) -> str:
        """The form of the card's program, in words."""
        return ("packets in one loop" if self.tracer.method.era_packets is not None
                else "one kernel per pass")

    @property
    def rays(self) -> tuple[str, ...]:
        """The kinds of rays that were traced, in words."""
        words = {False: "eye rays and other nearest-hit rays", True: "shadow rays"}
        return tuple(words[any_hit] for any_hit in sorted(self.kept.kinds))

    @cached_property
    def refusals(self) -> list[Refusal]:
        """Why the card could not have run the kernels; empty if it could."""
        method = self.tracer.method.name
        tables = self.tracer.session.tables.samplers().values()
        most = max(texture.width * texture.height for texture in tables)
        return era_refusals(self._card, {method: most})[method, ERA]

    @property
    def _card(self) -> Card:
        return find_card(str(self.tracer.options["era"]).upper())

    def on_card(self) -> tuple[Card, CardTime]:
        """Return the card and the predicted time of the traversal's passes, without shading.

        If the only reason in ``refusals`` is the limit INDEX, the time is that of kernels that
        address texels by two coordinates, as in the papers, at no further cost.

        Raises
        ------
        OptionError
            if the kernels were not compiled for the card, or the card could not have run them
        """
        chip, method, card = str(self.tracer.options["era"]), self.tracer.method, self._card
        for refused in self.refusals:
            if refused.limit != INDEX:
                raise OptionError(f"the {card.name} could not have run the method, which "
                                  f"{refused.says}")
        if method.era_packets is not None:
            return card, time_of_packets(card, self.kept)
        own = self.kept.own
        buffers = self.tracer.session.buffers.rays
        assert buffers is not None
        pixels = buffers.size[0] * buffers.size[1]
        time, occupied = host_time(card, self.log.queries, pixels=pixels), self._occupied()
        self.log.to_list()      # reads the counts of occlusion queries
        for (name, texts), work in self.log.passes.items():
            if name in method.kernels:
                any_hit = ANY_HIT in texts[1]
                cost = static_cost(chip, method.name, name, any_hit, **own)
                runs, lanes = (round(work.fragments * share)
                               for share in occupied.get((any_hit, name), (1.0, 1.0)))
                issued = KernelIssues((name,), (runs,), (lanes,), passes=(work.draws,))
                streams = stream_fetches(method.name, name, any_hit, False, **own)
                time += time_of_passes(card, issued, {name: cost}, {name: streams}, pixels)
        return card, time

    def _occupied(self) -> _Occupied:
        """Return the runs and the lanes of each kernel, per fragment that ran its program.

        A fragment here is a pixel that waited for the kernel during the last queries. The card
        issues whole quads, and a ray may need another kernel before the next queries, so some
        lanes wait. With a single kernel (brute force), nearly all rays run in every pass.
        """
        if len(self.tracer.method.kernels) == 1:
            return {}
        counts: dict[tuple[bool, str], list[float]] = {}
        with self.kept.stepper() as stepper:
            for one in self.kept.calls:
                trace = one.record(stepper)
                quads, single = issued_in_passes(trace), issued_in_passes(trace, block=(1, 1))
                for name, *found in zip(quads.kernels, quads.runs, quads.lanes, single.lanes):
                    sums = counts.setdefault((one.any_hit, name), [0.0, 0.0, 0.0])
                    sums[:] = [old + new / one.share for old, new in zip(sums, found)]
        return {key: (runs / fragments, lanes / fragments)
                for key, (runs, lanes, fragments) in counts.items() if fragments}


@contextmanager
def era_timed(tracer: Tracer) -> Iterator[EraTime]:
    """Log the tracer's passes in the block."""
    kept = KeptRays(tracer)
    with tracer.gpu, logged(tracer.gpu, Statistics()) as log, tracer.gpu.observed(kept):
        yield EraTime(tracer, log, kept)
