"""Which kernel each ray ran at each of its steps, as the renderer ran them one step a pass; and
what a traversal in one loop then costs, a static model that the emulation is held against."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpgpu_rt.hardware.program import Program, RegionWork
from gpgpu_rt.inspect.time_travel import Pass, travel
from gpgpu_rt.tracer import Tracer


@dataclass(frozen=True)
class Traces:
    """The steps of n rays.

    Attributes
    ----------
    kernels : (steps, n) int8, the number of the kernel that a ray ran; 0 behind its last step
    """

    kernels: np.ndarray

    @property
    def runs(self) -> list[int]:
        """How often each kernel ran, in their order."""
        most = int(self.kernels.max(initial=0))
        return [int(np.count_nonzero(self.kernels == kernel)) for kernel in range(1, most + 1)]

    @property
    def turns(self) -> int:
        """Turns of an outer loop in which each kernel runs on while rays want it, in their order:
        a ray needs another one where it goes back to an earlier kernel."""
        now, then = self.kernels[:-1], self.kernels[1:]
        return self.kernels.shape[1] + int(np.count_nonzero((then < now) & (then > 0)))


def kernel_traces(tracer: Tracer, origins: np.ndarray, directions: np.ndarray) -> Traces:
    """Trace rays under ``step``, one step a pass, and keep what each did.

    Parameters
    ----------
    tracer : under ``step`` with ``steps_per_pass=1``
    origins, directions : (n, 3) or (h, w, 3)
    """
    rows: list[np.ndarray] = []
    before: list[Pass] = []

    def look(one: Pass) -> None:
        if before:
            last = before[0].state
            ran = one.state["steps"] > last["steps"]
            rows.append(np.where(ran, last["phase"], 0).astype(np.int8))
        before[:] = [one]
    travel(tracer, origins, directions, look)
    return Traces(np.array([row for row in rows if row.any()], np.int8).reshape(
        -1, len(before[0].state["phase"])))


def modelled(program: Program, traces: Traces) -> RegionWork:
    """The static model of a traversal in one loop, from the steps that rays took.

    The loop program nests one loop a kernel in an outer one, in the order of the kernels' phases.
    Both sides of branches count, as a machine without branches runs them.
    """
    total = _times(program.flattened(0), traces.kernels.shape[1])
    outer, *inner = program.loops
    for region, runs in zip([outer, *inner], [traces.turns, *traces.runs]):
        total = total + _times(program.flattened(region), runs)
    return total


def _times(work: RegionWork, count: int) -> RegionWork:
    found = RegionWork(count * work.vector, count * work.scalar)
    found.fetches.update({name: count * fetches for name, fetches in work.fetches.items()})
    return found
