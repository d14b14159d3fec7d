"""Issue: counts how often a card issues each kernel, from a trace of rays.

Pixels that branch together form a group. One issue runs a kernel for all pixels of a group.
"""
from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from .trace import FINISHED, KernelTrace

QUAD = (2, 2)        # every card of Hachisuka's survey shades pixels in quads, for derivatives
# The (h, w) of a group in pixels. The survey states no shape, so a group is the rectangle of
# `branch_width` pixels (cards.json) that is nearest to a square. R300 and R420 cannot branch.
GROUPS: dict[str, tuple[int, int] | None] = {
    "R300": None, "R420": None, "NV40": (32, 32), "R580": (6, 8), "G80": (4, 8)}
PASSES_A_CHOICE = 16    # passes that the schedule `kernels` draws between occlusion queries
WHILE_WHILE, STEP = "while-while", "step"
ORDERS = (WHILE_WHILE, STEP)
# Kernels that have no inner loop of their own in a while-while program. The program runs such a
# kernel right after the step that needs it. `push` and `pop` belong to methods that keep a stack
# in textures under `step` (glsl/methods/bvh/packet_steps_stack.glsl), and to kd-packet in a loop
# (packet_trace.py). `leave` and `begin` belong to kd packets
# (glsl/methods/kdtree/packet_steps.glsl).
WITHIN = ("push", "pop", "leave", "begin")


@dataclass(frozen=True)
class KernelIssues:
    """How often each kernel is issued. Each tuple has an entry per kernel.

    Attributes
    ----------
    kernels : Names.
    runs : Runs that rays need, summed over rays.
    lanes : Lanes that the issues occupy, idle lanes included. A lane is a pixel of a group.
    iterations : Iterations of the outer loop, summed over lanes; 0 without a loop.
    passes : Number of passes that the host draws; empty for a loop.
    queries : Number of the host's occlusion queries; 0 for a loop.
    """

    kernels: tuple[str, ...]
    runs: tuple[int, ...]
    lanes: tuple[int, ...]
    iterations: int = 0
    passes: tuple[int, ...] = ()
    queries: int = 0

    @property
    def idle(self) -> float:
        """The share of issued lanes that are idle."""
        return 1 - sum(self.runs) / sum(self.lanes) if sum(self.lanes) else 0.0


def in_groups(steps: np.ndarray, group: tuple[int, int]) -> np.ndarray:
    """Return the steps (n, h, w) of an image, or another field of a trace, as (n, groups, lanes).

    ``group`` is a group's (height, width) in pixels. Lanes beyond the image's edge are FINISHED.
    """
    count, height, width = steps.shape
    down, across = -(-height // group[0]), -(-width // group[1])
    padded = np.full((count, down * group[0], across * group[1]), FINISHED,
                     steps.dtype)
    padded[:, :height, :width] = steps
    parts = padded.reshape(count, down, group[0], across, group[1])
    return parts.transpose(0, 1, 3, 2, 4).reshape(count, down * across, group[0] * group[1])


def issued_in_loop(trace: KernelTrace, group: tuple[int, int], order: str,
                   within: Collection[str] = ()) -> KernelIssues:
    """Return the issues of a program with a loop, for groups of pixels that branch together.

    Parameters
    ----------
    group : (h, w) of the pixels that branch together
    order : WHILE_WHILE has a loop for each kernel inside the outer loop: a group issues a kernel
        while any of its rays waits for the kernel. STEP has one loop, which runs a step of each
        ray per iteration: a group issues each kernel that any of its rays needs
    within : kernels without an inner loop under WHILE_WHILE. A ray that reaches such a kernel runs
        the kernel at once. A group issues the kernel if any of its rays runs it
    """
    steps, count = in_groups(trace.steps, group), len(trace.kernels)
    lanes = steps.shape[2]
    inner = np.array([False, *(name in within for name in trace.kernels)])
    issues, iterations = (_in_turns(steps, inner) if order == WHILE_WHILE
                          else _in_step(steps, count))
    totals = trace.totals()
    return KernelIssues(trace.kernels, tuple(totals[name] for name in trace.kernels),
                        tuple(int(number) * lanes for number in issues), iterations * lanes)


def _in_step(steps: np.ndarray, count: int) -> tuple[np.ndarray, int]:
    issues = np.array([(steps == kernel).any(axis=2).sum() for kernel in range(1, count + 1)])
    return issues, int((steps != FINISHED).any(axis=2).sum())


def _in_turns(steps: np.ndarray, within: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the issues of each kernel and the iterations of the outer loop, over all groups.

    All groups advance in rounds. In a round, every unfinished group issues one kernel. If the rays
    that ran this kernel next need a kernel k without an inner loop (``within[k]``), the group
    issues kernel k in the same round.
    """
    count = len(within) - 1
    padded = np.concatenate([steps, np.zeros((1, *steps.shape[1:]), np.uint8)])
    issues, iterations = np.zeros(count, np.int64), 0
    groups = np.arange(steps.shape[1])
    place = np.zeros(steps.shape[1:], np.int64)    # the step that each ray waits to run
    kernel = np.ones(len(groups), np.int64)        # the inner loop that each group is in
    lane = np.arange(steps.shape[2])
    while True:
        waits = padded[place, groups[:, None], lane]
        live = waits.any(axis=1)
        if not live.all():
            groups, place, kernel, waits = groups[live], place[live], kernel[live], waits[live]
        if not len(groups):
            return issues, iterations
        # Choose each group's next kernel: from ``kernel`` on, the first kernel with a waiting ray.
        any_waits = np.stack([(waits == k).any(axis=1) for k in range(1, count + 1)])
        ahead = (kernel - 1 + np.arange(count)[:, None]) % count
        chosen = any_waits[ahead, np.arange(len(groups))].argmax(axis=0)
        after = ahead[chosen, np.arange(len(groups))] + 1
        # Each return to an earlier kernel is an iteration of the outer loop.
        iterations += int((after < kernel).sum())
        kernel = after
        issues += np.bincount(kernel - 1, minlength=count)
        ran = waits == kernel[:, None]
        place += ran
        while within.any():
            waits = padded[place, groups[:, None], lane]
            ran &= within[waits]
            if not ran.any():
                break
            issues += [int((ran & (waits == k)).any(axis=1).sum()) for k in range(1, count + 1)]
            place += ran


def issued_in_passes(trace: KernelTrace, choice: int = PASSES_A_CHOICE) -> KernelIssues:
    """Return the issues of the schedule ``kernels``, which runs one kernel per pass.

    For each kernel, an occlusion query counts the waiting rays. The host then draws ``choice``
    passes of the kernel with the most waiting rays. The early depth test rejects a quad if none of
    its rays waited for this kernel during the queries.
    """
    count = len(trace.kernels)
    steps = in_groups(trace.steps, QUAD)
    padded = np.concatenate([steps, np.zeros((1, *steps.shape[1:]), np.uint8)])
    group, lane = np.arange(steps.shape[1])[:, None], np.arange(steps.shape[2])
    place = np.zeros(steps.shape[1:], np.int64)
    passes, lanes, queries = np.zeros(count, np.int64), np.zeros(count, np.int64), 0
    while True:
        waits = padded[place, group, lane]
        queries += count
        waiting = np.bincount(waits.reshape(-1), minlength=count + 1)[1:]
        kernel = int(waiting.argmax()) + 1
        if not waiting[kernel - 1]:
            break
        drawn = int((waits == kernel).any(axis=1).sum()) * steps.shape[2]
        passes[kernel - 1] += choice
        lanes[kernel - 1] += choice * drawn
        for _ in range(choice):
            on = waits == kernel
            if not on.any():
                break
            place += on
            waits = padded[place, group, lane]
    totals = trace.totals()
    return KernelIssues(trace.kernels, tuple(totals[name] for name in trace.kernels),
                        tuple(map(int, lanes)), 0, tuple(map(int, passes)), queries)
