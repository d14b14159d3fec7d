"""Median build: halve the triangles, sorted by centroid, until each leaf has a single triangle.

T. L. Kay, J. T. Kajiya, "Ray tracing complex scenes", SIGGRAPH 1986, section 4. Thrane and
Simonsen (2005) built binary trees of axis-aligned boxes in this way. Kay and Kajiya cycle through
the axes (`axis="cycle"`). The default splits along the axis with the largest extent of centroids.
"""
from __future__ import annotations

import numpy as np

from ...accel.options import choose, refuse_unknown
from . import top_down
from .tree import LooseTree


def build(triangles: np.ndarray, *, axis: str = "longest", **unknown: object) -> LooseTree:
    """Build by median splits: n leaves of one triangle, depth ceil(log2 n).

    axis : "longest" or "cycle"
    """
    refuse_unknown(build, unknown)
    choose("axis", axis, ("longest", "cycle"))

    def halve(level: top_down.TriangleLevel) -> tuple[np.ndarray, np.ndarray]:
        if axis == "longest":
            axes = level.extents().argmax(axis=0)
        else:
            axes = np.full(len(level.count), level.depth % 3)
        return axes, level.count // 2

    return top_down.build(triangles, halve)
