"""``gpgpu-rt program METHOD --card CARD``: print the programs that a card's compiler made."""
from __future__ import annotations

import argparse
from typing import Any

from ..errors import OptionError, nearest_names
from ..hardware.cards import Card, cards
from ..hardware.prediction import limit_of
from ..hardware.published_kernels import published_kernel
from ..hardware.static_costs import (
    COMPILERS, StaticCost, compiled_costs, era_programs, packet_methods, static_cost
)
from ..methods import find_method
from .era_messages import NV30, check_era_form

# Each row: an attribute of StaticCost, its label, and the attribute of Card that limits it, or "".
_ROWS = (("arithmetic", "arithmetic instructions", ""),
         ("slots", "instruction slots", "arithmetic_slots"),
         ("vector", "  vector operations", ""), ("scalar", "  scalar operations", ""),
         ("fetches", "texture fetches", "texture_slots"),
         ("levels", "levels of indirection", "dependent_reads"),
         ("registers", "registers", ""), ("targets", "render targets", "render_targets"),
         ("cycles", "clocks, as the driver estimates", ""))
_NOTES = {"nv40": "NVIDIA's own compiler probably needed fewer instructions (docs/"
          "compiled-kernels.md, How to read the counts)"}
_SLOTS = ("instruction slots: an instruction occupies two slots, one for a vector operation and "
          "one for a scalar operation, even if a slot stays empty")


def chip_of(text: str) -> str:
    """Return the chip that ``program --card`` names, in lower case."""
    chip = text.lower()
    if chip == "nv30":
        raise argparse.ArgumentTypeError(f"{NV30}; give one of {', '.join(COMPILERS)}")
    if chip not in COMPILERS:
        raise argparse.ArgumentTypeError(f"invalid choice {text!r}"
                                         + nearest_names(chip, COMPILERS))
    return chip


def card_costs(method: str, card: str, options: dict[str, Any], only: str | None = None
               ) -> list[StaticCost]:
    """Return the cost of each kernel of a method on a card, or only of the kernel named ``only``.

    Raises
    ------
    OptionError
        for an unknown kernel or card, or a method without an era form (kernels that the cards of
        2002-2006 could run; docs/era.md)
    """
    compiled_costs(card)    # raises an error that names the known cards
    check_era_form(method, card)
    row = find_method(method)
    packets = row.era_packets
    looped = packets is not None
    if packets is not None:
        implied = packets.implied(row.options)
        options = {**{o.name: implied[o.name] for o in row.options if o.name in implied},
                   **options}
    names = [only] if only else [
        one.kernel for one in era_programs(method, in_loop=looped, card=card, **options)]
    return [static_cost(card, method, name, in_loop=looped, **options) for name in names]


def card_text(costs: list[StaticCost], listing: bool = True) -> str:
    """Return the kernels' costs as text; with ``listing``, add the compiled programs."""
    first = costs[0]
    chip = next((card for card in cards() if card.chip.lower() == first.card), None)
    made = compiled_costs(first.card)
    form = "kernels in a loop" if first.method in packet_methods() else "one kernel per pass"
    lines = [f"{first.method} on {chip.name if chip else first.card.upper()}, {form}",
             f"compiled by {made.driver}, {made.date}"]
    if chip and (limit := limit_of(chip, first.method)):
        lines.append(f"the {chip.name} could not have run these kernels: {first.method} "
                     f"{limit.says}")
    if first.card in _NOTES:
        lines.append(_NOTES[first.card])
    if any(cost.vector for cost in costs):
        lines.append(_SLOTS)
    for cost in costs:
        lines += ["", f"kernel {cost.kernel}", *_counts(cost, chip)]
        if listing and cost.listing:
            lines += ["", cost.listing]
    return "\n".join(lines) + "\n"


def _counts(cost: StaticCost, chip: Card | None) -> list[str]:
    if cost.refused:
        return [f"  the card's compiler refuses the kernel: {cost.refused}"]
    lines = []
    for name, label, limit in _ROWS:
        value = getattr(cost, name)
        if value is None or (name in ("vector", "scalar") and not cost.vector):
            continue
        most = f" of {getattr(chip, limit):,}" if chip and limit else ""
        lines.append(f"  {label:32}{value:6,}{most}")
    published = published_kernel(cost.method, cost.kernel)
    if published:
        lines.append(f"  {'instructions in the paper':32}{published.text:>6}")
    return lines


def check_alone(given: dict[str, Any]) -> None:
    """Raise OptionError if ``given`` (option -> value) has a true value. The message says that
    ``--card`` excludes these options."""
    clash = [name for name, value in given.items() if value]
    if clash:
        words = " and ".join("--" + name.replace("_", "-") for name in clash)
        raise OptionError("--card prints the kernels as Mesa's driver for the chip compiled them; "
                          f"leave {words} out")
