"""Which methods a card could have run: each program of a method, compiled, against its limits.

They are the programs of this package: Carr's ray engine of 2002 did run in fixed point on the
Radeon 8500, ours stands on float textures.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..gl.fragment_pass import FragmentPass
from ..methods import find_method, methods
from ..scene.loading import load_scene
from ..tracer import Tracer
from .cards import Card, Needs, Refusal
from .compiler import not_countable
from .sample import programs_of

LEFT_OUT = {"drivers/tile_counts.frag"}   # ours: spares passes the tiles without rays
SIZE = 8   # pixels a side: programs do not depend on it


class _Programs:
    """Every program of a call, by its texts: its name, the most targets it was drawn into, and the
    texels of the largest table it read. A kernel's name is its own, not that of the file which it
    shares with the other kernels."""

    def __init__(self) -> None:
        self.found: dict[tuple[str, str], tuple[str, int, int]] = {}

    def note(self, one: FragmentPass, target: Any, textures: Mapping[str, Any]) -> None:
        if one.name in LEFT_OUT:
            return
        texts = one.gpu.text_of(one.program)
        name, targets, texels = self.found.get(texts, (one.label or one.name, 0, 0))
        largest = max((textures[sampler].width * textures[sampler].height
                       for sampler in one.samplers if sampler.endswith("_table")), default=0)
        self.found[texts] = (name, max(targets, len(target.color_attachments or ())),
                             max(texels, largest))


def method_needs(names: list[str] | None = None, scene_name: str = "cornell"
                 ) -> dict[tuple[str, str], dict[str, Needs]]:
    """(method, schedule) -> program -> what it asks of a card.

    Where no instruction can be counted on this machine (`compiler.not_countable`), the needs say
    so and hold what is known without: targets, tables, queries.

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
    programs = {} if not_countable() else dict(zip(texts, programs_of(texts)))
    needs = {}
    for key, found in seen.items():
        asked: dict[str, Needs] = {}
        for text, (name, targets, texels) in found.items():
            same = sum(label.split(" ")[0] == name.split("/")[-1] for label in asked)
            label = name.split("/")[-1] + (f" {same + 1}" if same else "")
            asked[label] = Needs.of(programs.get(text), targets, texels, key[1] != "loop")
        needs[key] = asked
    return needs


def refusals(card: Card, needs: dict[tuple[str, str], dict[str, Needs]]
             ) -> dict[tuple[str, str], list[Refusal]]:
    """(method, schedule) -> why the card cannot run it: nothing where it can."""
    return {key: list(dict.fromkeys(reason for one in programs.values()
                                    for reason in card.refuses(one)))
            for key, programs in needs.items()}
