"""Machine model: predicts a card's time for the kernels that it issues, without fitted constants.

A kernel computes, fetches texels of tables, and moves its streams (ray, state and hit). A card
does the three in parallel, so the slowest decides:

    time = lanes * max(instructions / issue rate, fetches / texel rate, bytes / bandwidth).

On NV40, fetches occupy slots of the arithmetic (``fetches_beside`` of cards.json), so the first
two terms are added. The texels of a stream are not in the texture cache, so a pass fetches them at
a lower rate (``stream_fetch``). ``lanes`` includes idle lanes (issue.py). `host_time` gives the
time that each pass and each occlusion query adds. All rates come from cards.json; `Assumptions`
holds the numbers without a source. The model ignores cache misses, and assumes enough fragments in
flight to hide the latency of fetches.
"""
from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from ..rays.records import RAY_TEXELS
from .cards import Card
from .issue import KernelIssues
from .nv40_pairing import arithmetic_of, clocks
from .static_costs import StaticCost, static_cost

_LISTED, _OWN_FETCH = "nv40", re.compile(r"TEX \S+, IN\[")
# On the 8800 GTX, an uncoalesced load of CUDA takes as long as a transfer of this many bytes at
# the memory's peak rate. Loads of 16, 8 and 4 bytes reach about a half, a quarter and a tenth of
# the peak (CUDA Programming Guide 1.0, performance guidelines; quoted from memory).
UNCOALESCED_BYTES = 32.0
SHARES = ("arithmetic", "texture", "bandwidth", "waiting lanes", "passes", "queries")


@dataclass(frozen=True)
class Assumptions:
    """The numbers of the model that no source states, the same for all cards.

    Attributes
    ----------
    draw_seconds : the host's time for a draw call with a change of target
    query_seconds : the time until the host has an occlusion query's result and continues
    branch_instructions : instruction slots of a loop's branch to a kernel, on cards without a unit
        for branches
    texel_bytes : bytes of a stream's texel; the papers' streams are RGBA32F
    """

    draw_seconds: float = 15e-6
    query_seconds: float = 50e-6
    branch_instructions: float = 6.0
    texel_bytes: float = 16.0

    def varied(self) -> dict[str, tuple[Assumptions, Assumptions]]:
        """Return name -> two sets of assumptions: with the named number halved, and doubled."""
        return {one.name: (replace(self, **{one.name: getattr(self, one.name) / 2}),
                           replace(self, **{one.name: getattr(self, one.name) * 2}))
                for one in fields(self)}


ASSUMED = Assumptions()


@dataclass(frozen=True)
class CardTime:
    """A predicted time, divided into parts.

    Attributes
    ----------
    parts : name of SHARES -> seconds. The time of a kernel's working lanes is listed under the
        part that bounds the kernel. The time of its idle lanes is listed under "waiting lanes"
    """

    parts: Mapping[str, float]

    @property
    def seconds(self) -> float:
        return sum(self.parts.values())

    @property
    def spent(self) -> dict[str, float]:
        """Name -> seconds of each part that takes time."""
        return {name: seconds for name, seconds in self.parts.items() if seconds}

    @property
    def shares(self) -> str:
        """The share of each part in words, the largest first."""
        return ", ".join(f"{name} {part / self.seconds:.0%}" for name, part in sorted(
            self.spent.items(), key=lambda one: -one[1]))

    def __add__(self, other: CardTime) -> CardTime:
        return CardTime({name: self.parts[name] + other.parts[name] for name in SHARES})

    def scaled(self, factor: float) -> CardTime:
        return CardTime({name: factor * seconds for name, seconds in self.parts.items()})


def stream_fetches(method: str, kernel: str, any_hit: bool = False, in_loop: bool = True,
                   card: str = _LISTED, **options: Any) -> int:
    """Return how many fetches of a kernel, in the form for a card, read the ray, its state and its
    hit.

    NV40's listing shows these fetches: their coordinates are an input of the fragment. No card's
    compiler removes such a fetch, so the number holds for all cards. A loop keeps ray, state and
    hit in registers, so `time_of_loop` subtracts the number from a kernel's fetches.
    """
    cost = static_cost(_LISTED, method, kernel, any_hit, in_loop, card, **options)
    return len(_OWN_FETCH.findall(cost.listing))


def issue_slots(cost: StaticCost) -> int:
    """Return the number of issue slots of a kernel's arithmetic: a pipe's clocks on NV40
    (`nv40_pairing`), the instructions on other cards."""
    if cost.card != _LISTED or not cost.listing:
        return cost.arithmetic
    # The driver adds copy instructions that the listing lacks. Each of them is issued alone.
    copies = cost.arithmetic - len(arithmetic_of(cost.listing))
    return clocks(cost.listing) + max(copies, 0)


def time_of_passes(card: Card, issued: KernelIssues, costs: Mapping[str, StaticCost],
                   streams: Mapping[str, int], pixels: int,
                   assumed: Assumptions = ASSUMED) -> CardTime:
    """Predict the time of passes that run one kernel each.

    Parameters
    ----------
    issued : the issues, from `issue.issued_in_passes`
    costs : the cost of each kernel of ``issued``
    streams : number of stream fetches by kernel (`stream_fetches`)
    pixels : number of pixels of the image. Each pass covers all pixels, and the early depth test
        rejects the pixels outside the issued lanes
    """
    total = host_time(card, issued.queries, sum(issued.passes), pixels, assumed)
    for runs, lanes, kernel in zip(issued.runs, issued.lanes, issued.kernels):
        cost = costs[kernel]
        read = streams[kernel]
        fetches = cost.fetches - read + card.stream_fetch * read
        moved = (read + cost.targets) * assumed.texel_bytes
        total += _kernel_time(card, issue_slots(cost), fetches, moved, runs, lanes)
    return total


def time_of_loop(card: Card, issued: KernelIssues, costs: Mapping[str, StaticCost],
                 streams: Mapping[str, int], pixels: int, assumed: Assumptions = ASSUMED,
                 sharing: int = 1, uncoalesced: bool = False, setup: float = 0) -> CardTime:
    """Predict the time of a pass with a loop, which keeps ray, state and hit in registers.

    Parameters
    ----------
    issued : the issues, from `issue.issued_in_loop`
    costs : the cost of each kernel in a loop
    streams : `stream_fetches` of each kernel; a loop does not make these fetches
    pixels : number of pixels of the image, all covered by the pass
    sharing : number of lanes that share one load of a table's texel
    uncoalesced : whether each run of a kernel loads its texels from memory, without the texture
        units and their cache
    setup : instruction slots per pixel before and after the loop (`loop_costs.setup_slots`)
    """
    branch = 0.0 if card.branch_unit else assumed.branch_instructions
    total = _kernel_time(card, branch, 0, 0, issued.iterations, issued.iterations)
    total += _kernel_time(card, setup, card.stream_fetch * RAY_TEXELS.texels,
                          (RAY_TEXELS.texels + 1) * assumed.texel_bytes, pixels, pixels)
    total += _parts(passes=assumed.draw_seconds)
    for runs, lanes, kernel in zip(issued.runs, issued.lanes, issued.kernels):
        cost = costs[kernel]
        fetches, moved = (cost.fetches - streams[kernel]) / sharing, 0.0
        if uncoalesced:
            # `_kernel_time` counts `moved` in every lane, but waiting lanes load nothing. So scale
            # `moved` by the share of working lanes.
            fetches, moved = 0.0, fetches * UNCOALESCED_BYTES * runs / max(lanes, 1)
        total += _kernel_time(card, issue_slots(cost) + branch, fetches, moved, runs, lanes)
    return total


def host_time(card: Card, queries: int, passes: int = 0, pixels: int = 0,
              assumed: Assumptions = ASSUMED) -> CardTime:
    """Predict the time that passes and occlusion queries over ``pixels`` pixels add: the host's
    time, the time of rejecting pixels by depth, and the time in which queries count rays.

    The depth test of a pass is for equality (traversal/schedules.py). Hierarchical depth buffers
    do not support this test, so the card tests each pixel. A query's pass fetches the state of
    each pixel, and writes a depth that marks the rays waiting for a kernel (classify.frag). The
    early depth test rejects no pixel of this pass, because its program uses ``discard``.
    """
    rejected = passes * pixels / card.depth_rate
    marked = queries * pixels * card.stream_fetch / card.texel_rate
    return _parts(passes=assumed.draw_seconds * (passes + queries) + rejected,
                  queries=assumed.query_seconds * queries + marked)


def _kernel_time(card: Card, instructions: float, fetches: float, moved: float, runs: float,
                 lanes: float) -> CardTime:
    each = {"arithmetic": instructions / card.issue_rate, "texture": fetches / card.texel_rate,
            "bandwidth": moved / card.bandwidth}
    bound = {max(each, key=each.__getitem__)}
    if not card.fetches_beside:
        shader = {"arithmetic", "texture"}
        slowest = sum(each[name] for name in shader) >= each["bandwidth"]
        bound = shader if slowest else {"bandwidth"}
    whole = sum(each[name] for name in bound)
    return _parts(**{name: each[name] * runs for name in bound},
                  **{"waiting lanes": whole * (lanes - runs)})


def _parts(**seconds: float) -> CardTime:
    return CardTime({name: float(seconds.get(name, 0.0)) for name in SHARES})
