"""Records which kernel each ray runs at each step, under the schedule `step` with one step per
pass. From these records, a static model computes the cost of the same traversal in one loop. Tests
compare this cost with the cost that the emulation counts."""
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
    kernels : (steps, n) int8, each ray's kernel number at each step; 0 after the ray's last step
    """

    kernels: np.ndarray

    @property
    def runs(self) -> list[int]:
        """Returns how often each kernel ran, in the kernels' order."""
        most = int(self.kernels.max(initial=0))
        return [int(np.count_nonzero(self.kernels == kernel)) for kernel in range(1, most + 1)]

    @property
    def turns(self) -> int:
        """Returns the total number of iterations of the outer loop, summed over all rays. An
        iteration runs the kernels in their order, each as long as the ray needs it. A ray that
        returns to an earlier kernel needs another iteration."""
        now, then = self.kernels[:-1], self.kernels[1:]
        return self.kernels.shape[1] + int(np.count_nonzero((then < now) & (then > 0)))


def kernel_traces(tracer: Tracer, origins: np.ndarray, directions: np.ndarray) -> Traces:
    """Traces rays under ``step`` with one step per pass; returns the kernel of each ray at each
    step.

    Parameters
    ----------
    tracer : a tracer under ``step`` with ``steps_per_pass=1``
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
    """Returns the cost of a traversal in one loop by the static model, from the rays' steps.

    The loop program has an inner loop for each kernel, in the order of the kernels' phases, inside
    an outer loop. Both sides of a branch count, because a machine without branches runs both.
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
