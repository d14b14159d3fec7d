"""The time that a card takes for counted work.

Arithmetic and memory go on at once, so the slower one counts; passes and transfers come on top:

    time = max(instructions / issue rate, texels / texel rate, streamed bytes / bandwidth) / share
         + passes x pixels / fill rate + bytes moved / bus

Fragments bound together run what any of them wants: instructions are those of whole groups at the
card's width. A side of a branch is skipped where no fragment of a group wants it, if that spares
more than the branch costs; a card without branches runs both sides. Tables come from the texture
cache at the texel rate, streams (rays, state, hits) from memory.

``share``, how much of the issue and memory rates programs reach, is the one constant of a card
that is fitted; everything else is read or stated in ``cards.json``.
"""
from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from .cards import Card


@dataclass(frozen=True)
class Counted:
    """Work in total.

    Attributes
    ----------
    instructions : lanes times instructions, those that wait among them
    texels : fetched
    streamed : bytes of streams read and written
    passes, pixels : passes, and the pixels that each covers
    uploaded, read_back : bytes over the bus
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
        """The same passes and transfers with so many times the work in them."""
        return replace(self, instructions=factor * self.instructions,
                       texels=factor * self.texels, streamed=factor * self.streamed)


@dataclass(frozen=True)
class Prediction:
    """Seconds, and what they are made of before ``share`` is taken into account."""

    seconds: float
    parts: dict[str, float] = field(default_factory=dict)

    @property
    def bound(self) -> str:
        """What decides."""
        return max(self.parts, key=self.parts.__getitem__)


def predict(card: Card, work: Counted, share: float = 1.0) -> Prediction:
    """The time of counted work on a card."""
    rates, over = _parts(card, work)
    return Prediction(max(rates.values()) / share + sum(over.values()), {**rates, **over})


def share_of(card: Card, work: Counted, seconds: float) -> float:
    """The share of the card's rates at which counted work takes so long; infinity where its passes
    and transfers alone take longer."""
    rates, over = _parts(card, work)
    left = seconds - sum(over.values())
    return max(rates.values()) / left if left > 0 else math.inf


def _parts(card: Card, work: Counted) -> tuple[dict[str, float], dict[str, float]]:
    """Seconds by what they are of: of those the slowest counts, and all of these."""
    return ({"arithmetic": work.instructions / (
        card.scalar_rate if card.scalar_units else card.vector_rate),
        "texels": work.texels / card.texel_rate if work.texels else 0.0,
        "bandwidth": work.streamed / card.bandwidth},
        {"passes": work.passes * work.pixels / (card.pipes * card.clock),
         "transfers": work.uploaded / card.upload + work.read_back / card.readback})


def loop_work(card: Card, work: Mapping[str, Any], width: int | None = None) -> Counted:
    """The work of one pass of a program that loops.

    Parameters
    ----------
    work : ``regions``, of each ``vector`` and ``scalar`` instructions, ``fetches`` by sampler,
        ``parent``, whether it is a ``loop``, and ``runs`` of groups by width; ``fragments``, and
        ``written_bytes`` of each; ``texel_bytes`` by sampler
    width : fragments that branch alike, where those are not the card's lanes
    """
    width = width or card.branch_width
    kind = "scalar" if card.scalar_units else "vector"
    instructions = texels = 0.0
    streamed = float(work["fragments"] * work["written_bytes"])
    for region in work["regions"]:
        cost, lanes = region[kind], width * region["runs"][str(width)]
        if region["parent"] >= 0 and not region["loop"]:   # a side of a branch: skipped or not
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
    """The work of passes of one kernel each, on a card without branches.

    Parameters
    ----------
    work : as of `loop_work`, and ``kernels``, of each ``vector`` instructions, ``fetches``, how
        often a fragment ``runs`` it and in how many ``passes``
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
    """Bytes of what is no table: those are read through the texture cache."""
    return sum(count * texel_bytes.get(name, 16) for name, count in fetched.items()
               if not name.endswith("_table"))
