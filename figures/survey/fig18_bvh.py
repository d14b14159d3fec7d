"""Figure 18: a bounding volume hierarchy over a few triangles."""
from __future__ import annotations

from pathlib import Path

from ..diagrams.small_bvh import Hierarchy, draw_boxes, draw_nodes, hierarchy, tree_places
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

HEADS = ("node", "depth", "box", "what it holds")


def cells(full: bool) -> list[Cell]:
    return []


def rows(found: Hierarchy) -> list[list[str]]:
    table = []
    for node in range(len(found)):
        holds = (f"triangles {', '.join(map(str, found.inside(node)))}" if found.is_leaf(node)
                 else "nodes {}, {}".format(*found.children(node)))
        box = " to ".join(f"({', '.join(f'{c:.3f}' for c in corner[node, :2])})"
                          for corner in (found.bvh.lo, found.bvh.hi))
        table.append([str(node), str(found.depth[node]), box, holds])
    return table


def draw(data: Path, out: Path, full: bool) -> None:
    found = hierarchy()
    leaves = sum(map(found.is_leaf, range(len(found))))
    text = ("# Figure 18: a bounding volume hierarchy\n\n"
            f"The figure shows the {len(found.small.triangles)} triangles of Figure 9, seen from "
            f"above, in a tree of {len(found) - leaves} inner nodes and {leaves} leaves. The "
            "builder halves the triangles by their centroids, as Kay and Kajiya do. An inner "
            "node's box is the smallest box around its children's boxes; the root's box "
            "encloses the scene. Each triangle lies in a single leaf, while a kd-tree lists it in "
            "every leaf that it overlaps. In return boxes may overlap, and the first hit found "
            "need not be the nearest.\n")
    write_csv(out / "fig18.csv", HEADS, rows(found))
    write_text(out / "fig18.md", text + "\n" + markdown_table(HEADS, rows(found)))
    figure, (ground, tree) = plt.subplots(1, 2, figsize=(11, 5.4), width_ratios=(1, 1.1))
    draw_boxes(ground, found)
    draw_nodes(tree, found, tree_places(found))
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig18.png", "Green: triangles seen from above, with their numbers. "
               "Under a leaf (square, dashed box): the triangles that it lists. Boxes are "
               "drawn a little wider than they are.",
               "Left, a scene seen from above with the boxes of a hierarchy; right, the tree "
               "of these boxes")
