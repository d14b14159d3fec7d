"""Build a bounding volume hierarchy by one of the builders, optimise it on request, and thread it.

To thread a tree means to give each node an escape index; see `tree.py`.
"""
from __future__ import annotations

import numpy as np

from ...accel.bounds import as_triangles
from ...accel.options import choose, in_range
from ...gl.record import EXACT_INTEGER
from . import hybrid, insertion, lbvh, median, sah
from .reinsertion import reinserted
from .tree import MAX_LEAF, Bvh

MOST_ROUNDS = 1000  # limit of the option `reinsertion`
BUILDERS = {"sah": sah.build, "kay-kajiya": median.build, "goldsmith-salmon": insertion.build,
            "lbvh": lbvh.build, "hybrid": hybrid.build}


def node_limit(triangles: int, copies: float = 1) -> dict[str, int]:
    """Return the argument ``most_nodes`` of `build_bvh`, or {} if no limit is needed.

    The limit keeps all indices exact as floats. The table stores each node about ``copies`` times,
    for example once per direction octant.
    """
    most = int(EXACT_INTEGER / copies)
    return {"most_nodes": most} if 2 * triangles - 1 > most else {}


def build_bvh(triangles: np.ndarray, *, build: str = "sah", reinsertion: int = 0,
              most_nodes: int | None = None, **options: object) -> Bvh:
    """Build a bounding volume hierarchy.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    build : "sah", "kay-kajiya", "goldsmith-salmon", "lbvh" or "hybrid"
    reinsertion : number of rounds that move subtrees to cheaper places (`reinsertion.py`). With
        rounds, triangles are joined into leaves after the last round
    most_nodes : limit on the number of nodes; a tree with more nodes gets larger leaves
    options : options of the builder: see `sah.build`, `median.build`, `insertion.build`,
        `lbvh.build`, `hybrid.build`

    Raises
    ------
    OptionError, SceneError
    """
    builder = BUILDERS[choose("build", build, BUILDERS)]
    triangles = as_triangles(triangles)
    if in_range("reinsertion", reinsertion, 0, MOST_ROUNDS, int):
        max_leaf = in_range("max_leaf", options.pop("max_leaf", MAX_LEAF), 1, 1 << 20, int)
        single = {"max_leaf": 1} if builder in (sah.build, lbvh.build, hybrid.build) else {}
        tree = reinserted(builder(triangles, **options, **single), triangles, reinsertion)
        tree = tree.with_leaves(triangles, max_leaf)
    else:
        tree = builder(triangles, **options)
    if most_nodes is not None:
        tree = tree.coarsened(in_range("most_nodes", most_nodes, 1, EXACT_INTEGER, int))
    return tree.thread(triangles)
