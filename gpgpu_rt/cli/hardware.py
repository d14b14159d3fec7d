"""``gpgpu-rt hardware``: the cards of the survey, and what they could have run."""
from __future__ import annotations

import argparse

from ..errors import OptionError
from ..hardware.cards import Card, cards
from .shared import Command, print_json, print_table, say

SCENE = "cornell"   # programs hardly depend on the scene, their tables do


def add_command(command: Command) -> None:
    sub = command("hardware", _hardware, "the survey's graphics cards: figures, sources, limits")
    sub.add_argument("--methods", action="store_true", help="which methods each could have run, "
                     "from the compiled programs of each schedule (takes a minute)")
    sub.add_argument("--scene", help="with --methods, the scene whose tables must fit; default "
                     + SCENE)
    sub.add_argument("--sources", action="store_true", help="where each figure is from")


def _hardware(chosen: argparse.Namespace) -> None:
    if chosen.scene and not chosen.methods:
        raise OptionError("option --scene says whose tables a card must hold, which --methods "
                          "looks at; give --methods with it")
    if chosen.sources and chosen.methods:
        raise OptionError("--sources and --methods are tables of their own; give one")
    found = cards()
    refused = {}
    if chosen.methods:
        from ..hardware.methods_on_cards import method_needs, refusals
        say("compiling every method's programs")
        needs = method_needs(scene_name=chosen.scene or SCENE)
        refused = {card.name: refusals(card, needs) for card in found}
    if chosen.json:
        return print_json([{**card.to_dict(), **({"refuses": {
            f"{method} {schedule}": reasons
            for (method, schedule), reasons in refused[card.name].items()}} if refused else {})}
            for card in found])
    if chosen.sources:
        return print_table(("card", "figure", "value", "source"), [
            (card.name, name, _value(card, name), one["source"] + ("" if one["read"] else " *"))
            for card in found for name, one in card.figures.items()])
    if refused:
        pairs = list(next(iter(refused.values())))
        print_table(("method", "schedule", *(card.chip for card in found)), [
            (method, schedule, *("no: " + refused[card.name][method, schedule][0]
                                 if refused[card.name][method, schedule] else "yes"
                                 for card in found)) for method, schedule in pairs])
        print("\nThe programs are this package's: an index is one channel here, two coordinates "
              "would reach further;\nthe ray engine of 2002 ran in fixed point, ours stands on "
              "float textures. How often loops turn is not held\nagainst the loop limit: that "
              "depends on the rays.")
        return
    names = list(found[0].figures)
    print_table(("figure", *(f"{card.chip}, {card.year}" for card in found)),
                [("card", *(card.name for card in found)),
                 *((name.replace("_", " "), *(_value(card, name) for card in found))
                   for name in names)])
    print("\nSources: --sources; those marked * there are recalled or derived, not read.")


def _value(card: Card, name: str) -> str:
    one = card.figures[name]
    value, unit = one["value"], one["unit"]
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    for scale, prefix in ((1e9, "G"), (1e6, "M")):
        if unit.endswith(("/s", "Hz")) and value >= scale:
            return f"{value / scale:g} {prefix}{unit}"
    return f"{value:,} {unit}"
