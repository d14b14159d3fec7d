"""Era packet time: predicts how long a card that runs loops would take for packets traced here.

One pass runs the whole loop over packets, so passes do not show how often each kernel of the loop
ran. Therefore the pass's rays are traced again, step by step.
"""
from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..gl.observation import ObservedPass, Observer
from ..gl.textures import read_texture
from ..rays.records import RAY_TEXELS
from ..tracer import Tracer
from ..traversal.era_packets import LOOP
from ..traversal.packets import packet_of
from . import packet_trace
from .cards import Card
from .issue import GROUPS, WHILE_WHILE, WITHIN, issued_in_loop
from .loop_costs import setup_slots
from .machine_model import CardTime, host_time, stream_fetches, time_of_loop
from .static_costs import static_cost
from .trace import record_trace

TILE, TILES = 48, 2     # least side of a tile, in packets; number of tiles along an axis


@dataclass(frozen=True)
class _Traced:
    """The rays of a pass over packets. ``texels``, (h, w, 2, 4), holds the tiles to trace again,
    side by side. ``share`` is the fraction of the pass's rays in the tiles."""

    any_hit: bool
    texels: np.ndarray
    share: float
    pixels: int


class PacketRays(Observer):
    """Keeps the rays of each pass over packets."""

    def __init__(self, tracer: Tracer) -> None:
        self.tracer = tracer
        self.passes: list[_Traced] = []

    def passed(self, one: ObservedPass) -> None:
        if one.kernel != LOOP:
            return
        across, down = packet_of(self.tracer.options)
        group = GROUPS[str(self.tracer.options["era"]).upper()]
        assert group is not None
        texels = np.stack([read_texture(one.inputs[f"{RAY_TEXELS.name}_texel_{k}"])
                           for k in range(RAY_TEXELS.texels)], axis=2)
        height, width = texels.shape[:2]
        rows, columns = _sampled(height, down, group[0]), _sampled(width, across, group[1])
        self.passes.append(_Traced("#define ANY_HIT\n" in one.texts[1], texels[rows][:, columns],
                                   len(rows) * len(columns) / (height * width), height * width))

    def time_on(self, card: Card) -> CardTime:
        """Return the predicted time of all passes.

        Raises
        ------
        OptionError
            if the kernels were not compiled for the card
        """
        tracer, method = self.tracer, self.tracer.method
        own = {option.name: tracer.options[option.name] for option in method.options}
        total = host_time(card, 0)
        with Tracer(tracer.scene, method.name, schedule="step", intersection="moller-trumbore",
                    context=tracer.options["context"], **own) as stepper:
            for one in self.passes:
                total += _time_of(card, stepper, one, own)
        return total


def _sampled(side: int, packet: int, group: int) -> np.ndarray:
    """Return which rows (or columns) of an image are traced again.

    Trace all of a small image. Divide the axis of a large image into TILES parts, and trace a tile
    in the middle of each part. A tile holds whole groups. The packets of a group branch together.
    """
    tile = -(-TILE // group) * group * packet
    if side <= TILES * tile:
        return np.arange(side)
    starts = ((2 * np.arange(TILES) + 1) * side // (2 * TILES) - tile // 2) // packet * packet
    return (starts[:, None] + np.arange(tile)).reshape(-1)


def _time_of(card: Card, tracer: Tracer, one: _Traced, own: dict[str, Any]) -> CardTime:
    flat = one.texels.reshape(-1, 2, 4)
    trace = tracer.occluded if one.any_hit else tracer.trace
    stack = bool(own["stack_size"])
    steps = packet_trace.in_loop(record_trace(
        tracer, one.texels.shape[:2],
        lambda: trace(flat[:, 0, :3], flat[:, 1, :3], t_min=flat[:, 0, 3], t_max=flat[:, 1, 3],
                      shape=one.texels.shape[:2]),
        packet_trace.fields_of(stack)), stack)
    group = GROUPS[card.chip]
    assert group is not None
    issued = issued_in_loop(steps, group, WHILE_WHILE, WITHIN)
    whole = replace(issued, runs=tuple(round(runs / one.share) for runs in issued.runs),
                    lanes=tuple(round(lanes / one.share) for lanes in issued.lanes),
                    iterations=round(issued.iterations / one.share))
    costs = {name: static_cost(card.chip.lower(), tracer.method.name, name, one.any_hit, True,
                               **own) for name in issued.kernels}
    streams = {name: stream_fetches(tracer.method.name, name, one.any_hit, **own)
               for name in issued.kernels}
    setup = setup_slots(card.chip.lower(), tracer.method.name, one.any_hit, **own)
    return time_of_loop(card, whole, costs, streams, one.pixels, setup=setup)
