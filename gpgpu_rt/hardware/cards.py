"""The graphics cards of Hachisuka's survey: their figures, and the programs that they can run."""
from __future__ import annotations

import functools
import importlib.resources
import json
from dataclasses import dataclass
from typing import Any

from ..errors import OptionError


@dataclass(frozen=True)
class Needs:
    """The requirements of a program on a card.

    Attributes
    ----------
    arithmetic, textures : numbers of arithmetic instructions and of fetches; 0 if no card's
        compiler has compiled the program
    dependent_reads : levels of fetches whose coordinates depend on another fetch; 0 if no card's
        compiler has compiled the program
    loops : whether the program has loops
    targets : number of render targets
    texture_size : side of the largest table in texels, if the table were square
    largest_index : largest number that one float must hold exactly: the number of texels of the
        largest table, or `EraSize.numbers` if pointers are columns and rows
    floats : whether the program needs float textures
    queries : whether the host counts rays by occlusion queries
    arrays : whether the program indexes a local array
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
    arrays: bool = False


@dataclass(frozen=True)
class Refusal:
    """Why a card cannot run a program: a word for the limit, and a sentence."""

    limit: str
    says: str


@dataclass(frozen=True)
class Sourced:
    """A card or machine whose figures have sources. A figure's value is an attribute, such as
    ``card.clock``."""

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
    def refuses(self, needs: Needs) -> list[Refusal]:
        """Return why the card cannot run a program; empty if it can."""
        limits = (("slots", "arithmetic_slots", needs.arithmetic, "arithmetic instructions"),
                  ("fetches", "texture_slots", needs.textures, "texture fetches"),
                  ("dependent", "dependent_reads", needs.dependent_reads,
                   "levels of dependent fetches"),
                  ("targets", "render_targets", needs.targets, "render targets"),
                  ("size", "texture_size", needs.texture_size, "texels per side"),
                  ("index", "exact_integers", needs.largest_index, "exact integers"))
        reasons = [Refusal(limit, f"needs {wanted:,} {what}, the card has "
                           f"{getattr(self, name):,}")
                   for limit, name, wanted, what in limits if wanted > getattr(self, name)]
        if needs.arrays and not self.local_arrays:
            reasons.insert(0, Refusal("arrays", "needs a local array, and the card's programs "
                                      "cannot index an array"))
        if needs.loops and not self.branching:
            reasons.insert(0, Refusal("loops", "needs loops, the card has no branches"))
        if needs.floats and not self.float_textures:
            reasons.insert(0, Refusal("floats", f"needs float textures, the card has "
                                      f"{self.precision}"))
        if needs.queries and not self.occlusion_query:
            reasons.append(Refusal("queries", "needs occlusion queries"))
        return reasons

    def to_dict(self) -> dict[str, Any]:
        """Return name, chip, year, and the figures with units and sources."""
        return {"name": self.name, "chip": self.chip, "year": self.year, "figures": self.figures}


@functools.cache
def cards() -> tuple[Card, ...]:
    text = (importlib.resources.files("gpgpu_rt.hardware") / "cards.json").read_text()
    return tuple(Card(**row) for row in json.loads(text)["cards"])


def find_card(name: str) -> Card:
    """Return a card by its name or its chip's name, in upper or lower case; raise OptionError for
    another name."""
    if not isinstance(name, str):
        raise OptionError(f"card is {name!r}; give a card's name or chip")
    for card in cards():
        if name.lower() in (card.name.lower(), card.chip.lower()):
            return card
    raise OptionError(f"no card {name!r}; give the name or the chip of one of "
                      + ", ".join(f"{card.name} ({card.chip})" for card in cards()))
