"""Builds Zhou's kd-tree by fragment passes (Zhou et al. 2008).

The tree equals the tree of `methods.kdtree.zhou`. The passes split large nodes level by level
(`zhou_large`), then small nodes by masks (`zhou_small`), and move all nodes into depth-first order
(`zhou_order`). After each level, the host reads back the numbers of nodes and of pieces
(triangles' parts in nodes): the sizes of the next draws.
"""
from __future__ import annotations

import numpy as np

from ....accel.bounds import scene_box
from ....gl.algorithms.streams import StreamRoom
from ....traversal.triangle_table import TRIANGLE
from .. import zhou as cpu
from ..tree import KdTree
from .zhou_large import Halving, grow_large, joined
from .zhou_order import finish
from .zhou_small import grow_small


def build(room: StreamRoom, triangles: np.ndarray, **options: object) -> KdTree:
    """Build with the options of `methods.kdtree.zhou.build`.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units; at least one triangle
    """
    rules = cpu.rules_of(triangles, **options)
    return build_by(room, triangles, rules, Halving(rules))


def build_by(room: StreamRoom, triangles: np.ndarray, rules: cpu.ZhouRules,
             way: Halving) -> KdTree:
    """Build a tree. ``way`` splits large nodes, and decides which nodes are small."""
    v0, v1, v2 = triangles.transpose(1, 0, 2)
    source = room.stream(TRIANGLE, len(triangles), v0=v0, v1=v1, v2=v2)
    large = grow_large(room, source, triangles, rules, way)
    pieces = joined(room, large.small + large.stuck)
    small = grow_small(room, large, pieces, rules)
    return finish(room, large, small, pieces, rules, scene_box(triangles))
