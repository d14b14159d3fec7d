"""Small BVH: the diagrams' bounding volume hierarchy, as bvh-threaded builds and walks it.

The triangles and the ray come from small_world.py.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.patches import Rectangle

import gpgpu_rt as rt
from gpgpu_rt.methods.bvh.tree import Bvh

from .plan import INK, PALE, RAY, SPLITS, TRIANGLE, label
from .small_world import BVH, World, world

METHOD = "bvh-threaded"
INNER = (*SPLITS, "#c98a1b", "#1f8a8a")     # colours of inner nodes' boxes, by depth


@dataclass(frozen=True)
class Hierarchy:
    """The small world's triangles and ray, and a BVH over the triangles.

    depth : (n,) int, the depth of each node
    parent : (n,) int, the parent of each node, -1 for the root
    """

    small: World
    bvh: Bvh
    depth: np.ndarray
    parent: np.ndarray

    def __len__(self) -> int:
        return len(self.bvh.escape)

    def is_leaf(self, node: int) -> bool:
        return bool(self.bvh.count[node] > 0)

    def children(self, node: int) -> tuple[int, int]:
        """The two children of an inner node."""
        return node + 1, int(self.bvh.escape[node + 1])

    def inside(self, node: int) -> list[int]:
        """The triangles that a leaf lists."""
        first = self.bvh.first[node]
        return self.bvh.order[first:first + self.bvh.count[node]].tolist()

    def hit_link(self, node: int) -> int | None:
        """The node that a ray visits after it hits this node's box; None ends the walk.

        A leaf's hit link equals its miss link.
        """
        return node + 1 if node + 1 < len(self) else None

    def miss_link(self, node: int) -> int | None:
        """The next node for a ray that misses this node's box; None ends the walk."""
        escape = int(self.bvh.escape[node])
        return escape if escape < len(self) else None


@lru_cache(maxsize=None)
def hierarchy() -> Hierarchy:
    small = world()
    with rt.Tracer(small.scene, METHOD, **BVH) as tracer:
        bvh = tracer.accelerator.structure
    left, right = bvh.children()
    depth, parent = np.zeros(len(left), int), np.full(len(left), -1)
    for node in np.flatnonzero(left >= 0):    # depth-first: parents before their children
        for child in (left[node], right[node]):
            depth[child], parent[child] = depth[node] + 1, node
    return Hierarchy(small, bvh, depth, parent)


def node_colour(found: Hierarchy, node: int) -> str:
    return INK if found.is_leaf(node) else INNER[found.depth[node] % len(INNER)]


def draw_boxes(axis: Any, found: Hierarchy, shaded: Mapping[int, str] | None = None) -> None:
    """Draw boxes and triangles, seen from above.

    A parent's box is widened more than its children's boxes, so that shared sides stay apart.

    shaded : node -> colour
    """
    reach = found.depth.max()
    for node in range(len(found)):
        lo, hi = (corner[node, :2].astype(float) for corner in (found.bvh.lo, found.bvh.hi))
        margin = 0.007 * (reach - found.depth[node] + 1)
        lo, hi = lo - margin, hi + margin
        leaf, colour = found.is_leaf(node), node_colour(found, node)
        axis.add_patch(Rectangle(lo, *(hi - lo), edgecolor=colour, linewidth=1.0 if leaf else 1.7,
                                 facecolor=(shaded or {}).get(node, "none"),
                                 linestyle="--" if leaf else "-", zorder=2))
        # Sides of nested boxes lie close together, so write names of inner nodes side by side.
        at = (lo[0], hi[1]) if leaf else (lo[0] + (0.1 + 0.16 * found.depth[node])
                                          * (hi[0] - lo[0]), lo[1])
        label(axis, at, str(node), color=colour, fontsize=9)
    for number, corners in enumerate(found.small.triangles):
        axis.plot(*corners[:2, :2].T, color=TRIANGLE, linewidth=3.2, solid_capstyle="butt",
                  zorder=4)
        along = corners[1, :2] - corners[0, :2]
        aside = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        label(axis, corners[:2, :2].mean(axis=0) + 0.024 * aside, str(number), color=TRIANGLE,
              fontsize=8)
    lo, hi = found.bvh.lo[0, :2], found.bvh.hi[0, :2]
    axis.set(xlim=(lo[0] - 0.07, hi[0] + 0.07), ylim=(lo[1] - 0.07, hi[1] + 0.07), aspect="equal")
    axis.axis("off")


def tree_places(found: Hierarchy) -> np.ndarray:
    """Return (nodes, 2) positions: x counts leaves from left to right, y is minus the depth."""
    places = np.zeros((len(found), 2))
    places[:, 1] = -found.depth
    leaves = [node for node in range(len(found)) if found.is_leaf(node)]
    places[leaves, 0] = np.arange(len(leaves))
    for node in reversed(range(len(found))):      # children before their parents
        if not found.is_leaf(node):
            places[node, 0] = places[list(found.children(node)), 0].mean()
    return places


def draw_nodes(axis: Any, found: Hierarchy, places: np.ndarray,
               shaded: Mapping[int, str] | None = None) -> None:
    """Draw the tree: edges, numbered nodes, and under each leaf the triangles that it lists."""
    for node, parent in enumerate(found.parent):
        if parent >= 0:
            axis.plot(*places[[parent, node]].T, color=PALE, linewidth=1.4, zorder=1)
    for node, (x, y) in enumerate(places):
        leaf = found.is_leaf(node)
        box = {"boxstyle": "square,pad=0.35" if leaf else "circle,pad=0.3", "linewidth": 1.4,
               "facecolor": (shaded or {}).get(node, "white"),
               "edgecolor": node_colour(found, node)}
        axis.text(x, y, str(node), ha="center", va="center", fontsize=10, bbox=box, zorder=5)
        if leaf:
            label(axis, (x, y - 0.33), ", ".join(map(str, found.inside(node))), color=TRIANGLE,
                  fontsize=9)
    axis.set(xlim=(-0.6, places[:, 0].max() + 0.9), ylim=(places[:, 1].min() - 0.6, 0.5))
    axis.axis("off")


def draw_way(axis: Any, found: Hierarchy, until: float) -> None:
    """Draw the small world's ray up to t = ``until``."""
    start, end = found.small.at(0)[:2], found.small.at(until)[:2]
    axis.annotate("", xy=end, xytext=start, zorder=7, arrowprops={
        "arrowstyle": "-|>", "color": RAY, "lw": 1.8, "shrinkA": 0, "shrinkB": 0})
    axis.plot(*start, "o", color=RAY, markersize=5, zorder=8)
