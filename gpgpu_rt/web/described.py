"""Describes a schedule's passes for the web page, from the passes that a tracer draws.

The host observes the passes that trace test rays. Two passes are equal if they have the same
program, inputs and target. The description has two parts: passes that run once, and a cycle of
passes that repeat. Under ``kernels``, each kernel has a cycle. The page's script (passes.js)
repeats cycles until no ray is alive. A cycle consists of turns. Each turn begins with the cycle's
first program, and successive turns may write to different targets.
"""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..gl.loops import without_do
from ..gl.observation import ObservedPass
from ..gl.record import Record
from ..gl.shader import Compilation
from ..inspect.program_text import program_text
from ..inspect.record_meaning import meaning
from ..inspect.time_travel import kernels_of
from ..rays.records import HIT
from ..tracer import Tracer
from ..traversal.records import STATE
from .page_data import NotInBrowser, PageData
from .structure import structure_of

EYE = "drivers/eye_rays.frag"
# The passes that mark and count rays are left out: the page's player (player.js and passes.js)
# counts with its own program.
COUNTING = ("drivers/mask.frag", "drivers/classify.frag", "drivers/tile_counts.frag")
PUSH = "drivers/push.frag"
PACKET_HITS = "drivers/packet_hits.frag"
MOST_KERNELS = 4        # glsl/web/alive.frag counts each kernel's rays in one channel of a texel
_CAMERA = ("eye", "right", "up", "forward", "size")
_OF_THE_EYE = (*_CAMERA, "rays_texel_0")        # the player sets these uniforms


class Described:
    """The description of a schedule's passes over ``side`` x ``side`` rays.

    Parameters
    ----------
    observed : the passes that the tracer drew for the rays, in their order
    compiled : the programs that the tracer compiled

    Attributes
    ----------
    directions : (side * side, 4) float32, the texels with the directions of the eye rays

    Raises
    ------
    NotInBrowser
        if the passes do not have the form that the player can repeat
    """

    def __init__(self, tracer: Tracer, observed: Sequence[ObservedPass], side: int,
                 tables: PageData, compiled: Sequence[Compilation]) -> None:
        self._printed = {one.fragment.text: one.fragment for one in compiled}
        self._tables, self._side = tables, side
        self._schedule, self._kernels = str(tracer.options["schedule"]), kernels_of(tracer)
        self._structure = structure_of(tracer.method, self._kernels)
        declared, self._stream = _state_record(tracer)
        self._state = tracer.precision.layout(declared)
        self._meaning = [f"{name}: {text}" for name, text in
                         {**meaning(declared), **meaning(STATE)}.items()]
        self._packets = tracer.method.packet_state is not None
        self._passes: list[dict[str, Any]] = []
        self._numbers: dict[tuple[Any, ...], int] = {}      # key of a pass -> its number
        self._targets: list[dict[str, Any]] = []
        self._places: dict[int, tuple[int, int]] = {}       # texture's id -> (target, output)
        if len(self._kernels) > MOST_KERNELS:
            raise NotInBrowser(f"the page counts the rays of at most {MOST_KERNELS} kernels")
        first = [one.name for one in observed].index(EYE)
        eye, rest = observed[first], observed[first + 1:]
        self.directions = np.frombuffer(eye.outputs[1].read(), np.float32).reshape(-1, 4)
        for one in (eye, *rest):
            if one.name not in COUNTING:
                self._place(one)
        self._states, self._hits = (self._sampled_as(rest, f"{name}_texel_0")
                                    for name in (self._stream, HIT.name))
        self._number(eye)
        self._cycles: list[dict[str, Any]] = []
        if self._schedule == "loop":
            once = list({_key(one): one for one in rest}.values())
            if len(once) > 1 + (once[-1].name == PACKET_HITS):
                raise NotInBrowser("a test ray exceeds the limit on loop iterations")
        elif self._schedule == "step":
            once, cycle = _cycle([one for one in rest if one.name not in COUNTING])
            self._cycles = [self._described_cycle(0, _turns(cycle))]
        else:
            once = []
            for one in rest:
                if one.name in COUNTING:
                    break
                once.append(one)
            self._cycles = self._by_kernel(rest[len(once):])
        self._once = [self._number(one) for one in (eye, *once)]
        place = self._places[once[-1].outputs[-1].glo]
        self._start = self._end(once) if self._cycles else {"states": place[0], "hits": place}

    def _by_kernel(self, rest: Sequence[ObservedPass]) -> list[dict[str, Any]]:
        """Return a cycle for each kernel: the passes between two counts of rays, from the first
        time that these passes run the kernel."""
        segments: list[list[ObservedPass]] = [[]]
        for one in rest:
            if one.name in COUNTING:
                segments.append([])
            else:
                segments[-1].append(one)
        cycles = []
        for number, kernel in enumerate(self._kernels, 1):
            found = next((one for one in segments if any(p.label == kernel for p in one)), None)
            if found is None:
                raise NotInBrowser(f"no test ray waited for the kernel {kernel}")
            cycles.append(self._described_cycle(number, [list(
                {_key(one): one for one in found}.values())]))
        return cycles

    def _described_cycle(self, kernel: int, turns: list[list[ObservedPass]]) -> dict[str, Any]:
        return {"kernel": kernel, "turns": [
            {"passes": [self._number(one) for one in turn], **self._end(turn)} for turn in turns]}

    def _end(self, passes: Sequence[ObservedPass]) -> dict[str, Any]:
        """Return the targets that hold the states and hits after these passes."""
        written = [self._places[one.outputs[0].glo][0] for one in reversed(passes)]
        states = next((target for target in written if target in self._states), None)
        hits = next((target for target in written if target in self._hits), None)
        if states is None or hits is None:
            raise NotInBrowser("no pass of a step writes the states and hits of all rays")
        return {"states": states, "hits": [hits, self._hits[hits]]}

    def _sampled_as(self, passes: Sequence[ObservedPass], sampler: str) -> dict[int, int]:
        """Map each target that passes read through ``sampler`` to the output that they read."""
        return dict(self._places[one.inputs[sampler].glo] for one in passes
                    if sampler in one.inputs and one.inputs[sampler].glo in self._places)

    def _place(self, one: ObservedPass) -> None:
        """Give a number to the pass's target, if the target is new."""
        if one.outputs[0].glo in self._places:
            return
        width, height = one.outputs[0].size
        told = {"outputs": len(one.outputs), "components": one.outputs[0].components,
                "of": [width / self._side, height / self._side]}
        if one.name == PUSH:
            tile = one.uniforms["tile_size"]
            told["of"] = [length / self._side for length in tile]
            told["levels"] = width // tile[0] * (height // tile[1])
        for k, texture in enumerate(one.outputs):
            self._places[texture.glo] = len(self._targets), k
        self._targets.append(told)

    def _number(self, one: ObservedPass) -> int:
        """Return the number of a pass. Equal passes have the same number."""
        key = _key(one)
        if key not in self._numbers:
            self._numbers[key] = len(self._passes)
            self._passes.append(self._described_pass(one))
        return self._numbers[key]

    def _described_pass(self, one: ObservedPass) -> dict[str, Any]:
        inputs = {}
        for sampler, texture in one.inputs.items():
            if texture.glo in self._places:
                target, k = self._places[texture.glo]
                inputs[sampler] = f"{target}:{k}"
            elif sampler.endswith("_table"):
                inputs[sampler] = f"table:{self._tables.texture(texture)}"
            else:
                raise NotInBrowser(f"neither a pass nor a table provides {sampler}")
        # Give the page the readable text, which computes the same bits as the tracer's program.
        sized, fragment = self._sized(one), program_text(self._printed[one.texts[1]])
        if self._packets:
            fragment = without_do(fragment)
        return {"title": _title(one, self._schedule),
                "vertex": self._tables.text(one.texts[0]),
                "fragment": self._tables.text(fragment), "sized": sized,
                "uniforms": {name: np.asarray(value, float).ravel().tolist()
                             for name, value in one.uniforms.items()
                             if name not in _OF_THE_EYE and name not in sized},
                "inputs": inputs, "target": self._places[one.outputs[0].glo][0],
                "outputs": len(one.outputs)}

    def _sized(self, one: ObservedPass) -> dict[str, list[Any]]:
        """Return the uniforms that depend on the number of rays: name -> [target, kind]. The kind
        is "rays" (the size of ray textures), "tile" (the size of a tile of the target) or "across"
        (the number of the target's tiles in a row)."""
        kinds = {"ray_texture_size": "rays", "tile_size": "tile", "tiles_a_row": "across"}
        atlas = next((k for k, target in enumerate(self._targets) if "levels" in target), 0)
        return {name: [atlas if name.startswith("tile") else 0, kind]
                for name, kind in kinds.items() if name in one.uniforms}

    def told(self) -> dict[str, Any]:
        fields = self._state.fields if self._cycles else ()
        return {"passes": self._passes, "targets": self._targets, "once": self._once,
                "cycles": self._cycles, "repeats": bool(self._cycles),
                "packets": self._packets,
                "outputs": max(one["outputs"] for one in self._passes),
                "start": self._start,
                "structure": self._structure,
                "state": [[field.name, field.texel, field.swizzle] for field in fields],
                "meaning": self._meaning if fields else []}


def _state_record(tracer: Tracer) -> tuple[Record, str]:
    """Return the record of a cycle's states, and the name of the stream that stores them."""
    row = tracer.method
    if row.packet_state is None:
        return row.state, "state"
    return row.packet_state(tracer.options).state, "packet_state"


def _title(one: ObservedPass, schedule: str) -> str:
    if one.name in (EYE, PUSH, PACKET_HITS):
        return {EYE: "eye rays", PUSH: "push", PACKET_HITS: "hits of packets"}[one.name]
    if one.kernel == "init":
        return "set-up" + (" of packets" if one.name == "drivers/packet_visit.frag" else "")
    return {"": schedule, "all": schedule}.get(one.kernel, one.kernel)


def _key(one: ObservedPass) -> tuple[Any, ...]:
    return (one.program.glo, tuple(sorted((name, texture.glo)
                                          for name, texture in one.inputs.items())),
            tuple(texture.glo for texture in one.outputs))


def _cycle(passes: list[ObservedPass]) -> tuple[list[ObservedPass], list[ObservedPass]]:
    """Return the passes before the first repeated pass, and the passes from this pass up to its
    repetition."""
    keys = [_key(one) for one in passes]
    first = next((k for k, key in enumerate(keys) if key in keys[k + 1:]), None)
    if first is None:
        raise NotInBrowser("the test rays end before a pass is repeated")
    end = keys.index(keys[first], first + 1)
    cycle = keys[first:end]
    if any(key != cycle[k % len(cycle)] for k, key in enumerate(keys[first:-1])):
        raise NotInBrowser("the passes of a step do not repeat in the same order")
    return passes[:first], passes[first:end]


def _turns(cycle: list[ObservedPass]) -> list[list[ObservedPass]]:
    """Cut a cycle wherever its first program runs again."""
    starts = [k for k, one in enumerate(cycle) if one.program.glo == cycle[0].program.glo]
    return [cycle[a:b] for a, b in zip(starts, [*starts[1:], len(cycle)])]
