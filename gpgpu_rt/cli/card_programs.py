"""``gpgpu-rt program METHOD --card CARD``: the kernels as a card's own compiler left them."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..errors import OptionError
from ..hardware.cards import Card, cards
from ..hardware.era_time import era_timed
from ..hardware.published_kernels import published_kernel
from ..hardware.static_costs import StaticCost, compiled_costs, era_programs, static_cost
from ..tracer import Tracer

# Attribute of a cost, its label, and the figure of the card that limits it.
_ROWS = (("arithmetic", "arithmetic instructions", "arithmetic_slots"),
         ("vector", "  vector operations", ""), ("scalar", "  scalar operations", ""),
         ("fetches", "texture fetches", "texture_slots"),
         ("levels", "levels of indirection", "dependent_reads"),
         ("registers", "registers", ""), ("targets", "render targets", "render_targets"),
         ("cycles", "clocks, as the driver estimates", ""))


def card_costs(method: str, card: str, options: dict[str, Any], only: str | None = None
               ) -> list[StaticCost]:
    """Return the costs of a method's kernels on a card; with ``only``, of that kernel.

    Raises
    ------
    OptionError
        for an unknown kernel or card, or a method without an era form
    """
    compiled_costs(card)    # names the cards if this card is unknown
    names = [only] if only else [one.kernel for one in era_programs(method, **options)]
    return [static_cost(card, method, name, **options) for name in names]


def card_text(costs: list[StaticCost], listing: bool = True) -> str:
    """Return the costs as text: a kernel after the other, each with its compiled program."""
    first = costs[0]
    chip = next((card for card in cards() if card.chip.lower() == first.card), None)
    made = compiled_costs(first.card)
    lines = [f"{first.method} on {chip.name if chip else first.card.upper()}, a kernel a pass",
             f"compiled by {made.driver}, {made.date}"]
    for cost in costs:
        lines += ["", f"kernel {cost.kernel}", *_counts(cost, chip)]
        if listing and cost.listing:
            lines += ["", cost.listing]
    return "\n".join(lines) + "\n"


def _counts(cost: StaticCost, chip: Card | None) -> list[str]:
    if cost.refused:
        return [f"  the card's compiler refuses it: {cost.refused}"]
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


@contextmanager
def told_card_time(tracer: Tracer, quiet: bool) -> Iterator[None]:
    """After the block, print the time that the card of the option ``era`` would have taken for
    the block's traversal. Without this option, or if ``quiet``, print nothing."""
    if quiet or not tracer.options["era"]:
        yield
        return
    with era_timed(tracer) as seen:
        yield
    found = seen.on_card()
    if found is None:
        return
    card, time = found
    shares = sorted(((seconds, name) for name, seconds in time.parts.items() if seconds),
                    reverse=True)
    print(f"the {card.name} would have taken about {time.seconds * 1e3:,.0f} ms for these passes "
          "without shading (" + ", ".join(f"{name} {seconds / time.seconds:.0%}"
                                          for seconds, name in shares)
          + "); docs/hardware.md says how well such predictions fit")


def check_alone(given: dict[str, Any]) -> None:
    """Raise OptionError for options that the listing of a card does not have."""
    clash = [name for name, value in given.items() if value]
    if clash:
        raise OptionError(f"--card prints what a card's compiler left of the kernels; leave "
                          f"{' and '.join('--' + name for name in clash)} out")
