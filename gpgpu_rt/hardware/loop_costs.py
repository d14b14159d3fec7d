"""Loop costs: computes what one run of a kernel costs inside a loop, from `static_costs`."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..traversal.era_packets import LOOP
from .machine_model import issue_slots, stream_fetches
from .static_costs import era_programs, packet_methods, static_cost

PACKET_RAYS = 4     # rays of a packet in the era form (traversal/era_packets.py)
ON_CHIP = ("push", "pop")     # kernels of the stack; a loop keeps the stack in on-chip memory


@dataclass(frozen=True)
class LoopCost:
    """The cost of a run of a kernel in a loop that keeps ray, state and hit in registers.

    Attributes
    ----------
    instructions : number of arithmetic instructions that the card issues
    fetches : texels fetched from tables
    levels : levels of texture indirection. A fetch is one level above the fetches on which its
        coordinates depend. The texels of a record are fetched together
    """

    instructions: int
    fetches: int = 0
    levels: int = 0


def loop_costs(card: str, method: str, **options: Any) -> dict[str, LoopCost]:
    """Return the cost of each kernel of a method with an era form.

    Parameters
    ----------
    card : a name from `static_costs.COMPILERS`
    options : the method's options
    """
    found = {}
    for program in era_programs(method, **options):
        cost = static_cost(card, method, program.kernel, in_loop=True, **options)
        fetches = 0 if program.kernel in ON_CHIP else (
            cost.fetches - stream_fetches(method, program.kernel))
        # The first level of a pass fetches ray, state and hit. A loop has no such level.
        found[program.kernel] = LoopCost(cost.arithmetic, fetches,
                                         cost.levels - 1 if fetches else 0)
    return found


def setup_slots(card: str, method: str, any_hit: bool = False, **options: Any) -> float:
    """Return the instruction slots that a ray needs before and after the loop.

    Without packets, these are the slots of the kernel `init`. For packets, the whole loop was
    compiled as one program. This program's slots minus the kernels' slots are divided among the
    packet's rays.

    Parameters
    ----------
    card : a name from `static_costs.COMPILERS`
    options : the method's options
    """
    if method not in packet_methods():
        return issue_slots(static_cost(card, method, "init", any_hit, **options))
    whole, *kernels = (
        issue_slots(static_cost(card, method, name, any_hit, True, **options))
        for name in (LOOP, *(one.kernel for one in era_programs(method, any_hit, True, **options)
                             if one.kernel != LOOP)))
    return max(whole - sum(kernels), 0) / PACKET_RAYS
