"""Figure 19: the hierarchy of Figure 18, threaded, and a ray that follows the threads."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Rectangle

from gpgpu_rt.methods import find_method

from ..diagrams.plan import HIT, PALE, RAY, VISITED, label
from ..diagrams.small_bvh import (
    METHOD, Hierarchy, draw_boxes, draw_nodes, draw_way, hierarchy, node_colour, tree_places
)
from ..diagrams.small_world import Walk, walk
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

HEADS = ("node", "hit link", "miss link", "the ray")
END = "end"


@dataclass(frozen=True)
class Visit:
    """A node that the ray visited, and whether the ray meets the node's box."""

    node: int
    entered: bool


def cells(full: bool) -> list[Cell]:
    return []


def visits(found: Hierarchy, ray: Walk) -> list[Visit]:
    """The nodes that the ray visited, read from the ray's states.

    An inner node's box counts as met if the ray goes on to the next node of the array. A leaf's
    box counts as met if the ray tests triangles.
    """
    testing = find_method(METHOD).kernels.index("intersect") + 1
    seen = []
    for step in ray.steps:
        node = step.visited
        if node is not None:
            seen.append(Visit(node, step.after["phase"] == testing if found.is_leaf(node)
                              else step.after["node"] == node + 1))
    return seen


def rows(found: Hierarchy, seen: list[Visit]) -> list[list[str]]:
    """The table, with a row for each node: its links, and whether the ray met the node's box."""
    did = {visit.node: "met" if visit.entered else "missed" for visit in seen}
    return [[str(node), *(END if link is None else str(link)
                          for link in (found.hit_link(node), found.miss_link(node))),
             did.get(node, "skipped")] for node in range(len(found))]


def draw(data: Path, out: Path, full: bool) -> None:
    found, ray = hierarchy(), walk(METHOD)
    seen = visits(found, ray)
    table = rows(found, seen)
    write_csv(out / "fig19.csv", HEADS, table)
    way = ", ".join(f"{visit.node} ({'met' if visit.entered else 'missed'})" for visit in seen)
    write_text(out / "fig19.md", "# Figure 19: a threaded hierarchy\n\nThe nodes lie in "
               "depth-first order. A ray that meets a box continues with the next node of the "
               "array, so the hit link needs no memory. A ray that misses a box follows the miss "
               "link past everything in the box. A leaf's two links lead to the same node. No "
               "stack is needed, and the order of the nodes is the same for every ray.\n\n"
               + markdown_table(HEADS, table)
               + f"\nThe ray visits {way}: {len(seen)} of {len(found)} nodes. It hits triangle "
               f"{ray.hits.triangle[0]} at t = {ray.hits.t[0]:.3f}.\n")
    shaded = {visit.node: VISITED for visit in seen if visit.entered}
    figure = plt.figure(figsize=(11.5, 7.4))
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.25), height_ratios=(3, 1))
    ground, tree = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    draw_boxes(ground, found, {node: colour for node, colour in shaded.items()
                               if found.is_leaf(node)})
    draw_way(ground, found, float(ray.hits.t[0]))
    places = tree_places(found)
    draw_nodes(tree, found, places, shaded)
    draw_threads(tree, found, places)
    draw_array(figure.add_subplot(grid[1, :]), found, seen)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "fig19.png", "Dotted: miss links, each to a node further right; "
               "links to the end of the array are not drawn in the tree. Below: the array in the "
               "texture, with the ray's path. Filled: boxes that the ray meets. Crossed: boxes "
               "that it misses.",
               "A tree of boxes with dotted miss links, and below it the array of nodes in the "
               "texture with the miss links that skip nodes")


def draw_threads(axis: Any, found: Hierarchy, places: np.ndarray) -> None:
    """Draw a dotted arrow from each node to the target of its miss link."""
    for node in range(len(found)):
        link = found.miss_link(node)
        if link is not None:
            level = places[link, 1] == places[node, 1]
            axis.annotate("", xy=places[link], xytext=places[node], zorder=3, arrowprops={
                "arrowstyle": "-|>", "linestyle": ":", "color": RAY, "lw": 1.5, "shrinkA": 11,
                "shrinkB": 11,
                "connectionstyle": f"arc3,rad={-0.25 if level else 0.18}"})


def draw_array(axis: Any, found: Hierarchy, seen: list[Visit]) -> None:
    """Draw the linear array, the ray's path above it, and below it the miss links that skip nodes.
    """
    did = {visit.node: visit.entered for visit in seen}
    for node in range(len(found)):
        axis.add_patch(Rectangle((node, 0), 1, 1, linewidth=1.4, zorder=2,
                                 edgecolor=node_colour(found, node),
                                 facecolor=VISITED if did.get(node) else "white"))
        label(axis, (node + 0.5, 0.5), str(node), fontsize=10)
        if did.get(node) is False:
            axis.plot([node + 0.1, node + 0.9], [0.1, 0.9], color=PALE, linewidth=1.2, zorder=3)
        link = found.miss_link(node)
        last = len(found) if link is None else link
        if last > node + 1:
            _arc(axis, (node + 0.5, -0.08), (last + 0.5, -0.08), RAY, ":", 0.17)
    for one, other in zip(seen, seen[1:]):
        _arc(axis, (one.node + 0.5, 1.08), (other.node + 0.5, 1.08), HIT, "-", -0.3)
    label(axis, (len(found) + 0.5, 0.5), END, color=RAY)
    axis.set(xlim=(-0.3, len(found) + 1.2), ylim=(-2.0, 2.2))
    axis.axis("off")


def _arc(axis: Any, start: tuple[float, float], end: tuple[float, float], colour: str,
         style: str, bend: float) -> None:
    axis.annotate("", xy=end, xytext=start, zorder=4, arrowprops={
        "arrowstyle": "-|>", "linestyle": style, "color": colour, "lw": 1.4, "shrinkA": 0,
        "shrinkB": 0, "connectionstyle": f"arc3,rad={bend}"})
