"""Which methods a card could have run: each program of a method, compiled, against its limits.

They are the programs of this package: Carr's ray engine of 2002 did run in fixed point on the
Radeon 8500, ours stands on float textures.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..methods import find_method, methods
from ..passes.fragment_pass import FragmentPass
from ..scene import load_scene
from ..tracer import Tracer
from .cards import Card, Needs
from .compiler import compiled
from .program import parse

LEFT_OUT = {"passes/tile_counts.frag"}   # ours: spares passes the tiles without rays
SIZE = 8   # pixels a side: programs do not depend on it


class _Programs:
    """Every program of a call: its texts, the most targets it was drawn into, and the texels of
    the largest table it read."""

    def __init__(self) -> None:
        self.found: dict[tuple[str, str], tuple[str, int, int]] = {}

    def note(self, one: FragmentPass, target: Any, textures: Mapping[str, Any]) -> None:
        if one.name in LEFT_OUT:
            return
        texts = one.gpu.text_of(one.program)
        most = max(len(target.color_attachments or ()), self.found.get(texts, ("", 0, 0))[1])
        texels = max((textures[name].width * textures[name].height for name in one.samplers
                      if name.endswith("_table")), default=0)
        self.found[texts] = (one.name, most, texels)


def method_needs(names: list[str] | None = None, scene_name: str = "cornell"
                 ) -> dict[tuple[str, str], dict[str, Needs]]:
    """(method, schedule) -> program -> what it asks of a card.

    Parameters
    ----------
    names : methods; None: all of the table
    scene_name : whose tables must fit
    """
    seen = {}
    scene = load_scene(scene_name)
    rays = scene.camera.rays((SIZE, SIZE))
    for row in [find_method(name) for name in names] if names else methods():
        for schedule in row.schedules:
            watch = _Programs()
            with Tracer(scene, row.name, schedule=schedule) as tracer:
                with tracer.gpu.watched(watch):
                    tracer.trace(*rays)
            seen[row.name, schedule] = watch.found
    texts = list(dict.fromkeys(text for found in seen.values() for text in found))
    programs = {text: parse(code) for text, code in zip(texts, compiled(texts))}
    needs = {}
    for key, found in seen.items():
        asked: dict[str, Needs] = {}
        for text, (name, targets, texels) in found.items():
            of_one = Needs.of(programs[text], targets, texels)
            label = name.split("/")[-1] + ("" if name not in asked else f" {len(asked)}")
            asked[label] = replace(of_one, queries=key[1] != "loop")
        needs[key] = asked
    return needs


def refusals(card: Card, needs: dict[tuple[str, str], dict[str, Needs]]
             ) -> dict[tuple[str, str], list[str]]:
    """(method, schedule) -> why the card cannot run it: nothing where it can."""
    return {key: list(dict.fromkeys(reason for one in programs.values()
                                    for reason in card.refuses(one)))
            for key, programs in needs.items()}
