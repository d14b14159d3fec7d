"""Era time: predicts how long a card of 2002-2006 would take for passes that ran here."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..errors import OptionError
from ..gl.pass_log import PassLog, logged
from ..statistics import Statistics
from ..tracer import Tracer
from .cards import Card, find_card
from .era_packet_time import PacketRays
from .issue import KernelIssues
from .machine_model import CardTime, host_time, stream_fetches, time_of_passes
from .methods_on_cards import ERA, era_refusals
from .static_costs import static_cost


@dataclass(frozen=True)
class EraTime:
    """The passes of a tracer that runs an era form (docs/era.md).

    Attributes
    ----------
    tracer : the tracer, with the option ``era``
    log : the passes
    packets : the observer that keeps the rays of packet passes
    """

    tracer: Tracer
    log: PassLog
    packets: PacketRays

    def on_card(self) -> tuple[Card, CardTime]:
        """Return the card and the predicted time of the traversal's passes, without shading.

        Raises
        ------
        OptionError
            if the kernels were not compiled for the card, or the card could not have run them
        """
        chip, method = str(self.tracer.options["era"]), self.tracer.method
        card = find_card(chip.upper())
        tables = self.tracer.session.tables.samplers().values()
        most = max(texture.width * texture.height for texture in tables)
        if refused := era_refusals(card, {method.name: most})[method.name, ERA]:
            raise OptionError(f"the {card.name} could not have run the method, which "
                              f"{refused[0].says}")
        if method.era_packets is not None:
            return card, self.packets.time_on(card)
        own = {o.name: self.tracer.options[o.name] for o in method.options}
        buffers = self.tracer.session.buffers.rays
        assert buffers is not None
        pixels = buffers.size[0] * buffers.size[1]
        time = host_time(card, self.log.queries, pixels=pixels)
        self.log.to_list()      # reads the counts of occlusion queries
        for (name, texts), work in self.log.passes.items():
            if name in method.kernels:
                any_hit = "#define ANY_HIT\n" in texts[1]
                cost = static_cost(chip, method.name, name, any_hit, **own)
                issued = KernelIssues((name,), (work.fragments,), (work.fragments,),
                                      passes=(work.draws,))
                streams = stream_fetches(method.name, name, any_hit, False, **own)
                time += time_of_passes(card, issued, {name: cost}, {name: streams}, pixels)
        return card, time


@contextmanager
def era_timed(tracer: Tracer) -> Iterator[EraTime]:
    """Log the tracer's passes in the block."""
    packets = PacketRays(tracer)
    with tracer.gpu, logged(tracer.gpu, Statistics()) as log, tracer.gpu.observed(packets):
        yield EraTime(tracer, log, packets)
