"""Machines with units for ray tracing, and the Cell: what the survey's section 5 wishes for, and
what was built (section 4.4), as a cost model that takes counted work out of the shader.

Kernels that a unit does cost the shader nothing; the unit takes a clock for each of their steps,
or for one of a packet. Shader, units and memory go on at once: the slowest decides. Memory is what
a cache of the machine's size would miss, which is simulated (`local_store`). Nothing is fitted:
each time is that of our programs' work at the machine's peak rates.
"""
from __future__ import annotations

import functools
import importlib.resources
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .cards import Card, Sourced
from .model import loop_work

TESTS = ("intersect",)     # kernels that test triangles; all others traverse


class Machine(Sourced):
    """A machine that is no card of the survey's."""


@functools.cache
def machines() -> dict[str, Machine]:
    """Each by its short name."""
    text = (importlib.resources.files("gpgpu_rt.hardware") / "machines.json").read_text()
    return {row["chip"]: Machine(**row) for row in json.loads(text)["machines"]}


@dataclass(frozen=True)
class Least:
    """Seconds a ray at peak rates, by what takes them; ``waiting`` comes on top of all."""

    shader: float = 0.0
    steps: float = 0.0
    tests: float = 0.0
    memory: float = 0.0
    waiting: float = 0.0

    @property
    def seconds(self) -> float:
        return max(self.shader, self.steps, self.tests, self.memory) + self.waiting

    @property
    def bound(self) -> str:
        """What decides."""
        parts = {name: getattr(self, name) for name in ("shader", "steps", "tests", "memory")}
        parts["shader"] += self.waiting
        return "waiting" if self.waiting > self.seconds / 2 else max(parts, key=parts.__getitem__)


def without(work: Mapping[str, Any], taken: str) -> dict[str, Any]:
    """Work whose kernels of a kind ("steps", "tests", "both" or "") cost the shader nothing."""
    def hard(kernel: str) -> bool:
        kind = "tests" if kernel in TESTS else "steps"
        return bool(kernel) and taken in (kind, "both")
    return {**work, "regions": [
        {**region, "vector": 0, "scalar": 0, "fetches": {}} if hard(kernel) else region
        for region, kernel in zip(work["regions"], work["kernels"])]}


def runs(work: Mapping[str, Any], kind: str, width: int = 1) -> float:
    """How often groups of so many rays ran the kernels of a kind, a ray."""
    total = 0
    for region, kernel in zip(work["regions"], work["kernels"]):
        if region["loop"] and kernel and (kernel in TESTS) == (kind == "tests"):
            total += region["runs"][str(width)]
    return total / work["count"]


def on_card(card: Card, work: Mapping[str, Any], units: Machine | None = None, taken: str = "",
            width: int | None = None) -> Least:
    """A card's shaders, with units beside them that take kernels of a kind.

    Parameters
    ----------
    work : as of `model.loop_work`, of ``count`` rays; ``kernels`` by region; ``transfers``, by
        the bytes of a cache, those of a transfer and the rays that fetch together ("8192 16 4")
        what it misses
    width : fragments that branch alike, where those are not the card's lanes
    """
    left = loop_work(card, without(work, taken), width)
    rate = card.scalar_rate if card.scalar_units else card.vector_rate
    count = work["count"]
    shader = max(left.instructions / rate, left.texels / card.texel_rate) / count
    if units is None:
        # What a card's texture cache misses is taken to be what the ideal machine's does.
        return Least(shader, memory=_memory(work, machines()["ideal"], card.bandwidth))
    each = units.units * units.clock
    return Least(shader,
                 runs(work, "steps") / (each * units.steps) if taken in ("steps", "both") else 0.0,
                 runs(work, "tests") / (each * units.tests) if taken in ("tests", "both") else 0.0,
                 _memory(work, units))


def on_prototype(machine: Machine, work: Mapping[str, Any]) -> Least:
    """A machine whose units do the traversal, and the tests if it has units for them; else its
    shader does, for a packet at a time."""
    each, packet = machine.units * machine.clock, machine.packet
    steps = runs(work, "steps", packet) / (each * machine.steps)
    memory = _memory(work, machine)
    if machine.tests:
        return Least(0.0, steps, runs(work, "tests", packet) / (each * machine.tests), memory)
    left = without(work, "steps")["regions"]
    lanes = sum(packet * region["runs"][str(packet)] * region["vector"] for region in left)
    return Least(lanes / work["count"] / machine.vector_rate, steps, 0.0, memory)


def on_cell(cell: Machine, work: Mapping[str, Any], hidden: bool, packet: int = 4) -> Least:
    """Processors that see no memory but their own: every fetch looks into a software cache, every
    miss is a transfer.

    Parameters
    ----------
    hidden : whether another packet goes on while one waits for a transfer, the report's "software
        hyperthreading"
    packet : rays that go together, each in a component of the processors' vectors; they share
        fetches
    """
    count = work["count"]
    components = sum(packet * region["runs"][str(packet)] * region["scalar"]
                     for region in work["regions"])
    fetched = sum(region["runs"][str(packet)] * sum(
        n for name, n in region["fetches"].items() if name.endswith("_table"))
        for region in work["regions"])
    shader = (components / 4 + cell.lookup * fetched) / cell.vector_rate / count
    missed = _missed(work, cell) / count
    stalled = 0.0 if hidden else missed * cell.latency / (cell.clock * cell.units)
    return Least(shader, memory=_memory(work, cell), waiting=stalled)


def _missed(work: Mapping[str, Any], machine: Machine) -> int:
    return work["transfers"][f"{machine.cache} {machine.line} {machine.together}"]


def _memory(work: Mapping[str, Any], machine: Machine, bandwidth: float | None = None) -> float:
    """Seconds a ray that its cache's misses take, at the machine's bandwidth or another one."""
    moved = _missed(work, machine) * machine.line
    return moved / (bandwidth or machine.bandwidth) / work["count"]
