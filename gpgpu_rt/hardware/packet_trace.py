"""Packet trace: converts a trace of kd-packet's steps into a trace of kd-packet in a loop.

Under ``step``, the kernel `traverse` includes the push, and the kernel `leave` includes the pops.
In the loop of the era form, `push` and `pop` are separate kernels
(glsl/methods/kdtree/kd_packet_era.glsl): packets that branch together skip `push` if no packet
pushes.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .trace import FINISHED, KernelTrace

PUSH, POP = "push", "pop"
BOTH = 3      # value of the field `needed` if the packet enters both children


def fields_of(stack: bool) -> tuple[str, ...]:
    """Return the fields that `in_loop` needs."""
    return ("needed", "pushing", *(("popped",) if stack else ()))


def in_loop(trace: KernelTrace, stack: bool) -> KernelTrace:
    """Return the trace of packets in a loop: pushes become steps after the step `traverse`, and
    pops become steps after the step `leave`. A restart counts as a pop.

    Parameters
    ----------
    trace : a trace of kd-packet, with the fields of `fields_of`
    stack : whether packets have a stack
    """
    # A trace holds the fields' values before each step. The values before the next step are the
    # values after this step.
    after = {name: _next(values) for name, values in trace.fields.items()}
    next_steps, number = _next(trace.steps), {
        name: at for at, name in enumerate(trace.kernels, 1)}
    left, visited = (trace.steps == number[name] for name in ("leave", "traverse"))
    goes_on = next_steps == number["traverse"]
    pops = np.where(left & goes_on, after["pushing"] + after.get("popped", 0), 0)
    if not stack:
        return with_more_runs(trace, {POP: pops})
    return with_more_runs(trace, {POP: pops, PUSH: visited & goes_on & (after["needed"] == BOTH)})


def with_more_runs(trace: KernelTrace, more: Mapping[str, np.ndarray]) -> KernelTrace:
    """Return the trace with runs of more kernels inserted after its steps.

    Parameters
    ----------
    more : name -> (n, h, w) int, the number of runs after each step. At most one of these
        kernels runs after a step
    """
    live = trace.steps != FINISHED
    counts = [np.where(live, count, 0).astype(np.int32) for count in more.values()]
    taken = live + sum(counts, np.zeros(trace.steps.shape, np.int32))
    starts = np.cumsum(taken, axis=0, dtype=np.int32) - taken
    steps = np.full((int(taken.sum(axis=0).max(initial=0)), *trace.steps.shape[1:]), FINISHED,
                    np.uint8)
    for at, runs in enumerate(trace.steps):
        row, column = np.nonzero(runs != FINISHED)
        start = starts[at, row, column]
        steps[start, row, column] = runs[row, column]
        for number, count in enumerate(counts, len(trace.kernels) + 1):
            for k in range(1, int(count[at].max(initial=0)) + 1):
                some = count[at, row, column] >= k
                steps[start[some] + k, row[some], column[some]] = number
    return KernelTrace((*trace.kernels, *more), steps)


def _next(values: np.ndarray) -> np.ndarray:
    """Return, for each step, the value of the next step; 0 for the last step."""
    return np.concatenate([values[1:], np.zeros_like(values[:1])])
