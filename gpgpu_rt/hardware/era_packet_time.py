"""Era packet time: predicts how long a card that runs loops would take for packets traced here.

One pass runs the whole loop over packets, so passes do not show how often each kernel of the loop
ran. Therefore the pass's rays are traced again, step by step (`era_rays`).
"""
from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..tracer import Tracer
from . import packet_trace
from .cards import Card
from .era_rays import KeptCall, KeptRays
from .issue import GROUPS, WHILE_WHILE, WITHIN, issued_in_loop
from .loop_costs import setup_slots
from .machine_model import CardTime, host_time, stream_fetches, time_of_loop
from .static_costs import static_cost


def time_of_packets(card: Card, kept: KeptRays) -> CardTime:
    """Return the predicted time of all passes over packets.

    Raises
    ------
    OptionError
        if the kernels were not compiled for the card
    """
    total = host_time(card, 0)
    with kept.stepper() as stepper:
        for one in kept.calls:
            total += _time_of(card, stepper, one, kept.own)
    return total


def _time_of(card: Card, stepper: Tracer, one: KeptCall, own: dict[str, Any]) -> CardTime:
    stack = bool(own["stack_size"])
    steps = packet_trace.in_loop(one.record(stepper, packet_trace.fields_of(stack)), stack)
    group = GROUPS[card.chip]
    assert group is not None
    issued = issued_in_loop(steps, group, WHILE_WHILE, WITHIN)
    whole = replace(issued, runs=tuple(round(runs / one.share) for runs in issued.runs),
                    lanes=tuple(round(lanes / one.share) for lanes in issued.lanes),
                    iterations=round(issued.iterations / one.share))
    costs = {name: static_cost(card.chip.lower(), stepper.method.name, name, one.any_hit, True,
                               **own) for name in issued.kernels}
    streams = {name: stream_fetches(stepper.method.name, name, one.any_hit, **own)
               for name in issued.kernels}
    setup = setup_slots(card.chip.lower(), stepper.method.name, one.any_hit, **own)
    return time_of_loop(card, whole, costs, streams, one.pixels, setup=setup)
