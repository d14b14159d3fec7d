"""Parallel build: the SAH kd-tree on several processes.

M. Shevtsov, A. Soupikov, A. Kapustin, "Highly parallel fast kd-tree construction for interactive
ray tracing of dynamic scenes", Eurographics 2007 (survey, section 5): min-max
binning (see `sah`), the top levels formed together, then subtrees by worker, exact SAH near the
leaves. Here threads share the top levels by axis and by side, not by triangle, as numpy lets go of
the interpreter in its loops; then processes grow the subtrees, dealt out by their references, from
arrays in shared memory. A node's split depends on nothing but the node, so the tree is that of one
worker, node for node (but for `MOST_REFERENCES`, which each group of subtrees then keeps for
itself).

Processes are spawned, not forked: a fork would take an OpenGL context along.
"""
from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np

from ...accel.runs import expand, run_starts
from ...accel.shared_arrays import SharedArrays, shared_arrays
from ...errors import Error
from ...interrupts import left_to_this_process
from .sah import Level
from .sah_growth import Rules, grow
from .tree import LooseKdTree, join

SUBTREES = 16       # a worker: enough to deal out evenly
GROUPS = 2          # a worker: the last one busy is not busy for long


def grow_on_processes(level: Level, vertices: np.ndarray | None, rules: Rules,
                      workers: int) -> LooseKdTree:
    """The tree below a level of one node.

    Raises
    ------
    Error
        where worker processes cannot be had or end early.
    """
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
    try:
        with left_to_this_process():
            for _ in range(workers):        # they start while the top levels are formed
                pool.submit(_awake)
        with ThreadPoolExecutor(workers) as threads:
            top, rest = grow(level, 0, vertices, rules, SUBTREES * workers, threads.map)
        if rest is None:
            return top.loose()
        depth = len(top.fields)
        arrays = {"lo": rest.lo, "hi": rest.hi, "count": rest.count, "triangle": rest.triangle,
                  "box": rest.box, **({} if vertices is None else {"vertices": vertices})}
        with shared_arrays(**arrays) as shared:
            groups = _deal_out(rest.count, GROUPS * workers)
            growing = [pool.submit(_grow_group, shared, group, depth, rules) for group in groups]
            subtrees = [task.result() for task in growing]
    except BrokenProcessPool as failure:
        raise Error("a worker process of the kd-tree's build ended early; in a script, call under "
                    "if __name__ == '__main__':, or take workers=1") from failure
    finally:
        pool.shutdown(cancel_futures=True)
    return join(top.loose(), groups, subtrees)


def _awake() -> None:
    """What a worker does first: nothing, but it has imported what it needs."""


def _deal_out(count: np.ndarray, groups: int) -> list[np.ndarray]:
    """Nodes in groups of about as many references each, the largest nodes dealt out first."""
    dealt: list[list[int]] = [[] for _ in range(groups)]
    held = np.zeros(groups, np.int64)
    for node in np.argsort(-count, kind="stable").tolist():
        least = int(held.argmin())
        dealt[least].append(node)
        held[least] += count[node]
    return [np.array(group, np.int64) for group in dealt if group]


def _grow_group(shared: SharedArrays, nodes: np.ndarray, depth: int, rules: Rules) -> LooseKdTree:
    """In a worker: the subtrees of some nodes, which come first."""
    with shared.open() as arrays:
        return _grow_some(arrays, nodes, depth, rules)


def _grow_some(arrays: dict[str, np.ndarray], nodes: np.ndarray, depth: int,
               rules: Rules) -> LooseKdTree:
    count = arrays["count"][nodes]
    index = expand(run_starts(arrays["count"])[nodes], count)
    roots = Level(arrays["lo"][:, nodes], arrays["hi"][:, nodes], count,
                  arrays["triangle"][index], arrays["box"][:, index])
    return grow(roots, depth, arrays.get("vertices"), rules)[0].loose()
