"""``gpgpu-rt hardware``: list the cards of Hachisuka's survey and the methods that fit them."""
from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

from ..bench.workloads import RAY_SETS
from ..errors import OptionError
from ..hardware.cards import Card, Refusal, cards, find_card
from ..hardware.methods_on_cards import ERA, era_refusals, era_sizes, method_needs, refusals
from ..hardware.prediction import KIND, SIDE
from ..hardware.program_forms import FORMS
from ..methods import methods
from .card_predictions import print_predictions
from .shared import Command, names, print_filled, print_json, print_table, say, side_word

SCENE = "cornell"   # the default of --scene; the scene changes tables, but hardly programs
PREFIXES, PER_SECOND = ((1e9, "G"), (1e6, "M")), ("/s", "Hz")
WIDE = ("exact_integers",)      # numbers too long for the table with a column per card
NOTE = ("The rows `era` judge the kernels as the papers had them (docs/era.md), by the counts of "
        "Mesa's compilers for the cards. The other rows judge today's programs by their render "
        "targets, tables, loops, queries and float textures, but not by their instructions, "
        "because no card's compiler counts them. The limit `index` is the largest number that one "
        "channel stores exactly. Today's programs store every index of a texel in one channel. On "
        "cards with fp24, the era form stores a column and a row, except for a hit's triangle, a "
        "leaf of kd-ropes and a cell's place in its slice. The ray engine of 2002 ran in fixed "
        "point; this project emulates fixed point in float textures (`--fixed-point`). The number "
        "of loop iterations is not compared with a card's limit, because it depends on the rays.")


def add_commands(command: Command) -> None:
    sub = command("hardware", _hardware, "list the survey's graphics cards with their figures, "
                  "limits and sources")
    sub.add_argument("--methods", action="store_true", help="print which methods each card could "
                     "have run: the programs of a method must fit the card's limits (takes a "
                     "minute)")
    sub.listed = [row.name for row in methods()]
    sub.add_argument("--predict", type=names, nargs="?", const=[], metavar="METHOD,METHOD,...",
                     help="print the time that each card would have taken for an image's rays, by "
                     "these methods, or by all (all methods take a minute on cornell; on a scene "
                     "of 100,000 triangles or more, each method takes a minute or more)")
    sub.add_argument("--card", type=names, metavar="CHIP,CHIP,...", help="print only these cards; "
                     "default: all, for --predict " + ", ".join(FORMS))
    sub.add_argument("--scene", help="with --methods: the scene whose tables must fit into a "
                     "card's memory; with --predict: the scene that the rays hit; default "
                     + SCENE)
    sub.add_argument("--rays", metavar="KIND", help="with --predict: the kind of rays, "
                     f"{', '.join(RAY_SETS)}; default {KIND}")
    sub.add_argument("--size", type=side_word, metavar="PIXELS", help="with --predict: side of "
                     f"the square image that the rays belong to; default {SIDE}")
    sub.add_argument("--sources", action="store_true", help="print the source of each figure")


def _hardware(chosen: argparse.Namespace) -> None:
    if chosen.predict == []:
        raise OptionError("--predict has no method; give METHOD,METHOD,... or all")
    if chosen.scene is not None and not (chosen.methods or chosen.predict):
        raise OptionError("--scene names the scene of --methods and of --predict; give one of "
                          "them, too")
    if (chosen.rays is not None or chosen.size is not None) and not chosen.predict:
        raise OptionError("--rays and --size name the rays of --predict; give --predict, too")
    if bool(chosen.sources) + bool(chosen.methods) + bool(chosen.predict) > 1:
        raise OptionError("--sources, --methods and --predict print different tables; give one "
                          "of them")
    wanted = [find_card(name) for name in chosen.card or ()]
    named = [card for card in cards() if card in wanted]
    if chosen.predict:
        kind = KIND if chosen.rays is None else chosen.rays
        return print_predictions(chosen.predict, named, chosen.scene or SCENE, kind,
                                 chosen.size or SIDE, chosen.command, chosen.json)
    found = named or cards()
    refused = {}
    if chosen.methods:
        say("compiling every method's programs")
        needs = method_needs(scene_name=chosen.scene or SCENE)
        sizes = era_sizes(scene_name=chosen.scene or SCENE)
        refused = {card.name: {**refusals(card, needs), **era_refusals(card, sizes)}
                   for card in found}
    if chosen.json:
        return print_json([{**card.to_dict(), **({"refuses": {
            f"{method} {schedule}": [one.says for one in reasons]
            for (method, schedule), reasons in refused[card.name].items()}} if refused else {})}
            for card in found])
    if chosen.sources:
        return print_table(("card", "figure", "value", "source"), [
            (card.name, name, _value(card, name), one["source"] + ("" if one["read"] else " *"))
            for card in found for name, one in card.figures.items()])
    if refused:
        _print_methods(found, refused, chosen.scene or SCENE)
        return
    _print_cards(found)
    print()
    print_filled("--sources prints the sources. Its mark * means that a figure was recalled or "
                 "derived, not read in its source.")


def _print_cards(found: Sequence[Card]) -> None:
    """Print a table of names and texts with a row per card, and a table of numbers with a row per
    figure. Each table fits into 100 columns."""
    texts = [name for name, one in found[0].figures.items()
             if isinstance(one["value"], str) or name in WIDE]
    print_table(("chip", "card", "year", *(name.replace("_", " ") for name in texts)),
                [(card.chip, card.name, str(card.year), *(_value(card, name) for name in texts))
                 for card in found])
    print()
    print_table(("figure", "unit", *(card.chip for card in found)),
                [_numbers(found, name) for name in found[0].figures if name not in texts])


def _numbers(found: Sequence[Card], name: str) -> list[str]:
    """Return a figure's name, its unit, and each card's value in this unit."""
    values, unit = [getattr(card, name) for card in found], found[0].figures[name]["unit"]
    words = [("yes" if value else "no") if isinstance(value, bool) else f"{value:,}"
             for value in values]
    least = min(filter(None, values), default=0)
    scale, prefix = next(((scale, prefix) for scale, prefix in PREFIXES
                          if unit.endswith(PER_SECOND) and least >= scale), (1, ""))
    if prefix:
        words = [f"{value / scale:,g}" for value in values]
    return [name.replace("_", " "), prefix + unit, *words]


def _print_methods(found: Sequence[Card],
                   refused: Mapping[str, Mapping[tuple[str, str], list[Refusal]]],
                   scene: str) -> None:
    """Print a row per method and schedule. A card's cell names the first limit of the card that
    the programs exceed. Without such a limit, the cell is "yes" for an era form (docs/era.md), and
    "-" for today's programs: their instructions are not compared."""
    def word(card: Card, pair: tuple[str, str]) -> str:
        reasons = refused[card.name][pair]
        return reasons[0].limit if reasons else "yes" if pair[1] == ERA else "-"
    pairs = list(refused[found[0].name])
    print_table(("method", "schedule", *(card.chip for card in found)),
                [(*pair, *(word(card, pair) for card in found)) for pair in pairs])
    print("\nyes: the card could run the method. -: not decided, because the instructions of "
          "today's programs\nare not compared. Other words name the first exceeded limit:")
    for limit in dict.fromkeys(r[0].limit for of in refused.values() for r in of.values() if r):
        # Print one example per limit; --json prints all.
        card, pair = next((card, pair) for pair in pairs for card in found
                          if word(card, pair) == limit)
        print_filled(f"{limit}: for example {' '.join(pair)} on the {card.chip}: "
                     f"{refused[card.name][pair][0].says}")
    print()
    print_filled(f"{NOTE} Tables are those of {scene}; --scene names another scene.")


def _value(card: Card, name: str) -> str:
    one = card.figures[name]
    value, unit = one["value"], one["unit"]
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    for scale, prefix in PREFIXES:
        if unit.endswith(PER_SECOND) and value >= scale:
            return f"{value / scale:g} {prefix}{unit}"
    return f"{value:,} {unit}"
