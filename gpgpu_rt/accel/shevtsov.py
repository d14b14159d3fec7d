"""Parallel build: the SAH kd-tree on several processes.

M. Shevtsov, A. Soupikov, A. Kapustin, "Highly parallel fast kd-tree construction for interactive
ray tracing of dynamic scenes", Eurographics 2007 (survey, section 3.4.6; fact sheet C7): min-max
binning (see `sah`), the top levels formed together, then a subtree a worker, exact SAH near the
leaves. Here threads share the top levels by axis and by side, not by triangle, as numpy lets go of
the interpreter in its loops; then processes grow the subtrees, the largest first, from arrays in
shared memory. A node's split depends on nothing but the node, so the tree is that of one worker,
node for node (but for `MOST_REFERENCES`, which each subtree then keeps for itself).

Processes are spawned, not forked: a fork would take an OpenGL context along.
"""
from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np

from ..errors import Error
from .kdtree import LooseKdTree
from .runs import expand, run_starts
from .sah import Level
from .sah_kdtree import Record, Rules, grow
from .shared import SharedArrays, shared_arrays

SUBTREES = 4        # a worker, so that they can be dealt out evenly


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
        for _ in range(workers):            # they start while the top levels are formed
            pool.submit(_awake)
        with ThreadPoolExecutor(workers) as threads:
            top, rest = grow(level, 0, vertices, rules, SUBTREES * workers, threads.map)
        if rest is None:
            return top.loose()
        depth = len(top.fields)
        arrays = {"lo": rest.lo, "hi": rest.hi, "count": rest.count, "triangle": rest.triangle,
                  "box": rest.box, **({} if vertices is None else {"vertices": vertices})}
        with shared_arrays(**arrays) as shared:
            nodes = np.argsort(-rest.count, kind="stable").tolist()
            growing = {node: pool.submit(_subtree, shared, node, depth, rules) for node in nodes}
            subtrees = [growing[node].result() for node in range(len(nodes))]
    except BrokenProcessPool as failure:
        raise Error("a worker process of the kd-tree's build ended early; in a script, call under "
                    "if __name__ == '__main__':, or take workers=1") from failure
    finally:
        pool.shutdown(cancel_futures=True)
    return _join(top, subtrees)


def _awake() -> None:
    """What a worker does first: nothing, but it has imported what it needs."""


def _subtree(shared: SharedArrays, node: int, depth: int, rules: Rules) -> LooseKdTree:
    """In a worker: the subtree of one of the nodes."""
    with shared.open() as arrays:
        return _grow_one(arrays, node, depth, rules)


def _grow_one(arrays: dict[str, np.ndarray], node: int, depth: int, rules: Rules) -> LooseKdTree:
    count = arrays["count"]
    first = int(run_starts(count)[node])
    run = slice(first, first + int(count[node]))
    root = Level(arrays["lo"][:, node, None].copy(), arrays["hi"][:, node, None].copy(),
                 count[node, None].copy(), arrays["triangle"][run].copy(),
                 arrays["box"][:, run].copy())
    return grow(root, depth, arrays.get("vertices"), rules)[0].loose()


def _join(top: Record, subtrees: list[LooseKdTree]) -> LooseKdTree:
    """One tree from the top levels and the subtrees of the level below them, in its order.

    The top levels name their children by where these will stand: behind them, in that order.
    """
    loose = top.loose()
    sizes = np.array([len(tree.axis) for tree in subtrees])
    # The roots stand behind the top levels, the nodes below each root behind all the roots.
    below = top.nodes + len(subtrees) + run_starts(sizes - 1) - 1
    held = run_starts(np.array([len(loose.references), *(len(t.references) for t in subtrees)]))

    def numbered(tree: LooseKdTree, at: int, child: np.ndarray) -> np.ndarray:
        return np.where(child < 0, child, child + below[at])    # no child is a root
    first = [numbered(tree, at, tree.first) for at, tree in enumerate(subtrees)]
    second = [numbered(tree, at, tree.second) for at, tree in enumerate(subtrees)]
    start = [tree.start + held[at + 1] for at, tree in enumerate(subtrees)]
    starts = run_starts(sizes)
    order = np.concatenate([starts, expand(starts + 1, sizes - 1)])

    def joined(name: str, parts: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([getattr(loose, name), np.concatenate(parts)[order]])
    return LooseKdTree(
        joined("axis", [t.axis for t in subtrees]), joined("split", [t.split for t in subtrees]),
        joined("first", first), joined("second", second), joined("start", start),
        joined("count", [t.count for t in subtrees]),
        np.concatenate([loose.references, *(t.references for t in subtrees)]))
