"""``gpgpu-rt program METHOD --card CARD``: print the programs that a card's compiler made."""
from __future__ import annotations

from typing import Any

from ..errors import OptionError
from ..hardware.cards import Card, cards
from ..hardware.published_kernels import published_kernel
from ..hardware.static_costs import (
    StaticCost, compiled_costs, era_programs, packet_methods, static_cost
)

# Each row: an attribute of StaticCost, its label, and the attribute of Card that limits it, or "".
_ROWS = (("arithmetic", "arithmetic instructions", ""),
         ("slots", "instruction slots", "arithmetic_slots"),
         ("vector", "  vector operations", ""), ("scalar", "  scalar operations", ""),
         ("fetches", "texture fetches", "texture_slots"),
         ("levels", "levels of indirection", "dependent_reads"),
         ("registers", "registers", ""), ("targets", "render targets", "render_targets"),
         ("cycles", "clocks, as the driver estimates", ""))


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
    looped = method in packet_methods()
    names = [only] if only else [
        one.kernel for one in era_programs(method, in_loop=looped, **options)]
    return [static_cost(card, method, name, in_loop=looped, **options) for name in names]


def card_text(costs: list[StaticCost], listing: bool = True) -> str:
    """Return the kernels' costs as text; with ``listing``, add the compiled programs."""
    first = costs[0]
    chip = next((card for card in cards() if card.chip.lower() == first.card), None)
    made = compiled_costs(first.card)
    form = "kernels in a loop" if first.method in packet_methods() else "one kernel per pass"
    lines = [f"{first.method} on {chip.name if chip else first.card.upper()}, {form}",
             f"compiled by {made.driver}, {made.date}"]
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
    """Raise OptionError for options that exclude ``--card``."""
    clash = [name for name, value in given.items() if value]
    if clash:
        raise OptionError(f"--card prints the kernels as a card's compiler compiled them; leave "
                          f"{' and '.join('--' + name.replace('_', '-') for name in clash)} out")
