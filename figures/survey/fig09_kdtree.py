"""Figure 9: a kd-tree over a few triangles, and the tree's nodes."""
from __future__ import annotations

from pathlib import Path

from ..diagrams.plan import draw_ground, draw_tree
from ..diagrams.small_world import World, world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

HEADS = ("node", "record", "box", "what it holds")


def cells(full: bool) -> list[Cell]:
    return []


def rows(small: World) -> list[list[str]]:
    found = []
    for node in range(len(small.tree.axis)):
        left, inside = int(small.tree.left[node]), small.inside(node)
        holds = (f"triangles {', '.join(map(str, inside))}" if inside else "nothing") \
            if small.is_leaf(node) else (
                f"plane {'xyz'[small.tree.axis[node]]} = {small.tree.split[node]:.4f}; children "
                f"{small.name(left)}, {small.name(left + 1)}")
        box = " to ".join(f"({', '.join(f'{c:.3f}' for c in corner[node, :2])})"
                          for corner in (small.lo, small.hi))
        found.append([small.name(node), str(node), box, holds])
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    small = world()
    leaves = sum(map(small.is_leaf, range(len(small.tree.axis))))
    text = ("# Figure 9: a kd-tree\n\n"
            f"The figure shows {len(small.triangles)} triangles that stand on the ground, seen "
            "from above, and the tree that the surface area heuristic builds over them. The tree "
            f"has {len(small.tree.axis) - leaves} splitting planes S and {leaves} leaves n. A "
            "triangle lies in every leaf that it overlaps. Siblings are neighbours in the "
            "texture, so a node stores only the number of its left child. All numbers come from "
            "the builder.\n")
    write_csv(out / "fig09.csv", HEADS, rows(small))
    write_text(out / "fig09.md", text + "\n" + markdown_table(HEADS, rows(small)))
    figure, (ground, tree) = plt.subplots(1, 2, figsize=(11, 5.4), width_ratios=(1, 1.35))
    draw_ground(ground, small)
    draw_tree(tree, small)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig09.png", "Green: triangles seen from above, with their numbers. "
               "Under a leaf: the triangles that it lists.",
               "Left, a scene seen from above, cut by the planes of a kd-tree; right, the tree "
               "with its inner nodes S and its leaves n")
