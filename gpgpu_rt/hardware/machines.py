"""Machines: predicts the time per ray on machines with units for ray tracing, and on the Cell.

Section 5 of Hachisuka's survey proposes such units; section 4.4 describes machines that were
built. A unit executes a step of a ray, or of a packet, in one clock, without work for the shader.
Shader, units and memory work in parallel, and the slowest decides. Misses of a simulated cache of
the machine's size (`local_store`) give the memory traffic. Nothing is fitted: each time is the
work of traced rays, divided by the machine's peak rate. The model ignores the set-up of rays and
the branches of loops.

A kernel's cost comes from the code of a card's compiler (`loop_costs`). For a machine without a
compiler, ``compiler`` in ``machines.json`` names the card with the most similar instructions.
"""
from __future__ import annotations

import functools
import importlib.resources
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from .cards import Card, Sourced
from .issue import WITHIN
from .loop_costs import LoopCost

TESTS = ("intersect",)     # kernels that test triangles; all other kernels traverse


class Machine(Sourced):
    """A machine of ``machines.json``."""


@functools.cache
def machines() -> dict[str, Machine]:
    """Return the machines by short name."""
    text = (importlib.resources.files("gpgpu_rt.hardware") / "machines.json").read_text()
    return {row["chip"]: Machine(**row) for row in json.loads(text)["machines"]}


@dataclass(frozen=True)
class Least:
    """The least time per ray, in seconds, that each resource needs at its peak rate. ``steps`` is
    the time of the units that traverse, and ``tests`` of the units that test triangles. Resources
    work in parallel. The time ``waiting`` is added to the time of the slowest resource."""

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
        """The resource that decides the time, or "waiting" for more than half of the time."""
        parts = {name: getattr(self, name) for name in ("shader", "steps", "tests", "memory")}
        parts["shader"] += self.waiting
        return "waiting" if self.waiting > self.seconds / 2 else max(parts, key=parts.__getitem__)


def by_unit(kernel: str, taken: str) -> bool:
    """Return whether units execute a kernel. ``taken`` names the kernels of the units: "steps"
    (kernels that traverse), "tests" (kernels that test triangles), "both", or "" for none."""
    return taken in ("tests" if kernel in TESTS else "steps", "both")


def runs(work: Mapping[str, Any], kind: str, width: int = 1) -> float:
    """Return how often groups of ``width`` rays run kernels of a ``kind`` ("steps" or "tests"),
    divided by the number of rays. A push or pop counts as part of the step before it."""
    lanes = work["lanes"][str(width)]
    return sum(count for kernel, count in lanes.items()
               if kernel not in WITHIN and by_unit(kernel, kind)) / width / work["count"]


def instructions_a_ray(work: Mapping[str, Any], costs: Mapping[str, LoopCost], width: int = 1,
                       taken: str = "") -> float:
    """Return the instructions per ray that groups of ``width`` rays issue, idle lanes included.
    Kernels ``taken`` by units (`by_unit`) cost nothing."""
    return sum(lanes * costs[kernel].instructions
               for kernel, lanes in work["lanes"][str(width)].items()
               if not by_unit(kernel, taken)) / work["count"]


def on_card(card: Card, work: Mapping[str, Any], costs: Mapping[str, LoopCost],
            units: Machine | None = None, taken: str = "", width: int | None = None) -> Least:
    """Return the time on a card's shaders, with units for some of the kernels.

    Parameters
    ----------
    card : The card.
    work : The work of ``count`` rays. ``runs`` maps a kernel to its runs. ``lanes["32"]`` maps a
        kernel to the lanes that it occupied in groups of 32 rays. ``transfers`` maps a cache to
        its misses. The key "8192 16 4" means a cache of 8192 bytes with lines of 16 bytes, for 4
        rays that fetch together.
    costs : Each kernel's cost, from the card's compiler.
    units : The units; None for a card without units.
    taken : The kernels that the units execute, as for `by_unit`.
    width : Number of fragments that branch together; None for the card's own number.
    """
    texels = sum(count * costs[kernel].fetches for kernel, count in work["runs"].items()
                 if not by_unit(kernel, taken)) / work["count"]
    issued = instructions_a_ray(work, costs, width or card.branch_width, taken)
    shader = max(issued / card.issue_rate, texels / card.texel_rate)
    if units is None:
        # Assume that the card's texture cache misses as often as the ideal machine's cache.
        return Least(shader, memory=_memory(work, machines()["ideal"], card.bandwidth))
    each = units.units * units.clock
    return Least(shader,
                 runs(work, "steps") / (each * units.steps) if taken in ("steps", "both") else 0.0,
                 runs(work, "tests") / (each * units.tests) if taken in ("tests", "both") else 0.0,
                 _memory(work, units))


def on_prototype(machine: Machine, work: Mapping[str, Any],
                 costs: Mapping[str, LoopCost]) -> Least:
    """Return the time on a machine whose units traverse.

    If the machine has units for triangle tests, ``costs`` has no effect. Otherwise the machine's
    shader tests triangles, for a packet at a time. ``work`` and ``costs`` are as for `on_card`.
    """
    each, packet = machine.units * machine.clock, machine.packet
    steps = runs(work, "steps", packet) / (each * machine.steps)
    memory = _memory(work, machine)
    if machine.tests:
        return Least(0.0, steps, runs(work, "tests", packet) / (each * machine.tests), memory)
    issued = instructions_a_ray(work, costs, packet, "steps")
    return Least(issued / machine.vector_rate, steps, 0.0, memory)


def on_cell(cell: Machine, work: Mapping[str, Any], costs: Mapping[str, LoopCost],
            hidden: bool) -> Least:
    """Return the time on processors that access only their local store.

    Every fetch looks into a software cache in the local store, and every miss is a transfer from
    memory. Each ray of a packet has a component of the processors' vectors, so one vector
    instruction executes a scalar instruction for all rays. The rays of a packet fetch together.

    Parameters
    ----------
    cell : the machine
    work, costs : as for `on_card`; the costs are in scalar instructions
    hidden : whether another packet runs during a transfer ("software hyperthreading" of Benthin et
        al. 2006)
    """
    count, packet = work["count"], cell.together
    fetched = sum(lanes / packet * costs[kernel].fetches
                  for kernel, lanes in work["lanes"][str(packet)].items()) / count
    vectors = instructions_a_ray(work, costs, packet) / packet
    shader = (vectors + cell.lookup * fetched) / cell.vector_rate
    missed = _missed(work, cell) / count
    stalled = 0.0 if hidden else missed * cell.latency / (cell.clock * cell.units)
    return Least(shader, memory=_memory(work, cell), waiting=stalled)


def with_shading(cell: Machine, traced: Least, times: float = 1.0) -> Least:
    """Return the time of tracing a ray and of shading its hit on the same processors.

    On the Cell, shading is the bottleneck, because shading reads memory at random (survey, section
    4.4). The model hides no transfer of shading: a processor waits for each transfer. ``times``
    multiplies the assumed transfers per hit.
    """
    transfers = times * cell.shading_transfers
    waited = transfers * cell.latency / (cell.clock * cell.units)
    moved = transfers * cell.line / cell.bandwidth
    return replace(traced, shader=traced.shader + cell.shading / cell.vector_rate,
                   memory=traced.memory + moved, waiting=traced.waiting + waited)


def _missed(work: Mapping[str, Any], machine: Machine) -> int:
    return work["transfers"][f"{machine.cache} {machine.line} {machine.together}"]


def _memory(work: Mapping[str, Any], machine: Machine, bandwidth: float | None = None) -> float:
    moved = _missed(work, machine) * machine.line
    return moved / (bandwidth or machine.bandwidth) / work["count"]
