"""Parallel build: builds the SAH kd-tree on several processes.

M. Shevtsov, A. Soupikov, A. Kapustin, "Highly parallel fast kd-tree construction for interactive
ray tracing of dynamic scenes", Eurographics 2007 (Hachisuka, section 5). In the paper, all workers
build the top levels together. Then each worker builds subtrees, with exact SAH near the leaves.

Here, threads build the top levels: each thread tries planes on one axis, or makes all left or all
right children. Then processes grow the subtrees from arrays in shared memory. Every number of
workers builds the same tree, unless the limit `MOST_REFERENCES` stops the growth of a group of
subtrees. Processes are spawned, because a fork would inherit the OpenGL context.
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
from .sah import KdLevel
from .sah_growth import Rules, grow
from .tree import LooseKdTree, join

SUBTREES = 16       # fewest subtrees per worker, to distribute the references evenly
GROUPS = 2          # groups of subtrees per worker; with two, workers end at similar times


def grow_on_processes(level: KdLevel, vertices: np.ndarray | None, rules: Rules,
                      workers: int) -> LooseKdTree:
    """Grow a tree on several processes. ``level`` holds only the root.

    Raises
    ------
    Error
        if a worker process cannot start, or ends early
    """
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
    try:
        with left_to_this_process():
            for _ in range(workers):        # workers start while threads build the top levels
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
        raise Error("a worker process of the kd-tree's build ended early; in a script, build "
                    "under if __name__ == '__main__':, or set workers=1") from failure
    finally:
        pool.shutdown(cancel_futures=True)
    return join(top.loose(), groups, subtrees)


def _awake() -> None:
    """Do nothing, but make a new worker import this module."""


def _deal_out(count: np.ndarray, groups: int) -> list[np.ndarray]:
    """Distribute nodes to groups with about equally many references, the largest nodes first."""
    dealt: list[list[int]] = [[] for _ in range(groups)]
    held = np.zeros(groups, np.int64)
    for node in np.argsort(-count, kind="stable").tolist():
        least = int(held.argmin())
        dealt[least].append(node)
        held[least] += count[node]
    return [np.array(group, np.int64) for group in dealt if group]


def _grow_group(shared: SharedArrays, nodes: np.ndarray, depth: int, rules: Rules) -> LooseKdTree:
    """Grow the given nodes' subtrees, in a worker. The result begins with the subtrees' roots."""
    with shared.open() as arrays:
        return _grow_some(arrays, nodes, depth, rules)


def _grow_some(arrays: dict[str, np.ndarray], nodes: np.ndarray, depth: int,
               rules: Rules) -> LooseKdTree:
    count = arrays["count"][nodes]
    index = expand(run_starts(arrays["count"])[nodes], count)
    roots = KdLevel(arrays["lo"][:, nodes], arrays["hi"][:, nodes], count,
                    arrays["triangle"][index], arrays["box"][:, index])
    return grow(roots, depth, arrays.get("vertices"), rules)[0].loose()
