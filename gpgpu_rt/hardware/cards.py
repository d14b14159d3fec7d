"""The graphics cards of the survey: what each could do, and which programs it could run at all."""
from __future__ import annotations

import functools
import importlib.resources
import json
import math
from dataclasses import dataclass
from typing import Any

from ..errors import OptionError, nearest_names
from .program import Program


@dataclass(frozen=True)
class Needs:
    """What a program asks of a card.

    Attributes
    ----------
    arithmetic, textures : instructions of the text
    dependent_reads : levels of fetches whose place comes from a fetch
    loops : whether it loops
    targets : render targets
    texture_size : texels a side of its largest table, were that a square
    largest_index : texels of it, which an index must tell apart
    floats : whether it stands on float textures
    queries : whether its host counts rays by occlusion queries
    counted : whether ``arithmetic``, ``textures``, ``dependent_reads`` and ``loops`` are known
    """

    arithmetic: int = 0
    textures: int = 0
    dependent_reads: int = 0
    loops: bool = False
    targets: int = 1
    texture_size: int = 0
    largest_index: int = 0
    floats: bool = True
    queries: bool = False
    counted: bool = True

    @classmethod
    def of(cls, program: Program | None, targets: int, texels: int = 0,
           queries: bool = False) -> Needs:
        """The needs of a compiled program, or of one that cannot be counted, whose largest table
        has so many texels."""
        counts = (0, 0, 0, False) if program is None else (
            sum(work.vector for work in program.work),
            sum(sum(work.fetches.values()) for work in program.work),
            program.dependent_reads, bool(program.loops))
        return cls(*counts, targets, math.isqrt(max(texels - 1, 0)) + 1, texels, True, queries,
                   program is not None)


@dataclass(frozen=True)
class Refusal:
    """Why a card cannot run a program: which limit in a word or two, and a sentence."""

    limit: str
    says: str


@dataclass(frozen=True)
class Sourced:
    """What has figures, each with its source; by name they are attributes too: ``card.clock``."""

    name: str
    chip: str
    year: int
    figures: dict[str, dict[str, Any]]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self.figures:
            raise AttributeError(name)
        return self.figures[name]["value"]


@dataclass(frozen=True)
class Card(Sourced):
    """A graphics card."""

    def refuses(self, needs: Needs) -> list[Refusal]:
        """Why it cannot run such a program: nothing where it can."""
        limits = (("slots", "arithmetic_slots", needs.arithmetic, "arithmetic instructions"),
                  ("fetches", "texture_slots", needs.textures, "fetches in the text"),
                  ("dependent", "dependent_reads", needs.dependent_reads,
                   "levels of dependent fetches"),
                  ("targets", "render_targets", needs.targets, "render targets"),
                  ("size", "texture_size", needs.texture_size, "texels a side"),
                  ("index", "exact_integers", needs.largest_index, "texels to index"))
        reasons = [Refusal(limit, f"{wanted:,} {what}, it has {getattr(self, name):,}")
                   for limit, name, wanted, what in limits if wanted > getattr(self, name)]
        if needs.loops and not self.branching:
            reasons.insert(0, Refusal("loops", "loops, it has no branches"))
        if needs.floats and not self.float_textures:
            reasons.insert(0, Refusal("floats", f"float textures, it has {self.precision}"))
        if needs.queries and not self.occlusion_query:
            reasons.append(Refusal("queries", "occlusion queries"))
        return reasons

    def to_dict(self) -> dict[str, Any]:
        """Name, chip, year and every figure with its unit and source."""
        return {"name": self.name, "chip": self.chip, "year": self.year, "figures": self.figures}


@functools.cache
def cards() -> tuple[Card, ...]:
    """The cards in the order of their years."""
    text = (importlib.resources.files("gpgpu_rt.hardware") / "cards.json").read_text()
    return tuple(Card(**row) for row in json.loads(text)["cards"])


def find_card(name: str) -> Card:
    """A card by its name, or by its chip's; OptionError where there is none."""
    for card in cards():
        if name in (card.name, card.chip):
            return card
    raise OptionError(f"no card {name!r}" + nearest_names(name, [c.chip for c in cards()]))
