"""``gpgpu-rt hardware --predict``: a table of the times that the cards would have taken."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..bench.workloads import RAY_SETS, Workload, rays_of, told
from ..errors import OptionError, nearest_names
from ..hardware.cards import Card, find_card
from ..hardware.prediction import limit_of, predict, why_no_time
from ..hardware.program_forms import FORMS
from ..methods import find_method, methods
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..text_format import number
from .shared import print_filled, print_json, print_stand_in, print_table, say

EVERY = "all"       # the word for all methods


def print_predictions(words: Sequence[str], scene_name: str, kind: str, size: int,
                      as_json: bool) -> None:
    """Print the predicted times of methods on the cards of `FORMS`.

    Parameters
    ----------
    words : names of methods, or only "all"
    scene_name : the scene that the rays hit
    kind : the kind of rays, a key of `RAY_SETS`
    size : side of the square image that the rays belong to, in pixels
    as_json : whether to print JSON

    Raises
    ------
    OptionError
        for an unknown method or kind of rays
    """
    if kind not in RAY_SETS:
        raise OptionError(f"--rays {kind!r}{nearest_names(kind, RAY_SETS)}")
    named = [row.name for row in methods()] if list(words) == [EVERY] else words
    names = [find_method(name).name for name in dict.fromkeys(named)]
    scene, cards = load_scene(scene_name), [find_card(chip) for chip in FORMS]
    rays, found = rays_of(scene, RAY_SETS[kind], size), []
    for at, method in enumerate(names, 1):
        say(f"{at} of {len(names)}: {method}")
        found += [_predicted(scene, method, card, rays) for card in cards]
    print_stand_in(scene, as_json)
    if as_json:
        return print_json({**scene.facts(), "rays": kind, "count": rays.live, "size": size,
                           "predictions": found})
    print(f"{scene.title}: predicted ms for {rays.live:,} {told(RAY_SETS[kind])} of {size} x "
          f"{size} pixels, without shading")
    print_table(("method", *FORMS), [
        (method, *(_cell(one) for one in found if one["method"] == method)) for method in names])
    print()
    print_filled("Predictions are rough: docs/hardware.md says how far they are from the papers' "
                 "times. `cannot run` names the card's limit that forbids the method.")
    without = dict.fromkeys(one["method"] for one in found if _cell(one) == "-")
    for reason in dict.fromkeys(map(why_no_time, without)):
        some = ", ".join(method for method in without if why_no_time(method) == reason)
        print_filled(f"- stands at {some}: {reason}")


def _predicted(scene: Scene, method: str, card: Card, rays: Workload) -> dict[str, Any]:
    """Return the JSON of a prediction, or of the reason why there is none."""
    named = {"method": method, "card": card.name}
    if limit := limit_of(card, method):
        return {**named, "limit": limit.limit, "reason": limit.says}
    try:
        made = predict(scene, method, card.chip, rays)
    except OptionError as reason:
        return {**named, "limit": None, "reason": str(reason)}
    return {**named, "form": made.form, "seconds": made.seconds, "parts": made.parts}


def _cell(one: dict[str, Any]) -> str:
    if "seconds" in one:
        return number(1e3 * one["seconds"])
    return f"cannot run: {one['limit']}" if one["limit"] else "-"
