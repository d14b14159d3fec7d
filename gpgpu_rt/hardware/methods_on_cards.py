"""Methods on cards: compares the programs of each method with the limits of a card.

The era form of a method (docs/era.md) is judged by the counts of Mesa's compiler for the card.
Today's programs, which no card's compiler accepts, are judged by their targets, tables, loops,
local arrays, queries and float textures.

The comparison may refuse a method that once ran on the card: Carr et al. (2002) ran the ray engine
in fixed point on the Radeon 8500, but this project emulates fixed point in float textures.
"""
from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..gl.observation import ObservedPass, Observer
from ..methods import find_method, methods
from ..options import TEXEL_POINTERS
from ..scene.loading import load_scene
from ..tracer import Tracer
from ..traversal.era_packets import LOOP
from .cards import Card, Needs, Refusal
from .static_costs import COMPILERS, PACKETS, StaticCost, era_programs, packet_methods, static_cost

# Not judged: this program finds tiles without live rays. The project added it only to save time.
LEFT_OUT = {"drivers/tile_counts.frag"}
# Under `loop`, these programs have a loop whose length depends on the rays.
LOOPS = {"drivers/traverse.frag", "drivers/packet.frag"}
ERA = "era"     # the era form's word in a key (method, schedule), in place of a schedule
SIZE = 8   # side of the image in pixels; programs do not depend on it


class _Programs(Observer):
    """Collects the programs of a call.

    ``found`` maps a program's texts to a name and two numbers: the most render targets of a pass,
    and the texels of the largest table that the program reads. The name is the kernel's name if
    the program runs a single kernel, else the file's name.
    """

    def __init__(self) -> None:
        self.found: dict[tuple[str, str], tuple[str, int, int]] = {}

    def passed(self, one: ObservedPass) -> None:
        if one.name in LEFT_OUT:
            return
        name, targets, texels = self.found.get(one.texts, (one.label, 0, 0))
        largest = max((texture.width * texture.height for sampler, texture in one.inputs.items()
                       if sampler.endswith("_table")), default=0)
        self.found[one.texts] = (name, max(targets, len(one.outputs)), max(texels, largest))


def method_needs(names: list[str] | None = None, scene_name: str = "cornell"
                 ) -> dict[tuple[str, str], dict[str, Needs]]:
    """Return what each program needs of a card, as (method, schedule) -> program's name -> needs.

    Parameters
    ----------
    names : methods; None for all methods
    scene_name : the scene whose tables must fit
    """
    seen = {}
    scene = load_scene(scene_name)
    rays = scene.camera.rays((SIZE, SIZE))
    for row in [find_method(name) for name in names] if names else methods():
        for schedule in row.schedules:
            watch = _Programs()
            with Tracer(scene, row.name, schedule=schedule) as tracer:
                with tracer.gpu.observed(watch):
                    tracer.trace(*rays)
                arrays = row.own_array is not None and row.own_array(tracer.options)
            seen[row.name, schedule] = watch.found, arrays
    needs = {}
    for key, (found, arrays) in seen.items():
        asked: dict[str, Needs] = {}
        for name, targets, texels in found.values():
            same = sum(label.split(" ")[0] == name.split("/")[-1] for label in asked)
            label = name.split("/")[-1] + (f" {same + 1}" if same else "")
            loops = key[1] == "loop" and name in LOOPS
            asked[label] = Needs(loops=loops, arrays=loops and arrays, targets=targets,
                                 texture_size=_side(texels), largest_index=texels,
                                 queries=key[1] != "loop")
        needs[key] = asked
    return needs


@dataclass(frozen=True)
class EraSize:
    """The size of a method's tables in the era form.

    Attributes
    ----------
    texels : number of texels of the largest table
    numbers : largest number of triangles, of leaves with ropes, or of cells in a grid's slice.
        Even with fp24, one float holds the index of such an element
    """

    texels: int = 1
    numbers: int = 1


def era_size(tracer: Tracer) -> EraSize:
    """Return the size of the tables of a tracer with the option ``era``."""
    textures = tracer.session.tables.samplers().values()
    return EraSize(max(texture.width * texture.height for texture in textures),
                   max(len(tracer.scene), tracer.session.accelerator.numbered))


def era_sizes(names: Sequence[str] | None = None, scene_name: str = "cornell",
              **options: Any) -> dict[str, EraSize]:
    """Return method -> size of its tables, for methods with an era form.

    Parameters
    ----------
    names : methods; None for all methods
    scene_name : the scene whose tables must fit
    options : options of the methods; by default, the chip is NV40. With fp24, a grid's table is
        larger, by at most a row of texels for each slice
    """
    found, scene = {}, load_scene(scene_name)
    for name in names or [row.name for row in methods() if not row.why_no_era_form()]:
        with Tracer(scene, name, **{"era": "nv40", **options}) as tracer:
            found[name] = era_size(tracer)
    return found


def era_refusals(card: Card, sizes: Mapping[str, EraSize]
                 ) -> dict[tuple[str, str], list[Refusal]]:
    """Return why a card cannot run the era form of each method. In the era form, a pass runs one
    kernel, or traces packets in a loop.

    Mesa's compiler for the card counts instructions. R200 and NV25 have no compiler in COMPILERS;
    their counts are those of R300's compiler.

    Parameters
    ----------
    sizes : from `era_sizes`
    """
    compiler = card.chip.lower() if card.chip.lower() in COMPILERS else COMPILERS[0]
    found = {}
    for name, size in sizes.items():
        loops = name in packet_methods()
        # `dict` keeps a method's last entry, which has all improvements of Horn et al.
        own = dict(PACKETS).get(name, {})
        index = size.numbers if compiler in TEXEL_POINTERS else size.texels
        needs = [Needs(one.slots, one.fetches, one.levels, loops, one.targets, _side(size.texels),
                       index, True, not loops)
                 for one in _costs(compiler, name, loops, own)]
        if not needs:
            needs = [Needs(targets=find_method(name).era_targets(compiler), queries=True,
                           texture_size=_side(size.texels), largest_index=index)]
        found[name, ERA] = list(dict.fromkeys(
            reason for one in needs for reason in card.refuses(one)))
    return found


def _costs(compiler: str, name: str, loops: bool, own: Mapping[str, Any]) -> list[StaticCost]:
    """Return the costs of a method's programs; none if the method has no form for the chip."""
    if not loops and find_method(name).why_no_era_form(compiler):
        return []
    kernels = [LOOP] if loops else [one.kernel for one in era_programs(name, card=compiler)]
    return [static_cost(compiler, name, kernel, in_loop=loops, **own) for kernel in kernels]


def _side(texels: int) -> int:
    return math.isqrt(max(texels - 1, 0)) + 1


def refusals(card: Card, needs: dict[tuple[str, str], dict[str, Needs]]
             ) -> dict[tuple[str, str], list[Refusal]]:
    """Return (method, schedule) -> why a card cannot run the method; empty if no limit is
    exceeded. Instructions are not compared."""
    return {key: list(dict.fromkeys(reason for one in programs.values()
                                    for reason in card.refuses(one)))
            for key, programs in needs.items()}
