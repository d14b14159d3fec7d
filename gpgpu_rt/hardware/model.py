"""The cost model: the time of counted work on a card.

Arithmetic and memory work in parallel, so the slower of the two decides. Passes and transfers add
their own time:

    time = max(instructions / issue rate, texels / texel rate, streamed bytes / bandwidth) / share
         + passes x pixels / fill rate + bytes moved / bus.

A SIMD group executes all instructions that any of its fragments needs, so instructions are counted
for whole groups of the card's width. A group skips a side of a branch that no fragment needs, if
this saves more than the cost of the branch; a card without branches executes both sides. Tables
are read through the texture cache, at the texel rate. Streams (rays, state, hits) are read from
memory and written to memory, at the bandwidth.

``share`` is the share of the issue and memory rates that programs reach. It is the only fitted
constant of a card; all other figures are in ``cards.json``.
"""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from .cards import Card


@dataclass(frozen=True)
class Counted:
    """The total work of a call.

    Attributes
    ----------
    instructions : instructions times lanes, including idle lanes
    texels : number of fetched texels
    streamed : bytes of streams read and written
    passes, pixels : number of passes, and number of pixels that each pass covers
    uploaded, read_back : bytes copied to the card and back
    """

    instructions: float = 0.0
    texels: float = 0.0
    streamed: float = 0.0
    passes: float = 0.0
    pixels: float = 0.0
    uploaded: float = 0.0
    read_back: float = 0.0

    def __add__(self, other: Counted) -> Counted:
        return Counted(*(getattr(self, name) + getattr(other, name) for name in (
            "instructions", "texels", "streamed", "passes")), max(self.pixels, other.pixels),
            self.uploaded + other.uploaded, self.read_back + other.read_back)

    def scaled(self, factor: float) -> Counted:
        """Return ``factor`` times the work in the same passes and transfers."""
        return replace(self, instructions=factor * self.instructions,
                       texels=factor * self.texels, streamed=factor * self.streamed)


@dataclass(frozen=True)
class Prediction:
    """Predicted seconds, and their parts before the division by ``share``."""

    seconds: float
    parts: dict[str, float] = field(default_factory=dict)

    @property
    def bound(self) -> str:
        """The name of the largest part."""
        return max(self.parts, key=self.parts.__getitem__)


def predict(card: Card, work: Counted, share: float = 1.0) -> Prediction:
    """Return the predicted time of counted work on a card."""
    rates, over = _parts(card, work)
    return Prediction(max(rates.values()) / share + sum(over.values()), {**rates, **over})


def share_of(card: Card, work: Counted, seconds: float) -> float:
    """Return the share of the card's rates at which the work takes ``seconds``.

    The result is infinite if passes and transfers alone take longer than ``seconds``.
    """
    rates, over = _parts(card, work)
    left = seconds - sum(over.values())
    return max(rates.values()) / left if left > 0 else math.inf


def _parts(card: Card, work: Counted) -> tuple[dict[str, float], dict[str, float]]:
    """Return seconds by part in two mappings. Of the parts in the first, which run in parallel,
    only the slowest counts; the parts in the second add up."""
    return ({"arithmetic": work.instructions / (
        card.scalar_rate if card.scalar_units else card.vector_rate),
        "texels": work.texels / card.texel_rate if work.texels else 0.0,
        "bandwidth": work.streamed / card.bandwidth},
        {"passes": work.passes * work.pixels / (card.pipes * card.clock),
         "transfers": work.uploaded / card.upload + work.read_back / card.readback})


def loop_work(card: Card, work: Mapping[str, Any], width: int | None = None) -> Counted:
    """Return the work of one pass of a program with loops.

    Parameters
    ----------
    card : the card
    work : a mapping. ``regions`` has an entry for each region of the program: ``vector`` and
        ``scalar`` instructions, ``fetches`` by sampler, ``parent`` (the enclosing region) and
        ``loop`` (whether the region is a loop). Its ``runs`` say how often groups ran the region,
        by the width of the groups. The other keys are ``fragments`` (their number),
        ``written_bytes`` per fragment and ``texel_bytes`` by sampler
    width : number of fragments that branch together; None for the card's own number
    """
    width = width or card.branch_width
    kind = "scalar" if card.scalar_units else "vector"
    instructions = texels = 0.0
    streamed = float(work["fragments"] * work["written_bytes"])
    for region in work["regions"]:
        cost, lanes = region[kind], width * region["runs"][str(width)]
        if region["parent"] >= 0 and not region["loop"]:   # a side of a branch
            around = width * work["regions"][region["parent"]]["runs"][str(width)]
            skipped = cost * lanes + card.branch_cost * around if card.branching else math.inf
            instructions += min(skipped, cost * around)
        else:
            instructions += cost * lanes
        fetched = {name: count * region["runs"]["1"] for name, count in region["fetches"].items()}
        texels += sum(fetched.values())
        streamed += _streamed(fetched, work["texel_bytes"])
    return Counted(instructions, texels, streamed, 1)


def kernel_work(work: Mapping[str, Any]) -> Counted:
    """Return the work of passes that run one kernel each, on a card without branches.

    Parameters
    ----------
    work : as for `loop_work`, and with ``kernels`` and ``pixels``. A kernel has ``vector``
        instructions, ``fetches``, ``runs`` (how often fragments run the kernel) and ``passes``
        (their number)
    """
    total = Counted(pixels=work["pixels"])
    for kernel in work["kernels"]:
        fetched = {name: count * kernel["runs"] for name, count in kernel["fetches"].items()}
        streamed = _streamed(fetched, work["texel_bytes"])
        total = total + Counted(
            kernel["vector"] * kernel["runs"], sum(fetched.values()),
            streamed + kernel["runs"] * work["written_bytes"], kernel["passes"], work["pixels"])
    return total


def _streamed(fetched: Mapping[str, float], texel_bytes: Mapping[str, int]) -> float:
    """Return the bytes read from streams; tables are read through the texture cache instead."""
    return sum(count * texel_bytes.get(name, 16) for name, count in fetched.items()
               if not name.endswith("_table"))
