"""``gpgpu-rt hardware --predict``: a table of the times that the cards would have taken."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..bench.workloads import RAY_SETS, Workload, rays_of, told
from ..errors import OptionError, nearest_name
from ..gl.context import open_gpu
from ..gl.environment import run_facts
from ..hardware.cards import Card, find_card
from ..hardware.prediction import check_predicted, limit_of, predict, why_no_time
from ..hardware.program_forms import FORMS
from ..methods import find_method, methods
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..text_format import number
from .shared import print_filled, print_json, print_row, print_stand_in, say

EVERY = "all"       # the word for all methods
NUMBER = len("0.000123")    # the longest text that `number` returns for a time


def print_predictions(words: Sequence[str], cards: Sequence[Card], scene_name: str, kind: str,
                      size: int, command: str, as_json: bool) -> None:
    """Print the predicted times of methods on cards, each method's row as soon as it is ready.

    Parameters
    ----------
    words : names of methods, or only "all"
    cards : the cards, the columns of the table; empty for all cards of `FORMS`
    scene_name : the scene that the rays hit
    kind : the kind of rays, a key of `RAY_SETS`
    size : side of the square image that the rays belong to, in pixels
    command : the command line, for JSON
    as_json : whether to print JSON. After an error or an interrupt, the JSON has the times that
        are ready

    Raises
    ------
    OptionError
        for an unknown method or kind of rays, a card without predicted times, or "all" beside
        other names
    """
    if kind not in RAY_SETS:
        raise OptionError(f"--rays {kind!r}{nearest_name(kind, RAY_SETS)}")
    cards = cards or [find_card(chip) for chip in FORMS]
    for card in cards:
        check_predicted(card)
    if EVERY in words and len(words) > 1:
        raise OptionError(f"--predict {EVERY} has every method; leave the other names out")
    named = [row.name for row in methods()] if list(words) == [EVERY] else words
    names = [find_method(name).name for name in dict.fromkeys(named)]
    scene = load_scene(scene_name)
    rays, found = rays_of(scene, RAY_SETS[kind], size), []
    print_stand_in(scene, as_json)
    widths, gpu = _widths(names, cards), open_gpu()
    if not as_json:
        print(f"{scene.title}: predicted ms for {rays.live:,} {told(RAY_SETS[kind])} of {size} x "
              f"{size} pixels, without shading")
        print_row(("method", *(card.chip for card in cards)), widths)
        print_row(["-" * width for width in widths], widths)
    try:
        for at, method in enumerate(names, 1):
            if as_json:
                say(f"{at} of {len(names)}: {method}")
            for card in cards:
                found.append(_predicted(scene, method, card, rays))
            if not as_json:
                print_row((method, *map(_cell, found[-len(cards):])), widths)
    finally:
        if as_json and found:
            print_json({**run_facts(gpu, command), **scene.facts(), "rays": kind,
                        "count": rays.live, "size": size, "predictions": found})
    if not as_json:
        _print_notes(found)


def _widths(names: Sequence[str], cards: Sequence[Card]) -> list[int]:
    """Return the widths of the table's columns in characters, before any time is known."""
    cells = [[_cell(one) for name in names if (one := _refused(name, card))] for card in cards]
    return [max(map(len, ["method", *names])),
            *(max(NUMBER, *map(len, [card.chip, *column])) for card, column in zip(cards, cells))]


def _print_notes(found: Sequence[dict[str, Any]]) -> None:
    print()
    print_filled("Predictions are rough: docs/hardware.md says how far they are from the papers' "
                 "times. `cannot run` names the card's limit that forbids the method.")
    without = dict.fromkeys(one["method"] for one in found if _cell(one) == "-")
    for reason in dict.fromkeys(map(why_no_time, without)):
        some = ", ".join(method for method in without if why_no_time(method) == reason)
        print_filled(f'"-" for {some}: {reason}')


def _refused(method: str, card: Card) -> dict[str, Any]:
    """Return the JSON of the limit that forbids the method on the card, or {}."""
    limit = limit_of(card, method)
    return {"method": method, "card": card.name, "limit": limit.limit,
            "reason": limit.says} if limit else {}


def _predicted(scene: Scene, method: str, card: Card, rays: Workload) -> dict[str, Any]:
    """Return the JSON of a prediction, or of the reason why there is none."""
    if refused := _refused(method, card):
        return refused
    named = {"method": method, "card": card.name}
    try:
        made = predict(scene, method, card.chip, rays)
    except OptionError as reason:
        return {**named, "limit": None, "reason": str(reason)}
    return {**named, "form": made.form, "seconds": made.seconds, "parts": made.parts}


def _cell(one: dict[str, Any]) -> str:
    if "seconds" in one:
        return number(1e3 * one["seconds"])
    return f"cannot run: {one['limit']}" if one["limit"] else "-"
